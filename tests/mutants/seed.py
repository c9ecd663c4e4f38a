"""One seeded bug: what somebody could get wrong, as a replacement of one piece of text."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Seed:
    """`old` stands exactly once in `file`; with `new` in its place one of `tests` must fail."""

    what: str
    file: str
    old: str
    new: str
    tests: tuple[str, ...]

    def spoilt(self, root: Path) -> str:
        """The file's text with the bug in it. Raises ValueError when the patch no longer applies."""
        text = (root / self.file).read_text()
        if text.count(self.old) != 1:
            raise ValueError(f"{self.file}: the seeded bug '{self.what}' no longer applies: {self.old!r}")
        return text.replace(self.old, self.new)
