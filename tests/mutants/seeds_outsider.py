"""Seeded bugs in what an outsider who checked issue 17 found (decision 0148)."""

from __future__ import annotations

from seed import Seed

STAMPS = "tests/unit/hw/test_playback_stamps.py"

SEEDS = (
    Seed(
        "rows stamped as their packet arrived are short stretches between gaps",
        "hw/playback/stamps.py",
        "if _is_of_arrival(time_s, gaps):",
        "if False:",
        (f"{STAMPS}::test_rows_that_are_stamped_as_a_packet_arrives_are_given_their_rate",),
    ),
    Seed(
        "regular strokes with pauses are taken for packets",
        "hw/playback/stamps.py",
        "longest < BUNCH_S\n        and",
        "True\n        and",
        (f"{STAMPS}::test_strokes_with_pauses_between_them_are_no_packets",),
    ),
)
