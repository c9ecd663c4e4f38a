"""The invariants of the safety contract, 1 to 11, each by its number (12 to 20:
test_safety_invariants_12_to_20).

Those about every tick are asserted on the ticks of random rigs that live through random faults, requests and
targets, anew and in another way than the campaign's monitor does it; the others on a rig of their own.
"""

import itertools
import math
import random

import msgpack
import numpy as np
import pytest
from random_lives import axis_column, before, random_lives
from watched_rig import LEASE, POWERED, WatchedRig

from hw.interface import LinkFault
from hw.jit import records
from hw.serial import frame
from rtctl.control.faults import TABLE
from rtctl.control.vocabulary import Environment, Fault, Reaction, State
from rtctl.host.exchange.events import EventDetector
from rtctl.host.exchange.messages import Refusal, decode
from rtctl.host.exchange.requests import Requests
from rtctl.host.exchange.rig_description import AxisDescription, RigDescription
from rtctl.rt.shared_memory import CommandWriter, Memory
from rtctl.tick import new_ticks
from rtctl.wire.authenticator import Caller
from rtctl.wire.protocol import Endpoints

CUT = sum(int(row.fault) for row in TABLE if row.reaction in (Reaction.CUT, Reaction.ESTOP, Reaction.LOCKOUT))
RAMP = sum(int(row.fault) for row in TABLE if row.reaction in (Reaction.RAMP, Reaction.STOP))
SPOILED = {
    Fault.STALE: {"fresh": False},
    Fault.BAD_SAMPLE: {"position_rad": math.nan},
    Fault.LINK_LOST: {"link_faults": int(LinkFault.LOST)},
    Fault.CHECKSUM: {"link_faults": int(LinkFault.CHECKSUM), "fresh": False},
    Fault.DEVICE: {"link_faults": int(LinkFault.DEVICE)},
    Fault.ESTOP: {"estop": 1},
    Fault.OVERRUN: {"skipped": 3},
    Fault.STALLED: {"skipped": 12},
}
"""What makes each fault. Some bring others with them: the first cause tells that the one meant was seen."""


@pytest.fixture(scope="module")
def lives():
    return random_lives()


def test_invariant_01_torque_leaves_only_in_powered_states_from_a_fresh_sample(lives):
    ticks_with_torque = 0
    for p, ticks in lives:
        torque = axis_column(ticks, "torque_applied_nm")
        some = torque != 0.0
        assert np.isin(ticks["state"][some], [int(state) for state in POWERED]).all()
        assert (ticks["sample_age_ticks"][some] <= 2).all()
        arming = ticks["state"] == State.ARMING
        assert (np.abs(torque[arming]) <= 0.05 * p["torque_limit_nm"][0] * (1 + 1e-9)).all()
        ticks_with_torque += some.sum()
    assert ticks_with_torque > 20_000


def test_invariant_02_the_encoded_torque_is_within_the_limit(lives):
    shares = []
    for p, ticks in lives:
        per_ampere = p["gear_ratio"][0] * p["gear_efficiency"][0] * p["torque_constant_nm_a"][0]
        encoded_nm = np.abs(axis_column(ticks, "current_command_a")) * per_ampere
        shares.append(encoded_nm.max() / p["torque_limit_nm"][0])
    assert max(shares) <= 1 + 1e-9
    assert max(shares) > 0.9, "no rig came near its limit: nothing was shown"


def test_invariant_03_the_change_per_tick_is_within_the_rate_and_a_cut_only_takes_away(lives):
    at_the_rate = 0
    for p, ticks in lives:
        torque = axis_column(ticks, "torque_applied_nm")
        change, rate = np.abs(torque - before(torque)), p["torque_rate_nm"][0]
        assert ((change <= rate * (1 + 1e-9)) | (torque == 0.0)).all()
        at_the_rate += (change > 0.999 * rate).sum()
    assert at_the_rate > 50


