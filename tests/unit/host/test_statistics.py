import pytest

from rtctl.control.vocabulary import Fault, State
from rtctl.host.exchange.run_statistics import RunStatistics
from rtctl.tick import new_ticks

STALE = int(Fault.STALE).bit_length() - 1


def closing(*states, first=-1):
    rows = new_ticks(len(states), 1)
    rows["state"], rows["fault_first"] = states, first
    statistics = RunStatistics()
    for i in range(len(states)):  # one batch each: what came before the end is remembered
        statistics.update(rows[i : i + 1])
    return statistics.summary()["fault_first"]


@pytest.mark.parametrize("end", [(), (State.SHUTDOWN, State.SHUTDOWN)])
def test_the_summary_of_a_run_that_ends_in_an_emergency_stop_names_that(end):
    assert closing(State.FAULT, State.ESTOP, *end, first=STALE) == "ESTOP"
    assert closing(State.ACTIVE, State.ESTOP, *end) == "ESTOP"


def test_else_it_names_what_was_latched_first():
    assert closing(State.ACTIVE, State.FAULT, State.SHUTDOWN, first=STALE) == "STALE"
    assert closing(State.ESTOP, State.IDLE, State.SHUTDOWN) is None
