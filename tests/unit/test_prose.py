"""Docstrings name what they speak of: none begins with a pronoun, or a nounless `Of`."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
NOUNLESS = re.compile(
    r'^ *r?"""((?:Of|Its?|They|Their|Them|The same (?:of|on|in|for|with)) .*|The same[.,].*)', re.MULTILINE
)


def test_no_docstring_begins_with_a_pronoun_that_has_no_noun():
    nounless = [
        f"{path.relative_to(ROOT)}: {found[1]}"
        for folder in ("rtctl", "hw")
        for path in (ROOT / folder).rglob("*.py")
        for found in NOUNLESS.finditer(path.read_text())
    ]
    assert nounless == [], "say what it is: 'Most bytes of a file', not 'Of a file'"


def test_what_has_no_noun_is_found():
    text = 'X = 1\n"""Of a file."""\ndef f():\n    """It takes 0.2 ms."""\n    """The same, with more.\n'
    found = NOUNLESS.findall(text)
    assert [text.rstrip('"') for text in found] == ["Of a file.", "It takes 0.2 ms.", "The same, with more."]
    assert not NOUNLESS.search('"""Often it rests."""\n"""The same page."""\n')
