"""Which core the loop takes, by counts of made-up machines."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from rtctl.rt import core

CPU = "sys/devices/system/cpu"
A_DAY_S = 86_400.0


def machine(root, lines, **kept):
    """A tree with interrupts by number, (devices, counts by core); `kept`: isolated, nohz_full."""
    for number, (devices, counts) in lines.items():
        folder = root / f"sys/kernel/irq/{number}"
        folder.mkdir(parents=True)
        (folder / "actions").write_text(f"{devices}\n")
        (folder / "per_cpu_count").write_text(f"{counts}\n")
    (root / CPU).mkdir(parents=True)
    for name, cores in kept.items():
        (root / CPU / name).write_text(f"{cores}\n")
    return root


DISK_ON_THE_LAST = {
    36: ("virtio1-req.0", "7,900000"),
    41: ("virtio3-rx", "120000,2000"),
    37: ("virtio2-config", "0,0"),
    12: ("", "0,9000000"),
}
QUEUE_FOR_EACH = {number: (f"nvme0q{number}", ",".join("9000" if i == number else "0" for i in range(4)))
                  for number in range(4)}  # fmt: skip


def test_the_last_core_is_left_to_the_disk_that_interrupts_it(tmp_path):
    machine(tmp_path, DISK_ON_THE_LAST)
    chosen = core.choose(-1, {0, 1}, tmp_path, 1000.0)
    assert chosen.core == 0
    assert chosen.why == (
        "devices interrupted it 120007 times since the start of the machine, core 1 902000 times (most by "
        "virtio1-req.0)"
    ), "a line that no device uses says nothing"


@pytest.mark.parametrize(
    ("lines", "since_s", "expected"),
    [
        ({}, 1000.0, 3),  # a kernel that does not tell
        (QUEUE_FOR_EACH, 100.0, 3),
        ({36: ("ahci", "0,0,0,900")}, 1000.0, 3),  # less than one a second
        ({36: ("ahci", "0,0,0,1100")}, 1000.0, 2),
        ({36: ("ahci", "0,0,3000,10000")}, 100.0, 1),  # the later one of equals
    ],
)
def test_the_last_core_is_left_for_much_less_only(tmp_path, lines, since_s, expected):
    machine(tmp_path, lines)
    chosen = core.choose(-1, {0, 1, 2, 3}, tmp_path, since_s)
    assert chosen.core == expected
    assert (chosen.why == "the last one") == (expected == 3)


def test_the_choice_does_not_change_with_what_a_day_does_to_the_counts(tmp_path):
    for quiet in (3100, 30_000, 60_000):
        lines = {36: ("ahci", f"{quiet},250000"), 41: ("eth0", "0,0")}
        root = machine(tmp_path / str(quiet), lines)
        assert core.choose(-1, {0, 1}, root, A_DAY_S).core == 0
    root = machine(tmp_path / "near", {36: ("ahci", "80000,250000")})
    assert core.choose(-1, {0, 1}, root, A_DAY_S).core == 1, "three times as often is not four times"


@pytest.mark.parametrize("devices", ["arch_timer", "riscv-timer", "IPI", "arm-pmu"])
def test_what_follows_the_loop_to_any_core_does_not_drive_it_away(tmp_path, devices):
    machine(tmp_path, {11: (devices, "1000,90000000")})
    assert core.choose(-1, {0, 1}, tmp_path, 100.0).core == 1
    assert core.interrupts(tmp_path) == {}


@pytest.mark.parametrize(
    ("kept", "expected"),
    [
        ({"isolated": "1-2", "nohz_full": "3"}, (2, "the last one, isolated")),
        ({"isolated": "", "nohz_full": "1"}, (1, "the last one, nohz_full")),
        ({"isolated": "\n", "nohz_full": "(null)"}, (3, "the last one")),
        ({"isolated": "7"}, (3, "the last one")),
    ],
)
def test_isolated_cores_come_first_of_those_allowed(tmp_path, kept, expected):
    machine(tmp_path, {36: ("ahci", "0,50,50,50")}, **kept)
    assert core.choose(-1, {0, 1, 2, 3}, tmp_path, 100.0) == expected


def test_of_isolated_cores_the_one_that_the_disk_leaves_alone(tmp_path):
    machine(tmp_path, {36: ("nvme0q3", "0,0,0,9000")}, isolated="2-3")
    chosen = core.choose(-1, {0, 1, 2, 3}, tmp_path, 100.0)
    assert chosen.core == 2
    assert chosen.why.endswith("(most by nvme0q3), isolated")


@pytest.mark.parametrize("asked", [0, 1, 9])
def test_a_core_that_is_named_is_taken(tmp_path, asked):
    machine(tmp_path, DISK_ON_THE_LAST, isolated="1")
    assert core.choose(asked, {0, 1}, tmp_path, 1000.0) == (asked, "loop.cpu")


@pytest.mark.parametrize("counts", ["", "nonsense", "1,", "-5,3", "1.5,nan", "\x00", "9" * 400, "8"])
def test_no_file_whatever_it_holds_raises(tmp_path, counts):
    machine(tmp_path, {36: ("ahci", counts)}, isolated=counts)
    assert core.choose(-1, {0, 1}, tmp_path, 100.0).core in (0, 1)


@pytest.mark.parametrize(
    ("taken", "expected"),
    [((3,), 2), ({3: 812, 2: 900}, 1), ((0,), 3), ((0, 1, 2, 3), 3), ((7,), 3)],
)
def test_a_core_that_another_rig_keeps_to_is_left_while_there_is_another(tmp_path, taken, expected):
    machine(tmp_path, {})
    assert core.choose(-1, {0, 1, 2, 3}, tmp_path, 100.0, taken).core == expected
    assert core.choose(3, {0, 1, 2, 3}, tmp_path, 100.0, taken).core == 3, "one that is named is taken"


def test_a_core_that_is_not_isolated_and_free_comes_before_an_isolated_one_that_is_taken(tmp_path):
    machine(tmp_path, {}, isolated="2-3")
    assert core.choose(-1, {0, 1, 2, 3}, tmp_path, 100.0, (3,)).core == 2
    assert core.choose(-1, {0, 1, 2, 3}, tmp_path, 100.0, (2, 3)).core == 1


ANOTHER = """
import os, signal, sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
from rtctl.rt import realtime
policy = os.sched_getscheduler
def of_ours(process):
    if sys.argv[3] in Path("/proc", str(process or os.getpid()), "cmdline").read_text():
        return policy(process)
    raise ProcessLookupError
