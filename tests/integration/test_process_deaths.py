"""The loop and the host die in every way, at any moment: the motor of a board of its own is torque-free in
time.

The board is another process that nobody kills: it runs the reference firmware with a time to live of ten of
its own cycles, and keeps a record of what its motor got in each of them. Everything is judged from that
record, in the board's cycles. Three or six rigs live side by side; each rig's next life starts where the last
one died.
"""

import json
import os
import random
import signal
import sys
from collections import Counter, defaultdict
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from lanes import PATIENCE_S, SEED, TIME_TO_LIVE, Death, Lane, until
from nursery import run, shared

from rtctl.control.vocabulary import State

pytestmark = pytest.mark.timeout(600)
LANES = 2
"""Those that the tests of single lives use; as many more for every three rounds of planned ones."""

MOST_LIVES = 3
"""For one planned death: the starts side by side take the machine from each other's loops."""
ROUNDS, OFTEN = 2, 8
"""Of every planned death: in `make test`, and with those that `make test-system` adds."""
TARGETS = ("loop", "host")
SIGNALS = (signal.SIGKILL, signal.SIGSEGV, signal.SIGSTOP, signal.SIGTERM)
PHASES = ("idle", "arming", "torque", "torque", "torque", "torque")
"""When the signal comes: still unarmed, just enabled, or some random time after torque has begun."""


def planned():
    """Every target and signal OFTEN times, shuffled, at random moments; by their rounds."""
    draw = random.Random(SEED)
    every = [(target, number) for target in TARGETS for number in SIGNALS] * OFTEN
    draw.shuffle(every)
    seen, rounds = Counter(), defaultdict(list)
    for k, (target, number) in enumerate(every):
        rounds[seen[target, number]].append(Death(k, target, number, draw.choice(PHASES), draw.randrange(60)))
        seen[target, number] += 1
    return rounds


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    return tmp_path_factory.mktemp("lives")


@pytest.fixture(scope="module")
def lanes(root):
    made = [Lane(root, 0)]  # the first one may have to compile
    made += [Lane(root, number) for number in range(1, LANES)]
    yield made
    for lane in made:
        lane.close()


@pytest.fixture(scope="module")
def nursery():
    return shared()


@pytest.fixture(
    scope="module",
    params=[range(ROUNDS), pytest.param(range(ROUNDS, OFTEN), marks=pytest.mark.system)],
    ids=["some", "others"],
)
def rounds(request):
    return request.param


@pytest.fixture(scope="module")
def deaths(root, lanes, nursery, rounds):
    """All lives of these rounds, a share of them on each lane at once."""
    every = [death for number in rounds for death in planned()[number]]
    side_by_side = LANES + LANES * len(rounds) // 3

    def share(k):
        return [one for death in every[k::side_by_side] for one in lives(open_ones[k], death, nursery)]

    with ThreadPoolExecutor(side_by_side) as pool:  # in here: a board dies with the thread that started it
        more = list(pool.map(lambda number: Lane(root, number), range(LANES, side_by_side)))
        open_ones = [*lanes, *more]
        died = [death for part in pool.map(share, range(side_by_side)) for death in part]
        for lane in more:
            lane.close()  # a board that nobody asks any more would go on turning
    return died


def lives(lane, death, nursery):
    """The planned death, and again where torque was wanted and a late loop had lost it to the board's
    watchdog: each is judged.
    """
    lived = [lane.live(replace(death), nursery)]
    while death.phase == "torque" and not lived[-1].had_torque and len(lived) < MOST_LIVES:
        lived.append(lane.live(replace(death), nursery))
    return lived


def silence(rows):
    """Board cycles since the last command came, at each row."""
    fresh = np.ones(len(rows), bool)
    fresh[1:] = np.diff(rows["command_sequence"]) != 0
    return rows["slot"] - np.maximum.accumulate(np.where(fresh, rows["slot"], 0))


def judge(death):
    driven = death.rows["torque_nm"].any(axis=1)
    assert (silence(death.rows)[driven] <= TIME_TO_LIVE + 1).all(), str(death)
    assert len(death.after)
    assert not death.after["torque_nm"].any(), str(death)
    assert not death.after["enabled"].any(), str(death)


@pytest.mark.parametrize("number", SIGNALS, ids=lambda number: number.name)
@pytest.mark.parametrize("target", TARGETS)
def test_the_motor_is_torque_free_within_the_time_to_live_of_the_last_command(deaths, rounds, target, number):
    chosen = [death for death in deaths if (death.target, death.signal) == (target, number)]
    assert len({death.number for death in chosen}) == len(rounds)
    for death in chosen:
        judge(death)


