"""A device that is unplugged becomes a fault, not the end of the daemon; plugged in again, it is found again.

While it is gone every tick carries `LinkFault.LOST`, so the law cuts, latches LINK_LOST, and nothing is
sent. Opening may take long: it is tried only then, when the rig is without torque anyway, and not in
every tick. It is the backend's `open` that insists on the same device. What follows is the operator's:
reset, then arm.

A backend may come from outside. An OSError of a driver that has no words of its own is a loss, too. What
`stop` raises at a loss, or `close` and `open` at an attempt, is told and ends nothing. Anything else out of
`read`, `write` or `warm_up` is a mistake of the backend, is told with the device's name, and ends the loop,
which stops the actuator."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hw.interface import (
    Backend,
    BackendError,
    CompiledBackend,
    CompiledCycle,
    CompiledCycleBackend,
    LinkFault,
)
from hw.refusals import mistake_of, raised_by, words_of

_LOST = int(LinkFault.LOST)

# half a second at 1 kHz: opening may block for milliseconds (decision 0007)
REOPEN_TICKS = 500
"""Ticks between two attempts."""


class Replug:
    """A backend whose loss is caught, shown to the law, and healed when the device is back.

    Parameters
    ----------
    backend
        An open backend.
    tell
        Given one line at each loss, at each new reason why it cannot be opened, and at the return. Must not
        block.
    opening
        Called with True before each attempt to open the device, which may take seconds, and with False after
        it. Must not block.
    listen
        Called with the tick after every `write` (`rtctl.rt.speech`). Must not block.
    place
        Names its devices where their code raises what it must not (`hw.member.Member.place`)."""

    def __init__(
        self,
        backend: Backend,
        tell: Callable[[str], None] = lambda _text: None,
        opening: Callable[[bool], None] = lambda _begun: None,
        listen: Callable[[np.ndarray], None] = lambda _tick: None,
        place: str = "the device",
    ) -> None:
        self._backend, self._place, self._listen = backend, place, listen
        self._tell, self._opening = tell, opening
        self._said = ""
        self._wait = 0  # ticks until the next attempt to open; 0: the device is there
        self.provides, self.consumes = backend.provides, backend.consumes

    def open(self) -> None:
        """Acquire the device. Raises BackendError."""
        self._backend.open()

    def warm_up(self, tick: np.ndarray) -> None:
        """As the backend's own, where it has one."""
        if isinstance(self._backend, CompiledBackend):
            backend = self._backend
            self._called("warm_up", lambda: backend.warm_up(tick))

    @property
    def is_there(self) -> bool:
        """Whether the device is there; while it is not, every cycle needs `read`."""
        return self._wait == 0

    def compiled_cycle(self, tick: np.ndarray) -> CompiledCycle | None:
        """As the backend's own, where it has one."""
        backend = self._backend
        return backend.compiled_cycle(tick) if isinstance(backend, CompiledCycleBackend) else None

    def listen(self, tick: np.ndarray) -> None:
        """What `write` does besides sending."""
        self._listen(tick)

    def read(self, tick: np.ndarray) -> None:
        """Read, or show that there is nothing to read."""
        # the last values stay in the tick, with the last count: nobody takes them for new
        if self._wait and not self._found():
            tick["link_faults"] = _LOST
            return
        try:
            self._backend.read(tick)
        except (BackendError, OSError) as error:
            self._lose(error)
            tick["link_faults"] = _LOST
        except Exception as error:
            raise mistake_of(self._place, "read", error) from error

    def write(self, tick: np.ndarray) -> None:
        """Send, unless there is nobody to send to; the next `read` says so."""
        if not self._wait:
            try:
                self._backend.write(tick)
            except (BackendError, OSError) as error:
                self._lose(error)
            except Exception as error:
                raise mistake_of(self._place, "write", error) from error
        self._listen(tick)

    def stop(self) -> None:
        """Make the actuator torque-free now. Raises what the backend raises though it must not, with its
        name."""
        self._called("stop", self._backend.stop)

    def close(self) -> None:
        """Release the device; raises as `stop` does."""
        self._called("close", self._backend.close)

    def _called(self, what: str, action: Callable[[], None]) -> None:
        try:
            action()
        except (BackendError, OSError):
            raise
        except Exception as error:
            raise mistake_of(self._place, what, error) from error

    def _lose(self, error: Exception) -> None:
        self._wait = REOPEN_TICKS
        refusal = raised_by(self._backend.stop)  # whatever part of the rig can still be reached
        self._say(f"lost: {words_of(error)}" + (f"; not stopped: {words_of(refusal)}" if refusal else ""))

    def _found(self) -> bool:
        """Count down, then try to open the device again."""
        self._wait -= 1
        if self._wait:
            return False
        self._opening(True)
        # closed, else its port would be held, by this very process; where that fails opening may still work
        refused = raised_by(self._backend.close)
        error = raised_by(self._backend.open)
        if error is not None and not isinstance(error, BackendError | OSError):
            raised_by(self._backend.stop)  # a mistake: nobody knows what it has left, as at the start
        self._opening(False)
        if error is not None:
            self._wait = REOPEN_TICKS
            first = f"{words_of(refused)}, then " if refused else ""
            self._say(f"not found again: {first}{words_of(error)}")
            return False
        self._say("found again" + (f", though closing it failed: {words_of(refused)}" if refused else ""))
        return True

    def _say(self, text: str) -> None:
        if text != self._said:
            self._said = text
            self._tell(text)
