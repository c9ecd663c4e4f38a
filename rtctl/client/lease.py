"""The lease of a renderer: kept alive in the background, its loss told, its targets sent without waiting."""

from __future__ import annotations

import math
import threading
from collections.abc import Sequence
from typing import Self

import msgpack
import zmq

from rtctl.client.connection import Connection
from rtctl.client.requests import Requester
from rtctl.errors import ClientError, NoReplyError, RefusedError

RENEWALS = 4
"""Renewals within the time after which a silent holder loses the lease."""

RELEASE_S = 1.0
"""A daemon that does not answer a release within this time has let go by itself, or soon will."""

_FINAL = ("lease_lost", "wrong_epoch", "not_ready", "forbidden")


class Lease:
    """The right to move the proxy, from `RigClient.lease`. Use it in one thread.

    A thread of its own renews it. It is lost by a stop or a fault of the rig, by silence (a program that was
    halted), or with the daemon; it is never taken again by itself, because after a stop somebody has to
    decide to go on.

    Attributes
    ----------
    lost : str
        Why the lease is lost; empty while it is held.
    start_rad : tuple of float
        Where the proxy was when the lease was given, one value per axis, rad: targets that begin here do not
        make the rig jump.
    epoch : int
        The epoch this lease belongs to.
    remote : tuple of str
        Axes that targets move, as of the last renewal. Empty: none has the environment `remote`, as after a
        restart of the daemon, and targets move nothing."""

    def __init__(self, connection: Connection, epoch: int, timeout_s: float) -> None:
        # a requester of its own: the thread that renews must not wait for the program's own requests
        self._requester = Requester(connection)
        self._timeout_s = timeout_s
        self.epoch = epoch
        self.lost = ""
        try:
            result = self._requester.call("lease", timeout_s, epoch=epoch)["result"]
        # Ctrl-C, too: a socket that is open keeps `RigClient.close` waiting for ever
        except BaseException:
            self._requester.close()
            raise
        self._text: str = result["lease"]
        self.start_rad = tuple(result["target_position_rad"])
        self.remote = tuple(result.get("remote", ()))  # an older daemon does not say
        self._period_s = result["silence_s"] / RENEWALS
        # CONFLATE is safe here: nothing is received by this socket, and a target is one frame (decision 0010)
        self._socket = connection.socket(zmq.DEALER, connection.endpoints.targets, {zmq.CONFLATE: 1})
        self._over = threading.Event()
        # last: it uses all of the above
        self._thread = threading.Thread(target=self._keep, name="rtctl-lease", daemon=True)
        self._thread.start()

    @property
    def text(self) -> str:
        """The lease as requests carry it."""
        return self._text

    def set_target(
        self, position_rad: Sequence[float], velocity_rad_s: Sequence[float] | None = None
    ) -> None:
        """Send the proxy of the remote axes, one value per axis. Does not wait; only the newest counts.

        A thread of ZeroMQ does the sending. Where cores are few, a program that computes on without a pause
        can delay it by some 0.3 ms.

        Raises
        ------
        RefusedError
            `lease_lost`, once this is known; `wrong_type` for another number of axes, `out_of_bounds` for a
            value that is not finite: the daemon drops such a target and answers nobody."""
        if self.lost:
            raise RefusedError("lease_lost", self.lost)
        target = {"lease": self._text, "epoch": self.epoch, "position_rad": self._numbers(position_rad)}
        if velocity_rad_s is not None:
            target["velocity_rad_s"] = self._numbers(velocity_rad_s)
        # NOBLOCK: with CONFLATE the newer one takes the place of what waits, and nothing is to be waited for
        self._socket.send(msgpack.packb(target), zmq.NOBLOCK)

    def _numbers(self, values: Sequence[float]) -> list[float]:
        numbers = [float(x) for x in values]
        if len(numbers) != len(self.start_rad):
            raise RefusedError(
                "wrong_type", f"a target has one number per axis, {len(self.start_rad)}, not {len(numbers)}"
            )
        if not all(map(math.isfinite, numbers)):
            raise RefusedError("out_of_bounds", f"a target of {numbers} is not finite")
        return numbers

    def release(self) -> None:
        """Give the lease back: somebody else may have it. Idempotent."""
        if self._over.is_set():  # given back already
            return
        self._end()
        try:
            # one that is lost is somebody else's by now, or nobody's
            if not self.lost:
                self._requester.call("release", min(self._timeout_s, RELEASE_S), lease=self._text)
        except (RefusedError, NoReplyError):
            pass  # it is over in any case
        finally:
            self.lost = self.lost or "released"
            self._requester.close()

    def abandon(self) -> None:
        """Stop renewing without telling the daemon, which notices by itself. Idempotent."""
        if not self._over.is_set():
            self._end()
            self._requester.close()
            self.lost = self.lost or "the client was closed"

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.release()

    def _end(self) -> None:
        self._over.set()
        # before the sockets close: they belong to one thread at a time
        self._thread.join()
        self._socket.close(linger=0)

    def _keep(self) -> None:
        """Renew until released or lost. A reply that does not come is asked for again."""
        while not self._over.wait(self._period_s):
            try:
                held = {"epoch": self.epoch, "lease": self._text}
                reply = self._requester.call("lease", self._period_s, **held)
                self.remote = tuple(reply.get("result", {}).get("remote", ()))
            except NoReplyError:
                # the daemon may be busy: the lease ends by the daemon's clock, and its next reply tells
                continue
            except RefusedError as refused:
                if refused.code in _FINAL:
                    self.lost = refused.reason
                    return
            except ClientError as error:  # what answers there now is no daemon, or another user's
                self.lost = str(error)
                return
