"""A backend of lines of text that gets its bytes from the test."""

from board_wire import BoardWire
from hardware import rig

from hw.serial.lines_backend import LinesBackend
from hw.serial.lines_options import LinesOptions
from rtctl.control.jit import records
from rtctl.tick import new_ticks

POSITION = {"channel": "position", "column": 0, "unit": "rad"}


TORQUE = {"channel": "torque", "prefix": "T", "unit": "N m"}


DRIVE = {"time_to_live_ms": 10.0, "field": [TORQUE]}


def options(command=None, sample=(), **more):
    table = {"columns": 2, "field": [POSITION], **dict(sample)}
    return {"port": "/dev/x", "sample": table, **({"command": command} if command else {}), **more}


class Wire(BoardWire):
    """A backend that gets its bytes from the test."""

    def __init__(self, table=None, n_axes=1):
        valid = LinesOptions.model_validate(table or options(DRIVE), context={"rate_hz": 1000.0})
        self.valid = valid.model_dump(mode="json")
        self.backend = LinesBackend(self.valid, rig(n_axes))
        self.tick = records(new_ticks(1, n_axes))
        self.backend.warm_up(self.tick)
        self.feed(b"\n")

    def sent(self, *, enabled=1, torque=0.0, current=0.0):
        self.tick["enabled"], self.tick["torque_applied_nm"] = enabled, torque
        self.tick["current_command_a"] = current
        return super().sent()

    @property
    def position(self):
        return float(self.tick["position_rad"][0, 0])
