"""A browser, a rig's page that is served to it, and the page as a desk shows it."""

import pytest
from page_rig import at_a_desk, opened, served


@pytest.fixture(scope="module")
def chromium():
    with opened() as program:
        yield program


@pytest.fixture
def rig():
    with served() as made:
        yield made


@pytest.fixture
def desk(chromium, rig):
    with at_a_desk(chromium, rig) as looked_at:
        yield looked_at
