"""`rtctl run --faults` as a process: the schedule reaches the device of the real loop."""

import pytest
from test_run import CONFIGS, finish, start

STALL = "[[fault]]\nchannel = 'loop'\nkind = 'stall'\nvalue = 3.0\nat_s = 0.3\nfor_ticks = 1\n"
PRESSED = "[[fault]]\nchannel = 'estop'\nkind = 'pressed'\nat_s = 0.6\nfor_s = 0.1\n"
UNPLUGGED = "[[fault]]\nchannel = 'link'\nkind = 'raise_read'\nat_s = 0.3\nfor_ticks = 1\n"


@pytest.fixture
def folder(tmp_path):
    path = tmp_path / "run"
    path.mkdir(mode=0o700)
    return path


def run(folder, schedule, *more):
    path = folder.parent / "faults.toml"
    path.write_text(schedule)
    return finish(start(CONFIGS / "mock.toml", folder, "--faults", str(path), *more))


def test_the_loop_misses_slots_and_sees_the_emergency_stop_as_scripted(folder):
    code, summary, _ = run(folder, STALL + PRESSED, "--for", "2")
    assert code == 11, summary
    assert summary["fault_first"] == "ESTOP"
    assert summary["missed_ticks"] >= 3


def test_a_link_that_raises_is_a_latched_fault_with_its_name_and_the_device_is_found_again(folder):
    code, summary, stderr = run(folder, UNPLUGGED, "--for", "3")
    assert code == 11, summary
    assert summary["fault_first"] == "LINK_LOST"
    assert "device lost: scripted fault: the link was lost in read" in stderr
    assert "device found again" in stderr


def test_a_bad_schedule_starts_nothing(folder):
    code, error, _ = run(folder, PRESSED + "axes = 1\n", "--for", "5")
    assert code == 3
    assert "faults.toml: fault[0].axes: unknown key; did you mean axis?" in error["faults"][0]
    assert not any(folder.iterdir())
