"""On the simulated joint with scripted drift the held-out error of whole sessions is that of the session
after.
"""

import pytest

from rtctl.rig_file.config import load
from tests.bench import next_session


@pytest.mark.volume
def test_held_out_sessions_foretell_the_next_one():
    loaded = load(next_session.SHIPPED)
    sessions = [next_session.session(loaded, day, at, 6, 2) for at, day in enumerate(next_session.DAYS[:7])]
    found = next_session.foretold(sessions, ("coulomb_viscous", "lorentzian"))
    assert len(found) == 3
    assert 1 / 1.5 <= next_session.ratio(found) <= 1.5
    assert sum(one.covered for one in found) / len(found) >= 0.9
