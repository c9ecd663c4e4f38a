"""What ends a command that is nobody's mistake in rtctl is told in a line: never by a traceback."""

import errno
import json
import os
import signal
import socket
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import click
import pytest
from click.testing import CliRunner

import rtctl.cli
from rtctl.cli import cli, main
from rtctl.cli.invocation import shown
from rtctl.cli.number import Number
from rtctl.cli.outputs import OutputFile, OutputFolder
from rtctl.errors import ConfigError, TerminatedError
from rtctl.host import flight_recorder
from rtctl.recording import recorder
from rtctl.rig_file.config import load
from rtctl.simulation.shipped_files import shipped_config
from rtctl.wire.endpoints import RuntimeDirectory

ROOT = Path(__file__).parents[3]
NO_ROOM = OSError(errno.ENOSPC, "No space left on device")


def ctrl_c_made_something_else():
    try:
        signal.raise_signal(signal.SIGINT)
    except KeyboardInterrupt:
        raise ValueError("KeyboardInterrupt") from None


def raising(error):
    def run(**_options):
        raise error

    return run


@pytest.fixture
def ended(monkeypatch, capsys):
    """Run `main` with a command that does this; gives its exit code, standard output and error."""
    before = signal.getsignal(signal.SIGINT)
    monkeypatch.setattr(rtctl.cli, "_interrupts", [])

    def run(does, *arguments):
        monkeypatch.setattr(cli, "main", does)
        monkeypatch.setattr(sys, "argv", ["rtctl", *arguments])
        with pytest.raises(SystemExit) as left:
            main()
        return left.value.code, *capsys.readouterr()

    yield run
    signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize(
    ("does", "code", "said"),
    [
        (
            raising(PermissionError(errno.EACCES, "Permission denied", "/x")),
            1,
            "rtctl: /x: Permission denied",
        ),
        (raising(OSError(errno.EMFILE, "Too many open files")), 1, "rtctl: Too many open files"),
        (raising(NO_ROOM), 1, "rtctl: standard output: No space left on device; make room"),
        (raising(KeyboardInterrupt()), 130, "interrupted"),
        (raising(TerminatedError()), 143, "terminated"),
        (lambda **_: ctrl_c_made_something_else(), 130, "interrupted"),
    ],
)
def test_what_the_machine_or_a_person_refuses_is_one_line(ended, does, code, said):
    assert ended(does) == (code, "", f"{said}\n")


def test_for_a_script_the_line_is_json(ended):
    code, out, err = ended(raising(PermissionError(errno.EACCES, "Permission denied", "/x")), "--json")
    body = json.loads(out)
    assert (code, body["exit_code"], body["message"], err) == (1, 1, "/x: Permission denied", "")


def test_ctrl_c_is_an_object_for_a_script_too(ended):
    code, out, err = ended(raising(KeyboardInterrupt()), "--json")
    assert (code, json.loads(out)["exit_code"], err) == (130, 130, "")


def test_a_mistake_in_rtctl_keeps_its_traceback(ended):
    with pytest.raises(ZeroDivisionError):
        ended(raising(ZeroDivisionError()))


def test_a_program_whose_files_were_replaced_says_so(ended, monkeypatch):
    monkeypatch.setattr(rtctl.cli, "installed_anew", lambda: True)
    code, _, err = ended(raising(ModuleNotFoundError("No module named 'rtctl.new'")))
    assert code == 1
    assert "rtctl was installed anew while it ran: start it again (ModuleNotFoundError: No module" in err


