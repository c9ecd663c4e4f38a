"""The evidence page: every rung of the ladder on every set of data, judged by what it never saw."""

from __future__ import annotations

from collections.abc import Sequence

from rtctl.friction.kind_table import FORMULAS, is_machine
from rtctl.friction.learn import hold_out
from rtctl.friction.learn.over_best import OverBest
from rtctl.friction.learn.report_evidence_sets import Found, Line
from rtctl.friction.learn.report_sentences import AGREES, formula_or_machine, mnm

NEAR = 1.1
"""Error over the least one, up to which a rung is called as good as the best."""


COVERS = (0.90, 0.99)
"""Share of what was held out that a band of 95 % is to hold."""


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
- **Next sessions** are whole logs that the fit has not seen. Nothing within *the same \
session* knows
  what the next one differs by. *As told* counts sessions in the range that `rtctl fit` prints for eight \
of ten. One number cannot
  be within {AGREES:g} of each: an oracle is of two in three (decision 0145).
- **Chosen over the best rung** has its 95 % interval, point by point and by blocks. The best of a dozen is \
the best partly by luck;
  *that of the other points* has none: without each block in turn (session, speed) the rung that is best \
on the others is judged by it.
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
        "| set | what was not seen | error on it over held out, "
        f"{1 / AGREES:.2f} to {AGREES:g} | each session within {AGREES:g} of what was expected, as told | "
        f"chosen over the best rung, at most {NEAR:g} | over that of the other points | in the band, 90 to "
        "99 % | out of it |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for one in found:
        times, over, covered = one.chosen_nm / one.chosen_held_out_nm, one.over_best, one.chosen_covered
        met = {
            "error foretold": 1 / AGREES <= times <= AGREES,
            # what its own interval reaches down to is out, and not surely
            "choice, not surely" if over.low <= NEAR else "choice": over.times <= NEAR,
            # too much is out, too: a band that holds all is wider than it says
            "band": covered is not None and COVERS[0] <= covered <= COVERS[1],
        }
        inside = "-" if covered is None else f"{100 * covered:.1f}"
        out = ", ".join(name for name, holds in met.items() if not holds) or "nothing"
        rows.append(
            f"| {one.name} | {_unseen(one)} | {times:.2f} | {_one_by_one(one)} | {_over(over)} | "
            f"{over.by_others:.2f} | {inside} | {out} |"
        )
    return "\n".join(rows)


def _unseen(one: Found) -> str:
    """What each fit has not seen: nothing within a session knows what the next one differs by."""
    return "next sessions" if one.way == "log" else f"{hold_out.HELD_OUT[one.way]} of the same session"


def _one_by_one(one: Found) -> str:
    """How many sessions erred what was expected of them, and lay in the range that was told."""
    if not one.sessions:
        return "-"
    alike = sum(1 / AGREES <= at.came_nm / at.expected_nm <= AGREES for at in one.sessions)
    told = sum(
        at.between_nm is not None and at.between_nm[0] <= at.came_nm <= at.between_nm[1]
        for at in one.sessions
    )
    return f"{alike} of {len(one.sessions)}, {told}"


def _over(over: OverBest) -> str:
    return f"{over.times:.2f} ({over.low:.2f} to {over.high:.2f})"


def _rows(one: Found) -> list[dict[str, float | str]]:
    return [
        {"family": line.family, "prediction_rmse_nm": line.nested_nm, "prediction_se_nm": line.nested_se_nm}
        for line in one.judged
        if line.nested_nm is not None
    ]


def _agreement(one: Found) -> str:
    """Whether held-out errors said what came, and whether the choice was the best."""
    times, over = one.chosen_nm / one.chosen_held_out_nm, one.over_best
    told = (
        "as its held-out error said"
        if 1 / AGREES <= times <= AGREES
        else "which its held-out error did not say"
    )
    best = "as good as the best rung" if over.times <= NEAR else f"{_over(over)} times the best rung"
    return (
        f"What the ladder chooses errs {mnm(one.chosen_nm)} mN m on what it did not see ({_unseen(one)}), "
        f"{told} ({mnm(one.chosen_held_out_nm)} mN m; {times:.2f} times), and is {best}. {_in_band(one)}"
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
