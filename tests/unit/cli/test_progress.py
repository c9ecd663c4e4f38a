"""A bar of a command that is mostly quick: on a terminal, and gone when it ends, however it ends."""

import contextlib
import sys

import pytest

from rtctl.cli.progress import on_a_terminal


@pytest.mark.parametrize(("live", "quiet"), [(True, False), (True, True), (False, False)])
def test_it_is_drawn_on_a_terminal_alone_and_leaves_no_line(monkeypatch, capsys, live, quiet):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: live, raising=False)
    with contextlib.suppress(ValueError), on_a_terminal(quiet=quiet) as bar:
        bar(0.6, "reading")
        raise ValueError
    said = capsys.readouterr().err
    assert ("60 %" in said, said.endswith(f"\r{'':110}\r")) == (live and not quiet,) * 2
