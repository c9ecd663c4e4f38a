"""The seeded bugs of `make mutants` can still be planted; that they are caught is for that command."""

import ast
from pathlib import Path

import few
import pytest
from mutations import mutations
from run import SEEDS

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("seed", SEEDS, ids=lambda seed: seed.what)
def test_a_seeded_bug_applies_and_its_tests_exist(seed):
    ast.parse(seed.spoilt(ROOT))
    for test in seed.tests:
        file, _, name = test.partition("::")
        assert f"def {name}" in (ROOT / file).read_text()
        assert few.FEW.get(file.removeprefix("tests/"), {}).get(name) != (), "`make test` does not ask it"


def test_there_are_many_and_each_is_a_different_one():
    assert len(SEEDS) >= 100
    assert len({(seed.file, seed.old, seed.new) for seed in SEEDS}) == len(SEEDS)


def test_mutations_change_the_code_and_leave_the_tree_as_it_was(tmp_path):
    module = tmp_path / "small.py"
    module.write_text(
        '"""Doc."""\nA = 3\n\ndef f(x: int) -> int:\n    """Doc."""\n    if x > 1 and not x == 4:\n        '
        "x += A\n    return max(x, 0)\n"
    )
    made = mutations(module)
    texts = {m.key for m in made}
    assert {
        "small: 3 => 4", "small.f: x > 1 => x >= 1", "small.f: x > 1 and (not x == 4) => x > 1",
        "small.f: max(x, 0) => min(x, 0)",
        "small.f: x += A => x -= A", "small.f: deleted: x += A", "small.f: not x == 4 => x == 4",
    } <= texts  # fmt: skip
    assert len(texts) == len(made)
    before = ast.unparse(made[0].tree)
    assert all(m.source() != before for m in made)
    assert ast.unparse(made[0].tree) == before
    values = {}
    for mutation in made:
        if mutation.function:

            def f(x):
                return None

            f.__code__ = mutation.code()
            values[mutation.key] = mutation
    assert values
