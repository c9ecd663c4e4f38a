"""`rtctl doctor --watch`: late ticks as they come, and their sums."""

import json

import pytest

from rtctl.cli.doctor_watch import watch
from rtctl.errors import NoReplyError


class Healths:
    """A rig that says these, one after the other; then its watcher presses Ctrl-C."""

    def __init__(self, *said):
        self._said = list(said)

    def health(self):
        return self

    def __enter__(self):
        return self

    def __exit__(self, *_exception):
        pass

    def receive(self, _timeout_s):
        if not self._said:
            raise KeyboardInterrupt
        return self._said.pop(0)


def late(ticks, **causes):
    return {"late": {"above_us": 100.0, "ticks": ticks, "causes": causes, "newest": None}}


def test_what_is_new_is_a_line_and_the_sums_come_last(capsys):
    watch(Healths(late(5, irq=5), late(5, irq=5), None, {}, late(8, irq=6, smi=2)), None, as_json=False)
    greeting, line, *sums = capsys.readouterr().out.splitlines()
    assert greeting.startswith("a tick is late above 100 us; 5 were so far")
    assert line.endswith(" 3 late: smi 2, irq 1")
    assert sums == ["3 late ticks", "       2  smi", "       1  irq"]


def test_the_sums_are_those_of_all_runs_of_the_daemon_meanwhile(capsys):
    watch(Healths(late(5, irq=5), late(9, irq=9), late(2, irq=1, smi=1)), None, as_json=True)
    *_, sums = capsys.readouterr().out.splitlines()
    assert json.loads(sums) == {"ticks": 6, "causes": {"irq": 5, "smi": 1}}


@pytest.mark.parametrize(
    ("said", "why"), [((), "no health came"), ((None, {}), "late ticks: it runs on a virtual clock")]
)
def test_a_rig_that_tells_nothing_of_late_ticks_has_no_sums(capsys, said, why):
    # a script that asks for one object is told by the exit code that there is none
    with pytest.raises(NoReplyError, match=why):
        watch(Healths(*said), None, as_json=True)
    assert not capsys.readouterr().out
