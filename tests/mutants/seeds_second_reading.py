"""Seeded bugs that a second reading of recordings, wire, rig file, client and loop found."""

from __future__ import annotations

from seed import Seed

RARE = "tests/unit/recording/test_rare_recordings.py"
ONE = "tests/unit/cli/test_one_object_and_its_code.py"

SEEDS = (
    Seed(
        "an array unpacks to whatever a stranger has packed",
        "rtctl/bounded_npz.py",
        "        return member.read(info.file_size)",
        "        return member.read()",
        (f"{RARE}::test_an_array_that_unpacks_to_more_than_its_head_says_is_not_unpacked",),
    ),
    Seed(
        "an array may be packed by a method that knows no bound",
        "rtctl/bounded_npz.py",
        "_PACKED = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)",
        "_PACKED = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA)",
        (f"{RARE}::test_an_array_that_is_packed_otherwise_than_numpy_does_is_refused",),
    ),
    Seed(
        "a column of bytes becomes as many ticks",
        "rtctl/recording/incident.py",
        "        if n * kind.itemsize > MOST_BYTES:",
        "        if n > MOST_BYTES:",
        (f"{RARE}::test_an_incident_whose_ticks_would_not_fit_is_refused",),
    ),
    Seed(
        "a time that MCAP has no number for ends the recorder unheard",
        "rtctl/recording/recorder.py",
        "(KeyError, TypeError, ValueError, OverflowError, struct.error)",
        "(KeyError, TypeError, ValueError)",
        (f"{RARE}::test_times_that_no_file_can_have_do_not_end_the_recorder_unheard",),
    ),
    Seed(
        "a machine whose clock is not set records nothing",
        "rtctl/recording/parts.py",
        'self._start_wall_ns = max(0, int(setup.about["start_wall_ns"]))',
        'self._start_wall_ns = int(setup.about["start_wall_ns"])',
        (f"{RARE}::test_times_that_no_file_can_have_do_not_end_the_recorder_unheard",),
    ),
    Seed(
        "a disk that hangs at the end is a success",
        "rtctl/recording/recorder.py",
        '            self._broken = self._broken or f"{self.folder}: the disk took nothing for',
        '            _ = self._broken or f"{self.folder}: the disk took nothing for',
        (f"{RARE}::test_a_disk_that_hangs_at_the_end_is_no_success",),
    ),
    Seed(
        "the last chunk is counted as dropped though only the summary is missing",
        "rtctl/recording/recorder.py",
        "self.folder), pending - (self._parts.written - written))",
        "self.folder), pending)",
        (f"{RARE}::test_a_chunk_that_is_on_the_disk_is_not_counted_as_dropped_for_its_summary",),
    ),
    Seed(
        "the second file of a second recording is a part of the first",
        "rtctl/recording/parts.py",
        "{session:08x}{again}-{number:03d}.mcap",
        "{session:08x}-{number:03d}{again}.mcap",
        (f"{RARE}::test_two_recordings_of_a_session_are_not_parts_of_each_other",),
    ),
    Seed(
        "of two recorders that begin at once the second takes the first one's file away",
        "rtctl/recording/parts.py",
        "                self._final = self._free_name()\n",
        "",
        (f"{RARE}::test_of_two_that_begin_at_once_neither_takes_the_others_file_away",),
    ),
    Seed(
        "before part 1000 nothing is found",
        "rtctl/recording/reader.py",
        'width = len(number) if number.startswith("0") else 3',
        "width = len(number)",
        (f"{RARE}::test_the_part_before_the_thousandth_is_found",),
    ),
    Seed(
        "a damaged first chunk is told as another law",
        "rtctl/recording/replay.py",
        "        expected = self._next\n",
        "        expected = self._next or int(numbers[0])\n",
        (f"{RARE}::test_a_first_chunk_that_is_damaged_is_a_loss_and_not_another_law",),
    ),
    Seed(
        "of two channels of a topic the last one counts",
        "rtctl/recording/joint_states.py",
        "topics.setdefault(contents.topics[channel], []).extend(messages)",
        "topics[contents.topics[channel]] = messages",
        (f"{RARE}::test_a_topic_of_two_channels_is_read_whole_and_in_order",),
    ),
    Seed(
        "what two channels bring is read one after the other",
        "rtctl/recording/joint_states.py",
        "        messages.sort(key=itemgetter(0))",
        "        messages = list(messages)",
        (f"{RARE}::test_a_topic_of_two_channels_is_read_whole_and_in_order",),
    ),
    Seed(
        "the age of a sample from the network goes by another machine's clock",
        "rtctl/client/streams.py",
        '                one["sent_monotonic_s"] = sent_s\n',
        '                one["sent_monotonic_s"] = one["sent_monotonic_s"] + 0.0 * sent_s\n',
        ("tests/unit/test_client.py::test_an_age_over_the_network_does_not_go_by_another_machines_clock",),
    ),
    Seed(
        "every message from the network is new",
        "rtctl/client/streams.py",
        "            apart_s = min(apart_s, self._apart_s +",
        "            apart_s = max(apart_s, self._apart_s +",
        ("tests/unit/test_client.py::test_an_age_over_the_network_does_not_go_by_another_machines_clock",),
    ),
    Seed(
        "half a key is a key",
        "rtctl/wire/keys.py",
        "                file.write(text.encode())\n",
        "                os.write(file.fileno(), text.encode())\n",
        ("tests/unit/test_keys.py::test_a_key_for_which_there_is_no_room_is_none",),
    ),
    Seed(
        "a latency that the kernel did not take is granted",
        "rtctl/rt/realtime.py",
        '        os.write(fd, (0).to_bytes(4, "little"))',
        '        _ = (0).to_bytes(4, "little")',
        ("tests/unit/rt/test_realtime.py::test_a_wake_up_latency_that_is_not_taken_is_not_granted",),
    ),
    Seed(
        "the name of a file comes to the disk before its content",
        "rtctl/whole_files.py",
        "            os.fsync(file.fileno())\n        _take_place",
        "            file.fileno()\n        _take_place",
        ("tests/unit/test_whole_files.py::test_what_is_in_a_file_is_on_the_disk_before_its_name",),
    ),
    Seed(
        "what was measured of one drive is believed of another that serves its axis now",
        "rtctl/rig_file/measured_timing.py",
        "(device.kind, device.axes or every, device.channels)",
        "(device.kind,)",
        ("tests/unit/test_timing.py::test_it_is_of_the_axes_that_each_device_serves",),
    ),
    Seed(
        "the name of a service that is a path has other folders deleted",
        "rtctl/host/service_steps.py",
        '    data = rig_directory(name, root / "var/lib/rtctl")',
        '    data = root / "var/lib/rtctl" / name',
        (f"{ONE}::test_a_name_that_is_a_path_takes_nothing_away",),
    ),
    Seed(
        "a replay that differs prints two objects",
        "rtctl/cli/replay.py",
        "        sys.exit(0 if verdict.first is None else ReplayDiffersError.exit_code)\n",
        "        if verdict.first is None:\n            return\n",
        (f"{ONE}::test_a_replay_that_differs_is_one_object",),
    ),
    Seed(
        "a motor that stays on is a stop",
        "rtctl/cli/operate.py",
        "        if time.monotonic() > deadline:  # whoever",
        "        if time.monotonic() > deadline:\n            break\n        if False:  # whoever",
        (f"{ONE}::test_a_motor_that_stays_on_is_no_success_of_stop",),
    ),
    Seed(
        "a torque that acts later than the law remembers is proved",
        "rtctl/check/verdicts_of_device.py",
        "    acting = s.axis.delay_ticks + lag_ticks(s.axis.current_loop_hz, s.period_s)",
        "    acting = s.axis.delay_ticks",
        (
            "tests/unit/cli/test_check_plausibility.py::"
            "test_a_torque_that_acts_later_than_the_law_remembers_is_not_proved",
        ),
    ),
    Seed(
        "half of a rig is left in the way of the next try",
        "rtctl/simulation/shipped_files.py",
        "            path.unlink(missing_ok=True)\n",
        "            pass\n",
        ("tests/unit/cli/test_init.py::test_half_of_a_rig_is_not_left_in_the_way_of_the_next_try",),
    ),
    Seed(
        "a campaign takes the cores of the whole machine",
        "rtctl/simulation/campaign_workers.py",
        "jobs or len(os.sched_getaffinity(0))",
        "jobs or os.cpu_count()",
        ("tests/unit/test_campaign_workers.py::test_there_are_as_many_workers_as_cores_that_may_be_used",),
    ),
    Seed(
        "a second of a contact is judged on a slow loop",
        "rtctl/experiments/admittance_runs.py",
        "    judged = round(JUDGED_S / simulation.plan.period_s)",
        "    judged = 500",
        (
            "tests/unit/experiments/test_admittance_experiment.py::"
            "test_of_a_contact_half_a_second_is_judged_at_any_rate",
        ),
    ),
    Seed(
        "a member of the group is told that no daemon runs",
        "rtctl/wire/protocol.py",
        "folder could not be looked into\n        return True\n",
        "folder could not be looked into\n        return False\n",
        (
            "tests/unit/host/test_endpoints.py::"
            "test_a_member_of_its_group_finds_a_rig_whose_lock_only_its_user_reads",
        ),
    ),
    Seed(
        "a service that is installed takes another one's files away",
        "rtctl/host/service_steps.py",
        '        if other := _loser(name, file, etc / "rtctl"):',
        '        if other := "":',
        ("tests/unit/cli/test_service.py::test_a_rig_takes_no_file_of_another_rig_away",),
    ),
    Seed(
        "a schedule takes the place of the rig file that names it",
        "rtctl/host/service_steps.py",
        '    if part == Path(f"{name}.toml"):',
        "    if part == Path(name):",
        ("tests/unit/cli/test_service.py::test_a_rig_takes_no_file_of_another_rig_away",),
    ),
    Seed(
        "the offset of a clock that was never set is taken again with every copy",
        "rtctl/host/exchange/rig_description.py",
        "        if self.start_wall_ns == NOT_TAKEN:",
        "        if self.start_wall_ns < 0:",
        ("tests/unit/host/test_description.py::test_the_offset_of_a_clock_that_was_never_set_is_taken_once",),
    ),
    Seed(
        "an incident of another version ends in a traceback",
        "rtctl/cli/incident.py",
        "    except (KeyError, TypeError, ValueError, IndexError, OverflowError) as error:",
        "    except ZeroDivisionError as error:",
        (f"{ONE}::test_an_incident_of_another_version_is_told_by_name",),
    ),
    Seed(
        "a model is written over the points that it is learned from",
        "rtctl/cli/outputs.py",
        "            if target and one and target.samefile(one):",
        "            if target is one:",
        ("tests/unit/cli/test_outputs.py::test_what_was_measured_is_not_written_over",),
    ),
    Seed(
        "a draft that cannot be removed ends the recorder unheard",
        "rtctl/recording/parts.py",
        "                with suppress(OSError):  # a disk that became",
        "                with suppress(ZeroDivisionError):  # a disk that became",
        (f"{RARE}::test_a_disk_that_becomes_read_only_does_not_end_the_recorder_unheard",),
    ),
    Seed(
        "a file that cannot be closed ends the recorder unheard",
        "rtctl/recording/mcap_file.py",
        "            with suppress(OSError):  # a network's disk",
        "            with suppress(ZeroDivisionError):  # a network's disk",
        (f"{RARE}::test_a_disk_that_becomes_read_only_does_not_end_the_recorder_unheard",),
    ),
)
