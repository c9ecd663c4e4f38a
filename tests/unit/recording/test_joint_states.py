"""Bags of ROS 2 as logs: joint states by topic, joint and quantity; what is damaged or of another kind is not
taken for them.
"""

import numpy as np
import pytest
from mcap.writer import Writer
from rosbags.typesys import Stores, get_typestore

from hw.interface import BackendError
from hw.playback.columns import read_table
from rtctl.recording import as_columns
from rtctl.recording.joint_states import SCHEMA, decoded

STORE = get_typestore(Stores.ROS2_HUMBLE)


def message(k, names=("shoulder", "elbow"), *, stamp=True, effort=True):
    """The k-th state: the elbow is at k, the shoulder at -k, torques ten times as large."""
    kinds = STORE.types
    time = kinds["builtin_interfaces/msg/Time"](sec=7 if stamp else 0, nanosec=k * 10**6 if stamp else 0)
    header = kinds["std_msgs/msg/Header"](stamp=time, frame_id="odd")
    at = np.array([float(k) if name == "elbow" else -float(k) for name in names])
    state = kinds[SCHEMA](
        header=header,
        name=list(names),
        position=at,
        velocity=np.zeros(len(names)),
        effort=10 * at if effort else np.zeros(0),
    )
    return bytes(STORE.serialize_cdr(state, SCHEMA))


def bag(folder, messages, schema=SCHEMA, topic="/joint_states"):
    path = folder / "bag_0.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2", library="test")
        kind = writer.register_schema(schema, "ros2msg", b"")
        channel = writer.register_channel(topic, "cdr", kind)
        for k, data in enumerate(messages):
            writer.add_message(channel, k * 2 * 10**6, data, k * 2 * 10**6)
        writer.finish()
    as_columns.register()
    return path


ELBOW, EFFORT = "/joint_states/elbow/position", "/joint_states/elbow/effort"


def test_joint_states_go_by_topic_joint_and_quantity(tmp_path):
    found = read_table(bag(tmp_path, [message(k) for k in range(9)]), ("time_s", ELBOW, EFFORT)).columns
    assert found["time_s"] == pytest.approx(0.001 * np.arange(9), abs=1e-12)
    assert found[ELBOW].tolist() == list(range(9))
    assert found[EFFORT].tolist() == [10.0 * k for k in range(9)]


def test_messages_that_overtook_each_other_are_in_the_order_of_their_stamps(tmp_path):
    turn = [0, 2, 1, 3, 4, 7, 5, 6, 8]
    found = read_table(bag(tmp_path, [message(k) for k in turn]), ("time_s", ELBOW)).columns
    assert found[ELBOW].tolist() == list(range(9))
    assert found["time_s"] == pytest.approx(0.001 * np.arange(9), abs=1e-12)


def test_a_clock_that_was_set_back_mixes_no_two_runs(tmp_path):
    found = read_table(bag(tmp_path, [message(k % 20) for k in range(40)]), ("time_s", ELBOW)).columns
    assert found[ELBOW].tolist() == [k % 20 for k in range(40)]
    assert found["time_s"][20] == 0


def test_joints_in_another_order_are_found_by_their_names(tmp_path):
    states = [message(k, ("elbow", "shoulder") if k % 2 else ("shoulder", "elbow")) for k in range(9)]
    assert read_table(bag(tmp_path, states), (ELBOW,)).columns[ELBOW].tolist() == list(range(9))


def test_without_a_stamp_it_is_when_the_message_was_recorded(tmp_path):
    states = [message(k, stamp=False) for k in range(9)]
    found = read_table(bag(tmp_path, states), ("time_s", ELBOW)).columns
    assert found["time_s"] == pytest.approx(0.002 * np.arange(9), abs=1e-12)


def test_a_clock_of_a_simulation_that_begins_at_0_is_one(tmp_path):
    # the stamp of the first sound message alone is 0; recorded it was after 2 ms
    states = [b"", message(0, stamp=False), *(message(k + 1) for k in range(8))]
    found = read_table(bag(tmp_path, states), ("time_s", ELBOW)).columns
    assert found["time_s"] == pytest.approx([0.0, *(7.001 + 0.001 * np.arange(8))], abs=1e-9)


def test_a_quantity_that_is_not_told_is_no_column_and_a_damaged_message_no_row(tmp_path):
    states = [message(k, effort=False) for k in range(9)]
    states[4] = states[4][:30]
    path = bag(tmp_path, states)
    assert read_table(path, (ELBOW,)).columns[ELBOW].tolist() == [0, 1, 2, 3, 5, 6, 7, 8]
    with pytest.raises(BackendError, match=f"no column '{EFFORT}'"):
        read_table(path, (ELBOW, EFFORT))


def test_a_bag_of_other_messages_says_its_topics(tmp_path):
    path = bag(tmp_path, [b"\x00\x01\x00\x00" + bytes(60)] * 9, "std_msgs/msg/String", "/chatter")
    with pytest.raises(BackendError, match=r"not a recording of rtctl.*topics: /chatter.*CSV"):
        read_table(path, (ELBOW,))


@pytest.mark.parametrize(
    "data", [b"", b"\x00\x00\x00\x00" + bytes(64), message(1)[:50], message(1)[:-4],
        b"\x00\x01\x00\x00" + b"\xff" * 64]
)  # fmt: skip
def test_damage_is_refused(data):
    with pytest.raises((ValueError, UnicodeDecodeError)):
        decoded(data)


def test_an_empty_bag_is_told_as_one_and_not_as_one_of_other_topics(tmp_path):
    with pytest.raises(BackendError, match=r"without a message of /joint_states .*record again"):
        read_table(bag(tmp_path, []), (ELBOW,))


def test_joints_that_no_message_has_together_are_named(tmp_path):
    states = [message(k, ("elbow",) if k % 2 else ("shoulder",)) for k in range(9)]
    with pytest.raises(BackendError, match="no message with all of elbow, shoulder: name the columns of one"):
        read_table(bag(tmp_path, states), (ELBOW, "/joint_states/shoulder/position"))
