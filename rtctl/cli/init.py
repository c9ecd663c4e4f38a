"""`rtctl init`: a rig file of your own, from one that comes with rtctl."""

from __future__ import annotations

from pathlib import Path

import click
from click.shell_completion import CompletionItem

from rtctl.cli.json_text import json_text


def _complete(_ctx: click.Context, _param: click.Parameter, incomplete: str) -> list[CompletionItem]:
    from rtctl.simulation.shipped_files import rig_files

    return [CompletionItem(path.name) for path in rig_files() if path.name.startswith(incomplete)]


@click.command("init")
@click.argument("shipped", required=False, shell_complete=_complete)
@click.argument("target", required=False, type=click.Path(path_type=Path, dir_okay=False))
@click.option("--name", help="name of the new rig; default: the name of TARGET without .toml")
@click.option("--json", "as_json", is_flag=True, help="one JSON object on stdout")
def command(shipped: str | None, target: Path | None, name: str | None, *, as_json: bool) -> None:
    """Copy the rig file SHIPPED to TARGET, a rig of your own; without arguments, list what there is.

    TARGET gets the name of the new rig, and the files that the rig file names (friction models, schedules) go
    along beside it. Nothing that exists is overwritten. With a path in place of SHIPPED one of your own is
    copied: a rig gets another name, its friction models too.

    \b
        rtctl init mock.toml my-rig.toml
        rtctl run my-rig.toml --arm
        rtctl init ./my-rig.toml other-name.toml"""
    from rtctl.simulation.shipped_files import about, find, rig_files, write_copy

    if shipped is None:
        files = {path.name: about(path) for path in rig_files()}
        width = max(map(len, files))
        click.echo(
            json_text(files)
            if as_json
            else "\n".join(f"{file:<{width}}  {text}" for file, text in files.items())
        )
        return
    if target is None:
        raise click.UsageError(f"where to? rtctl init {shipped} my-rig.toml")
    # by the target's name: two rigs of one name would take each other's lock and state
    written = write_copy(shipped, target, name or target.stem)
    if as_json:
        click.echo(json_text({"rig": name or target.stem, "files": written}))
        return
    for path in written:
        click.echo(f"wrote {path}")
    if find(shipped) not in rig_files() and len(written) > 1:
        click.echo(f"what came along is true of the joint of {shipped}; of another one: rtctl identify")
    from rtctl.cli.invocation import as_run, shown

    click.echo(as_run(f"next: edit {shown(target)}, then: rtctl check {shown(target)}"))
