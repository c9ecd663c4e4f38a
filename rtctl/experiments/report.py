"""A report: parts of a page, what must be reached, and numbers for scripts. HTML without script or network.

report.html    the page, figures inline
*.png          the same figures
report.json    the same numbers, SI units"""

from __future__ import annotations

import json
import platform
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from html import escape
from pathlib import Path
from typing import Any, cast

from hw.motion import named, words
from rtctl import __version__
from rtctl.experiments.statistics import Estimate
from rtctl.friction.learn.report_page import Picture, figure, rows_of, table_of
from rtctl.friction.learn.report_tables import Table
from rtctl.plain_data import as_data
from rtctl.whole_files import write_together

KIND = "rtctl experiment report"
PAGE = "report.html"
HEADER = "report.json"
LONG_TABLE = 32
"""Rows from which on a table is folded: a click opens it."""

_STYLE = """body{font:15px/1.5 sans-serif;max-width:66em;margin:2em auto;padding:0 1em;color:#222}
figure{margin:1.5em 0}img{max-width:100%}
figcaption,caption{color:#555;font-size:.9em;text-align:left;padding:.4em 0}
summary{color:#555;font-size:.9em;padding:.4em 0;cursor:pointer}
table{border-collapse:collapse;margin:1.2em 0;font-size:.85em;min-width:38em}
th,td{border-bottom:1px solid #ddd;padding:.2em .7em}
th{text-align:left;background:#f4f4f4}td{font-variant-numeric:tabular-nums}
.key{background:#eef5ff;padding:.7em 1em}
h1.part{margin-top:3em;border-top:3px solid #ddd;padding-top:1em}
.no{color:#a00;font-weight:bold}.yes{color:#070}
nav a{margin-right:1em}"""

_NO_NETWORK = (
    '<meta http-equiv="Content-Security-Policy" '
    "content=\"default-src 'none'; img-src data:; style-src 'unsafe-inline'\">"
)


@dataclass(frozen=True)
class Part:
    """One section: heading, paragraphs, then figures and tables in order."""

    heading: str
    paragraphs: tuple[str, ...] = ()
    shown: tuple[Table | Picture, ...] = ()


@dataclass(frozen=True)
class Target:
    """A figure that has to be reached. `measured` and `least` have the same unit.

    More is better, unless `at_most`: then `least` is the most that is allowed."""

    text: str
    measured: Estimate
    least: float
    unit: str = "%"
    scale: float = 100.0
    at_most: bool = False

    @property
    def reached(self) -> bool:
        """True when the mean is on the right side of the figure asked for. NaN does not reach anything."""
        # the mean and not its interval: a target is a figure that was asked for, the table shows the doubt
        return self.measured.mean <= self.least if self.at_most else self.measured.mean >= self.least

    def cells(self) -> tuple[str, ...]:
        """One row of the table of targets."""
        # NaN is told as one, and is not reached
        short = self.scale * abs(self.least - self.measured.mean)
        side = "too much" if self.at_most else "short"
        verdict = "reached" if self.reached else f"NOT reached: {short:.2g} {self.unit} {side}"
        bound = f"{'at most' if self.at_most else 'at least'} {self.scale * self.least:g} {self.unit}"
        return (self.text, bound.rstrip(), f"{self.measured.text(self.scale)} {self.unit}".rstrip(), verdict)


@dataclass(frozen=True)
class Outcome:
    """What one experiment found. `key` says it in a paragraph; `numbers` is for scripts, SI units."""

    name: str
    title: str
    key: str
    parts: tuple[Part, ...]
    targets: tuple[Target, ...] = ()
    numbers: Mapping[str, Any] = field(default_factory=dict)
    files: Mapping[str, bytes] = field(default_factory=dict)
    written: Callable[[], None] = lambda: None
    """Called once the report is on disk."""

    def pictures(self) -> list[Picture]:
        """Every figure of the outcome."""
        return [one for part in self.parts for one in part.shown if isinstance(one, Picture)]


def reworded(outcome: Outcome, say: Callable[[str], str]) -> Outcome:
    """The same outcome with every text through `say`, the keys of its numbers too."""

    def shown(one: Table | Picture) -> Table | Picture:
        # what is drawn in it was worded as it was drawn (`figures.png`)
        if isinstance(one, Picture):
            return replace(one, caption=say(one.caption))
        rows = tuple(tuple(say(cell) for cell in row) for row in one.rows)  # names of rows are in them
        return Table(say(one.caption), tuple(map(say, one.header)), rows)

    parts = tuple(
        # headings and paragraphs, too: they name units and torques as tables do
        Part(say(one.heading), tuple(map(say, one.paragraphs)), tuple(map(shown, one.shown)))
        for one in outcome.parts
    )
    targets = tuple(replace(one, text=say(one.text), unit=say(one.unit)) for one in outcome.targets)
    return replace(
        outcome, key=say(outcome.key), parts=parts, targets=targets, numbers=_with_keys(outcome.numbers, say)
    )


