"""How far an instability of a refused rig is looked for."""

import math

import pytest

from rtctl.simulation import campaign_margins


@pytest.mark.parametrize(("from_share", "found"), [(2.6, 1.6), (2.999, 1.999), (3.1, math.inf)])
def test_an_instability_is_looked_for_up_to_the_end(monkeypatch, from_share, found):
    proven = []

    def grows(case):
        proven.append(case.law.k_c / 1.02 if not proven else proven[0])  # the first share tried is 1.02
        return case.law.k_c >= from_share * proven[0]

    monkeypatch.setattr(campaign_margins, "grows", grows)
    assert campaign_margins.distance(1, 0) == pytest.approx(found, abs=0.02)
