"""Whether `rtctl view` only tells the address of the daemon's own page, or shows one itself."""

import pytest
from page_client import served

from rtctl.cli.view import _shown_by_daemon
from rtctl.wire.protocol import VIEW_NAME


@pytest.fixture
def told(tmp_path):
    """What is believed of a rig in whose folder such an address stands."""

    def of(rig, address):
        (tmp_path / rig).mkdir(mode=0o700)
        (tmp_path / rig / VIEW_NAME).write_text(address)
        return _shown_by_daemon(rig, tmp_path)

    return of


def test_the_page_of_this_rig_is_believed_and_that_of_another_on_its_port_is_not(told):
    with served() as (_rig, server):
        assert told("made-up", f"{server.url}#key=right\n") == (server.url, "key=right")
        assert told("other", f"{server.url}#key=right\n") is None


@pytest.mark.parametrize("address", ["", "http://127.0.0.1:port/", "http://127.0.0.1:1/#key=right"])
def test_an_address_at_which_nobody_answers_is_not_believed(told, address):
    assert told("made-up", address) is None
