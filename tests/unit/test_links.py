"""What documents and docstrings point to exists: links, anchors, files, decisions, invariants, tests,
commands.
"""

import re
import shlex
from functools import cache
from pathlib import Path

import click
import pytest

from rtctl.cli import cli, identify_log

ROOT = Path(__file__).parents[2]
DOCUMENTS = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "tests").rglob("*.md")])
LINK = re.compile(r"\]\(([^)\s]+)\)|^\[[^\]]+\]: (\S+)$|(?:href|src|srcset)=\"([^\"]+)\"", re.MULTILINE)
NAMED = re.compile(
    r"(?<![\w/.-])((?:rtctl|hw|tests|configs|docs|systemd)/[\w./*-]+\.(?:py|md|toml|json|csv|xml|sh|svg))"
    r"(?:#([\w.-]+))?"
)
HISTORY = {"CHANGELOG.md"}
"""Tells of files as they were called then."""


def texts():
    """Name and text of every file that points to others, the history and this file left out."""
    code = [path for folder in ("rtctl", "hw", "tests") for path in (ROOT / folder).rglob("*.py")]
    more = [*(ROOT / "configs").rglob("*.toml"), ROOT / "Makefile", ROOT / "pyproject.toml"]
    for path in (*DOCUMENTS, *code, *more):
        if path.name not in HISTORY and path != Path(__file__):
            yield path.relative_to(ROOT), path.read_text()


def prose(text):
    """A document without its blocks of code."""
    return re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE)


def slug(heading):
    """Anchor of a heading, as GitHub makes it."""
    words = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading.replace("`", "")).strip().lower()
    return re.sub(r"[^\w\- ]", "", words).replace(" ", "-")


@cache
def anchors(path):
    text, seen = prose(path.read_text()), {}
    found = set(re.findall(r'<a id="([^"]+)"', text))
    for heading in re.findall(r"^#+ (.*)$", text, re.MULTILINE):
        name = slug(heading)
        seen[name] = seen.get(name, -1) + 1
        found.add(f"{name}-{seen[name]}" if seen[name] else name)
    return found


def broken(path, link):
    """Why a relative link of a document leads nowhere; nothing if it leads somewhere."""
    target, _, anchor = link.partition("#")
    place = path.parent / target if target else path
    if not place.exists():
        return f"{path.relative_to(ROOT)}: no file {target}"
    if anchor and place.suffix == ".md" and anchor not in anchors(place.resolve()):
        return f"{path.relative_to(ROOT)}: no anchor {link}"
    return ""


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_relative_link_and_anchor_of_a_document_leads_somewhere(path):
    links = ["".join(found) for found in LINK.findall(prose(path.read_text()))]
    relative = [link for link in links if not re.match(r"\w+:", link)]
    assert [why for why in (broken(path, link) for link in relative) if why] == []


def test_a_link_that_leads_nowhere_is_found():
    readme = ROOT / "README.md"
    assert broken(readme, "docs/nothing.md")
    assert broken(readme, "docs/theory.md#s99.9")
    assert not broken(readme, "docs/theory.md#s2.3")
    assert slug("Steps of `the` encoder, and [a link](x.md)") == "steps-of-the-encoder-and-a-link"


def test_every_file_that_is_named_exists():
    wrong = []
    for name, text in texts():
        for found in NAMED.finditer(text):
            path, anchor = found[1], found[2]
            exists = any(ROOT.glob(path)) if "*" in path else (ROOT / path).exists()
            if not exists or (anchor and path.endswith(".md") and anchor not in anchors(ROOT / path)):
                wrong.append(f"{name}: {found[0]}")
    assert wrong == []


def test_every_decision_that_is_named_exists():
    there = {path.name[:4] for path in (ROOT / "docs" / "decisions").glob("*.md")}
    said = {
        (str(name), number)
        for name, text in texts()
        for number in re.findall(r"decisions? (\d{4})|decisions/(\d{4})", text)
    }
    numbers = {(name, "".join(pair)) for name, pair in said}
    assert len(numbers) > 5
    assert {one for one in numbers if one[1] not in there} == set()


