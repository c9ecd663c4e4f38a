"""How a client reaches a daemon: addresses, its key, and sockets that come back by themselves."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import zmq

from rtctl.errors import ConfigError, NoReplyError
from rtctl.wire.keys import ClientKey
from rtctl.wire.private_folder import foreign_endpoint
from rtctl.wire.protocol import HEARTBEAT_MS, Endpoints, tcp_endpoints

# ms: a host that cuts its connections has its clients back within these (decision 0010)
_OPTIONS = {zmq.LINGER: 0, zmq.RECONNECT_IVL: 20, zmq.RECONNECT_IVL_MAX: 500}


@dataclass(frozen=True)
class Connection:
    """Where a rig is, and the key that opens it.

    Parameters
    ----------
    context
        Of the client.
    endpoints
        ZeroMQ addresses of the rig.
    key
        Needed over TCP; None by ipc."""

    context: zmq.Context[zmq.Socket[bytes]]
    endpoints: Endpoints
    key: ClientKey | None = None

    def socket(
        self, kind: int, endpoint: str, options: dict[zmq.SocketOption, int], topics: Iterable[bytes] = ()
    ) -> zmq.Socket[bytes]:
        """A socket that connects to `endpoint`, now or once somebody listens there, to hear all of `topics`
        from the first moment.

        Raises NoReplyError where somebody else could answer in place of the rig."""
        self.vouch(endpoint)
        made = self.context.socket(kind)
        for option, value in {**_OPTIONS, **options}.items():
            made.setsockopt(option, value)
        for topic in topics:
            # before connecting: what is sent in between would be missed
            made.setsockopt(zmq.SUBSCRIBE, topic)
        if self.key is not None:
            made.setsockopt(zmq.CURVE_SERVERKEY, self.key.server_key.encode())
            made.setsockopt(zmq.CURVE_PUBLICKEY, self.key.public_key.encode())
            made.setsockopt(zmq.CURVE_SECRETKEY, self.key.secret_key.encode())
        # by ipc the kernel says at once that the other end is gone; of a network nobody may say anything
        if endpoint.startswith("tcp:"):
            made.setsockopt(zmq.HEARTBEAT_IVL, HEARTBEAT_MS)
            # three: one that is late on a busy network is no loss
            made.setsockopt(zmq.HEARTBEAT_TIMEOUT, 3 * HEARTBEAT_MS)
        # nobody need listen there yet: ZeroMQ tries until somebody does
        made.connect(endpoint)
        return made

    @staticmethod
    def vouch(endpoint: str) -> None:
        """Raise NoReplyError when the folder of a socket is another user's: whatever answers there is not the
        rig."""
        if reason := foreign_endpoint(endpoint):
            raise NoReplyError(f"{reason} (whoever owns it could answer in place of the rig)")


def remote_endpoints(address: str) -> Endpoints:
    """Endpoints of the rig at `HOST:PORT`, PORT being that of requests. Raises ConfigError for anything
    else."""
    host, _, port = address.rpartition(":")
    # telemetry takes the port two above it
    if not host or not port.isdecimal() or not 0 < int(port) < 65_534:
        raise ConfigError(f"address {address!r}: HOST:PORT, with [gateway] port of the rig file")
    return tcp_endpoints(host, int(port))
