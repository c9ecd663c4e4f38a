"""A shipped rig file of a serial device, run in step with the simulated device that its description makes."""

import threading
from dataclasses import replace
from pathlib import Path

from hw.rig import compose
from hw.simulators.mock_options import MockOptions
from hw.simulators.serial_board import step
from hw.simulators.serial_line import Damage, Line
from hw.simulators.serial_rig import Simulation, read_described
from rtctl.control.jit import records
from rtctl.rig_file.config import load
from rtctl.simulation.shipped_files import shipped_config
from rtctl.tick import new_ticks


class Played:
    """The backend of a rig file on a pty, and the board at its other end."""

    def __init__(self, folder, name, port, plant):
        self.link = folder / "board"
        text = Path(shipped_config(name)).read_text()
        assert text.count(f'"{port}"') == 1
        (folder / "rig.toml").write_text(text.replace(f'"{port}"', f'"{self.link}"'))
        loaded = load(folder / "rig.toml")
        self.hardware = loaded.config.hardware()
        members = [replace(member, budget_ns=0) for member in loaded.members()]  # this machine may be busy
        self.backend = compose(members, self.hardware)
        plant = MockOptions.model_validate(plant).model_dump(mode="json")
        self.line = Line(self.link, Damage(), 1)
        described = read_described(folder / "rig.toml")
        self.sim = Simulation(self.hardware, plant, self.line, "1", 0, described)
        self.board, self.tick = self.sim.board, records(new_ticks(1, self.hardware.n_axes))
        self.line.plug()

    def open(self):
        opened = threading.Event()

        def _serve():
            while not opened.wait(1e-3):
                self.sim.listen()
                step(self.sim)

        thread = threading.Thread(target=_serve)
        thread.start()
        try:
            self.backend.open()
        finally:
            opened.set()
            thread.join()
        self.backend.warm_up(self.tick)

    def cycles(self, n, *, enabled=1, torque_nm=0.0, current_a=0.0):
        """Read, command and let the board go on by a cycle, `n` times."""
        for _ in range(n):
            self.backend.read(self.tick)
            self.tick["tick"] += 1
            self.tick["enabled"], self.tick["torque_applied_nm"] = enabled, torque_nm
            self.tick["current_command_a"] = current_a
            self.backend.write(self.tick)
            self.sim.listen()
            step(self.sim)
        return self.tick[0]

    def silence(self, n):
        """`n` cycles of the board without a command."""
        for _ in range(n):
            step(self.sim)

    def close(self):
        self.backend.close()
        self.line.unplug()