@pytest.mark.parametrize("ignored", [False, True])
@pytest.mark.parametrize(
    ("number", "code", "said"),
    [(signal.SIGINT, 130, "interrupted\n"), (signal.SIGTERM, 143, "terminated\n")],
    ids=["Ctrl-C", "SIGTERM"],
)
def test_a_signal_while_the_program_is_imported_ends_it_with_a_line(tmp_path, ignored, number, code, said):
    (tmp_path / "click.py").write_text(f"import os\nos.kill(os.getpid(), {int(number)})\n")
    done = subprocess.run(
        [sys.executable, "-m", "rtctl", "--version"],
        env={**os.environ, "PYTHONPATH": f"{tmp_path}:{ROOT}"},
        preexec_fn=lambda: signal.signal(number, signal.SIG_IGN if ignored else signal.SIG_DFL),
        capture_output=True,
        text=True,
        check=False,
    )
    if ignored:  # then that click has no Group
        assert (done.returncode, "AttributeError" in done.stderr) == (1, True)
    else:
        assert (done.returncode, done.stderr) == (code, said)


@pytest.mark.parametrize("command", ["run", "check"])
def test_sigterm_before_the_rig_runs_ends_a_daemon_with_a_line_and_other_commands_at_once(command):
    code = (
        "import os, signal, sys, rtctl.cli\n"
        f"sys.argv = ['rtctl', {command!r}]\n"
        "rtctl.cli.cli.main = lambda **_: os.kill(os.getpid(), signal.SIGTERM)\n"
        "rtctl.cli.main()"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    daemon = command == "run"
    assert (done.returncode, done.stderr) == ((143, "terminated\n") if daemon else (-signal.SIGTERM, ""))


@pytest.mark.parametrize("arguments", [("--help",), ("check", "nowhere.toml", "--json")])
def test_a_command_whose_reader_has_left_ends_without_a_word(arguments):
    read, write = os.pipe()
    os.close(read)
    done = subprocess.run(
        [sys.executable, "-m", "rtctl", *arguments],
        stdout=write,
        stderr=subprocess.PIPE,
        check=False,
        cwd=ROOT,
    )
    os.close(write)
    assert (done.returncode, done.stderr) == (141, b"")


def test_a_broken_pipe_of_a_device_is_no_reader_that_has_left(ended):
    assert ended(raising(BrokenPipeError(errno.EPIPE, "Broken pipe"))) == (1, "", "rtctl: Broken pipe\n")


def test_a_service_that_cannot_start_says_why_in_its_status(tmp_path, monkeypatch):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind(str(tmp_path / "notify"))
        manager.setblocking(False)
        monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "notify"))
        done = CliRunner().invoke(cli, ["run", str(tmp_path / "absent.toml")])
        assert isinstance(done.exception, ConfigError)
        assert f"STATUS={done.exception}" == manager.recv(4096).decode()


@pytest.mark.parametrize("kind", [OutputFile(), OutputFolder()])
def test_an_output_that_may_not_even_be_looked_at_is_wrong_usage(kind):
    with pytest.raises(click.BadParameter, match=r"cannot write .*: File name too long"):
        kind.convert(f"/tmp/{'a' * 300}/out", None, None)


def options_of(command, path="rtctl"):
    for name in getattr(command, "list_commands", lambda _: [])(click.Context(command)):
        yield from options_of(command.get_command(click.Context(command), name), f"{path} {name}")
    yield from ((path, option) for option in command.params)


def test_no_option_takes_what_is_not_a_number():
    numbers = [(path, one) for path, one in options_of(cli) if one.type.name in ("float", "float range")]
    assert len(numbers) > 30
    assert [(path, one.name) for path, one in numbers if not isinstance(one.type, Number)] == []
    with pytest.raises(click.BadParameter, match="not a number"):
        Number(min=0).convert("nan", None, None)


def test_a_lock_that_cannot_be_opened_is_told_with_its_folder(tmp_path):
    (tmp_path / "mock" / "lock").mkdir(parents=True, mode=0o700)
    (tmp_path / "mock").chmod(0o700)
    with pytest.raises(ConfigError, match="cannot use it as runtime folder: Is a directory"):
        RuntimeDirectory.acquire("mock", tmp_path)


