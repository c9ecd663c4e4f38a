"""The shipped joint and the shipped carriage."""

from pathlib import Path

import pytest

from rtctl.rig_file.config import load

CONFIGS = Path(__file__).parents[3] / "configs"


@pytest.fixture(scope="module")
def mock():
    return load(CONFIGS / "mock.toml")


@pytest.fixture(scope="module")
def carriage():
    return load(CONFIGS / "mock-linear.toml")
