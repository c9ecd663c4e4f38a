"""Docstrings name what they speak of: none begins with a pronoun, or with an `Of` that has no noun before
it.
"""

import ast
import re
from pathlib import Path

from statements import statements

ROOT = Path(__file__).parents[2]
NOUNLESS = re.compile(r"^(Of|Its?|They|Their|Them|The same (of|on|in|for|with)) |^The same[.,]")


def docstrings(tree):
    """Line and text of every string that stands as a statement by itself."""
    for node in statements(tree):
        if (
            isinstance(node, ast.Expr)
            and isinstance(node.value, ast.Constant)
            and isinstance(node.value.value, str)
        ):
            yield node.lineno, node.value.value


def test_no_docstring_begins_with_a_pronoun_that_has_no_noun():
    nounless = [
        f"{path.relative_to(ROOT)}:{line}: {text.splitlines()[0]}"
        for folder in ("rtctl", "hw")
        for path in (ROOT / folder).rglob("*.py")
        for line, text in docstrings(ast.parse(path.read_text()))
        if NOUNLESS.match(text)
    ]
    assert nounless == [], "say what it is: 'Most bytes of a file', not 'Of a file'"


def test_what_has_no_noun_is_found():
    assert [text for _, text in docstrings(ast.parse('X = 1\n"""Of a file."""\n'))] == ["Of a file."]
    assert NOUNLESS.match("It takes 0.2 ms.")
    assert NOUNLESS.match("The same, with more.")
    assert not NOUNLESS.match("Offset of the sensor.")
