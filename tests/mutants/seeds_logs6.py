"""Seeded bugs in what playback says of springs, and in what a sixth look at logs found."""

from __future__ import annotations

from seed import Seed

SPRUNG = "tests/unit/test_playback_doubts.py::test_a_spring_that_a_hand_pulls_is_neither_inertia_nor_friction"

SPRINGS = "tests/unit/friction/test_springs.py"

CELLS = "tests/unit/hw/test_cells.py"

SEEDS = (
    Seed(
        "a log that is judged keeps its spring as inertia",
        "rtctl/simulation/playback_figures.py",
        "((free,),) = spring.taken_out(((log,),)) if spring else ((log,),)",
        "free = log",
        (SPRUNG,),
    ),
    Seed(
        "the spring that a hand pulls is friction in the report",
        "rtctl/simulation/playback_interaction.py",
        "stored = inertial + np.broadcast_to(signals.place_nm, len(chosen))[chosen]",
        "stored = inertial",
        (SPRUNG,),
    ),
    Seed(
        "a command without columns ends a recording unnamed",
        "rtctl/client/capture.py",
        "first, *_ = columns.values()",
        "first = next(iter(columns.values()))",
        ("tests/unit/test_broken_telemetry.py::test_what_a_recording_cannot_read_is_a_named_error",),
    ),
    Seed(
        "a short travel tells how large gravity is",
        "rtctl/friction/logs/springs.py",
        "return not apart or max(gravity, default=0.0) > SEEN_MOST * float(np.ptp(columns @ fit.added))",
        "return False",
        (f"{SPRINGS}::test_over_a_short_travel_gravity_and_a_spring_are_told_together",),
    ),
    Seed(
        "a gas spring gets stiffer towards larger positions only",
        "rtctl/friction/logs/springs.py",
        "tried = np.linspace(-math.log(GROWS_MOST), math.log(GROWS_MOST), 15)",
        "tried = np.linspace(0.01, math.log(GROWS_MOST), 15)",
        (f"{SPRINGS}::test_a_slide_on_a_gas_spring_is_told_with_how_much_stiffer_it_gets",),
    ),
    Seed(
        "a preload is told as the sensor's zero",
        "rtctl/friction/logs/plausibility.py",
        'if any(name.startswith(("stiffness", "gravity")) for name in found):',
        "if False:",
        (f"{SPRINGS}::test_an_offset_beside_a_spring_is_told_as_its_pull",),
    ),
    Seed(
        "a torque constant that falls is told where nothing else is left over only",
        "rtctl/friction/logs/torque_shape.py",
        "if not plainly and not (abs(found.value)",
        "if not (abs(found.value)",
        ("tests/unit/friction/test_torque_shape.py",),
    ),
    Seed(
        "a message that was cut off is left out as if nobody had written it",
        "hw/playback/message_lines.py",
        "elif set(own) & set(names):",
        "elif False:",
        (CELLS,),
    ),
    Seed(
        "cells without a name are words of a message",
        "hw/playback/message_lines.py",
        "any(map(str.isdigit, words))",
        "False",
        (CELLS,),
    ),
    Seed(
        "the nanoseconds of a stamp are left out",
        "hw/playback/json_rows.py",
        "1e-9 * float(value[ns])",
        "0.0 * float(value[ns])",
        (CELLS,),
    ),
    Seed(
        "rows at half the rate have no name",
        "rtctl/friction/logs/lost_rows.py",
        "if places < BORDERS_LEAST or places <= 2 * others:",
        "if True:",
        ("tests/unit/friction/test_lost_rows.py",),
    ),
    Seed(
        "speeds that double by no whole ratio are lost rows",
        "rtctl/friction/logs/lost_rows.py",
        "places <= 2 * others",
        "False",
        ("tests/unit/friction/test_lost_rows.py",),
    ),
    Seed(
        "quotes are part of a name between blanks",
        "hw/playback/text_rows.py",
        """return _quoted(line.replace("\\t", " "), " ") if '"' in line else line.split()""",
        "return line.split()",
        (CELLS,),
    ),
    Seed(
        "a speed that is counted as a torque has a share as no gear has",
        "rtctl/friction/logs/two_shares.py",
        "one.sure() and one.of_gear()",
        "one.sure() and one.alike()",
        (
            "tests/unit/cli/test_identify_log.py::test_the_report_says_the_units_taken_and_what_nothing_in_the_log_tells",
        ),
    ),
)
