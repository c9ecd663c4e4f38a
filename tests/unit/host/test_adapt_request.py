"""The operation `adapt`: the compensation follows the friction that is seen, or is held, while the rig
runs.
"""

import pytest
from test_requests import Desk


@pytest.fixture
def desk():
    made = Desk()
    yield made
    made.memory.close()


class Following:
    """A watch whose axis "tip" may follow, and "base" not."""

    def __init__(self):
        self.on = True

    def adapt(self, a, *, on):
        if a == 0:
            return "may not"
        self.on = on
        return ""

    def adapting(self, a):
        return self.on if a == 1 else None

    def warnings(self):
        return []


def test_the_compensation_follows_or_is_held_by_request_and_refused_by_name(desk):
    assert "follow: no axis may: it follows nothing: adapt_per_min" in desk.refused(
        "out_of_bounds", "adapt", follow="on"
    )
    desk.requests._friction = Following()
    assert "follow: axis base: it may not" in desk.refused("out_of_bounds", "adapt", axis=0, follow="on")
    assert desk.ask("adapt", axis=1, follow="off") == {"adapting": {"base": None, "tip": False}}
    assert [one["adapting"] for one in desk.ask("status")["axes"]] == [None, False]
    assert desk.ask("adapt", axis=0, follow="off") == {"adapting": {"base": None, "tip": False}}
    assert desk.ask("adapt", follow="on") == {"adapting": {"base": None, "tip": True}}