os.sched_getscheduler = of_ours
grants, held = realtime.acquire(10, int(sys.argv[2]))
assert os.sched_getscheduler(0) == os.SCHED_FIFO, grants
print(next(iter(os.sched_getaffinity(0))), next(g for g in grants if g.right == "affinity"), flush=True)
signal.pause()
"""
"""A process that takes its core as a loop does, and sees those alone that name the same test: other programs
of this machine may keep to a core too."""


@pytest.fixture
def another():
    """Starts other processes that take their core as a loop does, all at once; they end with the test."""
    started, test = [], f"test-{os.getpid()}-{time.monotonic_ns()}"

    def begin(*asked):
        source = [sys.executable, "-c", ANOTHER, str(Path.cwd())]
        new = [
            subprocess.Popen([*source, str(cpu), test], stdout=subprocess.PIPE, text=True) for cpu in asked
        ]
        started.extend(new)
        return [process.stdout.readline().split(maxsplit=1) for process in new]

    yield begin
    for process in started:
        process.kill()
        process.communicate()


def may_be_real_time():
    return subprocess.run(["chrt", "-f", "10", "true"], capture_output=True, check=False).returncode == 0


needs_two = pytest.mark.skipif(
    not {0, 1} <= os.sched_getaffinity(0) or not may_be_real_time(),
    reason="needs two cores, and real-time rights",
)


@needs_two
def test_loops_that_start_together_take_a_core_each(another):
    both = another(-1, -1)
    assert both[0][0] != both[1][0], both


@needs_two
def test_who_must_share_a_core_is_told_with_whom(another):
    (first, alone), (again, shared) = *another(0), *another(0)
    assert first == again == "0"
    assert "granted=True" in alone
    assert "granted=False" in shared
    assert "keeps to core 0, in real time too" in shared
    assert core.held()[0]


def test_the_kernels_own_threads_and_what_has_ended_keep_no_core(tmp_path, monkeypatch):
    stats = {
        "7": f"7 (mig) ration) S 2 0 0 0 -1 {0x0420_8040} 0",
        "8": "8 (a loop) S 1 8 8 0 -1 4194560 0",
        "9": "9 (every core) S 1 9 9 0 -1 4194560 0",
        "10": "10 (no real time) S 1 9 9 0 -1 4194560 0",
        "12": "nonsense",
        str(os.getpid()): "1 (me) S 1 9 9 0 -1 4194560 0",
        "self": "",
    }
    for name, text in stats.items():
        (tmp_path / name).mkdir()
        (tmp_path / name / "stat").write_text(text)
    (tmp_path / "11").mkdir()  # ended
    policy = {10: os.SCHED_OTHER, 8: os.SCHED_FIFO | os.SCHED_RESET_ON_FORK}
    monkeypatch.setattr(os, "sched_getaffinity", lambda pid: {1, 2} if pid == 9 else {pid % 4})
    monkeypatch.setattr(os, "sched_getscheduler", lambda pid: policy.get(pid, os.SCHED_RR))
    assert core.held(tmp_path) == {0: 8}


def test_nobody_who_holds_the_turn_keeps_a_loop_from_starting(monkeypatch):
    monkeypatch.setattr(core, "TURN_S", 0.05)
    began = time.monotonic()
    with core.turn(), core.turn():
        assert time.monotonic() >= began + 0.05
