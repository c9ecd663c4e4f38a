"""Simulated devices on a real bus: `python -m hw.simulators.can_device odrive --interface socketcan --channel
vcan0`.

A process of its own, so that the death of the host can be tried: the devices stop when their time to live
is over. In tests it runs in a thread, or is pumped by hand."""

from __future__ import annotations

import argparse
import signal
import sys
import threading
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from hw.can.adapter import python_can
from hw.can.bus import EXTENDED, REMOTE
from hw.interface import Rig
from hw.simulators.can_board import BoardSim
from hw.simulators.can_cia402 import Cia402Sim
from hw.simulators.can_drives import MoteusSim, OdriveSim, SimDrive
from hw.simulators.can_mapped_devices import MitSim, OptoForceSim, VescSim
from hw.simulators.can_plant import Inertia, MockRig, Plant

if TYPE_CHECKING:
    from can import BusABC

TORQUE_CONSTANT_NM_A = 0.0134
STEP_S = 5e-4
KINDS = ("odrive", "odrive-request", "odrive-0.5", "moteus", "cia402", "can", "mit", "vesc", "optoforce")


def make_drives(kind: str, nodes: Sequence[int], time_to_live_s: float = 0.01) -> list[SimDrive]:
    """Simulated devices of a kind, one per node."""
    constant = TORQUE_CONSTANT_NM_A
    makers: dict[str, Any] = {
        "odrive": lambda node: OdriveSim(node, constant, 1e-3, time_to_live_s),
        "odrive-request": lambda node: OdriveSim(node, constant, None, time_to_live_s),
        "odrive-0.5": lambda node: OdriveSim(node, constant, None, time_to_live_s, (0, 5, 6)),
        "moteus": lambda node: MoteusSim(node, constant),
        "cia402": lambda node: Cia402Sim(node, constant, 65536.0),
        "can": lambda _: BoardSim(time_to_live_s),
        "mit": lambda node: MitSim(node, constant, time_to_live_s=time_to_live_s),
        "vesc": lambda node: VescSim(node, time_to_live_s),
        "optoforce": OptoForceSim,
    }
    return [makers[kind](node) for node in nodes]


class DriveSim:
    """Devices, what they turn, and the python-can bus they sit on."""

    def __init__(self, bus: BusABC, drives: Sequence[SimDrive], plant: Plant, *, fd: bool = False) -> None:
        self.bus, self.drives, self.plant = bus, drives, plant
        self._fd, self._message = fd, python_can().Message
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self.muted = False
        """True: the devices hear and send nothing, as if unplugged."""

    def handle(self, wait_s: float = 0.0) -> int:
        """Take and answer waiting frames; returns how many there were."""
        handled = 0
        while (message := self.bus.recv(wait_s)) is not None:
            wait_s = 0.0  # it waits for the first frame alone
            # the controller's own word: no device sees it
            if message.is_error_frame:
                continue
            handled += 1
            can_id = message.arbitration_id | (EXTENDED if message.is_extended_id else 0)
            can_id |= REMOTE if message.is_remote_frame else 0
            for drive in self.drives:
                self._send(drive.frame(can_id, bytes(message.data)) if not self.muted else [])
        return handled

    def _send(self, frames: list[tuple[int, bytes]]) -> None:
        for can_id, data in frames:
            self.bus.send(
                self._message(
                    arbitration_id=can_id & 0x1FFF_FFFF,
                    is_extended_id=bool(can_id & EXTENDED),
                    data=data,
                    is_fd=self._fd,
                    bitrate_switch=self._fd,
                )
            )

    def advance(self, seconds: float) -> None:
        """Let time pass for plant and devices."""
        self.plant.advance(seconds, [drive.current_a for drive in self.drives])
        for axis, drive in enumerate(self.drives):
            plant = self.plant
            turns, turns_s = plant.motor_turns(axis), plant.motor_turns_s(axis)
            sent = drive.pass_time(seconds, turns, turns_s, plant.motor_current_a(axis))
            if not self.muted:
                self._send(sent)

    def pump(self, seconds: float) -> None:
        """One step by hand: time passes, then waiting frames are answered."""
        self.advance(seconds)
        self.handle()

    def run(self) -> None:
        """Serve in real time until `stop`."""
        before = time.monotonic()
        while not self._stop.is_set():
            self.handle(STEP_S)
            now = time.monotonic()
            # by time and not by frames: a busy bus would cut it into steps that cost more than they tell
            if now - before >= STEP_S:
                self.advance(now - before)
                before = now

    def start(self) -> None:
        """Serve in a thread."""
        self._stop.clear()
        self._thread = threading.Thread(target=self.run, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the thread."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None


def _plant(name: str, n_axes: int) -> Plant:
    if name == "inertia":
        return Inertia(n_axes, TORQUE_CONSTANT_NM_A)
    from hw.simulators.mock_options import (
        MockOptions,  # the simulator is its own process: pydantic is allowed here
    )

    lever = np.array([[0.0, 0.1, 0.0], [0.0, 0.0, 0.1], [0.1, 0.0, 0.0]])[:n_axes]
    rig = Rig(
        n_axes, 1e-3, np.full(n_axes, 80.0), np.full(n_axes, 0.72), np.full(n_axes, TORQUE_CONSTANT_NM_A),
        np.full(n_axes, 160_000.0), lever,
    )  # fmt: skip
    return MockRig(MockOptions().model_dump(mode="json"), rig)


def main(arguments: Sequence[str] | None = None) -> int:
    """Serve until Ctrl-C, SIGTERM or `--for` seconds."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("kind", choices=KINDS)
    parser.add_argument("--interface", default="socketcan", help="as python-can names it")
    parser.add_argument("--channel", default="vcan0")
    parser.add_argument("--node", type=int, action="append", help="one per axis; default 1")
    parser.add_argument(
        "--time-to-live-ms", type=float, default=10.0, help="without a command for this long they let go"
    )
    parser.add_argument("--plant", choices=("inertia", "mock"), default="mock")
    parser.add_argument(
        "--for", dest="seconds", type=float, default=0.0, help="end after this long; 0: never"
    )
    given = parser.parse_args(arguments)
    nodes, fd = given.node or [1], given.kind == "moteus"
    more = {"fd": True} if fd or given.interface == "udp_multicast" else {}
    try:
        bus = python_can().Bus(interface=given.interface, channel=given.channel, ignore_config=True, **more)
    except OSError as error:
        parser.error(
            f"{given.interface} {given.channel}: {error.strerror}: sudo ip link add {given.channel} type "
            f"vcan && sudo ip link set {given.channel} up; a machine without CAN: --interface udp_multicast "
            "--channel 239.74.163.2, and both in the rig file's [device.options.bus]"
        )
    drives = make_drives(given.kind, nodes, 1e-3 * given.time_to_live_ms)
    sim = DriveSim(bus, drives, _plant(given.plant, len(nodes)), fd=fd)
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    sim.start()
    try:
        # SIGTERM ends it as Ctrl-C does, with the bus shut down
        signal.signal(signal.SIGTERM, signal.default_int_handler)
        threading.Event().wait(given.seconds or None)
    except KeyboardInterrupt:
        pass
    finally:
        sim.stop()
        bus.shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main())
