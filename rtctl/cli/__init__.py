"""The command line: one file per command, imported only when it is called."""

from __future__ import annotations

import atexit
import errno
import gc
import importlib
import os
import signal
import sys
import threading
from contextlib import suppress
from difflib import get_close_matches
from types import FrameType
from typing import Any

import click

# Before numpy is loaded: matrices here are small, and beside a load OpenBLAS's threads wait for each other,
# two and a half times as long as one takes.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from hw import installed_anew
from rtctl import __version__
from rtctl.cli.command_table import COMMANDS, SECTIONS
from rtctl.cli.json_text import json_text
from rtctl.errors import ConfigError, RtctlError, TerminatedError
from rtctl.standard_streams import open_standard_streams
from rtctl.terminal import Grade, NobodyReadsError, graded, obey_nothing_foreign, write_for_nobody


class _LazyGroup(click.Group):
    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        module, _, name = COMMANDS.get(cmd_name, "").partition(":")
        return getattr(importlib.import_module(module), name or "command") if module else None

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        # a shell that completes has but the beginning of a name
        if args[0] not in COMMANDS and not (ctx.resilient_parsing or args[0].startswith("-")):
            near = get_close_matches(args[0], COMMANDS, 1)
            hint = f"Did you mean {near[0]!r}?" if near else "`rtctl --help` lists them."
            ctx.fail(f"No such command {args[0]!r}. {hint}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        width = max(map(len, self.list_commands(ctx)))
        for title, section in SECTIONS.items():
            with formatter.section(title):
                formatter.write_dl([(name.ljust(width), about) for name, (_, about) in section.items()])


@click.group(
    cls=_LazyGroup,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100, "show_default": True},
    epilog="Exit codes: 0 done, 2 wrong usage, 3 config, 4 model, 5 not provably stable, 6 device, "
    "7 real-time rights, 8 busy, 9 loop died, 10 data, 11 latched fault, 12 client, 13 hand on the rig, "
    "14 recording broken, 130 Ctrl-C, 141 nobody reads the output, 143 SIGTERM before the rig ran, "
    "1 anything else.",
)
@click.version_option(__version__, prog_name="rtctl")
def cli() -> None:
    """Control a haptic or motion rig in real time.

    Begin with `rtctl demo`: a simulated rig, a simulated hand, friction compensation off and on."""


def report(error: RtctlError, *, as_json: bool) -> None:
    """Show an error: lines on stderr, or one JSON object on stdout for scripts."""
    faults = list(getattr(error, "faults", ()))
    if as_json:
        body: dict[str, Any] = {
            "error": type(error).__name__,
            "message": str(error),
            "exit_code": error.exit_code,
        }
        if isinstance(error, ConfigError):
            body["faults"] = faults
        click.echo(json_text(body))
        return
    from rtctl.cli.invocation import as_run

    for line in (f"rtctl: {error}", *(f"  {fault}" for fault in faults)):
        click.echo(graded(as_run(line), Grade.ERROR), err=True)


def main() -> None:
    """Entry point of the `rtctl` program."""
    # first: a program that is started without them would get a device as its standard output
    open_standard_streams()
    obey_nothing_foreign()
    if runs := sys.argv[1:2] == ["run"]:
        gc.disable()  # what is imported is no garbage: to look for it takes a tenth of the start (`cli.run`)
        # until the host counts it (`rtctl.host.signals`); any other command ends by it as any program does
        signal.signal(signal.SIGTERM, _interrupt)
    elif signal.getsignal(signal.SIGTERM) is not signal.SIG_IGN:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
    # else a shell script has started this in the background, where Ctrl-C is ignored: it stays so
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, _interrupt)
        sys.unraisablehook = _unraisable
    try:
        code = _settled(_exit_code())
    except KeyboardInterrupt as stop:  # it came as the command had ended
        code = _settled(_interrupted(stop))
    if runs:
        _leave_at_once(code)
    sys.exit(code)


def _settled(code: int) -> int:
    """The exit status, which Ctrl-C does not change any more while the interpreter is taken apart."""
    # ignored: any other handler is given back meanwhile, and the signal ends the process by itself
    atexit.register(signal.signal, signal.SIGINT, signal.SIG_IGN)
    return code


_interrupts: list[int] = []


# long enough that whatever swallowed it has returned, too short for a person to press it again
AGAIN_S = 0.05