def in_units_of(outcome: Outcome, motion: str) -> Outcome:
    """The same outcome in the units of this motion; it is written for a rotary axis (`hw.motion.words`,
    `named`)."""
    # the same object: nothing is to be said otherwise
    if motion == "rotary":
        return outcome
    own = replace(outcome, numbers=cast("Mapping[str, Any]", named(as_data(outcome.numbers), motion)))
    return reworded(own, lambda text: words(text, motion))


def _with_keys(numbers: Mapping[str, Any], say: Callable[[str], str]) -> dict[str, Any]:
    return {
        say(str(key)): _with_keys(value, say) if isinstance(value, Mapping) else value
        for key, value in numbers.items()
    }


def write(folder: Path, outcomes: Sequence[Outcome], title: str, facts: Mapping[str, str]) -> Path:
    """Write one page of all outcomes into `folder`; returns the page.

    Raises
    ------
    DataError
        The folder cannot be written; nothing is left behind then."""
    # UTC: pages of two machines are put in order
    now = datetime.now(UTC).isoformat(timespec="seconds")
    facts = {**facts, "date": now, "rtctl": __version__, "python": platform.python_version()}
    # all in memory first: a page whose pictures could not be written is none
    files: dict[str, bytes] = {}
    for outcome in outcomes:
        files |= {f"{picture.name}.png": picture.png for picture in outcome.pictures()}
        files |= outcome.files
    document = {
        "kind": KIND,
        "schema": 1,
        "title": title,
        "provenance": facts,
        "experiments": {outcome.name: document_of(outcome) for outcome in outcomes},
    }
    # the page last: who sees it finds all that it names (`write_together` keeps the order)
    files[HEADER] = (json.dumps(as_data(document), indent=1, allow_nan=False) + "\n").encode()
    files[PAGE] = _page(outcomes, title, facts).encode()
    write_together(folder, files)
    for outcome in outcomes:
        outcome.written()  # only now: what was kept for a restart is not needed any more
    return folder / PAGE


def document_of(outcome: Outcome) -> dict[str, Any]:
    """Numbers of one experiment for scripts."""
    targets = [
        {
            "text": t.text,
            # under its own name: a script that reads the wrong one finds none
            "most" if t.at_most else "least": t.least,
            "measured": t.measured.as_dict(),
            "reached": t.reached,
        }
        for t in outcome.targets
    ]
    return {"title": outcome.title, "conclusion": outcome.key, "targets": targets, **outcome.numbers}


def _page(outcomes: Sequence[Outcome], title: str, facts: Mapping[str, str]) -> str:
    parts = [f"<h1>{escape(title)}</h1>"]
    if len(outcomes) > 1:
        links = "".join(f'<a href="#{one.name}">{escape(one.title)}</a>' for one in outcomes)
        parts.append(f"<nav>{links}</nav>")
    # of all experiments together, first of all: that is what a reader looks for
    targets = [(one, target) for one in outcomes for target in one.targets]
    if targets:
        parts += ["<h2>Figures asked for</h2>", _targets([target for _, target in targets])]
    for one in outcomes:
        if len(outcomes) > 1:
            parts.append(f'<h1 class="part" id="{one.name}">{escape(one.title)}</h1>')
        parts.append(f'<p class="key">{escape(one.key)}</p>')
        for part in one.parts:
            parts.append(f"<h2>{escape(part.heading)}</h2>")
            parts += [f"<p>{escape(text)}</p>" for text in part.paragraphs]
            parts += [figure(x) if isinstance(x, Picture) else _table(x) for x in part.shown]
    rows = tuple((name, value) for name, value in facts.items())
    parts += ["<h2>Provenance</h2>", _table(Table("Where this comes from.", ("what", "value"), rows))]
    head = f'<meta charset="utf-8">{_NO_NETWORK}<title>{escape(title)}</title><style>{_STYLE}</style>'
    body = "\n".join(parts)
    return f'<!DOCTYPE html>\n<html lang="en"><head>{head}</head><body>\n{body}\n</body></html>\n'


def _targets(targets: Sequence[Target]) -> str:
    # coloured below, by the words of the verdict: a table of text has no colours
    html = _table(
        Table(
            "Mean over seeds with its 95 % confidence interval against the figure asked for.",
            ("what", "asked for", "measured", "verdict"),
            tuple(target.cells() for target in targets),
        )
    )
    # in escaped text: no target's own words can hold a tag
    html = html.replace("<td>reached</td>", '<td class="yes">reached</td>')
    return html.replace("<td>NOT reached", '<td class="no">NOT reached')


def _table(table: Table) -> str:
    # with the rows in view where that is no long way
    if len(table.rows) <= LONG_TABLE:
        return table_of(table)
    summary = f"{escape(table.caption)} ({len(table.rows)} rows)"
    return f"<details><summary>{summary}</summary>\n<table>\n{rows_of(table)}\n</table>\n</details>"
