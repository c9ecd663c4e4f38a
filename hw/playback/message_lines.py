"""Lines of a program's messages with values in them: `[12345] pos=1.2 iq=0.5` of a printf,
`2026-11-28 15:02:11,123 - rig - INFO - q=1.25 tau=0.5` of a logger."""

from __future__ import annotations

import re
from collections import Counter

from hw.playback.text_rows import LABELLED, MONITORED

STAMP = "stamp"
"""Name of the number or the time of day that each line begins with."""

MOST_OTHERS = 0.3
"""Share of the first lines that may be of something else: what a board says when it starts."""

_BEGINS = re.compile(
    r"\W*((?:\d{4}-\d\d-\d\d[T ])?\d{1,2}:\d\d:\d\d(?:[.,]\d+)?|\d+(?:\.\d+)?)(?![\w.:]|\s*=)"
)


def of_messages(lines: list[str]) -> list[str]:
    """Lines of messages that are alike but for their values, as a table below one line of the names; lines
    without any of these names are left out."""
    first = [_taken_apart(line) for line in lines[:MONITORED] if line.strip()]
    if not first:
        return lines
    (usual, often), *_ = Counter((names, words, bool(stamp)) for stamp, names, _, words in first).most_common(
        1
    )
    names, words, stamped = usual
    # neither stamp nor words: a table whose cells have names; a number that nobody named: one of other cells
    if not names or not (words or stamped) or any(map(str.isdigit, words)):
        return lines
    if often < (1 - MOST_OTHERS) * len(first):
        return lines
    rows = [",".join((*([STAMP] if stamped else ()), *names))]
    for line in lines:
        stamp, own, values, between = _taken_apart(line)
        if (own, between, bool(stamp)) == usual:
            rows.append(",".join((*([stamp] if stamped else ()), *values)))
        elif set(own) & set(names):
            rows.append(line.replace(",", " "))  # one that was cut off: it keeps its place, and is told
    return rows


def _taken_apart(line: str) -> tuple[str, tuple[str, ...], tuple[str, ...], str]:
    """What a line begins with, its names and their values, and the words between them."""
    begins = _BEGINS.match(line)
    rest = line[begins.end() :] if begins else line
    found = LABELLED.findall(rest)
    words = re.sub(r"\W+", " ", LABELLED.sub("", rest)).strip()
    stamp = begins[1].replace(",", ".") if begins else ""
    return stamp, tuple(name for name, _ in found), tuple(value for _, value in found), words