def test_every_invariant_has_its_rule_and_its_test_and_no_other_is_named():
    safety = (ROOT / "docs" / "safety.md").read_text()
    rules = re.findall(r"^\| (\d+) \| ", safety, re.MULTILINE)
    assert rules == [str(n + 1) for n in range(21)]
    tests = "".join(path.read_text() for path in (ROOT / "tests" / "properties").glob("*.py"))
    tested = {int(n) for n in re.findall(r"def test_invariant_(\d+)_", tests)}
    assert tested >= set(range(1, 21))
    said = {n for _, text in texts() for n in re.findall(r"invariants? (\d+)", text)}
    assert said - set(rules) == set()


def test_every_test_that_a_document_names_exists():
    tests = "".join(path.read_text() for path in (ROOT / "tests").rglob("*.py"))
    defined = set(re.findall(r"def (test_\w+)", tests)) | {
        p.stem for p in (ROOT / "tests").rglob("test_*.py")
    }
    wrong = []
    for path in DOCUMENTS:
        if path.name not in {*HISTORY, "SURVIVORS.md"}:  # which names fields of the state
            named = re.findall(r"(?<![\w/])(test_\w+)(?!\w*[/*])", path.read_text())
            wrong += [f"{path.name}: {name}" for name in named if name not in defined and name != "test_"]
    assert wrong == []


def commands(text):
    """The calls of rtctl in a document: its words after `rtctl`, from code spans and indented or fenced
    blocks.
    """
    joined = text.replace("\\\n", " ")
    spans = re.findall(r"(?<!`)`([^`\n]+)`(?!`)", joined)
    lines = [
        line.strip()
        for line in joined.splitlines()
        if line.startswith("    ") or re.match(r"\S*rtctl ", line)
    ]
    for one in (*spans, *lines):
        found = re.match(r"(?:sudo )?(?:\S*/)?rtctl ([a-z][a-z-]+.*)$", one.partition("  #")[0].strip())
        if found:
            try:
                yield shlex.split(found[1])
            except ValueError:
                yield found[1].split()


def unknown(words):
    """What of a call does not exist: the command or an option; nothing if all does."""
    command, context, left = cli, click.Context(cli), list(words)
    if words[0] == "identify" and "--log" in words:
        command = identify_log.command
    while isinstance(command, click.Group) and left and re.fullmatch(r"[a-z][a-z-]*", left[0]):
        name = left.pop(0)
        command = command.get_command(context, name)
        if command is None:
            return f"command {name}"
    known = {
        option for parameter in command.params for option in (*parameter.opts, *parameter.secondary_opts)
    }
    options = [word.partition("=")[0].rstrip(",.;:") for word in left if re.match(r"--[a-z]", word)]
    wrong = [option for option in options if option not in known | {"--help", "--version"}]
    return f"option {wrong[0]}" if wrong else ""


def test_what_does_not_exist_of_a_call_is_found():
    assert unknown(["check", "rig.toml", "--plot", "x"]) == ""
    assert unknown(["schema", "--config"]) == "option --config"
    assert unknown(["chek", "rig.toml"]) == "command chek"
    assert list(commands("see `rtctl run X --arm` and\n\n    rtctl fit a \\\n      --rig b  # c\n")) == [
        ["run", "X", "--arm"],
        ["fit", "a", "--rig", "b"],
    ]


def test_every_command_that_a_document_calls_exists_with_its_options():
    calls = [
        (path.name, words)
        for path in DOCUMENTS
        if path.name not in HISTORY
        for words in commands(path.read_text())
    ]
    assert len(calls) > 100
    wrong = [
        f"{name}: rtctl {' '.join(words)}: no {unknown(words)}" for name, words in calls if unknown(words)
    ]
    assert wrong == []


def test_the_index_says_how_to_print_each_figure_of_the_bench():
    from rtctl.cli.bench import GROUPS, ON_REQUEST

    named = set(re.findall(r"`rtctl bench (\w+)", (ROOT / "docs" / "index.md").read_text()))
    assert named >= {*GROUPS, *ON_REQUEST}


def test_the_index_leads_to_every_document():
    index = (ROOT / "docs" / "index.md").read_text()
    pages = [path.relative_to(ROOT / "docs") for path in DOCUMENTS if path.is_relative_to(ROOT / "docs")]
    assert [str(page) for page in pages if f"]({page})" not in index and page.name != "index.md"] == []


def test_the_readme_is_short_and_its_picture_small():
    readme = (ROOT / "README.md").read_text()
    picture = (ROOT / "docs" / "demo.svg").read_bytes()
    assert len(readme.split()) < 900
    assert "(docs/demo.svg)" in readme
    assert len(picture) < 40_000
    assert b"dc:date" not in picture
