"""Pairs of the same CAN device: one whose cycles are compiled, one that Python serves."""

import pytest


@pytest.fixture
def pair(monkeypatch):
    from can_pair import Paired  # loads the compiled half, which most tests here do without

    made = []

    def _pair(*names, compiled_half=True, **more):
        made.append(Paired(monkeypatch, *names, compiled_half=compiled_half, **more))
        return made[-1]

    yield _pair
    for one in made:
        one.close()
