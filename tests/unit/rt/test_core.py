"""Which core the loop takes, by counts of made-up machines."""

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