def _interrupt(number: int, frame: FrameType | None) -> None:
    """Remember Ctrl-C, or SIGTERM: pydantic, for one, makes an error of its own of the exception that this
    raises."""
    _interrupts.append(number)
    if _lost_or_fatal(frame):
        _say_again(number)
        return
    raise TerminatedError if number == signal.SIGTERM else KeyboardInterrupt


def _lost_or_fatal(frame: FrameType | None) -> bool:
    """Whether an exception that is raised here goes nowhere, or ends the process with SIGSEGV."""
    names = []
    while frame is not None:
        names.append(str(frame.f_globals.get("__name__")))
        frame = frame.f_back
    # its core in Rust asks its Python for hashes while it makes a model, and drops what that raises: one
    # Ctrl-C of fifty in the first half second of `rtctl identify` went nowhere
    lost = names[:1] and names[0].partition(".")[0] == "pydantic"
    # a signal that came while LLVM linked a module is heard before llvmlite notes that the module is gone: it
    # would be freed again
    return bool(lost) or any(name.startswith("llvmlite.binding") for name in names)


def _say_again(number: int) -> None:
    threading.Timer(AGAIN_S, os.kill, (os.getpid(), number)).start()


def _unraisable(what: sys.UnraisableHookArgs) -> None:
    """Ctrl-C while Python ends an object, or runs a callback of C, goes nowhere: it is said again, some
    instructions later."""
    if _interrupts and issubclass(what.exc_type, KeyboardInterrupt):
        _say_again(_interrupts[-1])
    else:
        sys.__unraisablehook__(what)


def _exit_code() -> int:
    try:
        return _outcome()
    except NobodyReadsError:
        write_for_nobody()
        return 128 + signal.SIGPIPE  # as a shell tells of any program that its reader has left


def _outcome() -> int:
    try:
        cli.main(standalone_mode=False)
        sys.stdout.flush()
    except RtctlError as error:
        report(error, as_json="--json" in sys.argv)  # no options were parsed where parsing failed
        return error.exit_code
    except click.exceptions.Exit as stop:
        return stop.exit_code
    except click.ClickException as error:
        _show(error)
        return error.exit_code
    except SystemExit as stop:
        # as Python itself: None is 0, a text is 1
        return stop.code if isinstance(stop.code, int) else int(stop.code is not None)
    except (click.Abort, KeyboardInterrupt) as stop:
        return _interrupted(stop)
    except NobodyReadsError:
        raise
    except OSError as error:
        return _refused_by_the_machine(error)
    except Exception as error:  # whatever a library makes of Ctrl-C; anything else goes on as it is
        if _interrupts:
            return _interrupted(error)
        if not installed_anew():
            raise
        # imported from two versions, or from none: the traceback would name lines of either
        said = f"rtctl was installed anew while it ran: start it again ({type(error).__name__}: {error})"
        report(RtctlError(said), as_json="--json" in sys.argv)
        return 1
    return 0


def _show(error: click.ClickException) -> None:
    if "--json" in sys.argv:
        body = {"error": type(error).__name__, "message": error.format_message()}
        click.echo(json_text({**body, "exit_code": error.exit_code}))
    else:
        error.show()


def _refused_by_the_machine(error: OSError) -> int:
    if error.errno == errno.ENOSPC and not error.filename:  # an error of a stream names no file
        click.echo(f"rtctl: standard output: {error.strerror}; make room", err=True)
        return 1
    where = f"{error.filename}: " if error.filename else ""
    report(RtctlError(f"{where}{error.strerror or error}"), as_json="--json" in sys.argv)
    return 1


def _interrupted(stop: BaseException) -> int:
    # click makes an Abort of it, a library whatever it likes
    ended = isinstance(stop.__cause__ or stop, TerminatedError) or _interrupts[-1:] == [signal.SIGTERM]
    code = 128 + (signal.SIGTERM if ended else signal.SIGINT)
    kind = "Terminated" if ended else "Interrupted"
    if "--json" in sys.argv:
        click.echo(json_text({"error": kind, "message": kind.lower(), "exit_code": code}))
    else:
        click.echo(kind.lower(), err=True)
    return code


def _leave_at_once(code: int) -> None:
    """End a daemon that has closed everything. To take its interpreter apart would last longer than its whole
    end may."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):  # nobody reads it any more
            stream.flush()
    os._exit(code)
