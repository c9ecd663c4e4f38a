"""Seeded bugs in what playback says of springs, and in what a sixth look at logs found."""

from __future__ import annotations

from seed import Seed

SPRUNG = "tests/unit/test_playback_doubts.py::test_a_spring_that_a_hand_pulls_is_neither_inertia_nor_friction"

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
)
