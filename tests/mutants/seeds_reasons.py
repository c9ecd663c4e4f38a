"""Seeded bugs of a reading that asked of each line why it is so: what ends a thread unheard, is taken for
something else, or is told and is not there.
"""

from __future__ import annotations

from seed import Seed

VIEW, STREAMS = "tests/integration/test_view.py::test_", "tests/integration/test_view_streams.py::test_"
CLIENT, TELEMETRY = "tests/unit/test_client.py::test_", "tests/unit/host/test_telemetry.py::test_"
RECORDER = "tests/unit/recording/test_recorder.py::test_"
FLIGHT = "tests/unit/host/test_flight_recorder.py::test_"

SEEDS = (
    Seed(
        "a message that cannot be read ends the page's events",
        "rtctl/client/view_feed.py",
        "        except ClientError as error:\n            why =",
        "        except KeyError as error:\n            why =",
        (f"{STREAMS}a_message_that_cannot_be_read_is_told_and_the_next_one_counts",),
    ),
    Seed(
        "ticks of two sizes of rig are joined for a browser",
        "rtctl/client/view_feed.py",
        "if rows.dtype == batches[-1].dtype]",
        "if len(rows)]",
        (f"{STREAMS}a_rig_that_comes_back_with_another_number_of_axes_is_shown_from_then_on",),
    ),
    Seed(
        "a recording of the page asks for the motion of an axis that is not there",
        "rtctl/client/view_record.py",
        "if signal.index < len(of):",
        'if shape == "axis" or signal.index < len(of):',
        (f"{STREAMS}a_recording_of_an_axis_that_the_rig_has_not_has_an_empty_column",),
    ),
    Seed(
        "a length of five thousand digits ends in a traceback on the terminal",
        "rtctl/client/view_server.py",
        " and len(length) <= MOST_DIGITS",
        "",
        (f"{VIEW}a_body_that_is_too_long_is_not_read",),
    ),
    Seed(
        "a number beyond all floats takes the answer of the page's server",
        "rtctl/client/view_server.py",
        "KeyError, OverflowError, RecursionError)",
        "KeyError)",
        (f"{VIEW}nonsense_is_refused_with_a_reason",),
    ),
    Seed(
        "a STOP with a body that is none is not carried out",
        "rtctl/client/view_server.py",
        'values = {} if name == "stop" else _values(body)',
        "values = _values(body)",
        (f"{VIEW}a_stop_counts_whatever_was_sent_with_it",),
    ),
    Seed(
        "a lease whose renewal is answered by something else is held for ever",
        "rtctl/client/lease.py",
        "                self.lost = str(error)\n",
        "                continue\n",
        (f"{CLIENT}a_lease_whose_renewal_is_answered_by_something_else_is_lost",),
    ),
    Seed(
        "a client keeps every stream that it ever had",
        "rtctl/client/listener.py",
        " if not one.closed)",
        ")",
        (f"{CLIENT}streams_that_were_closed_are_not_kept",),
    ),
    Seed(
        "an event with a number that is none ends the event log",
        "rtctl/recording/event_log.py",
        "json.dumps(as_data(event), ",
        "json.dumps(event, ",
        (f"{FLIGHT}a_number_that_is_none_does_not_end_the_log",),
    ),
    Seed(
        "the command of an incident in a folder with a space cannot be pasted",
        "rtctl/cli/events.py",
        'shlex.quote(str(event["file"]))',
        'event["file"]',
        (
            "tests/unit/cli/test_events_followed.py"
            "::test_the_command_of_an_incident_can_be_pasted_wherever_its_file_lies",
        ),
    ),
    Seed(
        "an event of another version ends the recorder unheard",
        "rtctl/recording/recorder.py",
        "except (KeyError, TypeError, ValueError, OverflowError, struct.error) as error:",
        "except ZeroDivisionError as error:",
        (f"{RECORDER}an_event_that_cannot_be_recorded_is_told_and_what_comes_after_it_is_kept",),
    ),
    Seed(
        "a damaged motion of a recording is believed",
        "rtctl/recording/facts.py",
        'return len(found) == n_axes and set(found) <= {"rotary", "linear"}',
        "return len(found) == n_axes",
        (
            "tests/unit/recording/test_recording_files.py"
            "::test_a_motion_that_is_damaged_is_told_and_what_is_taken_in_its_place",
        ),
    ),
    Seed(
        "a user who may not look into the service's state can check no rig file",
        "rtctl/recording/state_folder.py",
        "except PermissionError:",
        "except FileNotFoundError:",
        (
            "tests/unit/test_state_file.py::test_the_services_state_that_is_not_for_this_user_is_not_looked_at",
        ),
    ),
    Seed(
        "a reload undoes what a client set of another axis",
        "rtctl/host/reload.py",
        "command[name][0, axes] = fresh[name][0, axes]",
        "command[name] = fresh[name]",
        (
            "tests/unit/host/test_reload.py"
            "::test_an_environment_that_a_client_set_stays_where_the_file_says_of_it_what_it_said",
        ),
    ),
    Seed(
        "a service whose data lie behind a link cannot be purged",
        "rtctl/cli/service.py",
        "if path.is_dir() and not path.is_symlink():",
        "if path.is_dir():",
        ("tests/unit/cli/test_service.py::test_data_that_a_link_leads_to_stay_when_the_link_is_purged",),
    ),
    Seed(
        "a Python below a folder with a space cannot compile for its service",
        "rtctl/host/service_steps.py",
        "*shlex.split(command),",
        "*command.split(),",
        (
            "tests/unit/cli/test_service.py::test_a_python_below_a_folder_with_a_space_is_one_word_of_the_unit",
        ),
    ),
    Seed(
        "a broken recording is a success of `rtctl record --json`",
        "rtctl/cli/record.py",
        "RecordingError if broken else 0)",
        "0)",
        (
            "tests/unit/cli/test_record_command.py"
            "::test_a_recording_that_the_disk_refused_ends_with_the_exit_code_of_one",
        ),
    ),
    Seed(
        "doctor sends the interrupts of all devices to the loop's core",
        "rtctl/host/machine_kernel.py",
        "irqaffinity={0 if core else 1}",
        "irqaffinity=0",
        ("tests/unit/doctor/test_doctor_machine.py::test_devices_are_not_sent_to_the_loops_own_core",),
    ),
    Seed(
        "a damaged key keeps its name for ever",
        "rtctl/wire/keys.py",
        "except ConfigError:  # it lets nobody in",
        "except OSError:  # it lets nobody in",
        ("tests/unit/test_keys.py::test_a_damaged_entry_lets_nobody_in_and_is_named",),
    ),
    Seed(
        "a crowd is told of where nobody was cut off",
        "rtctl/wire/intruders.py",
        "if surplus <= 0:",
        "if surplus < -STRANGERS:",
        ("tests/unit/host/test_intruders.py::test_of_a_local_crowd_whoever_was_let_in_stays",),
    ),
    Seed(
        "the demonstration waits for ever for a rig that was stopped",
        "rtctl/cli/demo_run.py",
        'return int(rows["epoch"][-1]) != self._epoch',
        'return bool(rows["state"][-1] == State.FAULT)',
        ("tests/unit/test_demo_figure.py::test_a_rig_that_was_stopped_ends_the_demonstration",),
    ),
    Seed(
        "the page of another rig is told as this one's",
        "rtctl/cli/view.py",
        ' and told.get("rig") == name',
        "",
        (
            "tests/integration/test_address_of_the_page.py"
            "::test_the_page_of_this_rig_is_believed_and_that_of_another_on_its_port_is_not",
        ),
    ),
    Seed(
        "health tells twice at once after a standstill of the host",
        "rtctl/host/exchange/streams.py",
        "due_ns if due_ns > now_ns else now_ns + HEALTH_PERIOD_NS",
        "max(due_ns, now_ns)",
        (f"{TELEMETRY}a_host_that_stood_still_tells_one_health_and_the_next_a_second_later",),
    ),
    Seed(
        "a motor at the bound of its temperatures flickers in health",
        "rtctl/host/exchange/motor_temperature.py",
        "return list(self._present.values())",
        "return [one for one in self._present.values() if self._rig.virtual]",
        (f"{TELEMETRY}a_warning_stands_in_health_until_its_event_takes_it_back",),
    ),
)