def test_a_device_opened_anew_has_time_after_the_host():
    unit = (ROOT / "systemd" / "rtctl@.service").read_text()
    until_killed_s = int(unit.partition("\nTimeoutStopSec=")[2].partition("\n")[0])
    assert until_killed_s >= 15
    # a disk that hangs at the end is told before systemd kills
    assert until_killed_s - 3 > recorder.END_S + 2 * flight_recorder.END_S


@pytest.mark.parametrize("words", [["playback"], ["playback", "--time", "t"], ["init", "mock.toml"]])
def test_a_command_line_that_lacks_something_is_wrong_usage(words):
    assert CliRunner().invoke(cli, words).exit_code == 2


def test_a_rig_file_whose_name_is_no_text_is_refused(tmp_path):
    path = tmp_path / os.fsdecode(b"\xff.toml")
    path.write_bytes(shipped_config("mock.toml").read_bytes())
    with pytest.raises(ConfigError, match="not UTF-8; rename it"):
        load(path)


def test_a_command_is_shown_in_a_folder_that_is_gone(tmp_path, monkeypatch):
    gone = tmp_path / "gone"
    gone.mkdir()
    monkeypatch.chdir(gone)
    gone.rmdir()
    assert shown(Path("/opt/my rtctl")) == "'/opt/my rtctl'"


SWALLOWED = """
import os, signal, sys, time
import rtctl.cli
class Ending:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)
        for _ in range(100): time.sleep(1e-3)
def work(**_):
    del globals()["ending"]
    time.sleep(9.0)
    print("nobody heard")
ending = Ending()
sys.argv = ["rtctl"]
rtctl.cli.cli.main = work
rtctl.cli.main()
"""


def test_ctrl_c_while_an_object_ends_is_heard_all_the_same():
    done = subprocess.run(
        [sys.executable, "-c", SWALLOWED], capture_output=True, text=True, timeout=60, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "interrupted\n")


@pytest.mark.parametrize(
    ("names", "heard"),
    [
        (["pydantic._internal.x"], False),
        (["rtctl.x"], True),
        (["llvmlite.binding.linker"], False),
        (["llvmlite.binding.executionengine", "numba.core.caching"], False),
        (["llvmlite.ir.builder", "numba.core.lowering"], True),
        (["pydantic.main", "rtctl.x"], True),
    ],
)
def test_ctrl_c_where_it_would_go_nowhere_or_be_fatal_is_said_again(monkeypatch, names, heard):
    again = []
    monkeypatch.setattr(rtctl.cli, "_say_again", again.append)
    monkeypatch.setattr(rtctl.cli, "_interrupts", [])
    frame = None
    for name in names:  # the outermost first
        frame = SimpleNamespace(f_globals={"__name__": name}, f_back=frame)
    raised = False
    try:
        rtctl.cli._interrupt(signal.SIGINT, frame)
    except KeyboardInterrupt:  # one that pytest saw would end it
        raised = True
    assert (raised, again) == (heard, [] if heard else [signal.SIGINT])
    assert rtctl.cli._interrupts == [signal.SIGINT]


CTRL_C_AT = {
    "its first line": (
        "import rtctl.cli\nrtctl.cli.open_standard_streams = lambda: signal.raise_signal(signal.SIGINT)\n",
        130,
    ),
    # LIFO: the program's own comes first
    "its last one": (
        "import atexit\natexit.register(lambda: print(int(signal.getsignal(signal.SIGINT))))\n",
        0,
    ),
}


@pytest.mark.parametrize("at", CTRL_C_AT)
def test_ctrl_c_never_ends_it_by_the_signal_itself(at):
    text, code = CTRL_C_AT[at]
    child = f"import signal, sys\n{text}from rtctl.__main__ import main\nmain()"
    done = subprocess.run(
        [sys.executable, "-c", child, "--version"], capture_output=True, text=True, check=False, cwd=ROOT
    )
    assert done.returncode == code, done.stderr
    assert code or done.stdout.splitlines()[-1] == str(int(signal.SIG_IGN))
