"""What several files of this folder stand on: a runtime folder, and a rig on the network with a key of every
role.
"""

import nursery
import pytest
from ports import free_ports
from tcp_rig import clients, listening, short_folder, stocked

from rtctl.host import waiting_loop


@pytest.fixture(scope="session", autouse=True)
def _loops_are_born():
    """Of hosts in the process of the test, as of those that are born."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(waiting_loop, "subprocess", nursery.makes_loops(nursery.Program))
        yield


@pytest.fixture
def folder(tmp_path):
    path = tmp_path / "run"
    path.mkdir(mode=0o700)
    return path


@pytest.fixture
def root():
    with short_folder() as folder:
        yield folder


@pytest.fixture
def store(root):
    return stocked(root)


@pytest.fixture
def port():
    return free_ports(4)


@pytest.fixture
def rig(root, store, port):
    with listening(root, store, port) as running:
        yield running


@pytest.fixture
def client(rig, root, port):
    with clients(root, port) as connect:
        yield connect
