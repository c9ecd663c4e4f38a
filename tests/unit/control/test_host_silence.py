"""A host that falls silent for longer than it promised stops the rig; sequences over many ticks."""

from law_rig import LawRig

from rtctl.control.vocabulary import Fault, State


def watched_rig(promise=200):
    rig = LawRig().arm()
    rig.command["beat_ticks"] = promise
    rig.request("beat_count")
    return rig.tick()


def test_a_host_that_is_silent_longer_than_it_promised_stops_the_rig():
    rig = watched_rig().run(200)
    assert rig.mode is State.ACTIVE
    epoch = int(rig["epoch"])
    rig.tick()
    assert rig.mode is State.STOPPING
    assert rig.faults == Fault.HOST_SILENT
    assert rig["fault_first"] == Fault.HOST_SILENT.value.bit_length() - 1
    assert rig["epoch"] == epoch + 1  # what waited in the host meanwhile is void
    rig.run(60)
    assert (rig.mode, rig.faults) == (State.IDLE, Fault(0))
    rig.request("beat_count")
    rig.run(60)
    assert rig.mode is State.IDLE  # it is back, but only an operator's ARM leads back


def test_beats_of_the_host_keep_the_rig_going_and_other_commands_do_not():
    rig = watched_rig()
    for _ in range(3):
        rig.run(190)
        rig.request("beat_count")
        rig.tick()
    assert rig.mode is State.ACTIVE
    for _ in range(250):
        rig.command["seq"] += 1
        rig.request("target_count")
        rig.tick()
    assert rig.mode is State.IDLE


def test_a_host_that_promises_nothing_is_not_watched():
    assert watched_rig(promise=0).run(400).mode is State.ACTIVE


def test_slots_that_the_loop_itself_missed_are_no_silence_of_the_host():
    rig = watched_rig(promise=20).run(19)
    rig.tick(skipped=5)
    assert rig.faults & Fault.HOST_SILENT == 0
    assert rig.mode is State.ACTIVE
