"""The evidence page: every rung of the ladder on every set of data, judged by what it never saw."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rtctl.friction.kind_table import FORMULAS, is_machine
from rtctl.friction.learn import hold_out, ladder, nested
from rtctl.friction.learn.grids import noise_nm
from rtctl.friction.learn.report_evidence import interval_nm
from rtctl.friction.learn.report_sentences import AGREES, formula_or_machine, mnm
from rtctl.friction.learn.selection import Rung
from rtctl.friction.points import FrictionPoints

NEAR = 1.1
"""Error over the least one, up to which a rung is called as good as the best."""


COVERS = (0.90, 0.99)
"""Share of what was held out that a band of 95 % is to hold."""


@dataclass(frozen=True)
class Line:
    """One rung: held-out RMSE with its 95 % interval, and the nested one, N m; None where there is none.
    `refused` says why.

    `covered` is the share of what was held out that lies in the band of the fit without it, 0 to 1; None: no
    band."""

    family: str
    held_out_nm: float | None
    low_nm: float
    high_nm: float
    terms: str
    nested_nm: float | None
    nested_se_nm: float
    refused: str
    covered: float | None = None


@dataclass(frozen=True)
class Found:
    """One set. Errors in N m; `friction_nm` is the RMS of what was measured, `floor_nm` the scatter of points
    about a smooth curve of their own.

    `chosen_nm` is the nested error of whatever the ladder chose each time, `chosen_held_out_nm` what it then
    held out, `chosen_covered` the share of it that lay in the band."""

    name: str
    source: str
    points: int
    way: str
    units: int
    friction_nm: float
    floor_nm: float
    chosen: str
    chosen_nm: float
    chosen_held_out_nm: float
    lines: tuple[Line, ...]
    notes: tuple[str, ...]
    chosen_covered: float | None = None

    @property
    def judged(self) -> list[Line]:
        """Rungs that are not refused and could be learned without each fold."""
        return [line for line in self.lines if line.nested_nm is not None and not line.refused]

    @property
    def least_nm(self) -> float:
        """Least nested error of a rung."""
        return min(line.nested_nm for line in self.judged if line.nested_nm is not None)


def judge_set(
    name: str, source: str, points: FrictionPoints, notes: Sequence[str], options: ladder.Options
) -> Found:
    """Climb the ladder on all points, and once more without each fold (`nested`).

    Raises
    ------
    DataError
        Nothing can be learned."""
    whole = ladder.ascend(points, options)
    without = nested.generalisation(points, options, every_rung=True)
    # each direction by itself: where they differ, neighbours of both would scatter by it
    noise = [noise_nm(*points.branch(direction)) for direction in (1, -1)]
    return Found(
        name=name,
        source=source,
        points=sum(len(points.rows_of(direction)) for direction in (1, -1)),
        way=options.folds,
        units=len(np.unique(hold_out.units_of(points, options.folds))),
        friction_nm=float(np.sqrt(np.mean(points.friction_nm**2))),
        floor_nm=float(np.sqrt(np.mean(np.square(noise)))),
        chosen=whole.choice.chosen.family,
        chosen_nm=without.rmse_nm,
        chosen_held_out_nm=without.held_out_nm,
        chosen_covered=without.covered.get(nested.CHOSEN),
        lines=tuple(_line(rung, without) for rung in whole.choice.rungs),
        notes=tuple(dict.fromkeys(_without_files(note) for note in notes)),
    )


def _without_files(note: str) -> str:
    """A warning without the names of the files it is about, which several share."""
    return re.sub(r"^(\S+\.\w+,? )*\S+\.\w+: ", "", note)


def _line(rung: Rung, without: nested.Generalisation) -> Line:
    low, high = (0.0, 0.0) if rung.refused else interval_nm(rung)
    nested_nm, se_nm = without.of_rungs.get(rung.family) or (None, 0.0)
    terms = " + ".join(f"{score.n_terms:.0f}" for score in rung.scores)
    held_out = None if rung.refused else rung.rmse_nm
    return Line(
        rung.family,
        held_out,
        low,
        high,
        terms,
        nested_nm,
        se_nm,
        rung.refused or "",
        without.covered.get(rung.family),
    )


def page(found: Sequence[Found], command: str) -> str:
    """Text of the page (Markdown); `command` is what makes it."""
    parts = [
        "# Evidence: which model errs how much, on which data",
        f"This page is made by `{command}`; change nothing here by hand. The data are described in "
        "[evidence.toml](evidence.toml); recordings are not in the repository.",
        "## In short",
        _short(found),
        _figures(found),
        "## How to read it",
        _HOW,
        *(text for one in found for text in _of_set(one)),
    ]
    return "\n\n".join(parts) + "\n"


_HOW = f"""- **Held out** is the RMS error of the ladder's own cross-validation, with its 95 % interval \
(docs/ladder.md): by blocks, of few
  blocks Student's t. It is the least of many, so it is a little too small.
- **Without it** is the generalisation error: everything is chosen and learned anew without each fold (a \
whole session where there are several), and
  judged by that fold. Verdicts stand on it: up to {NEAR:g} times the least is as good. The sentence above a \
table asks of the best formula only
  whether it is within one standard error of the best machine.
