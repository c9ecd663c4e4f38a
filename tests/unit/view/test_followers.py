"""What the page's server keeps for a browser that does not read, and what it does without descriptors."""

import errno
from types import SimpleNamespace

import pytest

from rtctl.client import view_server
from rtctl.client.view_feed import KEPT_BYTES, Follower
from rtctl.tick import new_ticks


@pytest.mark.parametrize(("rows", "batches"), [(2000, 30), (30_000, 3)])
def test_a_browser_that_does_not_read_keeps_a_bounded_number_of_bytes(rows, batches):
    follower, batch = Follower(), new_ticks(rows, 1)
    for k in range(batches):
        batch = batch.copy()
        batch["tick"] = k
        follower.add(batch)
    assert sum(one.nbytes for one in follower.batches) <= max(KEPT_BYTES, batch.nbytes)
    assert follower.take()[0]["tick"][-1] == batches - 1, "the newest is kept, however long it is"


def test_a_connection_that_cannot_be_taken_for_want_of_descriptors_is_not_asked_for_without_a_rest(
    monkeypatch,
):
    def refused():
        raise OSError(errno.EMFILE, "Too many open files")

    rests = []
    monkeypatch.setattr(view_server, "time", SimpleNamespace(sleep=rests.append))
    server = view_server.ViewServer.__new__(view_server.ViewServer)
    server.socket = SimpleNamespace(accept=refused)
    with pytest.raises(OSError, match="Too many"):  # as socketserver expects, which goes on
        server.get_request()
    assert rests == [view_server.MESSAGE_S]
