import msgpack
import pytest

from rtctl.errors import ClientError
from rtctl.host.exchange.messages import Refusal, Request, decode, decode_target
from rtctl.host.exchange.rig_description import AxisDescription, RigDescription
from tests.bench import flooder

RIG = RigDescription("mock", (AxisDescription("a", {"position_rad": (-1.0, 1.0)}),), 1000.0)


@pytest.mark.parametrize(
    "address", ["tcp://10.0.0.1:9860", "tcp://localhost:9860", "tcp://0.0.0.0:1", "udp://x"]
)
@pytest.mark.parametrize("kind", ["junk", "valid", "targets", "connections"])
def test_floods_never_leave_this_machine(kind, address):
    with pytest.raises(ClientError, match="this machine only"):
        flooder.main(kind, address, "1")


def test_the_messages_are_what_they_are_called():
    assert len(flooder.MESSAGES["junk"]) == 43
    assert isinstance(decode(flooder.MESSAGES["junk"], RIG), Refusal)
    assert isinstance(decode(flooder.MESSAGES["valid"], RIG), Request)
    assert isinstance(decode_target(flooder.MESSAGES["targets"], RIG), Request)
    assert msgpack.unpackb(flooder.MESSAGES["valid"])["op"] == "status"
