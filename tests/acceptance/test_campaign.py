"""The campaigns of `make test` and, fifty times as long, of `make test-volume`; `make campaign` runs ten
times as many ticks as that.
"""

import pytest
from amounts import asked_often, some_of

from rtctl.control.vocabulary import Fault, Program, State
from rtctl.simulation.campaign_run import Order, run, run_traced

NEVER = {
    Fault.END_OF_LOG, Fault.REALTIME, Fault.DEVICE, Fault.HOST_SILENT, Fault.GATE, Fault.OVERTORQUE,
    Fault.PASSIVITY_GROSS,
    Fault.FORCE_FROZEN, Fault.OFF_AXIS,
}  # fmt: skip
"""Faults ten million ticks do not provoke: other tests do. A campaign has no host that could fall silent. A
force that lies is judged over seconds, and what is across the joints by rigs that say so. GATE and OVERTORQUE
would be defects of ours; the last takes a loop that misses many slots with much torque held (rig 1135:
25)."""


def text(result):
    return "\n".join(violation.text() for violation in result.violations)


# First, as it compiles the campaign of one axis in this process: else each process of `run` would, at the
# same time.
def test_a_rig_follows_from_seed_and_number_alone():
    order = Order(seed=3, rigs=10, ticks=3000)
    first, _, ticks = run_traced(order, 5)
    again, _, same = run_traced(order, 5)
    other, _, _ = run_traced(order, 6)
    assert ticks.tobytes() == same.tobytes()
    assert first.visits.tolist() == again.visits.tolist()
    assert first.visits.tolist() != other.visits.tolist()
    assert order.reproduce(5) == "rtctl campaign --seed 3 --rig 5 --ticks 3000 --faults 10"


def test_two_hundred_thousand_ticks_of_random_rigs_and_two_hundred_faults_break_no_invariant():
    result = run(Order(seed=1, rigs=20, ticks=10_000, faults=10))
    assert not result.violations, text(result)
    assert result.ticks == 200_000
    assert result.faults_scheduled == 200
    assert result.visits[State.ACTIVE] > 20_000
    assert sum(result.as_dict()["faults_appeared"].values()) > 100


@pytest.mark.volume
def test_ten_million_ticks_of_random_rigs_and_ten_thousand_faults_break_no_invariant():
    result = run(Order(seed=1, rigs=1000, ticks=10_000, faults=10))
    assert not result.violations, text(result)
    assert result.ticks == 10_000_000
    assert result.faults_scheduled == 10_000
    seen = result.as_dict()["faults_appeared"]
    assert result.visits[State.ACTIVE] > 1_000_000
    assert sum(seen.values()) > 5_000
    assert {fault for fault in Fault if not seen[fault.name]} <= NEVER
    assert not seen["GATE"]
    assert not seen["PASSIVITY_GROSS"]
    assert all(result.visits[state] for state in State if state is not State.INIT)
    assert all(result.programs[kind] > 5_000 for kind in Program)


@asked_often
@pytest.mark.timeout(600)
def test_no_passive_rig_runs_into_debt():
    result = run(Order(seed=2, rigs=some_of(100), ticks=30_000, passive=True))
    assert not result.violations, text(result)
    assert result.visits[State.ACTIVE] > 0.9 * result.ticks


def test_a_motor_that_was_stuck_while_the_loop_stood_still_is_not_judged_deaf():
    """A fault that began before 37 missed slots and ended in them: found in a campaign ten times as long."""
    assert not run_traced(Order(seed=1), 9229)[0].violations
