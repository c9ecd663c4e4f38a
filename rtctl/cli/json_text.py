"""What every `--json` prints: one encoder, so that a row of any kind ends as JSON that any reader takes."""

from __future__ import annotations

import json

from rtctl.cli.invocation import as_run
from rtctl.plain_data import Plain, as_data


def json_text(value: object, indent: int | None = None) -> str:
    """`value` as JSON on one line, or indented. A command in any of its texts is one that runs here, as on a
    terminal."""
    # allow_nan: NaN is no JSON, and many readers stop at it; `as_data` has made it null before
    return json.dumps(_as_run(as_data(value)), indent=indent, allow_nan=False)


def _as_run(value: Plain) -> Plain:
    if isinstance(value, str):
        return as_run(value)
    if isinstance(value, dict):
        return {key: _as_run(item) for key, item in value.items()}
    return [_as_run(item) for item in value] if isinstance(value, list) else value
