"""A hundred deaths of loop and host under torque, judged by a board that shares no code with rtctl (`board.c`).

The board has a watchdog of its own, writes down the longest time for which torque stayed on without a fresh command, and sees
whether any came back.
"""

import random
import signal
import sys
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from c_board import CBoard, build

sys.path.insert(0, str(Path(__file__).parents[1] / "integration"))
from lanes import BOARD_HZ, SEED, TIME_TO_LIVE, Death, Lane, Nursery

TARGETS = ("loop", "host")
LATE_CYCLES = 1
"""Of the board: the watchdog looks once in a cycle."""


def planned(kills):
    """Loop and host in turn, each at some random moment after torque has begun."""
    draw = random.Random(SEED)
    return [Death(k, TARGETS[k % 2], signal.SIGKILL, "torque", draw.randrange(60)) for k in range(kills)]


def killed(root, kills, n_lanes):
    """All deaths, side by side, and what each board has to say in the end."""
    program = build(root)
    board = partial(CBoard, program, rate_hz=BOARD_HZ)
    with ThreadPoolExecutor(n_lanes) as pool:
        lanes = list(pool.map(lambda number: Lane(root, number, board), range(n_lanes)))
        nursery = Nursery(lanes[0].config)
        every = planned(kills)

        def share(k):
            return [lanes[k].live(death, nursery) for death in every[k::n_lanes]]

        try:
            deaths = [death for part in pool.map(share, range(n_lanes)) for death in part]
        finally:
            nursery.close()
            judgements = [lane.board.close() for lane in lanes]
    return deaths, judgements


def free_after_s(death):
    """From the last command before the end of the torque until the motor was without it for good."""
    rows = death.rows
    driven = np.flatnonzero(rows["torque_nm"][:, 0])
    if not len(driven) or driven[-1] + 1 == len(rows):
        return 0.0
    last = driven[-1]
    return (rows["time_ns"][last + 1] - rows["time_ns"][last]) * 1e-9 + rows["command_age"][last] / BOARD_HZ


def judge(deaths, judgements, kills):
    had = sum(death.had_torque for death in deaths)
    cycles = max(one["longest_cycles"] for one in judgements)
    longest_ms = max(one["longest_ns"] for one in judgements) * 1e-6
    late_ms = 1e3 * np.array([free_after_s(death) for death in deaths])
    print(
        f"\n{len(deaths)} deaths ({had} under torque), judged in C: longest torque without a fresh command {cycles} cycles, "
        f"{longest_ms:.0f} ms by the clock (time to live {TIME_TO_LIVE} cycles, {1e3 * TIME_TO_LIVE / BOARD_HZ:.0f} ms); "
        f"from the last command to no torque: median {np.median(late_ms):.0f} ms, slowest {late_ms.max():.0f} ms"
    )
    assert len(deaths) == kills
    assert had >= kills / 2
    assert cycles <= TIME_TO_LIVE + LATE_CYCLES
    for death in deaths:
        assert len(death.after), str(death)
        assert not death.after["torque_nm"].any(), str(death)
        assert not death.after["enabled"].any(), str(death)
        assert not death.unarmed["enabled"].any(), str(death)
        assert death.code == (9 if death.target == "loop" else -signal.SIGKILL), f"{death}: {death.words}"
    assert all(one["commands"] > 0 for one in judgements)


def test_four_kills(tmp_path_factory):
    judge(*killed(tmp_path_factory.mktemp("kills"), 4, 2), 4)


@pytest.mark.system
@pytest.mark.timeout(300)
def test_a_hundred_kills(tmp_path_factory):
    judge(*killed(tmp_path_factory.mktemp("kills"), 100, 6), 100)
