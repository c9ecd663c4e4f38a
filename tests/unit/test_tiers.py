"""The tiers: every test is in one of them, a part that fails fails the whole, and an interruption ends
all.
"""

import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import few
import pytest
import run_tier
import tiers
from patience import until
from run_tier import Part, Run

ROOT = Path(__file__).parents[2]
TABLES = (tiers.MEETS_A_CLOCK, tiers.ONLY_COMPUTES, tiers.PATIENT, tiers.LONG)


@pytest.fixture(autouse=True)
def logs(tmp_path, monkeypatch):
    monkeypatch.setattr(run_tier, "LOGS", tmp_path)
    return tmp_path


def files_of(parts):
    return [word for part in parts for word in part.command if word.endswith(".py")]


@pytest.mark.parametrize("name", sorted({name for table in TABLES for name in table}))
def test_what_the_table_names_is_there(name):
    assert (tiers.TESTS / name).exists()


def test_every_file_of_tests_is_in_one_part_of_make_test():
    every = sorted(str(path.relative_to(ROOT)) for path in tiers.TESTS.rglob("test_*.py"))
    assert sorted(files_of(run_tier.test())) == every
    assert len(every) > 200


def test_what_meets_a_clock_is_in_two_parts_and_in_no_other():
    _, clock, patient, *others = run_tier.test()
    assert clock.clock
    assert patient.clock
    assert not any(part.clock for part in others)
    meeting, waiting = files_of([clock]), files_of([patient])
    assert {"tests/integration/test_run.py", "tests/attacks/test_strangers.py"} < set(meeting)
    assert {"tests/integration/test_can_run.py", "tests/contract/test_can_slcan.py"} < set(waiting)
    assert not set(meeting) & set(waiting)
    assert not [name for name in meeting + waiting if name.endswith(tiers.ONLY_COMPUTES)]
    assert set(files_of(others)) >= {f"tests/{name}" for name in tiers.ONLY_COMPUTES}


def test_of_attacks_and_of_what_measures_a_loop_nothing_is_patient():
    _, _, patient, *_ = run_tier.test()
    assert not [name for name in files_of([patient]) if "/attacks/" in name or "/test_run" in name]


def test_what_daemons_of_devices_run_is_compiled_before_all_else_that_runs_beside_the_clock():
    compiled, _, _, first, *_ = run_tier.test()
    assert compiled.compiles
    assert "tests/unit/hw/test_can_steady.py" in files_of([first])


def test_what_takes_long_begins_early():
    _, _, _, _, *others = run_tier.test()
    slow = [sum(not tiers.is_quick(ROOT / name) for name in files_of([part])) for part in others]
    assert slow == sorted(slow, reverse=True)
    assert slow[0] > 20 > slow[-1]


def test_the_inner_loop_is_part_of_what_a_user_runs():
    assert set(files_of(run_tier.check())) < set(files_of(run_tier.test()))
    assert "tests/unit/control/test_gate.py" in files_of(run_tier.check())


def test_everything_marked_volume_is_found():
    assert "tests/acceptance/test_campaign.py" in files_of(run_tier.volume())


@pytest.mark.parametrize("name", few.FEW)
def test_what_make_test_asks_of_few_is_asked_of_the_others_in_ci(name):
    path = tiers.TESTS / name
    assert all(f"def {test.rpartition('::')[2]}(" in path.read_text() for test in few.FEW[name])
    if tiers.meets_a_clock(path):
        (system,) = re.findall(r'--ignore=%s .*\) (.*)" \|\|', (ROOT / ".ci/run").read_text())
        assert f"tests/{name.partition('/')[0]}" in system.split()
    else:
        assert f"tests/{name}" in files_of(run_tier.volume())


def test_ci_runs_every_tier():
    text = (ROOT / ".ci/run").read_text()
    for command in ("make lint", "make run", "make test ", "make test-volume", "make test-system"):
        assert command in text, command


MAKE = """#!/bin/sh
echo "$@" >>{told}
case " $* " in *" {fails} "*) exit 2;; esac
"""


