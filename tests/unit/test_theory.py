"""docs/theory.md: every section that is cited exists, every function it names exists, its table is what the
code gives.
"""

import ast
import math
import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from rtctl.control.proofs import stability
from rtctl.control.resting import REST_HZ

ROOT = Path(__file__).parents[2]
THEORY = (ROOT / "docs" / "theory.md").read_text()
ANCHORS = re.findall(r'^<a id="s([\d.]+)"></a>$', THEORY, re.MULTILINE)
HEADINGS = re.findall(r"^##+ (\d+(?:\.\d+)?)\.? ", THEORY, re.MULTILINE)
CITED = re.compile(r"docs/theory\.md((?:[ ,]|and |to )*\d+(?:\.\d+)?(?:(?:, | and | to )\d+\.\d+)*)")
VAGUE = re.compile(r"theory reference|theory2|theory,? (second|part|section|\d)|second theory", re.IGNORECASE)
T = 1e-3


def sources():
    """Every file of code and tests that may cite, but this one."""
    for folder in ("rtctl", "hw", "tests"):
        yield from (path for path in (ROOT / folder).rglob("*.py") if path != Path(__file__))


def cited(text):
    """Numbers of the sections that a text cites."""
    return [number for found in CITED.findall(text) for number in re.findall(r"\d+(?:\.\d+)?", found)]


def test_the_numbers_of_a_citation_are_read():
    assert cited("docs/theory.md 2.3 and 2.7). docs/theory.md 5, and docs/theory.md 12.1.") == [
        "2.3",
        "2.7",
        "5",
        "12.1",
    ]


def test_every_section_that_is_cited_exists():
    wrong = [
        f"{path.relative_to(ROOT)}: section {number}"
        for path in sources()
        for number in cited(path.read_text())
        if number not in ANCHORS
    ]
    assert wrong == []


def test_every_citation_says_which_section():
    vague = [
        f"{path.relative_to(ROOT)}: {line.strip()}"
        for path in sources()
        for line in path.read_text().splitlines()
        if VAGUE.search(line) or re.search(r"docs/theory\.md(?! \d|#s\d)", line)
    ]
    assert vague == [], "cite as docs/theory.md 2.3"


def test_every_section_has_its_anchor_in_order_and_once():
    assert ANCHORS == HEADINGS
    parts = [number for number in ANCHORS if "." not in number]
    assert parts == [str(n + 1) for n in range(len(parts))]
    for part in parts:
        inside = [int(number.split(".")[1]) for number in ANCHORS if number.startswith(f"{part}.")]
        assert inside == list(range(1, len(inside) + 1))


@cache
def names_of(module):
    """What a module defines: functions, classes, constants, and Class.method."""
    base = ROOT / "/".join(module)
    path = base.with_suffix(".py") if base.with_suffix(".py").is_file() else base / "__init__.py"
    if not path.is_file():
        return None
    found = set()
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            found.add(node.name)
        found |= {name.id for name in getattr(node, "targets", []) if isinstance(name, ast.Name)}
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            found.add(node.target.id)
    return found


def code_lines():
    """Numbers of the sections with the names that their line *Code:* holds."""
    section, lines = "", {}
    for line in THEORY.replace("\n`", " `").splitlines():
        heading = re.match(r"##+ (\d+(?:\.\d+)?)", line)
        section = heading[1] if heading else section
        if line.startswith("*Code:*"):
            text = re.sub(r"`tests/[^`]*`|`rtctl [^`]*`|`any_world`|\[[^]]*\]\([^)]*\)", "", line)
            lines[section] = re.findall(r"`([^`]+)`", text)
    return lines


def test_every_function_that_a_section_names_exists():
    wrong = []
    for section, names in code_lines().items():
        for name in names:
            *module, last = name.split(".")
            module = tuple(module) if module[:1] == ["hw"] else ("rtctl", *module)
            if last not in (names_of(module) or ()):
                wrong.append(f"{section}: {name}")
    assert wrong == []


