"""A scripted fault is due in the ticks its schedule says, by chance where it says so, compiled and plain
alike.
"""

import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scripted_mock import AT, DUE, FOR, SHOWN, N, all_effects, fault, holding, make, rig, run, with_due

from hw.fault_kinds import KINDS, Channel, Effect
from hw.fault_options import read_faults
from hw.fault_script import fill_schedule
from hw.interface import BackendError
from hw.scripted_faults import FAULTS
from hw.simulators.jit import records
from rtctl.tick import new_ticks


@pytest.fixture(scope="module")
def clean():
    return run(make())


def on_ticks(ticks=N, **when):
    when = {"channel": "estop", "kind": "pressed", **when}
    return np.flatnonzero(run(make([when]), ticks)[0]["estop"]).tolist()


@pytest.mark.parametrize(
    ("when", "expected"),
    [
        ({"at_tick": 0, "for_ticks": 1}, [0]),
        ({"at_tick": 58, "for_ticks": 0}, [58, 59]),
        ({"at_s": 0.057, "for_s": 0.0}, [57, 58, 59]),
        ({"at_s": 0.01, "for_s": 0.003}, [10, 11, 12]),
        ({"at_s": 0.0104, "for_s": 0.0001}, [10]),
        ({"at_tick": 5, "for_s": 0.002, "every_s": 0.02}, [5, 6, 25, 26, 45, 46]),
        ({"at_tick": 5, "for_ticks": 2, "every_ticks": 30}, [5, 6, 35, 36]),
        ({"at_tick": 56, "for_ticks": 1, "every_ticks": 1}, [56, 57, 58, 59]),
        ({"at_tick": 60, "for_ticks": 1}, []),
        ({"at_tick": 0, "for_ticks": 0, "probability": 0.0}, []),
    ],
)
def test_a_fault_acts_in_exactly_the_ticks_of_its_schedule(when, expected):
    assert on_ticks(**when) == expected


def test_time_counts_from_the_first_tick_whatever_its_slot():
    backend = make([fault("estop", "pressed", at_tick=2, for_ticks=1)])
    tick, pressed = records(new_ticks(1, 2)), []
    for slot in (1000, 1001, 1002, 1003):
        tick["tick"] = slot
        backend.read(tick)
        pressed.append(int(tick["estop"][0]))
        backend.write(tick)
    assert pressed == [0, 0, 1, 0]


def test_faults_on_one_reading_act_in_their_order_and_those_of_the_link_last(clean):
    twice = [fault("current", "scale", value=2.0), fault("current", "offset", value=1.0)]
    there, back = run(make(twice))[0], run(make(twice[::-1]))[0]
    true = clean[0]["current_a"][DUE]
    np.testing.assert_allclose(there["current_a"][DUE], 2 * true + 1, rtol=1e-13)
    np.testing.assert_allclose(back["current_a"][DUE], 2 * (true + 1), rtol=1e-13)
    dropped = run(make([fault("link", "drop"), fault("position", "nan")]))[0]
    assert dropped["position_rad"].tobytes() == holding(clean[0]["position_rad"]).tobytes()


# -- chance


def test_the_share_of_ticks_in_which_a_fault_acts_is_its_probability():
    shares = []
    for seed in range(40):
        flicker = [fault("estop", "pressed", at_tick=0, for_ticks=0, probability=0.3)]
        shares.append(run(make(flicker, seed=seed), 250)[0]["estop"].mean())
    deviation = math.sqrt(0.3 * 0.7 / 250)
    assert np.mean(shares) == pytest.approx(0.3, abs=4 * deviation / math.sqrt(40))
    assert np.std(shares) == pytest.approx(deviation, rel=0.4)
    assert len(set(shares)) > 10, "seeds differ"


def test_chance_repeats_with_the_seed_and_leaves_the_noise_alone(clean):
    flicker = [fault("estop", "pressed", at_tick=0, for_ticks=0, probability=0.5)]
    first, again, other = (run(make(flicker, seed=seed)) for seed in (7, 7, 8))
    assert first[0].tobytes() == again[0].tobytes()
    assert first[0]["estop"].tolist() != other[0]["estop"].tolist()
    assert first[0]["force_n"].tobytes() == clean[0]["force_n"].tobytes()


