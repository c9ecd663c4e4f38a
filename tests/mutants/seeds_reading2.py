"""Seeded bugs that a reading of reports, playback and experiments for their reasons found: sentences that do
not follow from the table below them.
"""

from __future__ import annotations

from seed import Seed

SENTENCES = ("tests/unit/friction/test_sentences.py",)
MAP = ("tests/unit/experiments/test_what_a_map_says.py",)
STABILITY = "rtctl/experiments/stability_map.py"

SEEDS = (
    Seed(
        "of two slow spans without points one is told in m/s and one in mm/s",
        "rtctl/friction/learn/report_measured_range.py",
        'f"{low:.3g} to {high:.3g} rad/s" if low',
        'f"{low:.3g} to {high:.3g}" if low',
        SENTENCES,
    ),
    Seed(
        "a gain of 1 is said to spend the two-line test",
        "rtctl/friction/learn/report_page.py",
        "if axis.gain >= 1.0:",
        "if False:",
        SENTENCES,
    ),
    Seed(
        "the worst point of a model by place is one that its places excuse",
        "rtctl/friction/learn/report_judge.py",
        "int(np.argmax(np.abs(sure)))",
        "int(np.argmax(np.abs(error)))",
        ("tests/unit/friction/test_judged_places.py",),
    ),
    Seed(
        "a column of JSON with null in it is not there",
        "hw/playback/json_rows.py",
        "if None in values:",
        "if False:",
        ("tests/unit/hw/test_structured_logs.py",),
    ),
    Seed(
        "one set of test points tells machine and formula apart",
        "rtctl/experiments/friction_model.py",
        "if mean[machine].count < 2:",
        "if False:",
        ("tests/unit/experiments/test_friction_model_experiment.py",),
    ),
    Seed(
        "points that say no number are means of none", "rtctl/experiments/friction_model.py",
        "if not least > 0:", "if least == 0:",
        ("tests/unit/experiments/test_friction_model_experiment.py",),
    ),
    Seed(
        "a log of four uneven rows ends the reader", "hw/playback/rising.py",
        "if len(time_s) < JITTER_ROWS:", "if False:",
        ("tests/unit/hw/test_playback_stamps.py",),
    ),
    Seed(
        "the rate of jittering rows is that over their gaps", "hw/playback/reader.py",
        "jittered(table.path, table.time_s[longest], position[longest, 0]",
        "jittered(table.path, table.time_s, position[:, 0]",
        ("tests/unit/hw/test_playback_stamps.py",),
    ),
    Seed(
        "a day between two rows is a second", "hw/playback/cells.py",
        "[one != other for one, other in pairwise(dates)]", "[False for _ in pairwise(dates)]",
        ("tests/unit/hw/test_cells.py",),
    ),
    Seed(
        "the legend of a linear axis is in N m", "rtctl/friction/learn/report_figures.py",
        "legend.get_texts() if legend else ()", "()", SENTENCES,
    ),
    Seed(
        "a map says that no hand is unstable whatever it found",
        STABILITY, "        if inside >= 1.0\n", "        if True\n", MAP,
    ),
    Seed(
        "a hand of more than 16 resonances is no network", "rtctl/experiments/worst_hand.py",
        "(2 * np.arange(1, modes) - 0.06)", "0.97 * 2 * np.arange(1, modes)",
        ("tests/unit/experiments/test_positioning.py"
         "::test_the_worst_hand_is_unstable_exactly_where_theory_says",),
    ),
    Seed(
        "a joint without damping is mapped", STABILITY, "if not device.damping > 0:", "if False:", MAP,
    ),
)  # fmt: skip
