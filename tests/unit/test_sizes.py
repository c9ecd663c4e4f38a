"""Nothing is too long to be read at once: no file over 300 lines and no function over 50 without a reason
beside it.

The reason is a comment that says `longer than 300 lines: why` below the file's docstring, or
`longer than 50 lines: why` on a line of the function's signature. Of a function its body counts: a docstring
gives units and errors, a parameter is an option.
"""

import ast
import re
import textwrap
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FOLDERS = ("rtctl", "hw", "tests", "docs/example-backend")
FILE_LINES, FUNCTION_LINES = 300, 50
A_REASON = 3
"""Words."""
MOST_SILENCED = 30
"""Lines of the whole that a linter is told to leave alone."""


def reasoned(lines, limit):
    """Whether one of the lines gives a reason for being longer than `limit`."""
    said = [re.search(rf"# longer than {limit} lines: (.+)", line) for line in lines]
    return any(found and len(found[1].split()) >= A_REASON for found in said)


def statements(tree):
    """All of them, within each other; handlers and cases, which hold some, are among them."""
    for inside in ("body", "handlers", "orelse", "finalbody", "cases"):
        for node in getattr(tree, inside, ()):
            yield node
            yield from statements(node)


def body_of(function):
    """The statements of a function, its docstring left out."""
    return function.body[1:] if ast.get_docstring(function, clean=False) is not None else function.body


def too_long(text):
    """What is too long in a source, and says no reason: "" for the file itself, or names of functions, with
    their lines.
    """
    lines, tree = text.splitlines(), ast.parse(text)
    found = []
    code = [node for node in tree.body if not isinstance(node, ast.Expr)]
    head = lines[: code[0].lineno] if code else lines
    if len(lines) > FILE_LINES and not reasoned(head, FILE_LINES):
        found.append(("", len(lines)))
    for node in statements(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and (body := body_of(node)):
            length = node.end_lineno - body[0].lineno + 1
            signature = lines[node.lineno - 1 : node.body[0].lineno - 1]
            if length > FUNCTION_LINES and not reasoned(signature, FUNCTION_LINES):
                found.append((node.name, length))
    return found


def silenced(text):
    return sum("# " + "noqa" in line for line in text.splitlines())


@pytest.mark.parametrize("folder", FOLDERS)
def test_no_file_and_no_function_is_longer_than_can_be_read_at_once_without_a_reason(folder):
    looked_at = sorted((ROOT / folder).rglob("*.py"))
    assert looked_at
    found = {path.relative_to(ROOT).as_posix(): too_long(path.read_text()) for path in looked_at}
    assert {path: names for path, names in found.items() if names} == {}


def test_a_linter_is_told_to_look_away_in_few_places():
    assert (
        sum(silenced(path.read_text()) for folder in FOLDERS for path in (ROOT / folder).rglob("*.py"))
        <= MOST_SILENCED
    )


def function(lines, note="", documented=0):
    text = "".join(["    text\n"] * documented)
    return (
        f"def long({note}\n    a,\n):\n"
        + (f'    """What.\n{text}    """\n' if documented else "")
        + "    a = 1\n" * lines
    )


def test_what_is_too_long_is_found():
    assert too_long("x = 1\n" * 301) == [("", 301)]
    assert too_long("x = 1\n" * 300) == []
    assert too_long(function(51)) == [("long", 51)]
    assert too_long(function(50)) == []
    assert too_long(function(50, documented=30)) == [], "a docstring is no code"
    assert too_long("if True:\n" + textwrap.indent(function(51), "    ")) == [("long", 51)]


def test_a_reason_is_words_in_its_place():
    assert too_long("# longer than 300 lines: a table is one thing\n" + "x = 1\n" * 301) == []
    assert too_long("# longer than 300 lines:\n" + "x = 1\n" * 301) == [("", 302)]
    assert too_long("x = 1\n" * 301 + "# longer than 300 lines: a table is one thing\n") == [("", 302)]
    assert too_long(function(51, "  # longer than 50 lines: an option is a parameter")) == []
    assert too_long(function(51, "  # longer than 50 lines: no")) == [("long", 51)]
