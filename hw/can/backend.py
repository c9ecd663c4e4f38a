"""A CAN bus and its devices as a backend. Runs in the loop process: no pydantic here.

One cycle: `read` drains the bus, the newest frame of each kind winning, and takes the sample when every part
of it has arrived since the last one; `write` sends every command. Nothing here waits."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from hw.can.bus import SILENT_TICKS, UNKNOWN_AGE_TICKS, Bus, Handler, SteadyBus, require
from hw.can.open_bus import open_bus
from hw.can.sample import Sample
from hw.can.stopping import noted, tell, tell_afresh
from hw.channels import COMMAND_FIELDS, QUANTITIES
from hw.interface import CompiledCycle, LinkFault, LinkLost, Options, Rig

if TYPE_CHECKING:
    from hw.can.raw import RawFrame
    from hw.can.steady import Steady
    from hw.can.steady_records import Command, Frame

_LOST = int(LinkFault.LOST)


class CanBackend:
    """A bus and its devices. Subclasses say which, and send each cycle's commands.

    Attributes
    ----------
    provides, consumes : frozenset of str
        Channels.
    sample : Sample
        Newest values and counters of bad frames."""

    provides: frozenset[str]
    consumes: frozenset[str]

    def __init__(self, options: Options, rig: Rig) -> None:
        self._options, self._rig = options, rig
        self.sample = Sample(rig.n_axes)
        self.bus: Bus | None = None
        self._identity: tuple[bytes, ...] | None = None
        self._tick: np.ndarray | None = None
        self._count = self._silent = 0
        self._slot = 0
        self.taken = Sample(rig.n_axes)
        self._steady: Steady | None = None
        self.command_words: dict[str, int] = {}
        self._noted: list[RawFrame] | None = None

    def _set_up(self, bus: Bus) -> Mapping[int, Handler]:
        """Make every device ready; returns all handlers. Raises BackendError."""
        raise NotImplementedError

    def _make_frames(self, bus: Bus) -> None:
        raise NotImplementedError

    def _prime(self, bus: Bus) -> None:
        raise NotImplementedError

    def send(self, bus: Bus, *, enabled: bool) -> None:
        """Send this cycle's commands, as the tick bound last has them."""
        raise NotImplementedError

    def _stop(self, bus: Bus) -> None:
        raise NotImplementedError

    def _device_faults(self) -> int:
        return 0

    def _lasting_faults(self) -> int:
        """Those of `_device_faults` that last until Python has the device again."""
        return self._device_faults()

    def steady_frames(self) -> list[Frame]:
        """Every frame that is subscribed to, as compiled cycles read it."""
        raise NotImplementedError

    def steady_commands(self) -> list[Command]:
        """What `send` has sent last, in its order, as compiled cycles send it again."""
        raise NotImplementedError

    def _alike(self) -> int:
        """How many cycles from now on are alike, for all that is due by itself."""
        raise NotImplementedError

    def pass_by(self, cycles: int) -> None:
        """So many cycles were made without Python."""
        raise NotImplementedError

    def _identities(self) -> tuple[bytes, ...]:
        return ()

    def open(self) -> None:
        """Open the bus, set every device up disarmed, and have a first sample. Raises BackendError."""
        if self.bus is not None:
            return
        bus = open_bus(self._options["bus"])
        try:
            bus.subscribe(self._set_up(bus))
            self._check_identity()
            self.sample.fresh = 0  # what came while the devices were set up is older than the question below
            self._prime(bus)
        except BaseException:
            bus.close()
            raise
        self.bus, self._tick = bus, None
        self._count = self._silent = 0

    def _check_identity(self) -> None:
        """A re-opened device must be the one that was opened first; one that tells nothing is not judged."""
        found, known = self._identities(), self._identity or self._identities()
        same = all(a == b or not a or not b for a, b in zip(found, known, strict=True))
        require(
            same,
            f"the devices on {self._options['bus']['channel']} are others than before: identities "
            f"{[one.hex() for one in found]} in place of {[one.hex() for one in known]}; "
            "connect the same ones again, or start anew",
        )
        self._identity = tuple(a or b for a, b in zip(known, found, strict=True))

    def warm_up(self, tick: np.ndarray) -> None:
        """Forget what has queued up since `open`, and ask for a new sample."""
        bus = self._open_bus()
        self._take_back()
        # compiling took seconds: what has queued up meanwhile is of no use, however much it is
        while not bus.receive():
            pass
        self.sample.fresh = self.sample.faults = 0
        self._prime(bus)
        self._bind(tick)

    def compiled_cycle(self, tick: np.ndarray) -> CompiledCycle | None:
        """See `CompiledCycleBackend`; None where the bus is python-can's, or the device needs Python in every
        cycle."""
        if not isinstance(self.bus, SteadyBus):
            return None
        from hw.can.steady import Steady, is_possible

        fields = tick.dtype.fields
        assert fields is not None
        # words of 8 bytes: every field of a tick is made of them
        self.command_words = {name: fields[of][1] // 8 for name, of in COMMAND_FIELDS.items()}
        self._take_back()
        # `begin` would refuse it in every cycle: asked once, such a device costs nothing more
        if not is_possible(self.steady_frames()):
            return None
        self._steady = Steady(self, tick)
        return self._steady.parts

    def _take_back(self) -> int:
        """From here on Python has the device; returns the faults that frames of this cycle have brought."""
        return 0 if self._steady is None else self._steady.end()

    def _hand_over(self, bus: Bus, tick: np.ndarray) -> None:
        """Let compiled code make the next cycles, if it may."""
        steady, health = self._steady, bus.health
        if steady is None or tick is not steady.tick or health.refused_in_a_row:
            return
        alike = self._alike()
        if alike > 0:
            faults = health.link_faults | self._lasting_faults()
            steady.begin(bus, alike, faults, enabled=self._enabled[0] != 0)  # type: ignore[arg-type] # one of two

    @property
    def cycles(self) -> tuple[int, int, int]:
        """Samples taken, cycles since the last one, slot of the last cycle."""
        return self._count, self._silent, self._slot

    @cycles.setter
    def cycles(self, cycles: tuple[int, int, int]) -> None:
        self._count, self._silent, self._slot = cycles

    @property
    def silent_cycles(self) -> int:
        """Cycles since the last whole sample."""
        self._take_back()
        return self._silent

    def _open_bus(self) -> Bus:
        if self.bus is None:
            raise LinkLost(f"the bus {self._options['bus']['channel']} is not open")
        return self.bus

    def _bind(self, tick: np.ndarray) -> None:
        """Keep plain views of the fields: looking them up costs more than filling them."""
        self._open_bus()
        row: Any = tick.view(np.ndarray)
        self._slots, self._counts = row["tick"].data, row["sample_count"].data
        self._faults, self._enabled = row["link_faults"].view(np.int64).data, row["enabled"].data
        self._current = row["current_command_a"][0].data
        self._torque = row["torque_applied_nm"][0].data
        shown = [reading for reading in QUANTITIES if reading.name in self.provides]
        self._shown = [(row[reading.field][0].data, self.taken.of[reading.name]) for reading in shown]
        self._estop = row["estop"].data if "estop" in self.provides else None
        self._slot = int(self._slots[0])
        self._tick = tick

    def read(self, tick: np.ndarray) -> None:
        """Take the newest sample, or show the last one again. Raises LinkLost."""
        if tick is not self._tick:
            self._bind_anew(tick)
        sample, bus = self.sample, self.bus
        if bus is None:
            raise LinkLost("the CAN bus is not open")
        sample.faults = self._take_back()
        drained = bus.receive()
        slot = self._slots[0]
        if not drained or slot - self._slot > UNKNOWN_AGE_TICKS:
            sample.fresh = 0
        # what was left waiting is of this cycle at best: for the next one its age is not known either
        self._slot = slot if drained else slot - UNKNOWN_AGE_TICKS
        faults = sample.faults | bus.health.link_faults | self._device_faults()
        if not self.show():
            self._silent += 1
            if self._silent > SILENT_TICKS:
                faults |= _LOST
        self._faults[0] = faults

    def _bind_anew(self, tick: np.ndarray) -> None:
        slot = self._slot
        first = self._tick is None
        self._bind(tick)
        if not first:  # another row of the ring is no missed slot: ages count from the last cycle
            self._slot = slot

    def show(self) -> bool:
        """Fill the tick: with the new sample if it is complete, else with the last one. True for a new
        one."""
        new = self.sample.fresh == self.sample.needed
        if new:
            self._take()
        for field, values in self._shown:
            field[:] = values
        if self._estop is not None:
            self._estop[0] = self.taken.estop
        self._counts[0] = self._count
        return new

    def _take(self) -> None:
        sample, taken = self.sample, self.taken
        taken.values[:] = sample.values
        taken.estop = sample.estop
        sample.fresh = self._silent = 0
        self._count += 1

    def write(self, tick: np.ndarray) -> None:
        """Send this cycle's commands. Raises LinkLost."""
        if tick is not self._tick:
            self._bind_anew(tick)
        if self.bus is None:
            raise LinkLost("the CAN bus is not open")
        self._take_back()
        self.send(self.bus, enabled=self._enabled[0] != 0)
        if self._steady is not None:
            self._hand_over(self.bus, tick)

    def ask(self) -> None:
        """See AskedBackend: what `open` asks with, once."""
        self._take_back()
        self._prime(self._open_bus())

    def counts(self) -> dict[str, int]:
        """Samples taken, frames refused here by reason, and what the controller reported."""
        self._take_back()
        health = {} if self.bus is None else self.bus.health.counts
        return {
            "samples": self._count,
            **self.sample.counts,
            **{f"bus_{name}": n for name, n in health.items()},
        }

    def prepare_stop(self) -> None:
        """See `PreparedStop`: the frames of a stop, for a bus that is not open here."""
        self._noted = noted(self._options["bus"], self._make_frames, self._stop)

    def stop(self) -> None:
        """Every actuator torque-free now (`stopping.tell`); where the bus is not open, by one that is opened
        for it, if that is quick. Cannot raise."""
        bus = self.bus
        if bus is not None:
            self._take_back()
            tell(bus, lambda: self._stop(bus))
            return
        if self._noted is None:
            self.prepare_stop()
        tell_afresh(self._options["bus"], self._noted or [])

    def close(self) -> None:
        """Stop and release the bus, if it is open."""
        bus = self.bus
        if bus is None:
            return
        self.stop()
        self.bus = self._tick = None  # before it is closed: a read then says so
        bus.close()