def test_a_schedule_that_is_not_due_changes_no_bit(clean):
    shown, truth = run(make([fault("position", "nan", at_tick=N), fault("actuator", "dead", at_tick=N)]))
    assert shown.tobytes() == clean[0].tobytes()
    for name in ("rng", "position_rad", "velocity_rad_s", "current_line_a"):
        assert truth[name].tobytes() == clean[1][name].tobytes()


# -- records


def test_a_schedule_can_be_written_into_the_records_directly(clean):
    backend = make()
    p = backend.params[0]
    for name, value in {
        "channel": Channel.POSITION,
        "effect": Effect.OFFSET,
        "axis": -1,
        "value": 0.5,
    }.items():
        p["fault_" + name][3] = value
    p["fault_from_tick"][3], p["fault_ticks"][3], p["fault_probability"][3] = AT, FOR, 1.0
    p["fault_count"] = 4  # places 0 to 2 are empty: no such channel, nothing happens
    shown, _ = run(backend)
    expected = with_due(clean[0]["position_rad"], lambda x: x + 0.5)
    assert shown["position_rad"].tobytes() == expected.tobytes()


def test_an_effect_that_is_not_of_its_channel_does_nothing(clean):
    known = {(kind.channel, kind.effect) for kind in KINDS.values()}
    channels = (0, Channel.ESTOP, Channel.LINK, Channel.ACTUATOR, Channel.LOOP, 99)
    for channel in channels:
        backend = make()
        p = backend.params[0]
        strange = [effect for effect in (0, *Effect, 99) if (channel, effect) not in known][:FAULTS]
        for k, effect in enumerate(strange):
            p["fault_channel"][k], p["fault_effect"][k], p["fault_value"][k] = channel, effect, 3.0
            p["fault_axis"][k], p["fault_probability"][k] = -1, 1.0
        p["fault_count"] = len(strange)
        shown, truth = run(backend)
        assert shown.tobytes() == clean[0].tobytes(), channel
        assert truth["motor_torque_nm"].tobytes() == clean[1]["motor_torque_nm"].tobytes(), channel


def test_filling_again_replaces_what_was_there(clean):
    backend = make([fault("position", "nan")] * FAULTS)
    fill_schedule(backend.params, read_faults([fault("estop", "pressed")]), rig())
    shown, _ = run(backend)
    assert shown["position_rad"].tobytes() == clean[0]["position_rad"].tobytes()
    assert backend.params["fault_count"][0] == 1
    assert not backend.params["fault_channel"][0, 1:].any()


def test_a_joint_that_is_not_there_is_refused_also_without_a_rig_file():
    with pytest.raises(BackendError, match=r"faults\[0\]\.axis: 2 is not there; must be below 2"):
        make([fault("position", "nan", axis=2)])
    make([fault("force", "nan", axis=2)])


PLAIN = """
import json, sys
sys.path.insert(0, {folder!r})
import scripted_mock as mock
shown, _ = mock.run(mock.make(mock.all_effects()[{part!r}]), 90)
print(json.dumps([shown[name].tolist() for name in mock.SHOWN]))
"""


@pytest.mark.parametrize(("part", "without_number"), [("first", "current_a"), ("last", "moment_nm")])
def test_compiled_and_plain_python_agree_on_all_effects_and_neither_warns(part, without_number):
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", PLAIN.format(folder=str(Path(__file__).parents[2]), part=part)],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert done.returncode == 0, done.stderr
    shown, _ = run(make(all_effects()[part]), 90)
    assert not np.isfinite(shown[without_number]).all()
    for name, plain in zip(SHOWN, json.loads(done.stdout), strict=True):
        np.testing.assert_allclose(np.array(plain), shown[name], rtol=1e-9, atol=1e-12, err_msg=name)
