"""What `hw.interface.Backend` promises, as tests. A package subclasses `Contract` and names its `cases`."""

from __future__ import annotations

import importlib
import inspect
import json
import math
import socket
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

from hw import registry
from hw.interface import CHANNEL_FIELDS, Finding, LinkLost
from rtctl.backend_contract.subject import Case, Received, Subject
from rtctl.backend_contract.units import CYCLES_TO_OBEY, Units, heard
from rtctl.tick import FIELDS

SAMPLES = 60
"""Cycles of a test."""

WAITED_S = 0.01
"""Ten cycles at 1 kHz. Every other call may take longer on a busy machine; a call that waits always does."""

# an odd number: the median is then one of the calls
CALLS = 15

METHODS: dict[str, list[str]] = {"open": [], "read": ["tick"], "write": ["tick"], "stop": [], "close": []}
HEAVY = ("pydantic", "zmq", "sklearn", "asyncio", "rtctl")
"""Packages that the loop process must not load."""


def _typical_s(call: Callable[[], object], first: Callable[[], object] = lambda: None) -> float:
    """How long a call takes, the median of many, each after `first`; a device that is lost meanwhile ends the
    counting."""
    took = []
    with suppress(LinkLost):
        for _ in range(CALLS):
            first()
            before = time.perf_counter()
            call()
            took.append(time.perf_counter() - before)
    return statistics.median(took)


@cache
def _loaded_too(module: str) -> str:
    """What a process that imports this module has loaded of `HEAVY`, or how the import failed."""
    # a process of its own: this one has loaded all of them
    code = f"import sys, {module}; sys.exit(', '.join(set({HEAVY}) & set(sys.modules)))"
    shown = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=170
    )
    return shown.stderr.strip()


