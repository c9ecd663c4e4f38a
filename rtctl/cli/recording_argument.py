"""FILE: how every command that looks at a recording is told which one."""

from __future__ import annotations

import os
from pathlib import Path

import click

from hw.outside import shown


class RecordingFile(click.Path):
    """A recording, or a folder of recordings, which stands for its newest one: `rtctl run --record DIR` was
    given a folder, too."""

    def __init__(self) -> None:
        super().__init__(path_type=Path)

    def convert(
        self, value: str | os.PathLike[str], param: click.Parameter | None, ctx: click.Context | None
    ) -> Path:
        """The file; of a folder the newest, named on the error output. Which part of a recording it is makes
        no difference."""
        from rtctl.recording.reader import newest

        path = Path(os.fsdecode(super().convert(value, param, ctx)))
        try:
            if not path.is_dir():
                return path
            found = newest(path)
        except OSError:  # not for this user to look at: told as data that cannot be read, where it is read
            return path
        if found is None:
            self.fail(f"no recording (*.mcap) lies in the folder {path}; name a file", param, ctx)
        click.echo(f"rtctl: the newest recording in {path}: {shown(found.name)}", err=True)
        return found