def test_every_section_with_a_formula_says_what_computes_it():
    without_formula = {"1", "1.2", "1.3", "2.1", "13"}
    whole = {number for number in ANCHORS if any(other.startswith(f"{number}.") for other in ANCHORS)}
    silent = [number for number in ANCHORS if number not in code_lines()]
    assert set(silent) - whole <= without_formula


def rows_of_numbers():
    """The table of section 2.11: b, b_c, and the greatest k_c of three tests."""
    for line in THEORY.partition('<a id="s2.11">')[2].partition('<a id="s2.12">')[0].splitlines():
        cells = line.strip("| ").split(" | ")
        if len(cells) == 5 and cells[0].replace(".", "").isdigit():
            yield tuple(float(cell) for cell in cells)


def test_the_table_of_the_greatest_stiffness_is_what_the_code_gives():
    rows = list(rows_of_numbers())
    assert len(rows) == 9
    for b, b_c, exact, late, papers in rows:
        assert stability.k_max_sampled_data(b, b_c, T) == pytest.approx(exact, abs=1e-4)
        assert stability.k_max_sampled_data(b, b_c, T, 1) == pytest.approx(late, abs=1e-4)
        assert stability.k_max_adams_hannaford(b, b_c, T) == pytest.approx(papers, abs=1e-4)


def test_the_row_of_delays_is_what_the_code_gives():
    said = re.search(r"a delay of ([\d., ]+) ticks: ([\d., ]+)\. A current", THEORY)
    delays, greatest = ([float(x) for x in part.split(", ")] for part in said.groups())
    assert len(delays) == len(greatest) == 8
    for delay, k_c in zip(delays, greatest, strict=True):
        assert stability.k_max_sampled_data(0.05, 0.01, T, delay) == pytest.approx(k_c, abs=6e-3)


def test_the_worst_hands_are_what_the_formula_gives():
    said = re.search(r"for b_c = \.01: ([\d., ]+) for N = 1 to 5", THEORY)
    for n, k in enumerate(map(float, said[1].split(", ")), start=1):
        share = 8 / math.pi**2 * sum(1 / (2 * m - 1) ** 2 for m in range(1, n + 1))
        assert 2 * 0.05 / T / share - 2 * 0.01 / T == pytest.approx(k, abs=6e-3)


REST_RAD_S = 2 * math.pi * REST_HZ


def grows(b, damper, bristles, k, gain):
    """True when the loop of 5.7 on bent bristles does, of 1 kg m^2; k and B are of hand and coupling."""
    twice = np.polymul([1 / REST_RAD_S, 1], [1 / REST_RAD_S, 1])
    whole = np.polyadd(np.polymul([1, b + damper, bristles + k], twice), [gain * damper, gain * k])
    return np.roots(whole).real.max() > 1e-9


def test_what_help_takes_from_bent_bristles_through_hand_and_coupling_is_bounded():
    draw = np.random.default_rng(5)
    for _ in range(1000):
        bristles = (2 * math.pi * draw.uniform(8, 60)) ** 2
        k, gain = bristles * 10 ** draw.uniform(-3, 3), draw.uniform(0, 5)
        damper = draw.choice([0.0, 10 ** draw.uniform(-3, 1) * math.sqrt(bristles)])
        assert not grows(1.1 * gain * REST_RAD_S**3 / (2 * bristles), damper, bristles, k, gain)


def test_the_damping_that_bent_bristles_need_is_what_the_section_says():
    said = re.search(
        r"least b/J is ([\d.]+), ([\d.]+) and ([\d.]+) 1/s.*the bound gives ([\d., and]+)\. ", THEORY
    )
    bounds = [float(one) for one in re.findall(r"\d*\.\d+", said[4])]
    for hz, least, bound in zip((4, 8, 16), map(float, said.groups()[:3]), bounds, strict=True):
        bristles = (2 * math.pi * hz) ** 2
        ks = bristles * np.logspace(-1, 1, 81)
        assert 4.75 * REST_RAD_S**3 / (2 * bristles) == pytest.approx(bound, rel=5e-3)
        assert not any(grows(1.01 * least, 0.0, bristles, k, 4.75) for k in ks)
        assert any(grows(0.98 * least, 0.0, bristles, k, 4.75) for k in ks)
