"""Printed bounds must pass themselves."""

import math

import numpy as np
import pytest

from rtctl.rounded import down, up


@pytest.mark.parametrize("digits", [2, 3, 4])
def test_what_is_printed_is_on_the_side_that_passes_and_as_near_as_its_digits_say(digits):
    values = 10.0 ** np.random.default_rng(3).uniform(-6, 6, 500)
    for value in map(float, values):
        above, below = float(up(value, digits)), float(down(value, digits))
        assert below * (1 - 1e-11) <= value <= above * (1 + 1e-11)
        assert above - below <= 1.001 * 10.0 ** (math.floor(math.log10(value)) + 1 - digits)


@pytest.mark.parametrize("text", ["0.3", "1e-05", "250", "0.0123", "999"])
def test_a_round_number_stays_itself(text):
    assert up(float(text)) == down(float(text)) == text


def test_what_has_no_digits_is_said_so():
    assert (up(0.0), down(0.0), down(-1.0), down(math.nan)) == ("0", "0", "0", "0")
    assert (up(math.inf), down(math.inf), up(math.nan)) == ("inf", "inf", "nan")
    assert float(up(9.996)) == 10.0
    assert float(down(9.999)) == 9.99
