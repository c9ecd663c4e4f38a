"""What every `--json` prints: one encoder, so that a row of any kind ends as JSON that any reader takes."""

from __future__ import annotations

import json
import sys
from typing import NoReturn

import click

from rtctl.cli.invocation import as_run
from rtctl.errors import RtctlError
from rtctl.plain_data import Plain, as_data


def json_text(value: object, indent: int | None = None) -> str:
    """`value` as JSON on one line, or indented. A command in any of its texts is one that runs here, as on a
    terminal."""
    # allow_nan: NaN is no JSON, and many readers stop at it; `as_data` has made it null before
    return json.dumps(_as_run(as_data(value)), indent=indent, allow_nan=False)


def end_with(body: object, ended: type[RtctlError] | int, indent: int | None = None) -> NoReturn:
    """End the command with its one object on standard output.

    `ended` is a class of errors, or an exit code that no error has (0, 1: the answer is no, 130: Ctrl-C).
    Unless it is 0 the object says it too, as that of an error does: `exit_code`, and `error`."""
    code = ended if isinstance(ended, int) else ended.exit_code
    if code and isinstance(body, dict):
        body = {**body, **({} if isinstance(ended, int) else {"error": ended.__name__}), "exit_code": code}
    click.echo(json_text(body, indent))
    sys.exit(code)


def _as_run(value: Plain) -> Plain:
    if isinstance(value, str):
        return as_run(value)
    if isinstance(value, dict):
        return {key: _as_run(item) for key, item in value.items()}
    return [_as_run(item) for item in value] if isinstance(value, list) else value
