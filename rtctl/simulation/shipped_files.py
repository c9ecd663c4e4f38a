"""Files that come with rtctl, in a checkout or in an installed package; and rig files of one's own made from
them."""

from __future__ import annotations

import re
import shlex
import tomllib
from collections.abc import Iterator
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
    """Write the shipped rig file `source` to `target` as the rig `name`, with the files it names beside it.

    A friction model becomes the new rig's: it is the same joint, until somebody changes it. Returns what was
    written, the rig file last.

    Raises
    ------
    ConfigError
        No such shipped file, a name that cannot be a rig's, a target that exists or cannot be written."""
    from rtctl.friction import artefact  # here: the list of commands does not wait for it

    origin = _find(source)
    if not _NAME.fullmatch(name):
        raise ConfigError(
            f"rig name {name!r}: a letter, then at most 31 letters, digits, - or _; give one with --name"
        )
    # the first name alone, which is the rig's: axes and devices have names, too
    text = re.sub(r'(?m)^name = "[^"]*"', f'name = "{name}"', origin.read_text(), count=1)
    text = text.replace(f"configs/{origin.name}", shlex.quote(str(target)))
    made: dict[Path, Path] = {}
    for part in sorted(set(_named_files(origin))):
        beside = part.with_name(f"{name}.json") if part.suffix == ".json" else part
        text = text.replace(f'"{part}"', f'"{beside}"')
        made[origin.parent / part] = target.parent / beside
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
            if old.suffix == ".json":
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


def _find(name: str) -> Path:
    names = {path.stem: path for path in rig_files()}
    wanted = Path(name).name.removesuffix(".toml")
    if wanted in names:
        return names[wanted]
    near = get_close_matches(wanted, names, 1)
    hint = f"did you mean {near[0]}.toml?" if near else "rtctl init lists them"
    raise ConfigError(f"{name}: no such rig file comes with rtctl; {hint}")


def _named_files(origin: Path) -> Iterator[Path]:
    """Files that a rig file names, relative to it."""
    for text in _strings(tomllib.loads(origin.read_text())):
        if text and not Path(text).is_absolute() and (origin.parent / text).is_file():
            yield Path(text)


def _strings(value: object) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict | list):
        for item in value.values() if isinstance(value, dict) else value:
            yield from _strings(item)
