"""What is remembered of sources that were parsed before, so that a start need not parse them again.

Parsing takes a hundred times as long as reading. What a text means follows from its bytes alone, so the memo
goes by a hash of them, never by the time of a file. Whoever could write the memo could have old machine code
taken for that of new sources: the memo lies beside the compiled code and is believed under the same
conditions."""

from __future__ import annotations

import hashlib
import json
import os
import sys
from functools import cache
from pathlib import Path

from hw.private_cache import is_own, make_private

MOST_ENTRIES = 2000
"""Four times as many as the project has modules; beyond, what this process did not ask for is forgotten."""

Meaning = tuple[str, tuple[str, ...]]
"""Hash of a syntax tree (hex), and the dotted names that it imports."""


class SourceMemo:
    """Meanings of texts, from the file of `makers` in `folder` / sources; without a folder, this process
    alone remembers.

    Parameters
    ----------
    makers
        Whatever a meaning depends on beside the text: each has a file of its own."""

    def __init__(self, folder: Path | None, makers: str) -> None:
        self._path = folder and folder / "sources" / f"{hashlib.sha256(makers.encode()).hexdigest()[:20]}"
        self._before = self._load()
        self._asked: dict[str, Meaning] = {}
        self._new = False

    def get(self, key: str) -> Meaning | None:
        """What was noted under `key`, by this process or an earlier one."""
        known = self._asked.get(key) or self._before.get(key)
        if known is not None:
            self._asked[key] = known
        return known

    def note(self, key: str, meaning: Meaning) -> None:
        """Remember a meaning: on the disk from the next `save` on."""
        self._asked[key] = meaning
        self._new = True

    def save(self) -> None:
        """Write what is new, if anything is, beside what other processes have written meanwhile.

        A process that writes at the same time may win: what is lost is parsed once more."""
        if self._path is None or not self._new or not make_private(self._path.parent, levels=2):
            return
        self._new = False
        # read again: another process may have written since this one began
        both = self._load() | self._asked
        told = json.dumps(self._asked if len(both) > MOST_ENTRIES else both).encode()
        # a name of this process' own, then renamed: two that save at once do not write into each other
        draft = self._path.with_name(f"{self._path.name}-{os.getpid()}")
        try:
            draft.unlink(missing_ok=True)
            descriptor = os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
            with os.fdopen(descriptor, "wb") as file:
                # no fsync: what a power cut leaves of it fails its seal, and is parsed again
                file.write(_seal(told) + told)
            draft.replace(self._path)  # readers find the old one or the new one, whole
        except OSError:  # a full disk, for one: parsed again by the next process, that is all
            draft.unlink(missing_ok=True)

    def _load(self) -> dict[str, Meaning]:
        """What is on the disk; nothing if it is damaged, or if anybody else may have written it."""
        if self._path is None or not is_own(self._path):
            return {}
        if not all(is_own(folder, folder=True) for folder in list(self._path.parents)[:2]):
            return {}
        try:
            seal, newline, told = self._path.read_bytes().partition(b"\n")
        except OSError:
            return {}
        if seal + newline != _seal(told):
            return {}
        return {key: (tree, tuple(imports)) for key, (tree, imports) in json.loads(told).items()}


def _seal(told: bytes) -> bytes:
    """First line of the file. It makes damage known; who may write is not for the seal to say."""
    return hashlib.sha256(told).hexdigest().encode() + b"\n"


@cache
def source_memo(folder: Path | None) -> SourceMemo:
    """The memo in `folder`: one for each version of Python and of the modules that make and read it."""
    own = [Path(__file__), Path(__file__).with_name("compile_key.py")]
    return SourceMemo(
        folder, f"{sys.version} {[hashlib.sha256(path.read_bytes()).hexdigest() for path in own]}"
    )