- **In the band** is how much of what was held out lies in the 95 % band of the fit without it \
(docs/friction.md); 90 to 99 % is as it should be.
- **The floor** is the scatter of the points about a smooth curve of their own: but for luck no model of \
speed errs less on what
  it did not see. (*Held out*, the least of many, may.)
- **Refused** is what the points cannot tell, or what cannot be compiled, on all points; a dash in *without \
it*: without some fold."""


def _short(found: Sequence[Found]) -> str:
    """Formulas first: where a formula is as good, nobody needs a machine."""
    said = []
    for who in ("formula", "machine", ""):
        for one in found:
            winner, words = formula_or_machine(_rows(one))
            if winner == who:
                said.append(
                    f"- **{one.name}**: {words or 'formulas alone, or machines alone, could be judged.'} "
                    f"{_agreement(one)}"
                )
    return "\n".join(said)


def _figures(found: Sequence[Found]) -> str:
    """What is wanted on every set, and what is there; out of it is told."""
    rows = [
        f"| set | error on what was not seen over held out, {1 / AGREES:.2f} to {AGREES:g} | chosen over the "
        f"best rung, at most {NEAR:g} | in the band, 90 to 99 % | out of it |",
        "|---|---|---|---|---|",
    ]
    for one in found:
        times, share = one.chosen_nm / one.chosen_held_out_nm, one.chosen_nm / one.least_nm
        covered = one.chosen_covered
        met = {
            "error foretold": 1 / AGREES <= times <= AGREES,
            "choice": share <= NEAR,
            # too much is out, too: a band that holds all is wider than it says
            "band": covered is not None and COVERS[0] <= covered <= COVERS[1],
        }
        inside = "-" if covered is None else f"{100 * covered:.1f}"
        out = ", ".join(name for name, holds in met.items() if not holds) or "nothing"
        rows.append(f"| {one.name} | {times:.2f} | {share:.2f} | {inside} | {out} |")
    return "\n".join(rows)


def _rows(one: Found) -> list[dict[str, float | str]]:
    return [
        {"family": line.family, "prediction_rmse_nm": line.nested_nm, "prediction_se_nm": line.nested_se_nm}
        for line in one.judged
        if line.nested_nm is not None
    ]


def _agreement(one: Found) -> str:
    """Whether held-out errors said what came, and whether the choice was the best."""
    times, share = one.chosen_nm / one.chosen_held_out_nm, one.chosen_nm / one.least_nm
    told = (
        "as its held-out error said"
        if 1 / AGREES <= times <= AGREES
        else "which its held-out error did not say"
    )
    best = "as good as the best rung" if share <= NEAR else f"{share:.2f} times the best rung"
    return (
        f"What the ladder chooses errs {mnm(one.chosen_nm)} mN m on what it did not see, {told} "
        f"({mnm(one.chosen_held_out_nm)} mN m; {times:.2f} times), and is {best}. {_in_band(one)}"
    )


def _in_band(one: Found) -> str:
    """What the band of the choice was worth on what it never saw."""
    if one.chosen_covered is None:
        return "It has no band."
    return f"Its 95 % band holds {100 * one.chosen_covered:.1f} % of that."


def _of_set(one: Found) -> list[str]:
    words = formula_or_machine(_rows(one))[1]
    rows = [
        "| model | held out, mN m | 95 % interval | without it, mN m | numbers | verdict | in the band, % |",
        "|---|---|---|---|---|---|---|",
    ]
    rows += [_cells(line, one) for line in one.lines]
    what = f"{one.units} {hold_out.HELD_OUT[one.way]}"
    return [
        f"## {one.name[:1].upper()}{one.name[1:]}",
        *([f"**{words[:1].upper()}{words[1:]}**"] if words else []),
        f"{one.source}.",
        f"{one.points} points, {what}; friction {mnm(one.friction_nm)} mN m RMS, floor "
        f"{mnm(one.floor_nm)} mN m. {_agreement(one)}",
        "\n".join(rows),
        *(["Told of the data:\n\n" + "\n".join(f"- {note}" for note in one.notes)] if one.notes else []),
    ]


def _cells(line: Line, one: Found) -> str:
    if line.held_out_nm is None:
        return f"| `{line.family}` | - | - | - | - | refused: {line.refused} | - |"
    span = f"{mnm(line.low_nm)} to {mnm(line.high_nm)}"
    nested_nm = "-" if line.nested_nm is None else mnm(line.nested_nm)
    covered = "-" if line.covered is None else f"{100 * line.covered:.1f}"
    return (
        f"| `{line.family}` | {mnm(line.held_out_nm)} | {span} | {nested_nm} | {line.terms} | "
        f"{_verdict(line, one)} | {covered} |"
    )


def _verdict(line: Line, one: Found) -> str:
    chosen = "chosen; " if line.family == one.chosen else ""
    if line.nested_nm is None:
        return chosen + "cannot be told without some fold"
    times = line.nested_nm / one.least_nm
    chosen += "at the floor; " if line.nested_nm <= NEAR * one.floor_nm else ""
    # exactly: the least is one of these very numbers
    if line.nested_nm == one.least_nm:
        return f"{chosen}the least error{_by(line.family)}"
    return chosen + ("as good as the best" if times <= NEAR else f"{times:.2g} times the best")


def _by(family: str) -> str:
    """Who has the least error; of the mean its own name says it."""
    if family in FORMULAS:
        return ", by a formula"
    return ", by a machine" if is_machine(family) else ""
