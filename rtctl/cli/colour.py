"""Colour, where a person wants it (https://no-color.org)."""

from __future__ import annotations

import os

import click


def coloured(text: str, colour: str) -> str:
    """`text` in a colour, unless NO_COLOR is set; click takes it out again where nobody looks at a
    terminal."""
    return text if os.environ.get("NO_COLOR") else click.style(text, fg=colour)
