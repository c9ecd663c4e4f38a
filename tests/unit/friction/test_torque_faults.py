"""Faults of torques, each by itself: signs that wrapped or were lost, one signal mapped as two."""

import numpy as np
import pytest

from rtctl.errors import DataError
from rtctl.friction.logs.dead_band import dead_band
from rtctl.friction.logs.torque_faults import lost_sign, much, require_two

T = np.arange(5000) / 500
TORQUE = 0.6 * np.sin(3 * T) + 0.2 * np.sin(11 * T)


def test_negative_numbers_that_wrapped_are_refused_with_what_to_take_off():
    wrapped = np.mod(np.round(1e3 * TORQUE), 65536) / 1e3
    with pytest.raises(DataError, match=r"negative numbers were written without a sign; take 65\.536 N m"):
        lost_sign(wrapped, np.sin(3 * T), "log")
    right = np.where(wrapped > 32.768, wrapped - 65.536, wrapped)
    assert not lost_sign(right, np.sin(3 * T), "log")


def test_a_magnitude_is_told():
    assert "a magnitude?" in lost_sign(np.abs(TORQUE), np.sin(3 * T), "log")[0]
    assert not lost_sign(np.abs(TORQUE) + 1.0, np.sin(3 * T), "log"), "gravity"


def test_one_torque_mapped_twice_or_seen_from_both_sides_is_refused():
    noise = np.random.default_rng(1).normal(0, 1e-3, len(T))
    with pytest.raises(DataError, match=r"is the motor torque again, 2 times it"):
        require_two(TORQUE, 2 * TORQUE + noise, "log")
    with pytest.raises(DataError, match=r"cancels the motor torque"):
        require_two(TORQUE, 0.3 - TORQUE + noise, "log")
    require_two(TORQUE, np.zeros(len(T)), "log")
    friction = 0.1 * np.sign(np.cos(3 * T))
    require_two(TORQUE, friction - TORQUE, "log")  # a hand that holds against the motor


def test_what_a_drive_counts_in_is_no_torque():
    with pytest.raises(DataError, match=r"whole numbers up to 800, read as N m.*:Nm:SCALE"):
        much(np.round(1000 * TORQUE), "log")
    assert "much for what a hand" in much(100 * TORQUE, "log")


def test_a_torque_with_a_dead_band_is_told_and_steps_and_a_motor_that_is_off_are_not():
    torque = 0.6 * np.sin(5 * T) + 0.2 * np.sin(11 * T) + np.random.default_rng(1).normal(0, 1e-3, len(T))
    banded = np.sign(torque) * np.maximum(np.abs(torque) - 0.05, 0)
    (told,) = dead_band(banded, "log")
    assert "a dead band set small torques to 0" in told
    assert not dead_band(torque, "log")
    assert not dead_band(np.round(torque, 1), "log")
    assert not dead_band(np.where(T % 1 < 0.5, torque, 0), "log"), "switched off"
