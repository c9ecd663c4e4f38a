import itertools
import math
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
import pytest
import zmq
from fake_rig import FakeRig
from patience import PATIENCE_S, until

from rtctl.client import RigClient, State
from rtctl.errors import NoReplyError, RefusedError


@pytest.fixture
def root():
    with tempfile.TemporaryDirectory(prefix="rt") as folder:
        yield Path(folder)


def connected(root, **more):
    """A client that waits as long as a loaded machine may take."""
    return RigClient("mock", runtime_dir=root, timeout_s=PATIENCE_S, **more)


def test_a_virtual_world_arms_moves_the_proxy_and_stops(root):
    with FakeRig(root), connected(root) as rig:
        hello = rig.hello()
        assert (hello["rig"], [axis["name"] for axis in hello["axes"]]) == ("mock", ["joint"])
        rig.arm()
        assert rig.status()["state"] == "ACTIVE"
        rig.set_target([0.25], [1.0])
        until(lambda: rig.latest_state().fields["proxy_position_rad"] == [0.25])
        assert rig.latest_state().state == State.ACTIVE
        rig.stop()
        until(lambda: rig.latest_state().state == State.IDLE)
        with pytest.raises(RefusedError, match="wrong_epoch"):
            rig.set_target([0.3])
        rig.status()
        rig.set_target([0.3])


def test_settings_reach_the_tick_of_their_axis(root):
    with FakeRig(root, names=("base", "tip")), connected(root) as rig:
        in_force = rig.set_environment("tip", "spring", stiffness_nm_rad=2.5)
        assert in_force["environment"]["stiffness_nm_rad"] == 2.5
        rig.set_compensation(0.5)
        with pytest.raises(RefusedError, match="display_change"):
            rig.set_display("tip", "admittance")
        rig.set_compensation(0.75, axis="base")
        until(lambda: rig.latest_state().command_seq == in_force["command_seq"] + 2)
        fields = rig.latest_state().fields
        assert fields["environment_kind"] == [5.0, 1.0]
        assert fields["compensation"] == [0.75, 0.5]
        with pytest.raises(RefusedError) as refused:
            rig.set_environment("tip", "spring", stiffness_nm_rad=1e9)
        assert refused.value.code == "out_of_bounds"


def test_numbers_of_numpy_are_numbers_and_what_is_none_is_named(root):
    with FakeRig(root, names=("base", "tip")), connected(root) as rig:
        asked = rig.set_environment(np.int64(1), "wall", stiffness_nm_rad=np.float32(2.5), side=np.int8(-1))
        assert (asked["axis"], asked["environment"]["stiffness_nm_rad"]) == ("tip", 2.5)
        with pytest.raises(TypeError, match="numbers and texts, not a ndarray"):
            rig.set_environment(1, "wall", stiffness_nm_rad=np.ones(1))


def test_a_target_that_the_daemon_would_drop_unheard_is_refused_where_it_is_made(root):
    with FakeRig(root), connected(root) as rig, rig.lease() as lease:
        for wrong, code in (([0.0, 0.0], "wrong_type"), ([], "wrong_type"), ([math.nan], "out_of_bounds")):
            for target in ((wrong,), ([0.0], wrong)):
                with pytest.raises(RefusedError) as refused:
                    lease.set_target(*target)
                assert refused.value.code == code


def test_a_display_is_changed_as_far_as_the_rig_allows_and_told(root):
    with FakeRig(root, names=("base", "tip"), displays=("admittance", "impedance")), connected(root) as rig:
        assert rig.hello()["axes"][1]["displays"] == ["admittance", "impedance"]
        asked = rig.set_display("tip", "admittance", mass_kgm2=0.03, mass_damping_nms_rad=0.4)
        assert asked["display"] == {"kind": "admittance", "mass_kgm2": 0.03, "mass_damping_nms_rad": 0.4}
        until(lambda: rig.latest_state().command_seq >= asked["command_seq"])
        fields = rig.latest_state().fields
        assert [fields[name][1] for name in ("display_kind", "mass_kgm2")] == [1.0, 0.03]
        for wrong in (0.3, 0.001, math.nan):
            with pytest.raises(RefusedError) as refused:
                rig.set_display("tip", mass_kgm2=wrong)
            assert refused.value.code == "out_of_bounds"
        assert rig.set_display("tip", "impedance")["display"]["mass_kgm2"] == 0.03


def test_a_plane_and_a_spring_near_the_joint_are_set_whole(root):
    with FakeRig(root, names=("base", "tip")), connected(root) as rig:
        rig.set_environment("tip", "detents", stiffness_nm_rad=9.0, damping_nms_rad=0.5, pitch_rad=0.2)
        wall = rig.set_plane("tip", face_rad=0.1, stiffness_nm_rad=2.0, side=-1)["environment"]
        assert (wall["kind"], wall["center_rad"], wall["stiffness_nm_rad"]) == ("wall", 0.1, 2.0)
        assert (wall["damping_nms_rad"], wall["side"]) == (0.0, -1)
        spring = rig.set_spring("tip", rest_rad=-0.2, stiffness_nm_rad=3.0)["environment"]
        assert (spring["kind"], spring["center_rad"], spring["stiffness_nm_rad"]) == ("spring", -0.2, 3.0)