@pytest.mark.skipif(not shutil.which("make"), reason="no make on this machine")
@pytest.mark.parametrize("fails", ["lint", "run", "test", "test-system", "test-volume", "nothing"])
def test_whatever_fails_in_ci_fails_it_and_the_rest_is_run_all_the_same(tmp_path, fails):
    script, tools, told = tmp_path / "tree/.ci/run", tmp_path / "tools", tmp_path / "told"
    script.parent.mkdir(parents=True)
    tools.mkdir()
    script.write_bytes((ROOT / ".ci/run").read_bytes())
    for name, text in (("make", MAKE.format(told=told, fails=fails)), ("apt-get", "#!/bin/sh\n")):
        (tools / name).write_text(text)
        (tools / name).chmod(0o755)
    environment = {**os.environ, "PATH": f"{tools}:{os.environ['PATH']}"}
    done = subprocess.run(
        ["bash", script], env=environment, capture_output=True, text=True, check=False, timeout=60
    )
    assert done.returncode == (0 if fails == "nothing" else 2), done.stdout + done.stderr
    assert "s in all" in done.stdout
    ran = sorted(line.split()[0] for line in told.read_text().splitlines())
    assert ran == ["lint", "run", "setup", "test", *["test-system"] * 4, "test-volume"]


def shell(name, text, **more):
    return Part(name, ("sh", "-c", text), **more)


def test_a_part_that_fails_fails_the_whole_and_is_shown_and_the_others_run_to_their_end(capsys):
    parts = [
        shell("good", "echo '3 passed, 1 skipped in 1.00s'"),
        shell(
            "bad",
            "echo the reason; echo FAILED a.py::test_b; echo '1 failed, 2 passed in 1.00s'; exit 1",
        ),
        shell("late", "echo '4 passed in 0.1s'"),
    ]
    assert Run(parts, at_a_time=1).whole() == 1
    said = capsys.readouterr().out
    assert "the reason" in said
    assert "9 passed, 1 skipped, 1 failed" in said
    assert said.rstrip().endswith("FAILED part bad\nFAILED a.py::test_b")
    assert Run(parts[::2], at_a_time=2).whole() == 0


@pytest.mark.parametrize("ending", ["kill -9 $$", "exit 4", "exit 2"])
def test_a_part_that_dies_without_a_word_fails_too(ending):
    assert Run([shell("dead", ending)], at_a_time=2).whole() == 1


def test_a_folder_of_which_nothing_is_chosen_is_no_failure():
    assert Run([shell("empty", f"exit {run_tier.NOTHING_COLLECTED}")], at_a_time=2).whole() == 0


def test_what_starts_beside_a_clock_takes_idle_time_only_and_what_starts_later_does_not(tmp_path):
    policy = f"{sys.executable} -c 'import os; print(os.sched_getscheduler(0))'"
    done = tmp_path / "done"
    parts = [
        shell("clock", f"while [ ! -e {done} ]; do sleep .02; done; {policy}", clock=True),
        shell("another clock", policy, clock=True),
        shell("beside", f"{policy}; touch {done}"),
    ]
    assert Run(parts, at_a_time=2).whole() == 0
    assert Run([shell("later", policy), shell("volume", policy, idle=True)], at_a_time=2).whole() == 0
    names = ("clock", "another clock", "beside", "later", "volume")
    told = {name: int(shell(name, "").log.read_text()) for name in names}
    ordinary, idle = os.sched_getscheduler(0), os.SCHED_IDLE
    assert told == dict(zip(names, (ordinary, ordinary, idle, ordinary, idle), strict=True))


def test_no_clock_begins_before_what_it_runs_is_compiled_and_what_does_takes_idle_time(tmp_path):
    compiled, begun = tmp_path / "compiled", tmp_path / "begun"
    policy = f"{sys.executable} -c 'import os; print(os.sched_getscheduler(0))'"
    parts = [
        shell(
            "compile", f"until [ -e {begun} ]; do sleep .02; done; sleep .1; touch {compiled}", compiles=True
        ),
        shell("clock", f"[ -e {compiled} ]", clock=True),
        shell("beside", f"{policy}; touch {begun}"),
    ]
    assert Run(parts, at_a_time=2).whole() == 0
    assert int(parts[2].log.read_text()) == os.SCHED_IDLE


