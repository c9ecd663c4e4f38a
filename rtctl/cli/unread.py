"""Options that a command would not read: refused, since a person who gives one believes that it counts."""

from __future__ import annotations

from collections.abc import Collection

import click
from click.core import ParameterSource


def refuse_unread(unread: Collection[str], why: str) -> None:
    """Raise UsageError for an option that was given and is among the parameters `unread`.

    `why` goes on after its name: "counts with --still alone"."""
    context = click.get_current_context()
    for one in context.command.params:
        name = one.name or ""
        # the command line alone: a default, or a variable of the environment, was not meant for this call
        if name in unread and context.get_parameter_source(name) is ParameterSource.COMMANDLINE:
            raise click.UsageError(f"{one.opts[0]} {why}")
