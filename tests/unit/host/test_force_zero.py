"""The zero of the force sensor from run to run: what is accepted, refused, kept, and what a file may say."""

import json
from dataclasses import replace

import numpy as np
import pytest
from test_requests import RIG, Desk

from rtctl.control.records import params_dtype, state_dtype
from rtctl.control.vocabulary import State
from rtctl.host.exchange.force_zero import NAME, REMEDY, ForceZero
from rtctl.host.exchange.requests import Requests
from rtctl.wire.protocol import Endpoints

DAY_NS = 86400 * 10**9
NOW_NS = 1_800_000_000 * 10**9


@pytest.fixture
def rig():
    params = np.zeros(1, params_dtype(2))
    params["force_offset_limit_nm"] = 0.2  # a hand pulls by more than .05
    params["tare_ticks"] = 300
    return replace(RIG, params=params, devices_sha256="these")


def law(force_n, *, seen=0, count=300):
    """The law's state once it has tared at this force along z, at levers of .1 m and .2 m."""
    state = np.zeros(1, state_dtype(2))[0]
    state["screw"][:, 2] = 0.1, 0.2
    state["tare"][:, 2] = force_n
    state["tare_count"], state["tare_seen"] = count, seen
    return state


def kept(zero):
    """Write what there is to keep; whether there was anything."""
    task = zero.to_keep()
    if task is not None:
        task()
    return task is not None


def test_a_zero_that_the_disk_refused_is_given_again_after_a_while(rig, tmp_path):
    zero = ForceZero(rig, tmp_path / "folder", lambda: NOW_NS)
    zero.follow(law(3.0))
    (tmp_path / "folder").write_text("in its way")
    with pytest.raises(OSError, match="exists"):
        zero.to_keep(10**9)()
    assert zero.to_keep(2 * 10**9) is None
    (tmp_path / "folder").unlink()
    zero.to_keep(7 * 10**9)()
    assert zero.to_keep(20 * 10**9) is None
    assert zero.to_keep() is None
    assert (tmp_path / "folder" / NAME).exists()