def test_beside_each_clock_runs_one_part_more_and_only_then(tmp_path):
    def meets(mine, *others):
        there = " && ".join(f"[ -e {tmp_path / other} ]" for other in others)
        return f"touch {tmp_path / mine}; timeout 30 sh -c 'until {there}; do sleep .02; done'"

    names = ["one", "two", "three"]
    one, two, three = (meets(mine, *(other for other in names if other != mine)) for mine in names)
    together = [
        shell("a clock", one, clock=True),
        shell("another", two, clock=True),
        shell("beside", three),
    ]
    assert Run(together, at_a_time=1).whole() == 0
    alone = f"mkdir {tmp_path / 'busy'} && sleep .2 && rmdir {tmp_path / 'busy'}"
    assert Run([shell("first", alone), shell("second", alone)], at_a_time=1).whole() == 0


BUSY = """
import time
def test_busy():
    end = time.process_time() + {seconds}
    while time.process_time() < end: pass
"""


def test_a_session_says_which_files_were_not_quick(tmp_path, monkeypatch):
    for name in ("conftest.py", "few.py", "patience.py"):
        shutil.copy(tiers.TESTS / name, tmp_path)
    table = (tiers.TESTS / "tiers.py").read_text().replace(f"QUICK_S = {tiers.QUICK_S}", "QUICK_S = 0.2")
    (tmp_path / "tiers.py").write_text(table)
    for name, seconds in (("slow", 0.4), ("quick", 0.0)):
        (tmp_path / f"test_{name}.py").write_text(BUSY.format(seconds=seconds))
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(tmp_path)]
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=120, env=environment)
    assert "s of a core: test_slow.py" in done.stdout
    assert "test_quick.py" not in done.stdout
    assert done.stdout.rstrip().rpartition("\n")[2].startswith("2 passed")


def test_the_inner_loop_names_what_of_it_is_not_quick_and_no_table_says_so(capsys):
    long, quick = tiers.LONG[0], "unit/control/test_gate.py"
    said = "".join(f"{tiers.said_of(name, 3.25)}\n" for name in (long, quick, "integration/test_run.py"))
    part = shell("some", "true")
    part.log.write_text(f".....\n{said}3 passed in 9.00s\n")
    run_tier.tell_of_slow_files([part])
    assert capsys.readouterr().out.splitlines()[1:] == [f"   3.2 s of a core: {quick}"]


@pytest.mark.skipif(os.geteuid() != 0, reason="only root takes a program out of idle time again")
def test_when_the_clock_is_over_what_ran_beside_it_takes_its_share_again(tmp_path):
    idle = f"{sys.executable} -c 'import os, sys; sys.exit(os.sched_getscheduler(0) != os.SCHED_IDLE)'"
    beside, over = tmp_path / "beside", tmp_path / "over"
    parts = [
        shell("clock", f"while [ ! -e {beside} ]; do sleep .02; done; touch {over}", clock=True),
        shell("after", f"{idle} && touch {beside}; while {idle}; do sleep .02; done; [ -e {over} ]"),
    ]
    assert Run(parts, at_a_time=2).whole() == 0


WHOLE = """
import sys, pathlib
sys.path.insert(0, {tests!r})
import run_tier
run_tier.LOGS = pathlib.Path({logs!r})
line = "sleep 300 & echo $! >" + {logs!r} + "/"
parts = [run_tier.Part(name, ("sh", "-c", line + name + "; wait")) for name in ("a", "b")]
run_tier.TIERS["check"] = lambda: parts
sys.argv[1:] = ["check"]
sys.exit(run_tier.main())
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interruption_ends_every_part_and_what_it_started(tmp_path, number):
    code = WHOLE.format(tests=str(tiers.TESTS), logs=str(tmp_path))
    whole = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    try:
        pids = [until(lambda name=name: written(tmp_path / name), name) for name in ("a", "b")]
        whole.send_signal(number)
        said, _ = whole.communicate(timeout=60)
    finally:
        whole.kill()
    assert whole.returncode == 130
    assert "interrupted" in said
    until(lambda: not any(lives(pid) for pid in pids), "the end of what the parts started")


def written(path):
    return path.exists() and path.read_text().strip()


def lives(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_a_tier_nobody_knows_is_refused():
    command = [sys.executable, str(tiers.TESTS / "run_tier.py"), "everything"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 2
    assert "check|test|volume" in done.stdout