def test_every_planned_death_was_died_and_many_of_them_took_torque_away(deaths, rounds):
    planned_ones = {death.number for death in deaths}
    assert len(planned_ones) == len(rounds) * len(TARGETS) * len(SIGNALS)
    assert len({death.number for death in deaths if death.had_torque}) >= len(planned_ones) / 4


def test_every_life_starts_unarmed_and_finds_no_obstacle(deaths):
    for death in deaths:
        assert death.first_state in ("INIT", "IDLE"), str(death)
        assert len(death.unarmed), str(death)
        assert not death.unarmed["enabled"].any(), str(death)
        assert not death.unarmed["torque_nm"].any(), str(death)


def test_a_host_whose_loop_died_or_stalled_says_so_and_stops_the_device_itself(deaths):
    for death in deaths:
        if death.target == "loop" and death.signal != signal.SIGTERM:
            assert death.code == 9, f"{death}: {death.words}"
            assert "device[0] 'serial': opened afresh and stopped" in death.words, f"{death}: {death.words}"
            stalled = "stopped advancing" in death.words
            assert stalled or death.signal != signal.SIGSTOP, f"{death}: {death.words}"


def test_a_daemon_that_is_asked_to_end_ends_in_order(deaths):
    """But for a ramp during which the machine itself stood still: that is a stall, and told as one."""
    asked = [death for death in deaths if death.signal == signal.SIGTERM]
    for death in asked:
        assert death.code in (0, 11) or "stopped advancing" in death.words, f"{death}: {death.words}"
        assert "Traceback" not in death.words
    assert any(death.code in (0, 11) for death in asked)


@pytest.mark.parametrize("target", TARGETS)
def test_the_same_of_the_program_itself(lanes, target):
    death = Death(1000, target, signal.SIGKILL, "torque", 7)
    judge(lanes[0].live(death, None))
    assert death.code == (9 if target == "loop" else -signal.SIGKILL)


def test_a_loop_that_is_stopped_and_continued_sees_it_and_sends_no_burst(lanes, nursery):
    lane = lanes[0]
    daemon, client = lane.armed(nursery)
    with client:
        loop = daemon.loop()
        os.kill(daemon.pid, signal.SIGSTOP)  # or it would kill the loop
        os.kill(loop, signal.SIGSTOP)
        lane.board.wait_for(lane.observation.count + 6 * TIME_TO_LIVE)
        continued = lane.observation.count
        heard = lane.newest()["command_sequence"]
        assert not lane.newest()["torque_nm"].any()
        os.kill(loop, signal.SIGCONT)
        until(lambda: lane.newest()["command_sequence"] != heard, "a command after the standstill")
        lane.board.wait_for(lane.observation.count + 4 * TIME_TO_LIVE)
        rows = lane.rows(continued - 1)
        os.kill(daemon.pid, signal.SIGCONT)
        status = until(lambda: (s := client.status())["state"] == "FAULT" and s, "the fault")
    os.kill(daemon.pid, signal.SIGTERM)
    assert daemon.exit_code() == 11, daemon.said.read_text()
    assert status["fault_first"]["name"] == "STALLED", daemon.said.read_text()
    assert not rows["torque_nm"].any()
    assert not rows["enabled"].any()
    sent = (rows["command_sequence"] - rows["command_sequence"][0]) & 0xFFFF
    slots = rows["slot"] - rows["slot"][0]
    # a board that had to wait has written the slot first and heard the rest later: up to the next slot
    heard_before = np.append(slots[1:], slots[-1] + 1)
    assert sent[-1] > 0
    assert (sent <= heard_before / 2 + 2.5).all(), (
        "two board cycles per tick: more commands than that are a burst"
    )


def test_a_rig_is_stopped_from_outside_while_it_runs(lanes, nursery):
    """`rtctl stop-rig` asks nobody: the board lets go, and the loop sees that and latches a fault."""
    lane = lanes[1]
    daemon, client = lane.armed(nursery)
    with client:
        before = lane.observation.count
        command = [sys.executable, "-m", "rtctl", "stop-rig", str(lane.config), "--json"]
        done = run(command, capture_output=True, text=True, check=False, timeout=PATIENCE_S)
        until(lambda: State[client.status()["state"]] is State.FAULT, "the fault")
    assert not lane.newest()["torque_nm"].any()
    assert not lane.rows(before)["enabled"][-1]
    body = json.loads(done.stdout)
    assert done.returncode == 6, "it cannot be confirmed while the daemon has the port"
    assert "in use" in body["devices"][0]["detail"]
    os.kill(daemon.pid, signal.SIGTERM)
    assert daemon.exit_code() == 11, daemon.said.read_text()
    done = run(command, capture_output=True, text=True, check=False, timeout=PATIENCE_S)
    assert done.returncode == 0
    assert json.loads(done.stdout) == {
        "ok": True,
        "devices": [{"device": "device[0] 'serial'", "confirmed": True, "detail": ""}],
    }
