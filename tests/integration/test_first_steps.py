"""`docs/first-steps.md` as a newcomer types it: every command in its order, in at most five for each task."""

import csv
import os
import re
import shlex
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from patience import until

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "first-steps.md").read_text()
OWN_TERMINAL = "  # in a terminal of its own"
MOST_COMMANDS = 5


def tasks():
    """Title -> commands of its shell blocks; and the programs that a task prints, by their name."""
    for part in PAGE.split("\n## ")[1:]:
        blocks = re.findall(r"```sh\n(.*?)```", part, re.DOTALL)
        programs = re.findall(r"```python\n(# (\w+\.py).*?)```", part, re.DOTALL)
        yield part.partition("\n")[0], [line for block in blocks for line in block.splitlines()], programs


TASKS = list(tasks())
COUNTED = dict(re.findall(r"^\| (.*?) \| (\d+) \| [\d.]+ \|$", PAGE, re.MULTILINE))


class Desk:
    """A folder with the shipped files, `rtctl` and `python` of this installation, and terminals."""

    def __init__(self, folder):
        self.folder, self.terminals = folder, {}
        (folder / "configs").symlink_to(ROOT / "configs")
        (folder / "bin").mkdir()
        self.program("rtctl", f'exec {shlex.quote(sys.executable)} -m rtctl "$@"')
        self.program("python", f'exec {shlex.quote(sys.executable)} "$@"')
        runtime = folder / "run"
        runtime.mkdir(mode=0o700)
        self.environment = {
            **os.environ,
            "PATH": f"{folder / 'bin'}:{os.environ['PATH']}",
            "PYTHONPATH": str(ROOT),
            "RTCTL_RUNTIME_DIR": str(runtime),
            "RTCTL_STATE_DIR": str(folder / "state"),
        }

    def program(self, name, text):
        path = self.folder / "bin" / name
        path.write_text(f"#!/bin/sh\n{text}\n")
        path.chmod(0o755)

    def type(self, line):
        done = subprocess.run(
            ["bash", "-c", line],
            cwd=self.folder,
            env=self.environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, f"{line}\n{done.stdout}{done.stderr}"
        return done.stdout

    def open_terminal(self, line):
        """Run a daemon in it; one that runs already from an earlier task is as good, and saves its start."""
        if line in self.terminals:
            return
        process = subprocess.Popen(
            shlex.split(line, comments=True),
            cwd=self.folder,
            env=self.environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        self.terminals[line] = process
        until(lambda: self.answers() or process.poll() is not None, "the daemon", 240)

    def close(self):
        for process in self.terminals.values():
            process.send_signal(signal.SIGINT)
            process.wait(60)
        self.terminals.clear()

    def answers(self):
        """Asked only where there is somebody to ask: each question starts the program."""
        asked = ["bash", "-c", "rtctl status"]
        return (
            any(self.folder.glob("run/*/command"))
            and subprocess.run(asked, env=self.environment, capture_output=True, check=False).returncode == 0
        )


@pytest.fixture(scope="module")
def desk(tmp_path_factory):
    made = Desk(tmp_path_factory.mktemp("desk"))
    yield made
    made.close()


def run(desk, commands, programs):
    for text, name in programs:
        (desk.folder / name).write_text(text)
    said = []
    for line in commands:
        if OWN_TERMINAL in line:
            desk.open_terminal(line)
        elif "pip install" not in line:  # `make setup` has done that
            said.append(desk.type(line))
    return said


def plain(text):
    """Lines without their numbers and spaces; none that is empty."""
    lines = (re.sub(r"[-+]?\d[\d.e+-]*", "#", " ".join(line.split())) for line in text.splitlines())
    return [line for line in lines if line]


def answered(said, word):
    """Everything that the page shows as a task's answers was said, in that order."""
    (shown,) = [shown for title, shown in ANSWERS.items() if word in title]
    heard = iter(plain("\n".join(said)))
    assert shown, f"{word}: no transcript"
    for line in shown:
        assert line in heard, f"{word}: not said, or not in this order: {line}"


ANSWERS = {
    part.partition("\n")[0]: [
        line
        for block in re.findall(r"```text\n(.*?)```", part, re.DOTALL)
        for line in plain(block)
        if line != "..."
    ]
    for part in PAGE.split("\n## ")[1:]
}


def task(word):
    (found,) = [(commands, programs) for title, commands, programs in TASKS if word in title]
    return found


def test_every_task_takes_at_most_five_commands():
    assert len(TASKS) == 6
    assert all(0 < len(commands) <= MOST_COMMANDS for _, commands, _ in TASKS)
    assert {title: str(len(commands)) for title, commands, _ in TASKS} == COUNTED


def test_a_rig_is_armed_and_stopped(desk):
    for _ in range(4):  # a machine that stands in the test pulse leaves nothing measured
        armed, status, stopped = run(desk, *task("armed and stopped"))
        if "test pulse" in armed:
            break
    assert "mock: ACTIVE" in armed
    assert "mock: ACTIVE" in status
    assert "mock: IDLE, no torque" in stopped
    answered([armed, status, stopped], "armed and stopped")


def test_a_world_of_ones_own_is_felt(desk):
    (said,) = run(desk, *task("A world of your own"))
    assert "in the wall" in said
    answered([said], "A world of your own")


def test_a_rig_file_of_ones_own_is_recorded_opened_and_gives_a_model(desk):
    """Three tasks, one upon the other."""
    desk.close()
    made = run(desk, *task("A rig file of your own"))
    assert "OK: no test fails" in made[-1]
    answered(made, "A rig file of your own")
    recorded = run(desk, *task("opened in pandas"))
    assert "count" in recorded[-1]
    answered(recorded, "opened in pandas")
    with (desk.folder / "ticks.csv").open() as file:
        row = next(csv.DictReader(file))
    assert {"position_rad.joint", "hand_torque_nm.joint"} <= set(row)
    found = run(desk, *task("A friction model from a log"))
    learned = found[1]
    answered(found, "A friction model from a log")
    assert "model: friction/my-model.json" in learned
    assert "my-model.json" in (desk.folder / "my-rig.toml").read_text()
