"""Run `rtctl` in the process of the test."""

import sys

from rtctl.__main__ import main


def run(monkeypatch, capsys, *arguments):
    """Exit status, stdout and stderr of `rtctl ARGUMENTS`."""
    monkeypatch.setattr(sys, "argv", ["rtctl", *map(str, arguments)])
    code = 0
    try:
        main()
    except SystemExit as ended:
        code = ended.code or 0
    captured = capsys.readouterr()
    return code, captured.out, captured.err
