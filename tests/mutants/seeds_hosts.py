"""Bugs of hosts of another make: what the journal is told, older recordings and state, other versions."""

from seed import Seed

NOTICES = "tests/unit/host/test_rates_and_notices.py"
GRADE = f"{NOTICES}::test_only_the_journal_is_told_the_grade_and_of_each_line"

SEEDS = (
    Seed(
        "a person's terminal is shown grades that are the journal's", "rtctl/terminal.py",
        'os.environ.get("JOURNAL_STREAM") == f"{found.st_dev}:{found.st_ino}"',
        '"JOURNAL_STREAM" in os.environ',
        (GRADE,),
    ),
    Seed(
        "only the first line of an error is one in the journal", "rtctl/terminal.py",
        'text.split("\\n"))', 'text.split("\\0"))',
        (GRADE,),
    ),
    Seed(
        "every event is information to the journal", "rtctl/host/speaker.py",
        "text, _GRADES[level_of(event)],", "text, Grade.INFO,",
        ("tests/unit/host/test_speaker.py::test_the_journal_is_told_how_grave_a_line_is",),
    ),
    Seed(
        "nobody but the client knows that an arm was refused", "rtctl/host/exchange/gateway.py",
        'if request.op == "arm":', 'if request.op == "none":',
        ("tests/unit/host/test_gateway.py"
         "::test_an_arm_that_is_refused_is_told_to_the_journal_and_what_is_less_is_not",),
    ),
    Seed(
        "whoever runs from a folder called rtctl is its daemon", "rtctl/host/machine_line.py",
        'Path(word).name in ("rtctl", "rtctl.rt")', '"rtctl" in word',
        ("tests/unit/doctor/test_doctor_ports_held.py::test_a_port_that_another_process_holds_names_it",),
    ),
)  # fmt: skip
