"""Load terms of published actuators: their coefficients are found again, and friction errs half of Coulomb +
viscous or less.
"""

from pathlib import Path

import pytest

from tests.bench import load_models

DATA = Path(__file__).parents[3] / "shared" / "data" / "bam_actuators"


@pytest.mark.skipif(not DATA.is_dir(), reason="the published parameters are not on this machine")
def test_published_load_coefficients_are_found_again():
    found = list(load_models.every(DATA))
    assert len(found) == 12
    for actuator, model, share, off in found:
        assert share <= 0.5, (actuator, model)
        assert off, (actuator, model)
        assert max(abs(error) for error in off.values()) <= 0.1, (actuator, model, off)