def test_a_fault_is_told_by_event_and_status_and_reset_leaves_it(root):
    with FakeRig(root) as fake, connected(root) as rig, rig.events() as events:

        def is_heard():
            rig.arm()
            if event := events.receive(0.1):
                return event
            rig.stop()
            return until(lambda: rig.status()["state"] == "IDLE") and None

        until(is_heard, "the subscription")
        fake.loop.trip.set()
        told = []
        until(lambda: told.append(next(events)) or told[-1].get("to") == "FAULT")
        assert told[-2]["name"] == "OVERSPEED"
        with pytest.raises(RefusedError, match=r"FAULT.*reset"):
            rig.arm()
        rig.reset()
        assert rig.status()["state"] == "IDLE"
        with pytest.raises(RefusedError, match="no latched fault"):
            rig.reset()


def test_every_tick_arrives_at_three_subscribers_at_10_khz(root):
    with FakeRig(root, rate_hz=10_000, ring_rows=80_000), connected(root) as rig:
        streams = [rig.ticks() for _ in range(3)]
        for stream in streams:
            collected = [next(stream) for _ in range(60)]
            ticks = np.concatenate([batch["tick"] for batch in collected])
            assert (np.diff(ticks) == 1).all()
            assert np.isnan(collected[0]["temperature_c"]).all()
            assert stream.lost == 0


def lose(reader, n):
    """As if the loop had overwritten rows before they were read."""
    reader.next += n
    reader.overwritten += n


def test_losses_are_counted_by_the_one_who_lost(root):
    with (
        FakeRig(root, batch_s=0.005) as fake,
        connected(root) as rig,
        rig.ticks() as ticks,
    ):
        next(ticks)
        fake.in_host(lambda: lose(fake.reader, 50))
        until(lambda: len(next(ticks)) and ticks.lost >= 50)
        assert ticks.lost == 50


def test_a_halted_subscriber_does_not_take_old_samples_for_new(root):
    with FakeRig(root) as fake, connected(root) as rig:
        every, fresh = rig.states(), rig.states(max_age_s=0.1)
        next(every)
        next(fresh)
        sent = fake.reader.next
        time.sleep(0.6)  # the program stands still; its queue fills up
        until(lambda: fake.reader.next > sent + 600, "what fills it")
        assert next(every).stale
        sample = next(fresh)
        assert sample.age_s <= 0.1  # as of the moment it was handed out
        assert not sample.stale
        assert fresh.outdated > 10
        assert fresh.lost == 0


def test_client_and_streams_survive_a_restart_of_the_daemon(root):
    with RigClient("mock", runtime_dir=root, timeout_s=0.5) as rig:
        states = rig.states()
        with FakeRig(root, session=1):
            until(lambda: _quiet(rig.hello))
            until(lambda: _quiet(lambda: next(states).session == 1))
        with pytest.raises(NoReplyError):
            rig.arm()
        with FakeRig(root, session=2):
            until(lambda: _quiet(lambda: next(states).session == 2))
            rig.timeout_s = PATIENCE_S
            assert rig.status()["state"] == "IDLE", (
                "the request that got no reply must not arm a later daemon"
            )
            assert rig.latest_state().session == 2
        assert (states.restarts, states.lost) == (1, 0)


def _quiet(call):
    try:
        return call()
    except NoReplyError:
        return None


def test_a_late_reply_is_never_taken_for_another(root):
    from rtctl.wire.endpoints import RuntimeDirectory

    with RuntimeDirectory.acquire("mock", root) as runtime, zmq.Context() as context:
        slow = context.socket(zmq.ROUTER)
        slow.setsockopt(zmq.LINGER, 0)
        slow.bind(runtime.endpoints.command)
        import msgpack

        def answer(first):
            """All requests from this one on are answered, each after stale replies."""
            request = {"id": 0}
            while request["id"] < first:
                identity, payload = slow.recv_multipart()
                request = msgpack.unpackb(payload)
            for i in range(1, request["id"] + 1):
                body = {
                    "id": i,
                    "op": request["op"],
                    "ok": True,
                    "state": "IDLE",
                    "epoch": i,
                    "result": {"n": i},
                }
                slow.send_multipart([identity, msgpack.packb(body)])

        with RigClient("mock", runtime_dir=root, timeout_s=1.0) as rig:
            asked = itertools.count(1)

            def in_vain():
                """The number of a request that was sent: none is by a machine that stands still."""
                number = next(asked)
                with pytest.raises(NoReplyError):
                    rig.hello()
                return slow.poll(0) and number

            number = until(in_vain, "a request that nobody answers in time") + 1
            server = threading.Thread(target=answer, args=(number,))
            server.start()
            rig.timeout_s = PATIENCE_S
            assert rig.hello() == {"n": number}
            server.join()
        slow.close(linger=0)


def test_requests_from_many_threads_take_turns(root):
    with FakeRig(root), connected(root) as rig:
        results = []

        def ask():
            results.extend(rig.status()["state"] for _ in range(20))

        threads = [threading.Thread(target=ask) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert results == ["IDLE"] * 80


def test_a_late_look_shows_a_fresh_state(root):
    with FakeRig(root), connected(root) as rig, connected(root) as other:
        first, states = rig.latest_state(), other.states()
        # meanwhile 60 samples queue up; one as old as `latest_state` may give is a quarter of a second old
        until(lambda: next(states).tick > first.tick + 600)
        second = rig.latest_state()
        assert second.tick > first.tick + 200
        assert 0 <= second.age_s < math.inf
