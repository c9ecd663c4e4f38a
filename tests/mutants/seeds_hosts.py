"""Bugs of hosts of another make: what the journal is told, older recordings and state, other versions."""

from seed import Seed

OLD = "tests/unit/recording/test_json_ticks.py"
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
    Seed(
        "what an older recording lacks is a 0 once it is exported", "rtctl/tick.py",
        'rows[name] = np.nan if rows.dtype[name].base.kind == "f" else 0', "rows[name] = 0",
        (f"{OLD}::test_what_an_older_recording_lacks_is_no_0_once_exported_and_is_told",),
    ),
    Seed(
        "a column that a block lacks is 0", "rtctl/recording/tick_blocks.py",
        'np.full(self.n, np.nan if kind.kind == "f" else 0, kind)', "np.zeros(self.n, kind)",
        ("tests/unit/recording/test_tick_blocks.py"
         "::test_a_column_that_a_block_lacks_is_nan_and_0_in_whole_numbers",),
    ),
    Seed(
        "an export of an older recording does not say what is not in it", "rtctl/cli/export.py",
        "    if missing:\n", "    if False:\n",
        (f"{OLD}::test_what_an_older_recording_lacks_is_no_0_once_exported_and_is_told",),
    ),
    Seed(
        "an older recording of a rig with a force sensor had none", "rtctl/friction/drift_recorded.py",
        "_TAKEN.intersection(missing)", "_TAKEN.intersection(())",
        ("tests/unit/recording/test_shadow.py"
         "::test_what_an_older_archive_of_the_law_lacks_is_named_and_no_drift_is_told_of_it",),
    ),
)  # fmt: skip
