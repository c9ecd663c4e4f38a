"""What `rtctl run` says: a line per event and per broken file, bounded, and nothing that nobody asked for."""

from rtctl.host.speaker import LINES_PER_S, REMEDY, Speaker
from rtctl.terminal import Grade
from rtctl.wire.event_words import device_line, line_of

FAULT = {
    "event": "fault", "name": "DEVICE", "text": "see its manual", "axis": "tip", "channel": None,
    "device": "device[0] 'drive'", "detail": "node 2: DC_BUS_UNDER_VOLTAGE",
}  # fmt: skip


class Heard:
    """Notices of one second."""

    def __init__(self):
        self.lines, self.grades, self.kinds = [], [], set()

    def __call__(self, kind, text, grade):
        if kind not in self.kinds:
            self.kinds.add(kind)
            self.lines.append(text)
            self.grades.append(grade)


def test_changes_of_state_and_faults_with_axis_cause_and_remedy_are_said():
    heard = Heard()
    change = {"event": "state", "from": "ACTIVE", "to": "FAULT", "cause": "DEVICE"}
    Speaker(heard).tell([FAULT, change, {"event": "measured"}], {"event log": None})
    assert heard.lines == [
        "fault DEVICE (axis tip, device[0] 'drive'): node 2: DC_BUS_UNDER_VOLTAGE: see its manual",
        "ACTIVE -> FAULT: DEVICE",
    ]


def test_the_journal_is_told_how_grave_a_line_is():
    heard = Heard()
    speaker = Speaker(heard)
    states = [{"event": "state", "from": "ACTIVE", "to": to, "cause": ""} for to in ("STOPPING", "LOCKOUT")]
    speaker.tell([FAULT, *states], {"recording": "no space left"})
    speaker.refused("arm of anna", "hands off")
    expected = [Grade.ERROR, Grade.INFO, Grade.CRITICAL, Grade.ERROR, Grade.WARNING]
    assert heard.grades == expected, heard.lines
    assert heard.lines[-1] == "arm of anna refused: hands off"


def test_a_recording_that_breaks_and_one_that_is_written_again_are_said_once():
    heard = Heard()
    speaker = Speaker(heard)
    for why in (None, "no space left", "no space left", None):
        speaker.tell([], {"recording": why})
    assert heard.lines == [f"RECORDING BROKEN: no space left; {REMEDY}", "recording: written again"]


def test_lines_are_bounded_in_a_second():
    heard = Heard()
    Speaker(heard).tell([FAULT] * 1000, {})
    assert len(heard.lines) == LINES_PER_S


def test_a_burst_of_other_lines_never_hides_why_the_rig_stopped():
    heard = Heard()
    said = {"event": "device", "device": "device[0]", "axis": None, "text": "warm", "faults": []}
    flicker = [{**said, "silent": False, "tick": k} for k in range(100)]
    change = {"event": "state", "from": "ACTIVE", "to": "FAULT", "cause": "DEVICE", "tick": 100}
    Speaker(heard).tell([*flicker, {**FAULT, "tick": 100}, change, *flicker], {})
    assert len(heard.lines) == LINES_PER_S + 2
    assert [line.split(" (")[0] for line in heard.lines[-2:]] == ["fault DEVICE", "ACTIVE -> FAULT: DEVICE"]


def test_without_notices_nothing_is_said():
    Speaker(None).tell([FAULT], {"recording": "broken"})


def test_a_device_that_is_well_again_says_so():
    said = {"device": "device[0]", "axis": None, "text": "", "faults": [], "silent": False}
    assert device_line(said) == "device[0]: well again"
    assert line_of({"event": "device", **said, "silent": True}) == "device[0]: no fresh sample"
    assert line_of({"event": "warning", "text": "warm"}) == "warning: warm"
