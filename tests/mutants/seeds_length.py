"""Seeded bugs of a presliding length that is only bounded."""

from __future__ import annotations

from seed import Seed

BOUND = ("tests/unit/friction/test_presliding.py",)
SURE = ("tests/unit/friction/test_guarantee.py",)

SEEDS = (
    Seed(
        "the count that the encoder hides is left out of the bound of a presliding length",
        "rtctl/friction/presliding.py",
        "    moved_rad = max(float(np.ptp(ramp.grid_rad)) + ramp.count_rad for ramp in ramps)",
        "    moved_rad = max(float(np.ptp(ramp.grid_rad)) for ramp in ramps)",
        BOUND,
    ),
    Seed(
        "a bound of the presliding length is that of the hardest place",
        "rtctl/friction/presliding.py",
        "    moved_rad = max(float(np.ptp(ramp.grid_rad)) + ramp.count_rad for ramp in ramps)",
        "    moved_rad = min(float(np.ptp(ramp.grid_rad)) + ramp.count_rad for ramp in ramps)",
        BOUND,
    ),
    Seed(
        "a bound of one direction is a measured length beside the other's",
        "rtctl/friction/presliding.py",
        "    told = [part for part in parts if not part.at_most]",
        "    told = list(parts)",
        BOUND,
    ),
    Seed(
        "of two bounds the shorter holds",
        "rtctl/friction/presliding.py",
        "        longest_rad = max(part.length_rad for part in parts)",
        "        longest_rad = min(part.length_rad for part in parts)",
        BOUND,
    ),
    Seed(
        "a presliding length that is only bounded counts as measured",
        "rtctl/friction/guarantee.py",
        '        source = AT_MOST if model.presliding_spread_rad == 0.0 else "model"',
        '        source = "model"',
        SURE,
    ),
    Seed(
        "a joint whose length is only bounded is lent less than one of which nothing is known",
        "rtctl/friction/guarantee.py",
        "LENGTH_FACTOR * assumed_rad(axis.motion) if source == AT_MOST else 0.0)",
        "0.0)",
        SURE,
    ),
    Seed(
        "bristles of a bounded length are tried no stiffer than measured ones",
        "rtctl/friction/guarantee.py",
        "        return self.length_source in (ASSUMED, AT_MOST)",
        "        return self.length_source == ASSUMED",
        SURE,
    ),
)
