"""How often a question is asked that takes long to ask often: a part of it in `make test`, all of it in
`make test-volume`.
"""

import os

import pytest

WHOLE = os.environ.get("RTCTL_TEST_VOLUME") == "1"
"""Set by `tests/run_tier.py volume`."""

SHARE = 10


def some_of(number):
    """So many of a question's random cases: a tenth, or all of them as volume."""
    return number if WHOLE else max(1, number // SHARE)


def seeds_of(number, first=0):
    """Seeds of a question's random cases: the first tenth, or the others as volume, so that no CI asks one
    twice.
    """
    few = first + max(1, number // SHARE)
    return range(few, first + number) if WHOLE else range(first, few)


def asked_often(test):
    """Mark a test whose cases are `some_of` so many, or of `seeds_of`: it belongs to both tiers."""
    return pytest.mark.volume(test) if WHOLE else test