def test_a_first_zero_is_taken_as_it_is_and_kept_for_the_next_run(rig, tmp_path):
    first = ForceZero(rig, tmp_path, lambda: NOW_NS)
    assert first.taring(0)
    first.follow(law(0.0, count=299))
    assert first.taring(0)
    assert first.to_keep() is None
    first.follow(law(3.0))
    assert not first.taring(0)
    assert first.refusal() == ""
    assert kept(first)
    assert not kept(first)
    second = ForceZero(rig, tmp_path, lambda: NOW_NS + 7 * DAY_NS // 2)
    second.follow(law(3.24))  # .048 N m at the longer lever
    assert second.refusal() == ""
    assert second.moved_nm().tolist() == [0.0, 0.0], "the new one is the zero from here on"
    assert kept(second)


@pytest.mark.parametrize("force_n", [3.26, 2.74, np.nan])
def test_a_hand_that_pulls_at_start_up_is_told_by_the_zero_of_before(rig, tmp_path, force_n):
    first = ForceZero(rig, tmp_path, lambda: NOW_NS)
    first.follow(law(3.0))
    kept(first)
    then = ForceZero(rig, tmp_path, lambda: NOW_NS + 7 * DAY_NS // 2)
    then.follow(law(force_n))
    told = then.refusal()
    axis, lever = ("base", 0.1) if np.isnan(force_n) else ("tip", 0.2)
    now_nm = lever * force_n
    assert told.startswith(
        f"axis {axis}: the force sensor was tared at {now_nm:.3g} N m, and at {3 * lever:.3g} on 2027"
    )
    assert "3.5 days ago; further apart than 0.05: a hand pulled" in told
    assert told.endswith(f"hands off, `rtctl tare`; {REMEDY}")
    assert not kept(then), "the zero of before stays until there is a better one"
    then.follow(law(3.0, seen=1))
    assert then.refusal() == ""


def test_a_zero_of_other_devices_judges_too_and_is_said_to_be_one(rig, tmp_path):
    first = ForceZero(replace(rig, devices_sha256="those"), tmp_path, lambda: NOW_NS)
    first.follow(law(3.0))
    kept(first)
    then = ForceZero(rig, tmp_path, lambda: NOW_NS)
    then.follow(law(9.0))
    assert "0.0 hours ago with other devices, options or loop rate; further apart than" in then.refusal()
    assert not kept(then)
    then.accept_next(1)
    then.follow(law(9.0, seen=1))
    assert then.refusal() == ""
    assert kept(then)
    then.follow(law(3.0, seen=2))
    assert "0.0 hours ago; further" in then.refusal(), "from here on it is one of these devices"


def steps(zero, forces_n):
    """The forces at which it is tared, up to the first that is refused, and why."""
    for n, force_n in enumerate(forces_n):
        zero.follow(law(force_n, seen=n))
        if why := zero.refusal():
            return force_n, why
    return None, ""


@pytest.mark.parametrize("sign", [1, -1])
def test_light_pulls_add_up_to_half_of_the_bound_and_no_further_over_restarts_too(rig, tmp_path, sign):
    first = ForceZero(rig, tmp_path, lambda: NOW_NS)
    assert steps(first, [3.0, 3.0 + 0.2 * sign])[0] is None
    kept(first)
    then = ForceZero(rig, tmp_path, lambda: NOW_NS)
    force_n, why = steps(then, [3.0 + 0.2 * n * sign for n in range(1, 9)])
    assert force_n == pytest.approx(3.0 + 0.6 * sign), "of .2 N m a half is .1: .5 N at the longer lever"
    assert f"axis tip: the force sensor's zero has walked {0.12 * sign:.3g} N m in small steps" in why
    assert why.endswith(REMEDY)
    then.follow(law(3.0 + 0.4 * sign, seen=20))
    assert then.refusal() == "", "nearer again"


def test_what_a_person_says_is_where_the_walk_begins_anew(rig):
    zero = ForceZero(rig)
    assert steps(zero, [0.0, 0.2, 0.4])[0] is None
    zero.accept_next(9)
    zero.follow(law(0.6, seen=9))
    assert zero.refusal() == ""
    assert steps(zero, [0.8, 1.0])[0] is None
    zero.follow(law(1.2, seen=12))
    assert "has walked" in zero.refusal()


@pytest.mark.parametrize("vouched", [None, "absent", [0.0] * 5, [True] * 6, [float("nan")] * 6, {}])
def test_of_a_file_that_tells_nothing_of_a_word_the_walk_begins_at_its_zero(rig, tmp_path, vouched):
    first = ForceZero(rig, tmp_path, lambda: NOW_NS)
    first.follow(law(3.0))
    kept(first)
    body = json.loads((tmp_path / NAME).read_text())
    for axis in body["axes"].values():
        axis["vouched"] = vouched
        if vouched == "absent":
            del axis["vouched"]
    (tmp_path / NAME).write_text(json.dumps(body))
    then = ForceZero(rig, tmp_path, lambda: NOW_NS)
    assert steps(then, [3.2, 3.4, 3.6])[0] == 3.6


def test_what_a_person_says_is_accepted_of_the_tare_it_was_said_for_and_of_no_other(rig):
    zero = ForceZero(rig)
    zero.follow(law(0.0))
    zero.accept_next(2)
    zero.follow(law(9.0, seen=1))
    assert zero.refusal()
    assert zero.taring(2), "the loop has not begun it"
    zero.follow(law(9.0, seen=2, count=5))
    assert zero.taring(2)
    zero.follow(law(9.0, seen=2))
    assert not zero.taring(2)
    assert zero.refusal() == ""
    zero.follow(law(0.0, seen=3))
    assert zero.refusal()


def test_a_hand_that_has_let_go_is_seen_by_the_zero_of_before(rig):
    zero = ForceZero(rig)
    zero.follow(law(0.0))
    zero.follow(law(1.0, seen=1))
    row = np.zeros(1, [("hand_torque_nm", "f8", 2)])[0]
    assert "shows 0.1 N m, more than 0.05" in zero.pull(row), "the hand pulls on"
    row["hand_torque_nm"] = -0.1, -0.2
    assert zero.pull(row) == "", "it has let go: what the law shows is the zero that it took wrongly"


@pytest.mark.parametrize(
    "spoil",
    [
        lambda text: text[:30],
        lambda text: text.replace("6.0", "1e400"),
        lambda text: text.replace("6.0", "NaN"),
        lambda text: text.replace("6.0", "true"),
        lambda text: text.replace("2027", "twenty"),
        lambda text: text.replace("+00:00", ""),
        lambda text: text.replace('"tip"', '"top"').replace('"base"', '"bottom"'),
        lambda text: json.dumps(
            {"devices_sha256": "these", "axes": {"tip": 3, "base": {"zero": [6.0], "date": ""}}}
        ),
    ],
)
def test_a_file_that_is_damaged_or_of_other_axes_says_nothing(rig, tmp_path, spoil):
    first = ForceZero(rig, tmp_path, lambda: NOW_NS)
    first.follow(law(6.0))
    kept(first)
    file = tmp_path / NAME
    file.write_text(spoil(file.read_text()))
    then = ForceZero(rig, tmp_path)
    then.follow(law(60.0))
    assert then.refusal() == ""


def test_the_age_is_not_told_where_the_wall_clock_was_set_back(rig, tmp_path):
    first = ForceZero(rig, tmp_path, lambda: NOW_NS)
    first.follow(law(3.0))
    kept(first)
    before = ForceZero(rig, tmp_path, lambda: -NOW_NS)
    before.follow(law(5.0))
    assert "2027-01-15T08:00:00+00:00; further" in before.refusal()


def test_where_the_laws_state_is_not_known_any_more_what_was_refused_stays_refused_until_a_word(rig):
    zero = ForceZero(rig)
    zero.follow(law(0.0))
    zero.follow(law(5.0, seen=1))
    zero.follow(None)
    assert not zero.taring(1)
    assert zero.refusal()
    zero.accept_next(2)
    assert not zero.taring(2)
    assert zero.refusal() == ""
    unknown = ForceZero(rig)
    unknown.follow(None)
    assert (unknown.taring(0), unknown.refusal()) == (False, "")


def test_nothing_is_armed_while_the_zero_is_not_known_nor_with_one_that_moved(rig):
    desk, zero = Desk(), ForceZero(rig)
    desk.requests = Requests(desk.writer, rig, Endpoints("ipc://t", "ipc://c"), lambda: desk.row, zero=zero)
    assert desk.ask("arm", 0) == {"command_seq": 1}
    assert desk.sent["arm_count"] == 0, "as the law: used up without effect"
    zero.follow(law(0.0))
    desk.ask("arm", 0)
    assert desk.sent["arm_count"] == 1
    desk.row["state"] = State.IDLE
    desk.ask("tare")
    desk.ask("arm", 0)
    assert desk.sent["arm_count"] == 1
    zero.follow(law(1.0, seen=1))
    assert "a hand pulled while it was tared" in desk.refused("not_ready", "arm", 0)
    desk.ask("tare", 0, hands="off")
    desk.ask("arm", 0)
    zero.follow(law(1.0, seen=2))
    assert desk.sent["arm_count"] == 1
    desk.ask("arm", 0)
    assert desk.sent["arm_count"] == 2
    desk.memory.close()
