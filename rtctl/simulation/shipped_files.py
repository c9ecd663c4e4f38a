"""Files that come with rtctl, in a checkout or in an installed package; and rig files of one's own made from
them."""

from __future__ import annotations

import re
import shlex
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path

from rtctl.errors import ConfigError

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,31}")


def shipped(name: str) -> Path:
    """Path of a file that comes with rtctl, e.g. `configs/mock.toml` or `docs/view.md`."""
    package = Path(__file__).parents[1]
    inside = package / name  # a wheel has them in the package, a checkout beside it
    return inside if inside.exists() else package.parent / name


def shipped_config(name: str) -> Path:
    """Path of a rig file that comes with rtctl, e.g. `mock.toml`, in a checkout or in an installed
    package."""
    return shipped(f"configs/{name}")


def rig_files() -> list[Path]:
    """Every shipped rig file, sorted by name."""
    return sorted(shipped("configs").glob("*.toml"))


def about(path: Path) -> str:
    """What the first comment of a rig file says it is, in one sentence."""
    lines = path.read_text().splitlines()
    head = []
    for line in lines:
        if not line.startswith("#") or not line.strip("# "):
            break
        head.append(line.strip("# "))
    return re.split(r"(?<=[a-z)]\.) ", " ".join(head))[0].rstrip(":")


def write_copy(source: str, target: Path, name: str) -> list[Path]:
    """Write the rig file `source` to `target` as the rig `name`, with the files it names beside it.

    `source` is the name of a shipped file, or the path of one's own (`find`). A friction model becomes the
    new rig's: it is the same joint, until somebody changes it. Returns what was written, the rig file last.

    Raises
    ------
    ConfigError
        No such file, one that is wrong or too unlike a shipped one to be changed here, a name that cannot be
        a rig's, a target that exists or cannot be written."""
    from rtctl.friction import artefact  # here: the list of commands does not wait for it

    origin = find(source)
    if not _NAME.fullmatch(name):
        raise ConfigError(
            f"rig name {name!r}: a letter, then at most 31 letters, digits, - or _; give one with --name"
        )
    text, made, models = _changed(origin, target, name)
    # before anything is written: half of a rig beside somebody's files would be hard to take away
    for path in (target, *made.values()):
        if path.exists():
            raise ConfigError(
                f"{path} exists already, and nothing is overwritten: choose another TARGET or --name"
            )
    done: list[Path] = []
    try:
        for old, new in made.items():
            new.parent.mkdir(parents=True, exist_ok=True)
            done.append(new)
            if old in models:
                artefact.save(replace(artefact.load(old), rig=name), new)
            else:
                new.write_bytes(old.read_bytes())
        target.parent.mkdir(parents=True, exist_ok=True)
        with target.open("x") as file:  # x: a file that appeared meanwhile is not overwritten
            done.append(target)
            file.write(text)
    except BaseException as error:
        for path in done:  # half of a rig would be in the way of the next try, which overwrites nothing
            path.unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise ConfigError(f"{error.filename or target}: {error.strerror}") from error
        raise
    return done


def find(source: str) -> Path:
    """The rig file that is meant: what a path names, of a bare name first the shipped file, then one's own.

    Raises
    ------
    ConfigError
        There is none."""
    names = {path.stem: path for path in rig_files()}
    own, wanted = Path(source), Path(source).name.removesuffix(".toml")
    theirs = names.get(wanted)
    # `./mock.toml` is somebody's own, whatever it is called
    if theirs and (own.name == source or not own.is_file() or own.samefile(theirs)):
        return theirs
    if own.is_file():
        return own
    near = get_close_matches(wanted, names, 1)
    hint = f"did you mean {near[0]}.toml?" if near else "rtctl init lists them"
    raise ConfigError(f"{source}: no such rig file, here or of those that come with rtctl; {hint}")


def _changed(origin: Path, target: Path, name: str) -> tuple[str, dict[Path, Path], set[Path]]:
    """The text of a rig file for another place and name; which files go where for it; friction models of
    these."""
    try:
        text = origin.read_text()
        wanted = tomllib.loads(text)
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise ConfigError(f"{origin}: {error}; rtctl check tells more") from error
    parts = sorted(set(_named_files(origin.parent, wanted)))
    # an axis names no other file; a device may, a log for one
    models = sorted(set(_strings(wanted.get("axis", []))).intersection(map(str, parts)))
    # the first name alone, which is the rig's: axes and devices have names, too
    text = re.sub(r'(?m)^name = "[^"]*"', f'name = "{name}"', text, count=1)
    text = text.replace(f"configs/{origin.name}", shlex.quote(str(target)))
    made: dict[Path, Path] = {}
    other = {}
    for part in parts:
        own = name if len(models) == 1 else f"{name}-{part.stem}"
        beside = part.with_name(f"{own}.json") if str(part) in models else part
        other[str(part)] = str(beside)
        text = text.replace(f'"{part}"', f'"{beside}"')
        old, new = origin.parent / part, target.parent / beside
        if old.resolve() != new.resolve():  # a schedule of faults stays where both rigs find it
            made[old] = new
    wanted.setdefault("rig", {})["name"] = name
    # somebody's own hand may have written it in another way than this finds
    if tomllib.loads(text) != _replaced(wanted, other):
        raise ConfigError(
            f"{origin}: the name of the rig, or of a file, is not where rtctl init looks for it: begin with "
            '[rig] and name = "..." on a line of its own, and write names of files between "'
        )
    return text, made, {origin.parent / part for part in models}


def _replaced(value: object, other: Mapping[str, str]) -> object:
    if isinstance(value, dict):
        return {key: _replaced(item, other) for key, item in value.items()}
    if isinstance(value, list):
        return [_replaced(item, other) for item in value]
    return other.get(value, value) if isinstance(value, str) else value


def _named_files(folder: Path, rig: Mapping[str, object]) -> Iterator[Path]:
    """Files that a rig file in `folder` names, relative to it."""
    for text in _strings(rig):
        if text and not Path(text).is_absolute() and (folder / text).is_file():
            yield Path(text)


def _strings(value: object) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict | list):
        for item in value.values() if isinstance(value, dict) else value:
            yield from _strings(item)
