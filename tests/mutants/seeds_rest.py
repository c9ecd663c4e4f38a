"""Seeded bugs of the friction at rest, of a motion that comes to rest in between, and of the rest: what was
left over elsewhere.
"""

from __future__ import annotations

from seed import Seed

SEEDS = (
    Seed(
        "a break-away below what the slowest speeds hold is kept",
        "rtctl/identify/rest.py",
        "wanted = held if",
        "wanted = abs(ramp_nm) if",
        ("tests/unit/identify/test_rest.py",),
    ),
    Seed(
        "slow speeds that chance puts first end an identification",
        "rtctl/identify/session.py",
        "if not any(task.speed_rad_s >= top_rad_s for task in todo):",
        "if todo:",
        (
            "tests/unit/identify/test_difficult_joints.py"
            "::test_where_only_quick_speeds_become_steady_no_order_of_the_speeds_ends_it",
        ),
    ),
    Seed(
        "a CAN board that heard no stop is sent counts that begin anew after a re-plug",
        "hw/can/board_backend.py",
        "sent.stop(bus)\n        for frame in self._poll:",
        "sent.send(bus, (), (), False)\n        for frame in self._poll:",
        ("tests/unit/hw/test_stop_sequence.py",),
    ),
    Seed(
        "the count of a CAN board with idle bytes begins anew after a re-plug",
        "hw/can/board_out.py",
        "self._counter[1].count = before._counter[1].count",
        "self._counter[1].count = 0",
        ("tests/unit/hw/test_stop_sequence.py",),
    ),
    Seed(
        "a driver's OSError out of write ends the daemon",
        "rtctl/rt/replug.py",
        "self._backend.write(tick)\n            except (BackendError, OSError) as error:",
        "self._backend.write(tick)\n            except BackendError as error:",
        ("tests/unit/rt/test_replug.py",),
    ),
    Seed(
        "a stop that raises at a loss ends the daemon",
        "rtctl/rt/replug.py",
        "refusal = raised_by(self._backend.stop)",
        "refusal = self._backend.stop()",
        ("tests/unit/rt/test_replug.py",),
    ),
    Seed(
        "a close that raises at a re-plug ends the daemon",
        "rtctl/rt/replug.py",
        "refused = raised_by(self._backend.close)",
        "refused = self._backend.close()",
        ("tests/unit/rt/test_replug.py",),
    ),
    Seed(
        "a device whose opening fails by a mistake of its code is not stopped",
        "rtctl/rt/process.py",
        "raised_by(backend.stop)",
        "pass",
        ("tests/unit/rt/test_replug.py",),
    ),
    Seed(
        "a stop that raises in one device keeps the host from stopping the others",
        "rtctl/host/safe_stop.py",
        "reach_all([backend.stop for",
        "reach_all([backend.stop() for",
        ("tests/unit/host/test_safe_stop.py",),
    ),
    Seed(
        "devices stay open where another one's opening fails by a mistake of its code",
        "hw/rig.py",
        "except Exception as error:  # whatever it was: the others",
        "except BackendError as error:  # whatever it was: the others",
        ("tests/unit/hw/test_rig_time_and_loss.py",),
    ),
    Seed(
        "the motor torque of a log that is judged is not put back",
        "rtctl/simulation/playback_figures.py",
        "aligned(recording, rig, delay_s)",
        "aligned(recording, rig, 0.0)",
        ("tests/unit/test_playback_report.py::test_a_log_is_judged_as_it_is_learned_from",),
    ),
    Seed(
        "a recording of some seconds keeps every tick that waited",
        "rtctl/cli/record.py",
        "batch.rows[:count]",
        "batch.rows",
        ("tests/unit/cli/test_record_command.py",),
    ),
    Seed(
        "a replay that stops at a gap is a success",
        "rtctl/cli/replay.py",
        "    if verdict.stopped:\n        raise",
        "    if False:\n        raise",
        ("tests/unit/cli/test_one_object_and_its_code.py",),
    ),
    Seed(
        "whoever holds a pseudo terminal plays its device",
        "hw/device_holders.py",
        '["tty-index:", name.name] in',
        '["tty-index:", name.name] not in',
        ("tests/unit/doctor/test_doctor_ports_held.py",),
    ),
    Seed(
        "a joint that passed its goal in a late batch does not follow",
        "rtctl/identify/motion.py",
        "if patience_s < 0 and (goal - self.position_rad) * direction > 0:",
        "if patience_s < 0:",
        (
            "tests/unit/identify/test_late_host.py::test_a_joint_that_passed_its_goal_in_a_late_batch_has_followed",
        ),
    ),
    Seed(
        "the guard of the travel stops the way back from beyond it",
        "rtctl/identify/travel_guard.py",
        "beyond = max(beyond, side * here_rad + 0.5 * half_rad)",
        "pass",
        (
            "tests/unit/identify/test_late_host.py::test_the_way_back_from_beyond_the_guard_is_open_whatever_the_velocity_is_thought_to_be",
        ),
    ),
    Seed(
        "the way back opens the guard outward, too",
        "rtctl/identify/travel_guard.py",
        "elif side * v < 0.0:",
        "if v != 0.0:",
        (
            "tests/unit/identify/test_late_host.py::test_the_way_back_from_beyond_the_guard_is_open_whatever_the_velocity_is_thought_to_be",
        ),
    ),
    Seed(
        "tries that a late host spoilt give a point up",
        "rtctl/identify/collected.py",
        "if late and self.forgiven < FORGIVEN:",
        "if False:",
        (
            "tests/unit/identify/test_late_host.py::test_tries_that_a_late_host_spoilt_count_for_nothing_but_not_for_ever",
        ),
    ),
    Seed(
        "a turn in which a late host let the joint be braked is taken for an even one",
        "rtctl/identify/sweep.py",
        "ticks = before_the_guard(ticks[: max(count, 0)], motion.rig.axis)",
        "ticks = ticks[: max(count, 0)]",
        (
            "tests/unit/identify/test_late_host.py::test_a_turn_that_a_late_host_never_lets_be_seen_ends_with_words",
        ),
    ),
    Seed(
        "a place that a late host ran past is measured where the joint is",
        "rtctl/identify/points.py",
        "steady = False  # it ran on",
        "pass  # it ran on",
        ("tests/unit/identify/test_late_host.py::test_a_place_that_a_late_host_ran_past_is_gone_to_again",),
    ),
    Seed(
        "a place that a late host ran past is left out",
        "rtctl/identify/points.py",
        "if got.forgiven == forgiven:",
        "if True:",
        ("tests/unit/identify/test_late_host.py::test_a_place_that_a_late_host_ran_past_is_gone_to_again",),
    ),
)
