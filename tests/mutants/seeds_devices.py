"""Seeded bugs of what stands between wire and tick: serial frames, encoders, force sensors, the loop."""

from __future__ import annotations

from seed import Seed

HW = "tests/unit/hw"
FRAME = (f"{HW}/test_serial_frame.py::test_numbers_come_back_as_they_went",
         f"{HW}/test_serial_frame.py::test_packets_of_another_version_type_or_number_of_axes_are_not_taken",
         f"{HW}/test_serial_frame.py::test_fixed_point_saturates_and_truncates_toward_zero")  # fmt: skip
DAMAGE = (f"{HW}/test_serial_frame.py::test_what_is_no_packet_is_refused",)
LINK = (f"{HW}/test_serial_link.py::test_a_sample_must_be_newer_by_number_and_by_time",
        f"{HW}/test_serial_link.py::test_nothing_older_is_ever_accepted",
        f"{HW}/test_serial_link.py::test_a_sample_is_fresh_once",
        f"{HW}/test_serial_link.py::test_damage_is_a_checksum_fault_unless_a_good_sample_follows_at_once",
        f"{HW}/test_serial_link.py::test_nothing_out_of_a_backlog_is_fresh_and_what_comes_after_it_is",
        f"{HW}/test_serial_commands.py::test_a_value_that_is_not_finite_disables_every_axis",
        f"{HW}/test_serial_commands.py::test_a_disabled_tick_sends_zeros",
        f"{HW}/test_serial_link.py::test_a_velocity_has_the_unit_and_sign_of_the_position",
        f"{HW}/test_serial_link.py::test_a_velocity_that_is_used_and_missing_is_a_fault_of_the_device",
        f"{HW}/test_serial_commands.py"
        "::test_a_board_that_reports_a_failure_of_what_is_used_is_as_good_as_lost",
        f"{HW}/test_serial_commands.py"
        "::test_a_board_that_went_torque_free_by_itself_while_enabled_is_as_good_as_lost")  # fmt: skip
BOARD = (f"{HW}/test_serial_firmware.py",)
ENCODER = (
    "tests/properties/test_encoder.py::test_the_count_follows_every_walk_of_less_than_half_a_range_a_step",
)
MOMENTS = (f"{HW}/test_moments_of_boards.py",)
FORCE = (f"{HW}/test_force_codecs.py",)
LOOP = ("tests/unit/rt/test_loop.py",)
WHOLE = ("tests/unit/rt/test_whole_cycle.py",)
REHEARSAL = ("tests/unit/rt/test_rehearsal.py",)
SERIAL_CYCLE = ("tests/unit/hw/test_serial_compiled_cycle.py",)
REPLUG = ("tests/unit/rt/test_replug.py",)

