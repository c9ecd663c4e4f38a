"""The page of a report: HTML without script, network or external font."""

from __future__ import annotations

import base64
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

from hw.motion import words
from rtctl.friction.gain import AxisGain, Gains, told
from rtctl.friction.learn import hold_out, report_sentences, report_tables
from rtctl.friction.learn.report_evidence import EXTRA_COLUMNS, Evidence
from rtctl.friction.learn.report_tables import Table

_STYLE = """body{font:15px/1.5 sans-serif;max-width:66em;margin:2em auto;padding:0 1em;color:#222}
figure{margin:1.5em 0}img{max-width:100%}\
figcaption,caption{color:#555;font-size:.9em;text-align:left;padding:.4em 0}
table{border-collapse:collapse;margin:1.2em 0;font-size:.85em}\
th,td{border-bottom:1px solid #ddd;padding:.2em .7em}
pre{background:#f8f8f8;padding:.7em 1em;overflow-x:auto}th{text-align:left;background:#f4f4f4}\
td{font-variant-numeric:tabular-nums}.key{background:#eef5ff;padding:.7em 1em}"""

_IMAGE = re.compile(r'(src="data:[^"]*")')

_NO_NETWORK = (
    '<meta http-equiv="Content-Security-Policy" '
    "content=\"default-src 'none'; img-src data:; style-src 'unsafe-inline'\">"
)
"""The browser itself refuses every request: a report may be opened anywhere."""


@dataclass(frozen=True)
class Picture:
    """One figure: file name without ending, caption, PNG bytes."""

    name: str
    caption: str
    png: bytes


def page(evidence: Evidence, gains: Gains, document: Mapping[str, Any], pictures: Sequence[Picture]) -> str:
    """HTML of the whole report: one page, figures inline, everything escaped."""
    title = f"Friction of rig {evidence.model.rig}"
    by_name = {picture.name: figure(picture) for picture in pictures}
    curves = [html for name, html in by_name.items() if name.startswith("curve_")]
    residuals = [html for name, html in by_name.items() if name.startswith("residuals_")]
    shown = [picture.name.removeprefix("curve_") for picture in pictures if picture.name.startswith("curve_")]
    vectors = [
        table_of(report_tables.support_vectors(name, evidence.of(name), evidence.points.motion))
        for name in shown
        # a formula has none to list
        if any(len(one.limit) for one in evidence.of(name))
    ]
    parts = [
        f"<h1>{escape(title)}</h1>",
        _paragraph(" ".join(report_sentences.headline(evidence))),
        "<h2>Recommended compensation</h2>",
        _gain(gains),
        "<h2>Learned curves</h2>",
        *curves,
        "<h2>Errors</h2>",
        table_of(report_tables.overall(evidence)),
        table_of(report_tables.errors(evidence)),
        "<h2>Ladder of models</h2>",
        by_name["ladder"],
        _paragraph(hold_out.describe(evidence.points, evidence.folds)),
        table_of(report_tables.ladder(evidence)),
        "<h2>Residuals</h2>",
        *residuals,
        _absent(evidence),
        "<h2>The model as the loop evaluates it</h2>",
        table_of(report_tables.model(evidence)),
        "<h2>Support vectors</h2>",
        *vectors,
        "<h2>Provenance</h2>",
        table_of(Table("Where this comes from.", ("what", "value"), _flat(document["provenance"]))),
    ]
    head = f'<meta charset="utf-8">{_NO_NETWORK}<title>{escape(title)}</title><style>{_STYLE}</style>'
    body = "\n".join(part for part in parts if part)
    whole = f'<!DOCTYPE html>\n<html lang="en"><head>{head}</head><body>\n{body}\n</body></html>\n'
    pieces = _IMAGE.split(whole)  # the bytes of a picture are no words
    return "".join(
        piece if _IMAGE.fullmatch(piece) else words(piece, evidence.points.motion) for piece in pieces
    )


def _gain(gains: Gains) -> str:
    model = (
        f"Of the model alone: a gain (kappa) up to {told(gains.gain_model)} of the whole curve stays below "
        "the true friction, as far as its known errors tell. The least dry friction is "
        f"{gains.friction_min_nm:.4g} N m."
    )
    if not gains.axes:
        missing = (
            " This leaves nothing for the coupling: period, coupling and encoder are in the rig file, "
            "which was not given. Fit again with --config RIG.toml for the two-line test."
        )
        return _paragraph(model + missing)
    words = []
    for axis in gains.axes:
        if axis.margin_at_zero_nm < 0:
            words.append(
                f"Axis {axis.axis}: the two-line test fails by {-axis.margin_at_zero_nm:.4g} N m without any "
                "compensation; lower the coupling's stiffness or damping, or use a finer encoder."
            )
        else:
            words.append(
                f"Axis {axis.axis}: gain up to {told(axis.gain)}, with the feed-forward capped at "
                f"{axis.cap_nm:.4g} N m (gain times the least dry friction; cap_share = "
                f"{axis.cap_share:.4g} in the rig file). {_left_at(axis)}"
            )
    passing = [axis for axis in gains.axes if axis.margin_at_zero_nm >= 0]
    paste = "".join(f"<pre>{escape(axis.snippet('MODEL.json'))}</pre>" for axis in passing)
    table = table_of(report_tables.gains(gains))
    return _paragraph(" ".join(words)) + paste + table + f"<p>{escape(model)}</p>"


def _left_at(axis: AxisGain) -> str:
    """What the test has left at the recommended gain."""
    # 1 is not where the test ends, but where there is no friction left to take out
    if axis.gain >= 1.0:
        return f"The test would bear all of the friction taken out, with {axis.margin_nm:.4g} N m to spare."
    return "At that gain the test has nothing left: stay below it."


def _absent(evidence: Evidence) -> str:
    missing = [name for name in EXTRA_COLUMNS if name not in evidence.extra]
    if not missing:
        return ""
    said = (
        f"No residuals against {' and '.join(name.split('_')[0] for name in missing)}: the points have no "
        "column "
    )
    return f"<p>{escape(said + ' or '.join(missing))}.</p>"


def _flat(values: Mapping[str, Any], prefix: str = "") -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    for name, value in values.items():
        if isinstance(value, Mapping):
            rows += _flat(value, f"{prefix}{name}.")
        else:
            rows.append((prefix + name, "-" if value is None else str(value)))
    return rows


def _paragraph(text: str) -> str:
    return f'<p class="key">{escape(text)}</p>'


def figure(picture: Picture) -> str:
    """A picture with its caption, whole in the page."""
    data, caption = base64.b64encode(picture.png).decode(), escape(picture.caption)
    image = f'<img src="data:image/png;base64,{data}" alt="{caption}">'
    return f"<figure>{image}<figcaption>{caption}</figcaption></figure>"


def table_of(table: Table) -> str:
    """A table with its caption."""
    return f"<table><caption>{escape(table.caption)}</caption>\n{rows_of(table)}\n</table>"


def rows_of(table: Table) -> str:
    """Header and rows of a table."""

    def row(cells: Sequence[str], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{escape(cell)}</{tag}>" for cell in cells) + "</tr>"

    return "\n".join([row(table.header, "th"), *(row(cells, "td") for cells in table.rows)])