class Contract(Units):
    """Subclass it as `TestSomething`, with `cases`: name -> `Case`."""

    cases: ClassVar[Mapping[str, Case]] = {}

    @pytest.fixture
    def actuator(self, case: Case, request: pytest.FixtureRequest) -> Subject:
        """A subject whose device tells what it is told."""
        if not case.hears:
            pytest.skip("the case says that its device does not tell what it was told")
        running: Subject = request.getfixturevalue("running")
        if not running.backend.consumes:
            pytest.skip("drives nothing")
        if running.info.simulated and not running.paced:
            pytest.skip("simulated: no device beside it")
        return running

    # -- what it is

    def test_channels_are_known_and_none_is_both_given_and_taken(self, subject: Subject) -> None:
        provides, consumes = subject.backend.provides, subject.backend.consumes
        assert isinstance(provides, frozenset)
        assert isinstance(consumes, frozenset)
        assert provides | consumes <= set(CHANNEL_FIELDS)
        assert not provides & consumes
        assert provides
        declared = subject.info.channels
        assert declared is None or declared.provides >= provides

    def test_a_new_backend_shows_its_channels_before_it_is_opened(self, subject: Subject) -> None:
        # before `open`: the rig file is checked with no device there
        found = registry.channels(subject.case.kind, subject.options, subject.rig)
        assert found.provides >= subject.backend.provides
        assert found.consumes >= subject.backend.consumes

    def test_the_methods_are_those_of_the_interface(self, subject: Subject) -> None:
        for name, arguments in METHODS.items():
            assert list(inspect.signature(getattr(subject.backend, name)).parameters) == arguments

    def test_the_options_are_plain_data_and_refuse_unknown_keys(
        self, subject: Subject, tmp_path: Path
    ) -> None:
        model = registry.options_model(subject.case.kind)
        # as the loop process gets them: by one line of JSON
        dump = json.loads(json.dumps(subject.options))
        again = model.model_validate(dump, context={"folder": tmp_path})
        assert again.model_dump(mode="json") == subject.options
        with pytest.raises(ValueError, match="no_such_key"):
            model.model_validate({**dump, "no_such_key": 1}, context={"folder": tmp_path})

    def test_the_loop_process_gets_it_without_what_only_the_host_loads(self, case: Case) -> None:
        assert _loaded_too(registry.lookup(case.kind).factory.partition(":")[0]) == ""

    def test_what_it_declares_to_check_and_doctor_has_the_right_form(self, subject: Subject) -> None:
        for declared in (registry.timing, registry.joint, registry.force_sensor):
            declared(subject.case.kind, subject.options, subject.rig)
        assert all(isinstance(one, Finding) for one in registry.examine(subject.case.kind, subject.options))

    def test_a_kind_that_opens_sockets_of_the_network_says_so(
        self, subject: Subject, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """The unit of the service closes the network to a rig whose kinds do not say that they need it."""
        opened: list[int] = []
        plain: Any = socket.socket

        class Noted(plain):  # type: ignore[misc] # a class found at run time
            def __init__(self, family: int = -1, *more: int, **named: object) -> None:
                opened.append(family)
                super().__init__(family, *more, **named)

        for name in ("factory", "options"):  # whatever it imports makes classes of the true one
            importlib.import_module(getattr(subject.info, name).partition(":")[0])
        monkeypatch.setattr(socket, "socket", Noted)
        subject.open()
        monkeypatch.undo()
        if {family for family in opened if family not in (socket.AF_UNIX,)}:
            assert subject.info.network, (
                "it opens sockets: BackendInfo(network=True), or a service cannot reach it"
            )

    # -- open, stop, close

    def test_stop_is_safe_before_open_and_after_close_and_often(self, subject: Subject) -> None:
        subject.backend.stop()
        subject.open()
        subject.backend.stop()
        subject.backend.stop()
        subject.backend.close()
        subject.backend.stop()

    def test_open_and_close_may_be_repeated(self, subject: Subject) -> None:
        subject.backend.close()
        subject.open()
        subject.open()
        subject.read(subject.tick())
        subject.backend.close()
        subject.backend.close()

    # -- what it reads

    def test_every_fresh_sample_advances_the_count_by_one(self, running: Subject) -> None:
        for slot in range(SAMPLES):
            tick = running.tick(slot)
            running.read(tick)
            assert tick["sample_count"][0] == slot + 1
            running.write(tick)

    def test_a_sample_is_fresh_once(self, running: Subject) -> None:
        """The law takes an old sample that is called fresh for a joint at rest, and its age for none."""
        if not running.paced:
            assert running.info.simulated, "play the device: its step() sends a sample, and nothing else does"
            pytest.skip("simulated: a fresh sample for every slot")
        running.read(running.tick())
        count = running.tick(1)
        for slot in range(1, 6):
            count = running.tick(slot)
            with suppress(LinkLost):
                running.backend.read(count)
                assert count["sample_count"][0] == 1, "nothing came since, and it is called fresh"

    def test_reading_and_writing_never_wait(self, running: Subject) -> None:
        tick = running.tick()
        running.read(tick)

        def sample_comes() -> None:
            tick["tick"] += 1
            running.write(tick)
            running.device.step()

        assert _typical_s(lambda: running.backend.read(tick), sample_comes) < WAITED_S, "read waits"
        assert _typical_s(lambda: running.write(tick)) < WAITED_S, "write waits"
        if running.paced:
            assert _typical_s(lambda: running.backend.read(tick)) < WAITED_S, "read waits for a sample"

    def test_reading_writes_the_given_channels_and_nothing_else(self, running: Subject) -> None:
        given = {CHANNEL_FIELDS[channel] for channel in running.backend.provides}
        # two: a field that holds the one by chance does not hold the other
        for sentinel in (77, -55):
            tick = running.tick()
            for field in FIELDS:
                tick[field.name] = sentinel if field.kind != "bits" else 77
            tick["tick"] = 0
            before = tick.copy()
            running.read(tick)
            changed = {
                field.name for field in FIELDS if not np.array_equal(tick[field.name], before[field.name])
            }
            assert changed <= given | {"sample_count", "link_faults"}
            assert "sample_count" in changed
            assert changed & given
            assert tick["link_faults"][0] == 0, "a good sample clears what an earlier one left"

    def test_missed_slots_are_no_error(self, running: Subject) -> None:
        tick = running.tick()
        # slots that were skipped are never caught up (`rtctl.rt.cycle`)
        for slot in (0, 1, 5, 6, 40):
            tick = running.tick(slot)
            running.read(tick)
            running.write(tick)
        assert tick["sample_count"][0] > 0

    def test_ticks_may_be_rows_of_a_ring(self, running: Subject) -> None:
        # in the daemon every tick is one: what a backend keeps of it is overwritten a ring later
        ring = np.concatenate([running.tick(slot) for slot in range(4)]).view(type(running.tick()))
        for slot in range(4):
            running.read(ring[slot : slot + 1])
            running.write(ring[slot : slot + 1])
        assert ring["sample_count"].tolist() == [1, 2, 3, 4]

    def test_two_backends_with_the_same_options_show_the_same(self, running: Subject) -> None:
        if not running.case.twins:
            pytest.skip("one device at a time")
        twin = running.twin()
        twin.open()
        for slot in range(20):
            a, b = running.tick(slot), running.tick(slot)
            running.read(a)
            twin.read(b)
            # as bytes: NaN is not equal to itself
            assert a.tobytes() == b.tobytes()
            running.write(a)
            twin.write(b)
        twin.release()

    # -- what it sends

    def test_writing_changes_nothing_in_the_tick(self, running: Subject) -> None:
        tick = running.tick()
        running.read(tick)
        tick["enabled"], tick["current_command_a"], tick["torque_applied_nm"] = 1, 0.3, 0.2
        before = tick.tobytes()
        running.write(tick)
        assert tick.tobytes() == before

    def test_measurements_are_finite_whatever_is_sent(self, running: Subject) -> None:
        # what one of them breaks shows in the reading of the next
        for slot, value in enumerate([0.0, math.nan, math.inf, -math.inf, 1e308, -1e308, 0.5]):
            tick = running.tick(slot)
            running.read(tick)
            for channel in running.backend.provides:
                assert np.isfinite(tick[CHANNEL_FIELDS[channel]]).all(), channel
            tick["enabled"], tick["current_command_a"], tick["torque_applied_nm"] = 1, value, value
            running.write(tick)

    @pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e308])
    def test_no_torque_that_is_no_torque_reaches_the_actuator(self, actuator: Subject, value: float) -> None:
        """One that is no number is sent as none; one too large as what the device can do at most."""
        for slot in range(5):
            told = heard(actuator.told(slot, enabled=1, torque=value))
            assert np.isfinite(told.torque).all(), f"the device was told {told.torque}"
            assert not (math.isnan(value) and any(told.torque)), f"NaN became {told.torque}"

    def test_the_actuator_is_enabled_while_it_is_told_to_be_and_no_longer(self, actuator: Subject) -> None:
        slots: Iterator[int] = iter(range(10 * CYCLES_TO_OBEY))

        def told(enabled: int) -> Received:
            return heard(actuator.told(next(slots), enabled=enabled, torque=0.01))

        actuator.read(actuator.tick())
        before = actuator.device.received()
        assert before is None or not before.enabled, "enabled by being opened"
        for _ in range(5):
            found = told(0)
            assert not found.enabled, "enabled although nobody asked for it"
            assert not any(found.torque), f"a torque of {found.torque} while disabled"
        assert any(told(1).enabled for _ in range(CYCLES_TO_OBEY)), "never enabled"
        assert any(not told(0).enabled for _ in range(5)), "enabled for good"
        assert any(told(1).enabled for _ in range(CYCLES_TO_OBEY)), "not enabled again"
        actuator.backend.stop()
        actuator.device.step()
        assert not heard(actuator.device.received()).enabled, "stop() leaves it enabled"