SEEDS = (
    Seed(
        "half of the packet's checksum is compared", "hw/serial/framing.py",
        "if crc32(body, 0, at - 4) != unsigned(body, at - 4, 4):",
        "if crc32(body, 0, at - 4) & 0xFFFF != unsigned(body, at - 4, 2):", DAMAGE,
    ),
    Seed(
        "a COBS code may point beyond the end", "hw/serial/framing.py",
        "if code == 0 or i + code > n:", "if code == 0:", DAMAGE,
    ),
    Seed(
        "a zero inside a packet is taken for a byte", "hw/serial/framing.py",
        "            if data[k] == 0:\n                return -1\n", "", DAMAGE,
    ),
    Seed(
        "packets too short for a checksum are looked into", "hw/serial/framing.py",
        "if n < 6 or n > BODY_MAX + 1:", "if n > BODY_MAX + 1:", DAMAGE,
    ),
    Seed(
        "numbers lose their sign", "hw/serial/framing.py",
        "if value >> (8 * size - 1):", "if value >> (8 * size):", FRAME,
    ),
    Seed(
        "a state of another number of axes is read", "hw/serial/frame.py",
        "end + (12 if moment else 0)) or body[13] != n_axes:",
        "end + (12 if moment else 0)):", FRAME,
    ),
    Seed(
        "packets of another version are read", "hw/serial/frame.py",
        "return n == length and body[0] == VERSION and body[1] == kind",
        "return n == length and body[1] == kind", FRAME,
    ),
    Seed(
        "a command without a time to live is obeyed", "hw/serial/frame.py",
        " or body[6] != n_axes or body[5] == 0:", " or body[6] != n_axes:", BOARD,
    ),
    Seed(
        "a large negative command becomes a large positive one", "hw/serial/frame.py",
        "return 2147483647 if scaled > 0.0 else -2147483647", "return 2147483647", FRAME,
    ),
    Seed(
        "an older packet is a fresh sample", "hw/serial/link.py",
        "0 < ahead < 0x8000 and", "ahead != 0 and", LINK,
    ),
    Seed(
        "a new packet around an old sample is fresh", "hw/serial/link.py",
        " and 0 < later_us < 0x80000000):", "):", LINK,
    ),
    Seed(
        "a finite value enables a disabled rig", "hw/serial/link.py",
        "enable = enable and math.isfinite(value)", "enable = math.isfinite(value)", LINK,
    ),
    Seed(
        "a disabled command still carries its values", "hw/serial/link.py",
        "            c.value[axis] = 0\n", "            pass\n", LINK,
    ),
    Seed(
        "a board that let go by itself is not noticed", "hw/serial/link.py",
        "if ln.status & ln.unusable_status or _dropped(ln):", "if ln.status & ln.unusable_status:", LINK,
    ),
    Seed(
        "a command of before a stop enables the board again", "hw/simulators/serial_firmware.py",
        "elif not 0 < ahead < 0x8000:", "elif ahead == 0:", BOARD,
    ),
    Seed(
        "the board's time to live never ends", "hw/simulators/serial_firmware.py",
        "self.age = min(self.age + cycles, 255)", "self.age = min(self.age, 255)", BOARD,
    ),
    Seed(
        "a velocity has the other sign than the position", "hw/serial/link.py",
        "ln.velocity_rad_s[axis] = ln.rad_per_count[axis] *",
        "ln.velocity_rad_s[axis] = abs(ln.rad_per_count[axis]) *", LINK,
    ),
    Seed(
        "a board without velocities is taken for one at rest", "hw/serial/link.py",
        "(0 if s.has_velocity else _NO_VELOCITY)", "0", LINK,
    ),
    Seed(
        "velocities are read out of packets that have none", "hw/serial/frame.py",
        "end = 28 + (14 if velocity else 10) * n_axes", "end = n if velocity else 28 + 10 * n_axes", FRAME,
    ),
    Seed(
        "a board without moments is taken for one that measures none", "hw/serial/link.py",
        "(0 if s.has_moment else _NO_MOMENT)", "0", MOMENTS,
    ),
    Seed(
        "moments do not turn with mirrored axes", "hw/force/axes.py",
        "sign = 1.0 if determinant(matrix) > 0 else -1.0", "sign = 1.0", MOMENTS,
    ),
    Seed(
        "an encoder that wraps jumps", "hw/encoder.py",
        "state[1] += wrap(raw - state[1], bits)", "state[1] = raw", ENCODER,
    ),
    Seed(
        "an encoder wraps in one direction only", "hw/encoder.py",
        "return ((count + half) & (2 * half - 1)) - half", "return count & (2 * half - 1)", ENCODER,
    ),
    Seed(
        "a board that has let go is sent torque", "hw/serial/link.py",
        "enable = t.enabled != 0 and ln.dropped == 0", "enable = t.enabled != 0",
        (f"{HW}/test_serial_commands.py"
         "::test_a_board_whose_power_stage_lets_go_stays_torque_free_until_it_is_disabled",),
    ),
    Seed(
        "a drive that has let go is walked back after a second", "hw/can/armed.py",
        "return wanted and not self.dropped",
        "return wanted and not (self.dropped and self.ticks < self._limit)",
        ("tests/contract/test_can_contract.py"
         "::test_a_drive_that_lets_go_is_a_fault_at_once_and_takes_no_torque_until_it_is_armed_anew",),
    ),
    Seed(
        "half of a force frame's checksum is compared", "hw/force/rokubi.py",
        "return crc16_x25(frame[_CRC_OF]) == frame[-2] | frame[-1] << 8",
        "return crc16_x25(frame[_CRC_OF]) & 0xFF == frame[-2]", FORCE,
    ),
    Seed(
        "a force of NaN is a good one", "hw/force/rokubi.py",
        "        status |= _NOT_FINITE\n", "        pass\n", FORCE,
    ),
    Seed(
        "the oldest of several force frames is shown", "hw/force/frames.py",
        "found, at = frame, start + length", "found, at = found or frame, start + length", FORCE,
    ),
    Seed(
        "a saturated force sensor is believed", "hw/force/rdt.py",
        "return 0 if rest == _ERROR and status & _MONITOR else rest",
        "return 0 if rest & _ERROR and status & _MONITOR else rest", FORCE,
    ),
    Seed(
        "the loop writes before it decides", "rtctl/rt/loop.py",
        "                decide()  # 3 decide: newest command, law, gate\n",
        "                write(tick)\n                decide()\n", LOOP,
    ),
    Seed(
        "late slots are caught up in a burst", "rtctl/rt/loop.py",
        "grid[SLOT], grid[DEADLINE] = grid[SLOT] + skipped, deadline + skipped * period",
        "grid[SLOT], grid[DEADLINE] = grid[SLOT], deadline", LOOP,
    ),
    Seed(
        "the grid drifts with the work of a cycle", "rtctl/rt/loop.py",
        "grid[SLOT] + 1, grid[DEADLINE] + grid[PERIOD]", "grid[SLOT] + 1, woke + grid[PERIOD]", LOOP,
    ),
    Seed(
        "a compiled cycle catches late slots up in a burst", "rtctl/rt/whole_cycle.py",
        "        grid.deadline_ns += skipped * grid.period_ns\n", "", WHOLE,
    ),
    Seed(
        "a rehearsal of the law is none: it decides on what is in force", "rtctl/rt/whole_cycle.py",
        "            practised(law_arguments),\n", "            law_arguments,\n", REHEARSAL,
    ),
    Seed(
        "a simulated device rehearses on itself", "rtctl/rt/whole_cycle.py",
        "            practised(parts.write_arguments),\n", "            parts.write_arguments,\n", REHEARSAL,
    ),
    Seed(
        "a rehearsal reaches the device", "rtctl/rt/whole_cycle.py", "bool(parts.simulated)", "True",
        REHEARSAL,
    ),
    Seed(
        "a compiled cycle decides before it reads", "rtctl/rt/whole_cycle.py",
        "        if call_for_int(o.read_at, read_arguments) != 0:  # 2 read the devices\n",
        "        call(o.law_at, law_arguments)\n        if call_for_int(o.read_at, read_arguments) != 0:\n",
        WHOLE,
    ),
    Seed(
        "what a compiled half leaves is not done", "rtctl/rt/whole_cycle.py",
        "            return READ\n", "            pass\n", WHOLE,
    ),
    Seed(
        "compiled cycles go on while the device is lost", "rtctl/rt/whole_cycle.py",
        "        if not device.is_there:\n", "        if False:\n", WHOLE,
    ),
    Seed(
        "a look before the deadline ends before it", "rtctl/rt/clock.py",
        "    while now < deadline_ns:\n", "    while now < until:\n",
        ("tests/unit/rt/test_early.py", "tests/unit/rt/test_clock.py"),
    ),
    Seed(
        "the margin has no bound", "rtctl/rt/clock.py",
        "min(max(followed + change, 0), early[_MOST])", "max(followed + change, 0)",
        ("tests/unit/rt/test_early.py",),
    ),
    Seed(
        "a look spends what is not saved", "rtctl/rt/clock.py",
        "min(early[_FOLLOWED], early[_SAVED])", "early[_FOLLOWED]", ("tests/unit/rt/test_early.py",),
    ),
    Seed(
        "a look takes what the kernel leaves to real-time processes", "rtctl/rt/early.py",
        "min(MOST_SHARE, share / 2)", "MOST_SHARE", ("tests/unit/rt/test_early.py",),
    ),
    Seed(
        "a command that found no room is sent once more", "hw/serial/backend.py",
        '        if wire["full"][0]:  # the compiled half has tried\n', "        if False:\n", SERIAL_CYCLE,
    ),
    Seed(
        "a compiled half shows a backlog as fresh", "hw/serial/compiled_core.py",
        "        meta[1] = BACKLOGGED\n", "        meta[1] = DRAINED\n", SERIAL_CYCLE,
    ),
    Seed(
        "a loop that fails leaves the motor as it is", "rtctl/rt/loop.py",
        "    finally:\n        backend.stop()", "    finally:\n        pass", LOOP,
    ),
    Seed(
        "a second request to end is ignored", "rtctl/rt/loop.py",
        "if stop.requests > 1:", "if stop.requests > 2:", LOOP,
    ),
    Seed(
        "a device that is gone is written to", "rtctl/rt/replug.py",
        "        if not self._wait:\n            try:\n                self._backend.write(tick)",
        "        if True:\n            try:\n                self._backend.write(tick)", REPLUG,
    ),
    Seed(
        "words are made while torque flows", "rtctl/rt/speech.py", "        if self._enabled[0]:\n",
        "        if False:\n",
        ("tests/unit/rt/test_speech.py",),
    ),
    Seed(
        "a fault at rest is told in words of later", "rtctl/rt/speech.py",
        "if now == self._before or not (self._spare or now & ~self._looked_at):", "if True:",
        ("tests/unit/rt/test_speech.py",),
    ),
    Seed(
        "a fault that others flickered before has no words", "rtctl/rt/speech.py",
        "(self._spare or now & ~self._looked_at)", "self._spare", ("tests/unit/rt/test_speech.py",),
    ),
    Seed(
        "what is left of a lost rig is not stopped", "rtctl/rt/replug.py",
        "raised_by(self._backend.stop)  # whatever", "None  # whatever", REPLUG,
    ),
    Seed(
        "a copy of a rig file with other devices keeps those of its origin", "rtctl/rig_file/config.py",
        "if self._made is None or not all(map(is_, self._made[0], made_of)):", "if self._made is None:",
        ("tests/unit/test_config_devices.py::test_a_copy_with_other_tables_has_devices_of_its_own",),
    ),
)  # fmt: skip
