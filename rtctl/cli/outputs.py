"""Options that name what is written: tried when the command line is read, before any work begins.

A measurement of half an hour must not end in front of a folder that cannot be written. Trying leaves nothing
behind."""

from __future__ import annotations

import io
import os
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, redirect_stdout, suppress
from pathlib import Path

import click

from hw.motion import words
from rtctl.errors import RtctlError

PICTURES = (".png", ".pdf", ".svg", ".jpg", ".jpeg")


class OutputFile(click.Path):
    """A file to write, into a folder that is there. `picture`: a figure, by the ending of its name."""

    def __init__(self, *, picture: bool = False) -> None:
        super().__init__(path_type=Path, dir_okay=False)
        self._picture = picture

    def convert(
        self, value: str | os.PathLike[str], param: click.Parameter | None, ctx: click.Context | None
    ) -> Path:
        """The path, once it has been tried."""
        path = Path(os.fsdecode(super().convert(value, param, ctx)))
        try:
            path = path.resolve() if path.is_symlink() else path  # what it names is replaced, never the link
            why = _why_no_file(path)
        except OSError as error:  # below a folder that this user may not look into
            why = error.strerror or str(error)
        if self._picture and path.suffix.lower() not in PICTURES:
            self.fail(f"{path}: a picture ends in {', '.join(PICTURES)}", param, ctx)
        if why:
            self.fail(f"cannot write {path}: {why}", param, ctx)
        return path


class OutputFolder(click.Path):
    """A folder to write into, made when it is not there."""

    def __init__(self) -> None:
        super().__init__(path_type=Path, file_okay=False)

    def convert(
        self, value: str | os.PathLike[str], param: click.Parameter | None, ctx: click.Context | None
    ) -> Path:
        """The path, once it has been tried."""
        path = Path(os.fsdecode(super().convert(value, param, ctx)))
        if why := why_no_folder(path):
            self.fail(f"cannot write into {path}: {why}", param, ctx)
        return path


def _why_no_file(path: Path) -> str:
    if not path.parent.is_dir():
        return f"there is no folder {path.parent}; make it first"
    if why := _why_not(path.parent):
        return why
    # a file is written beside it and renamed, which would replace /dev/null
    if path.exists() and not path.is_file():
        return "it is a device or a pipe; name a file"
    return "it exists and may not be written" if path.exists() and not os.access(path, os.W_OK) else ""


def require_apart(target: Path | None, read: Iterable[Path | None], picture: Path | None = None) -> None:
    """Refuse to replace what is read (UsageError), by whatever name: measured data are measured once. Nor may
    a picture that is drawn last replace what was learned."""
    if target and picture and target.resolve() == picture.resolve():
        raise click.UsageError(f"{target} is what is drawn, too: give another name to one of both")
    for one in read:
        with suppress(OSError):  # one of both is not there, or cannot be looked at: told where it is read
            if target and one and target.samefile(one):
                raise click.UsageError(f"{target} is what is read: give another name to what is written")


def why_no_folder(path: Path) -> str:
    """Why nothing can be written into `path`, a folder that may still have to be made; empty when it can."""
    there = path.absolute()
    try:
        # the nearest folder that is there: the rest is made below it
        while not there.exists() and there != there.parent:
            there = there.parent
    except OSError as error:  # below a folder that this user may not look into
        return f"{error.strerror} ({there})"
    return _why_not(there) if there.is_dir() else f"{there} is a file"


def _why_not(folder: Path) -> str:
    try:
        # without a name where the system can: nobody finds it, and nothing is left if this process is killed
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(b"tried")
            file.flush()  # a full disk refuses what is written, not what is kept in a buffer
    except OSError as error:
        return f"{error.strerror} ({folder})"
    return ""


@contextmanager
def errors_in_units_of(motion: str) -> Iterator[None]:
    """Tell what goes wrong meanwhile in the units of this motion; it is written for a rotary axis
    (`hw.motion.words`)."""
    try:
        yield
    except RtctlError as error:
        if motion == "linear":
            error.args = (words(str(error), motion), *error.args[1:])
        raise


@contextmanager
def in_units_of(motion: str) -> Iterator[None]:
    """Print what is printed meanwhile in the units of this motion; it is written for a rotary axis
    (`hw.motion.words`)."""
    said = io.StringIO()
    try:
        with redirect_stdout(said):
            yield
    finally:  # what was said before an error, too
        click.echo(words(said.getvalue(), motion), nl=False)
