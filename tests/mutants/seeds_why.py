"""Seeded bugs that a reading of friction found: empty folds, one bad ramp, positions in the wrong file."""

from __future__ import annotations

from seed import Seed

SECOND = ("tests/unit/friction/test_second_logs.py",)
LOAD = ("tests/unit/friction/test_load_given_up.py",)

SEEDS = (
    Seed(
        "stretches of a sweep are counted whether they hold a place or not",
        "rtctl/friction/learn/cogging.py",
        "blocks = min(_BLOCKS, places)",
        "blocks = _BLOCKS",
        ("tests/unit/friction/test_cogging.py",),
    ),
    Seed(
        "a fold of places without a row has no error",
        "rtctl/friction/learn/places.py",
        "np.mean(fold**2) for fold in folds if len(fold)",
        "np.mean(fold**2) if len(fold) else 0.0 for fold in folds",
        ("tests/unit/friction/test_learn_places.py",),
    ),
    Seed(
        "sectors without a row are counted",
        "rtctl/friction/learn/places.py",
        "np.unique(np.floor((x / period_rad) % 1.0 * _SECTORS), return_inverse=True)[1] % FOLDS",
        "np.floor((x / period_rad) % 1.0 * _SECTORS).astype(int) % FOLDS",
        ("tests/unit/friction/test_learn_places.py",),
    ),
    Seed(
        "least squares that give up once end the report",
        "rtctl/friction/learn/load_terms.py",
        "with contextlib.suppress(RuntimeError):",
        "with contextlib.suppress():",
        LOAD,
    ),
    Seed(
        "a fit that did not converge foretells a session",
        "rtctl/friction/learn/foretold.py",
        "if not trained.converged:",
        "if not trained:",
        ("tests/unit/friction/test_foretold.py",),
    ),
    Seed(
        "a hold is sought in a table as long as the longest gap",
        "rtctl/friction/logs/rows_in_turn.py",
        "every = np.unique(np.floor((at - first) / times).astype(int).clip(-1, number[-1]))",
        "every = np.arange(-1, number[-1] + 1)\n    "
        "stands = at[np.searchsorted(at, first + times * every).clip(0, len(at) - 1)]\n    "
        "every = every[stands < first + times * (every + 1)]",
        SECOND,
    ),
    Seed(
        "a joint that was held in the second log is told at a time of neither",
        "rtctl/friction/logs/held_still.py",
        "since_s = signals.time_s[begin] - signals.began_s(log)",
        "since_s = signals.time_s[begin]",
        SECOND,
    ),
    Seed(
        "parts of a second log are told by the time of the first",
        "rtctl/friction/logs/balance_faults.py",
        "{balance.time_s[part[0]] - began_s:.3g} s",
        "{balance.time_s[part[0]]:.3g} s",
        SECOND,
    ),
    Seed(
        "rows behind a gap are told as rows of the file",
        "rtctl/friction/logs/dynamics.py",
        "if self.start_s else self.source",
        "if False else self.source",
        SECOND,
    ),
    Seed(
        "an offset is a share of a Coulomb friction below 0",
        "rtctl/friction/logs/plausibility.py",
        'if coulomb > 0 else "beside no"',
        'if coulomb else "beside no"',
        SECOND,
    ),
    Seed(
        "a ramp whose counts were passed in one tick makes the mean of all NaN",
        "rtctl/friction/presliding.py",
        "len(np.unique(ramp.share)) >= CHANGES_MIN",
        "len(ramp.share) >= CHANGES_MIN",
        ("tests/unit/friction/test_presliding.py",),
    ),
    Seed(
        "a point that was left out has a weakest place",
        "rtctl/friction/learn/point_evidence.py",
        "shortfall[points.rows_of(sign)]",
        "shortfall[points.direction == sign]",
        ("tests/unit/friction/test_point_evidence.py",),
    ),
    Seed(
        "a hand of another axis says how the first is held",
        "rtctl/experiments/virtual.py",
        'table.get("hand", ())[:1]',
        'table.get("hand", ())',
        ("tests/unit/experiments/test_first_axis.py",),
    ),
    Seed(
        "the hands of all axes are in the figure of the first",
        "rtctl/experiments/policies.py",
        'rms(run.truth["hand_torque_nm"][:, 0])',
        'rms(run.truth["hand_torque_nm"])',
        ("tests/unit/experiments/test_first_axis.py",),
    ),
)
