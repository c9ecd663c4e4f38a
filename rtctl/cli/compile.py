"""`rtctl compile`: the wait of a first start, at a time of one's own."""

from __future__ import annotations

import time
from pathlib import Path

import click

from rtctl.cli.json_text import json_text

TELL_EVERY_S = 10.0
"""So often a person who waits is told how far it is."""


@click.command("compile")
@click.argument("config", type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="one JSON object on stdout")
def command(config: Path, *, as_json: bool) -> None:
    """Compile what the rig of CONFIG needs, so that its next start is a warm one. Opens no device.

    `rtctl service install` does this as the user of the service. A start does by itself what was not done
    before it."""
    from hw import code_cache
    from rtctl.host.preparation import compile_rig
    from rtctl.rig_file.config import load

    loaded = load(config)
    began = time.monotonic()
    # before the rig is built: that compiles already
    code_cache.on_compiled.append(_Progress(began).hear)
    devices = compile_rig(loaded)
    functions, seconds = len(set(code_cache.made_here)), time.monotonic() - began
    if as_json:
        click.echo(json_text({"functions": functions, "seconds": round(seconds, 1), "devices": devices}))
        return
    left = "" if devices else "; functions of devices that must be open for it are left to the first start"
    done = (
        f"compiled {functions} functions in {seconds:.0f} s"
        if functions
        else "everything was compiled before"
    )
    click.echo(f"{done}{left}")


class _Progress:
    """One line when the first function is compiled, then one every `TELL_EVERY_S`, on stderr."""

    def __init__(self, now_s: float) -> None:
        # the first function is told at once: a person learns why it takes long
        self._next_s = now_s

    def hear(self, _count: int) -> None:
        """Another function was compiled."""
        from hw import code_cache

        if (now := time.monotonic()) >= self._next_s:
            self._next_s = now + TELL_EVERY_S
            functions, most = len(set(code_cache.made_here)), len(code_cache.may_be_made)
            click.echo(
                f"compiling for this machine, about a minute: {functions} functions so far, of at most "
                f"{most}",
                err=True,
            )
