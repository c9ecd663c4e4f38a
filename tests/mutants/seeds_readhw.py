"""Seeded bugs of devices on a bus or a line, as a strict reader found them."""

from __future__ import annotations

from seed import Seed

_HEAT = ("tests/unit/hw/test_can_odrive_frames.py",)

_FILES = ("tests/unit/hw/test_can_configs.py",)

_BOARD = ("tests/unit/hw/test_can_board.py",)

SEEDS = (
    Seed(
        "the last temperature of an ODrive stands for ever",
        "hw/can/odrive.py",
        "if self._heat.is_over_long:",
        "if False:",
        _HEAT,
    ),
    Seed(
        "before the first temperature of an ODrive its motor is cold",
        "hw/can/odrive.py",
        "            # none yet: 0 would be a motor that is cold, and may have all its torque\n"
        "            sample.temperature_c[axis] = math.nan\n",
        "",
        _HEAT,
    ),
    Seed(
        "what no frame has told yet is shown as 0 before the first sample",
        "hw/can/drive_backend.py",
        "        self.taken.values[:] = self.sample.values\n",
        "",
        _HEAT,
    ),
    Seed(
        "a sent counter may be a signed number, which stands still at its end",
        "hw/can/board_tables.py",
        '(self.type, self.scale, self.offset) != ("uint", 1.0, 0.0)',
        "self.scale != 1.0",
        _FILES,
    ),
    Seed(
        "of three frames of an identifier the last two may be alike",
        "hw/can/board_options.py",
        "combinations(self.receive, 2)",
        "zip(self.receive[:1] * 32, self.receive[1:])",
        _FILES,
    ),
    Seed(
        "the frame that opening a force sensor has read is fresh behind a backlog",
        "hw/force/serial_backend.py",
        "            newest = None\n",
        "",
        ("tests/contract/test_force_sensors.py::test_the_frame_of_opening_is_not_fresh_behind_a_backlog",),
    ),
    Seed(
        "an emergency stop in a slow CAN frame that comes no more counts as released",
        "hw/can/board_backend.py",
        "return _LOST if any(frame.is_lost for frame in self._received) else 0",
        "return 0",
        _BOARD,
    ),
    Seed(
        "the temperature of a slow CAN frame that comes no more stands for ever",
        "hw/can/board_in.py",
        "                    target[axis] = math.nan",
        "                    pass",
        _BOARD,
    ),
    Seed(
        "compiled cycles take a slow CAN frame, whose silence they do not count",
        "hw/can/board_in.py",
        "return self._parts is not None or self._silence is not None",
        "return self._parts is not None",
        _BOARD,
    ),
    Seed(
        "a line behind one that was cut is glued to it",
        "hw/can/steady_cycle.py",
        "            if b.on == TOLD:\n",
        "            if False:\n",
        (
            "tests/unit/hw/test_can_line_refusals.py"
            "::test_a_line_behind_one_that_found_no_room_begins_with_an_end_of_line",
        ),
    ),
    Seed(
        "letters beyond ASCII make a message longer than a pipe takes whole",
        "rtctl/rt/speech.py",
        "while len(json.dumps(text)) > most_bytes:",
        "while len(text) > most_bytes:",
        ("tests/unit/rt/test_speech.py",),
    ),
)