def test_invariant_04_what_is_sent_is_finite_and_decodes_to_itself(lives):
    for _, ticks in lives:
        for name in ("torque_applied_nm", "current_command_a"):
            assert np.isfinite(ticks[name]).all()
    sent, got = (records(np.zeros(1, frame.command_dtype(2))) for _ in range(2))
    body, draw = np.zeros(64, np.uint8), np.random.default_rng(4)
    for values in [(2**31 - 1, -(2**31) + 1), (0, -1), *draw.integers(-(2**31) + 1, 2**31, (2000, 2))]:
        sent["value"], sent["sequence"] = values, draw.integers(2**16)
        sent["time_to_live"], sent["enable"] = draw.integers(1, 256), draw.integers(2)
        assert frame.decode_command(body, frame.encode_command(sent, body), got)
        assert got.tobytes() == sent.tobytes()


def test_invariant_05_disabled_states_send_torque_0_and_enable_0(lives):
    for _, ticks in lives:
        powered = np.isin(ticks["state"], [int(state) for state in POWERED])
        assert ((ticks["enabled"] == 1) == powered).all()
        assert (axis_column(ticks, "torque_applied_nm")[~powered] == 0.0).all()
        assert (axis_column(ticks, "current_command_a")[~powered] == 0.0).all()


def test_invariant_06_active_is_reached_only_through_arming_with_a_fresh_single_use_arm(lives):
    for _, ticks in lives:
        state, was = ticks["state"], before(ticks["state"])
        assert np.isin(was[(state == State.ACTIVE) & (was != State.ACTIVE)], [State.ARMING, State.HOLD]).all()
        assert (was[(state == State.ARMING) & (was != State.ARMING)] == State.IDLE).all()
    rig = WatchedRig()
    rig.ask("arm_count")  # not ready yet: used up
    assert rig.run(600).mode is State.IDLE
    rig.ask("arm_count")
    assert rig.run().mode is State.ARMING
    rig.run(200)
    rig.ask("stop_count")
    rig.run(60)
    assert rig.run(2000).mode is State.IDLE, "one request arms once"
    rig.command["arm_count"] += 1  # of the epoch before the stop
    assert rig.run(50).mode is State.IDLE


@pytest.mark.parametrize("fault", SPOILED, ids=lambda fault: fault.name)
def test_invariant_07_a_cleared_cause_or_a_restart_never_re_arms(fault):
    rig = WatchedRig().arm()
    rig.run(5, **SPOILED[fault])
    rig.run(60)
    latched = rig.mode
    assert latched is (State.ESTOP if fault is Fault.ESTOP else State.FAULT)
    assert 1 << int(rig["fault_first"]) == fault
    for number in range(1200):
        if number % 500 == 0:
            rig.ask("arm_count")  # refused, and used up: it must not wait for the reset
        assert rig.run()["enabled"] == 0.0
        assert rig.mode is latched, "the cause is gone, the fault is not"
    rig.ask("arm_count", "reset_count")
    for _ in range(300):
        rig.command["epoch"] = rig.state["epoch"]  # as any other request of the host would say
        assert rig.run()["enabled"] == 0.0
        assert rig.mode is State.IDLE
    rig.restart()
    rig.command["arm_count"] = 7  # as a mailbox of before might still say
    rig.command["epoch"] = rig.state["epoch"]
    for _ in range(300):
        assert rig.run()["enabled"] == 0.0
    assert rig.mode is State.IDLE
    assert rig.arm().mode is State.ACTIVE, "a fresh request arms it: nothing else kept it quiet"


def test_invariant_08_a_cut_acts_at_once_and_a_ramp_is_monotone_and_over_in_fifty_ticks(lives):
    cuts = ramps = 0
    for _, ticks in lives:
        state, was = ticks["state"], before(ticks["state"])
        torque = np.abs(axis_column(ticks, "torque_applied_nm"))
        cut = (ticks["faults"].astype(np.int64) & CUT) != 0
        assert (torque[cut] == 0.0).all()
        assert (ticks["enabled"][cut] == 0).all()
        ramped = (ticks["faults"].astype(np.int64) & RAMP) != 0
        assert not (ramped & np.isin(state, [State.ARMING, State.ACTIVE, State.HOLD])).any()
        stopping = state == State.STOPPING
        assert (torque[stopping] <= before(torque)[stopping]).all()
        lengths = np.diff(np.flatnonzero(np.diff(np.r_[0, stopping, 0])))[::2]
        assert (lengths <= 51).all()
        cuts += (cut & np.isin(was, [int(one) for one in POWERED])).sum()
        ramps += len(lengths)
    assert cuts > 20
    assert ramps > 20


