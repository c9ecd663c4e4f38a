"""Ticks that come late, and a standstill of the loop: sequences over many ticks."""

from test_state_sequences import spring_rig

from hw.interface import LinkFault
from rtctl.control.vocabulary import Fault, State


def test_three_late_ticks_in_a_row_ramp_down_and_two_do_not():
    rig = spring_rig()
    rig.tick(skipped=1).tick(skipped=1).tick()
    assert rig.mode is State.ACTIVE
    for _ in range(3):
        rig.tick(skipped=1)
    assert rig.mode is State.STOPPING
    assert rig.run(60).mode is State.FAULT
    assert rig["fault_first"] == Fault.OVERRUN.value.bit_length() - 1


def test_more_than_one_percent_of_late_ticks_ramps_down_and_exactly_one_percent_does_not():
    rig = spring_rig()
    for _ in range(10):
        rig.tick(skipped=1)
        rig.run(30)
    rig.run(1000)
    assert rig.mode is State.ACTIVE
    for _ in range(11):
        assert rig.mode is State.ACTIVE
        rig.tick(skipped=1)
        rig.tick()
    assert rig.faults & Fault.OVERRUN
    assert rig.mode is State.STOPPING


def test_one_tick_more_than_ten_periods_late_is_cut_before_anything_is_sent():
    assert spring_rig().tick(skipped=9).mode is State.ACTIVE
    rig = spring_rig().tick(skipped=10)
    assert rig.mode is State.FAULT
    assert rig["torque_applied_nm"] == 0.0
    assert rig["fault_first"] == Fault.STALLED.value.bit_length() - 1


def test_what_is_found_after_a_standstill_does_not_hide_it():
    rig = spring_rig().tick(skipped=10, link_faults=int(LinkFault.LOST | LinkFault.DEVICE))
    assert rig.faults & (Fault.LINK_LOST | Fault.STALLED) == Fault.LINK_LOST | Fault.STALLED
    assert rig["fault_first"] == Fault.STALLED.value.bit_length() - 1
