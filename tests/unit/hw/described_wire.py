"""A backend of described frames that gets its bytes from the test, and the board that makes them."""

import copy
import tomllib
from pathlib import Path

import numpy as np
from board_wire import BoardWire
from hardware import rig

from hw.serial.described_backend import DescribedBackend
from hw.serial.described_options import DescribedOptions
from hw.simulators.serial_described_board import DescribedBoard
from rtctl.control.jit import records
from rtctl.tick import new_ticks

CONFIG = Path(__file__).parents[3] / "configs" / "serial-described.toml"


OPTIONS = tomllib.loads(CONFIG.read_text())["device"][0]["options"]


COUNTS = 160_000.0


def options(**changes):
    """The shipped options; `sample__length=5` changes one of the sample table."""
    out = copy.deepcopy(OPTIONS)
    for path, value in changes.items():
        *tables, key = path.split("__")
        here = out
        for table in tables:
            here = here[table]
        here[key] = value
    return out


class Wire(BoardWire):
    """A described backend that gets its bytes from the test, and the board that makes them."""

    def __init__(self, table=None, n_axes=1):
        valid = DescribedOptions.model_validate(table or options()).model_dump(mode="json")
        self.backend = DescribedBackend(valid, rig(n_axes))
        self.board = DescribedBoard(valid, rig(n_axes), 7)
        self.tick, self.measured = records(new_ticks(1, n_axes)), records(new_ticks(1, n_axes))
        self.counts = np.zeros(n_axes, np.int64)
        self.backend.warm_up(self.tick)

    def frame(self):
        return self.board.state_packet(self.measured, self.counts, 0)