def test_invariant_09_the_first_cause_is_kept_and_each_transition_is_one_event(lives):
    latched = [State.FAULT, State.ESTOP, State.LOCKOUT]
    for _, ticks in lives:
        state, first = ticks["state"], ticks["fault_first"]
        stays = np.isin(state, latched) & np.isin(before(state), latched) & (before(first) >= 0)
        assert (first[stays] == before(first)[stays]).all()
        detector = EventDetector(RigDescription("mock", (AxisDescription("joint", {}),), 1000.0))
        events = [event for part in np.array_split(ticks, 7) for event in detector.detect(part)]
        changes = [event for event in events if event["event"] == "state"]
        assert len(changes) == np.count_nonzero(np.diff(np.r_[int(State.INIT), state]))
        seen = [(State[event["from"]], State[event["to"]]) for event in changes]
        assert all(now[0] is last[1] for last, now in itertools.pairwise(seen))


@pytest.mark.parametrize(
    ("wrong", "why"),
    [
        ({"lease": 13}, "another renderer's lease"),
        ({"lease": 0}, "no lease"),
        ({"epoch": -1}, "an epoch that is over"),
        ({"epoch": 1}, "an epoch to come"),
        ({"position": math.nan}, "not a number"),
    ],
)
def test_invariant_10_there_is_one_lease_and_a_wrong_target_has_no_effect(wrong, why):
    rig = WatchedRig()
    rig.world(Environment.REMOTE)
    rig.arm_with_targets()
    assert rig.state["lease"][0] == LEASE
    saved = rig.copy_records()
    runs = []
    for bad in (False, True):
        rig.put_back(saved)
        refused = rig["targets_refused"]
        for _ in range(15):
            if bad:
                rig.target(**{"position": 0.4, **wrong})
            rig.run()
            runs.append(
                (rig["torque_applied_nm"], rig["proxy_position_rad"], rig.mode, rig.state["lease"][0])
            )
        assert rig["targets_refused"] == refused + (15 if bad else 0), why
    assert runs[:15] == runs[15:], why


def bent(draw, count):
    """Requests that are damaged, unknown, out of bounds or sent by somebody who may not."""
    whole = [
        {"id": 1, "op": "arm", "epoch": 0},
        {"id": 2, "op": "set_environment", "axis": 0, "kind": "spring", "stiffness_nm_rad": 5.0},
        {"id": 3, "op": "reset"},
    ]
    wild = [math.nan, math.inf, -1e9, "x" * 70, [], {}, None, 2**63, b""]
    for _ in range(count):
        message = dict(draw.choice(whole))
        if draw.random() < 0.5:
            message[draw.choice([*message, "kind", "more"])] = draw.choice(wild)
        data = bytearray(msgpack.packb(message))
        for _ in range(draw.randrange(3)):
            data[draw.randrange(len(data))] ^= 1 << draw.randrange(8)
        yield bytes(data)


def test_invariant_11_invalid_messages_change_counters_only():
    memory = Memory.create(1, 8, 1_000_000)
    writer, row = CommandWriter(memory), new_ticks(1, 1)
    rig = RigDescription("mock", (AxisDescription("joint", {"stiffness_nm_rad": (0.0, 100.0)}),), 1000.0)
    requests = Requests(writer, rig, Endpoints("ipc://a", "ipc://b", "ipc://c"), lambda: row)
    observer, refused = Caller("key:anna", "anna", "observer"), 0
    untouched = writer.command.tobytes(), int(memory.header[0]["mailbox_seq"])
    for data in bent(random.Random(11), 5000):
        request = decode(data, rig)
        if not isinstance(request, Refusal):
            request = requests.perform(request, row, observer)
        refused += isinstance(request, Refusal)
        assert (writer.command.tobytes(), int(memory.header[0]["mailbox_seq"])) == untouched, data
    assert refused > 4500
    memory.close()
