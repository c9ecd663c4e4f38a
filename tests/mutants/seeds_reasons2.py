"""Seeded bugs of a reading of `hw/` that asked of each line why it is so: lines that are full, counters that
are narrow, axes that nobody tells of, zeros that are none.
"""

from __future__ import annotations

from seed import Seed

CELLS, FORMATS = "tests/unit/hw/test_cells.py::test_", "tests/unit/hw/test_log_formats.py::test_"
DESCRIBED, LINES = "tests/unit/hw/test_serial_described", "tests/unit/hw/test_serial_lines"
REFUSALS, BOARD = "tests/unit/hw/test_can_line_refusals.py::test_", "tests/unit/hw/test_can_board.py::test_"
LIVES = "tests/unit/hw/test_serial_commands.py::test_"
CARRIAGES = "tests/unit/hw/test_units_of_carriages.py::test_"
FULL = (f"{REFUSALS}nothing_out_of_a_full_line_is_shown_as_fresh",)
LEFT_OUT = "an_axis_that_is_left_out_is_not_taken_for_one_that_stands_at_zero"

SEEDS = (
    Seed(
        "a quoted delimiter below the tenth row shifts the cells behind it",
        "hw/playback/text_table.py",
        "    if '\"' in text or len(marks) > 1:\n",
        "    if '\"' in body[0]:\n",
        (f"{CELLS}a_quoted_cell_with_the_delimiter_in_it_shifts_nothing_however_far_down_it_stands",),
    ),
    Seed(
        "1_5 in a log is read as 15",
        "hw/playback/cells.py",
        '    if "_" in cell:',
        '    if "__" in cell:',
        (f"{CELLS}python_s_own_way_to_write_a_number_is_none_of_a_log",),
    ),
    Seed(
        "column #0 is the last one",
        "hw/playback/text_table.py",
        'r"#([1-9]\\d{0,3})"',
        'r"#(\\d{1,4})"',
        (f"{CELLS}the_place_before_the_first_is_not_the_last_one",),
    ),
    Seed(
        "a damaged log ends in the traceback of a library",
        "hw/playback/columns.py",
        "    except Exception as error:  # whatever a library stumbles over",
        "    except (ValueError, TypeError, KeyError, OSError) as error:  # whatever a library stumbles over",
        (f"{FORMATS}a_damaged_file_is_refused_by_name_whatever_its_library_raises",),
    ),
    Seed(
        "the moment is left out of the bytes that a serial board's delay is reckoned with",
        "hw/serial/declared.py",
        'for name in ("velocity", "moment")}',
        'for name in ("velocity",)}',
        (
            "tests/unit/hw/test_declared.py::test_a_board_is_late_by_the_bytes_that_its_packets_have_on_the"
            "_wire",
        ),
    ),
    Seed(
        "flags above a narrow counter are turns of the joint",
        "hw/serial/described_codec.py",
        "    count = wrap(int(np.int64(raw)), f.bits)\n",
        "    count = int(np.int64(raw))\n",
        (f"{DESCRIBED}.py::test_flags_above_a_narrow_counter_are_no_turns_at_its_first_reading",),
    ),
    Seed(
        "a motor that is sent 0 gets half a step",
        "hw/serial/described_options.py",
        " and self.zero.is_integer())",
        ")",
        (f"{DESCRIBED}_commands.py::test_bad_descriptions_are_refused_by_key",),
    ),
    Seed(
        "a zero of a line with more digits than are written is rounded",
        "hw/serial/lines_options.py",
        "if round(self.zero, self.decimals) != self.zero:",
        "if round(self.zero, 9) != self.zero:",
        (f"{LINES}_commands.py::test_descriptions_that_make_no_sense_are_refused_by_key",),
    ),
    Seed(
        "what switches a drive on is lost where the line has no room for it",
        "hw/serial/asking.py",
        "(not before or (entering and refused))",
        "not before",
        (f"{LINES}_commands.py::test_what_switches_a_drive_on_is_sent_until_the_line_has_room_for_it",),
    ),
    Seed(
        "a counter of 16 bits that starts over is a board that was powered anew",
        "hw/serial/lines_sample.py",
        "self._span = int(spans[0] or _SPAN) if spans else _SPAN",
        "self._span = _SPAN",
        (f"{LINES}.py::test_a_counter_of_sixteen_bits_that_starts_over_is_no_board_that_was_powered_anew",),
    ),
    Seed(
        "a motor without a thermometer of its own is at 0 degrees (described)",
        "hw/serial/described_backend.py",
        '        self.link["temperature_c"] = self.link["velocity_rad_s"] = np.nan\n',
        "",
        (f"{DESCRIBED}.py::test_an_axis_whose_motor_has_no_thermometer_is_not_told_to_be_cold",),
    ),
    Seed(
        "a motor without a thermometer of its own is at 0 degrees (lines)",
        "hw/serial/lines_sample.py",
        '        for name in ("velocity", "temperature"):\n',
        '        for name in ("velocity",):\n',
        (f"{LINES}.py::test_an_axis_without_a_sensor_of_its_own_is_not_told_to_stand_or_to_be_cold",),
    ),
    Seed(
        "an axis whose current no described board tells of reads 0 A",
        "hw/serial/described_plan.py",
        'NEEDED = ("position", "current")',
        'NEEDED = ("position",)',
        (
            f"{DESCRIBED}_commands.py::test_descriptions_that_do_not_fit_the_rig_are_refused",
            f"{LINES}_commands.py::test_descriptions_that_do_not_fit_the_rig_are_refused",
        ),
    ),
    Seed(
        "an axis whose position no CAN board tells of stands at 0 for ever, fresh",
        "hw/can/board_backend.py",
        "            _require_every(channel, given.get(channel, every), every)\n",
        "            _require_every(channel, every, every)\n",
        (f"{BOARD}{LEFT_OUT}",),
    ),
    Seed(
        "an axis that no frame of a CAN board drives counts as driven",
        "hw/can/board_backend.py",
        '"torque or current_command", commanded or every, every)',
        '"torque or current_command", every, every)',
        (f"{BOARD}{LEFT_OUT}",),
    ),
    Seed(
        "an adapter that refuses every frame is never a lost link",
        "hw/can/slcan.py",
        "elif self.health.refused_in_a_row and not self._belled:\n            self.health.taken()",
        "elif self.health.refused_in_a_row:\n            self.health.taken()",
        (f"{REFUSALS}an_adapter_that_refuses_every_frame_is_a_lost_link_until_it_takes_one",),
    ),
    Seed(
        "a refusal of the adapter is answered by an empty line, which it refuses, too",
        "hw/can/slcan.py",
        "(self.health.refused_in_a_row and not self._belled)\n        begin",
        "self.health.refused_in_a_row\n        begin",
        (f"{REFUSALS}a_refusal_of_the_adapter_makes_no_empty_line_and_one_of_the_port_does",),
    ),
    Seed(
        "old frames out of a full line are fresh in Python",
        "hw/can/slcan.py",
        "                return k == 0 ",
        "                return k >= 0 ",
        FULL,
    ),
    Seed(
        "old frames out of a full line are fresh in compiled cycles",
        "hw/can/steady_cycle.py",
        "return _MORE if n >= LINE_FULL else _DRAINED",
        "return _DRAINED",
        FULL,
    ),
    Seed(
        "a frame with less data than it says is read beyond its end",
        "hw/can/adapter.py",
        "handler(message.data, 0, len(message.data))",
        "handler(message.data, 0, message.dlc)",
        ("tests/unit/hw/test_can_adapter_ports.py::test_a_frame_is_as_long_as_its_data_whatever_it_says",),
    ),
    Seed(
        "a stop is not sent where the port takes no settings",
        "hw/serial_port.py",
        "(OSError, termios.error):\n                    _make_raw(fd, baud)\n",
        "(ValueError):\n                    _make_raw(fd, baud)\n",
        (f"{DESCRIBED}_commands.py::test_a_stop_is_sent_by_a_port_that_takes_no_settings",),
    ),
    Seed(
        "the serial number of a USB device in no UTF-8 ends the daemon",
        "hw/serial_port.py",
        'read_text(errors="replace")',
        "read_text()",
        (f"{DESCRIBED}_commands.py::test_a_usb_device_whose_words_cannot_be_read_ends_nothing",),
    ),
    Seed(
        "a drive that knows the gear of a screw gets the torque of a turn a metre",
        "hw/can/sample.py",
        "        screw = 2 * math.pi / lead_m if lead_m else 1.0\n",
        "        screw = 1.0\n",
        (
            "tests/unit/hw/test_can_axes.py::test_a_turn_of_a_screw_is_its_lead_and_torque_on_it_is_that_of"
            "_the_gear",
        ),
    ),
    Seed(
        "a turn of a screw is 6 m to a board",
        "hw/field_units.py",
        "    return dict(rotary) if own is None else coordinate_units(rotary, own, motion, lead_m)\n",
        "    return dict(rotary)\n",
        (f"{CARRIAGES}a_turn_of_a_screw_is_its_lead_and_a_torque_on_it_pulls_by_it",),
    ),
    Seed(
        "a board that is sent torques gives a screw 2 pi / lead times the force",
        "hw/field_units.py",
        '    if channel == "torque":\n        return effort_units',
        '    if channel == "moment":\n        return effort_units',
        (f"{CARRIAGES}a_turn_of_a_screw_is_its_lead_and_a_torque_on_it_pulls_by_it",),
    ),
    Seed(
        "a serial board holds its last torque for 50 periods after the host has died",
        "hw/serial/frame_backend.py",
        " <= life_s <= 1.01 * most_s:",
        " <= life_s <= 101 * most_s:",
        (f"{LIVES}a_time_to_live_is_two_to_ten_periods_of_the_loop_whatever_the_boards_own_cycle_is",),
    ),
    Seed(
        "a drive may let go between two commands",
        "hw/option_tables.py",
        "    if rate_hz and time_to_live_ms < 2e3 / rate_hz:\n",
        "    if rate_hz and time_to_live_ms < 1e3 / rate_hz:\n",
        ("tests/unit/hw/test_can_load.py::test_a_life_shorter_than_two_periods_is_refused",),
    ),
)
