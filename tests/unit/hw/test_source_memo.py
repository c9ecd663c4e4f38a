"""The memo of parsed sources saves time, and nothing else: no file on the disk makes a key that the sources
do not have.
"""

import ast
import os
from pathlib import Path

import pytest

from hw import compile_key, source_memo
from hw.compile_key import module_key, remember
from hw.source_memo import SourceMemo

LAW = "from plant.gains import LIMIT\nK = 2.0\n"
GAINS = "LIMIT = 2.0\n"


@pytest.fixture
def plant(tmp_path):
    folder = tmp_path / "plant"
    folder.mkdir()
    for name, text in (("__init__.py", ""), ("law.py", LAW), ("gains.py", GAINS)):
        (folder / name).write_text(text)
    return folder


def new_process():
    """Forget what a process keeps for itself."""
    compile_key._read.cache_clear()
    source_memo.source_memo.cache_clear()


def key(plant):
    new_process()
    return module_key(plant / "law.py", root=plant.parent / "compiled")


@pytest.fixture
def memo(plant):
    """The file of the memo, written by a process that has parsed the plant."""
    key(plant)
    remember(plant.parent / "compiled")
    (file,) = (plant.parent / "compiled" / "sources").iterdir()
    return file


@pytest.fixture
def parsed(monkeypatch):
    """What is parsed from here on."""
    texts, parse = [], ast.parse
    monkeypatch.setattr(ast, "parse", lambda text: texts.append(bytes(text).decode()) or parse(text))
    return texts


def without(plant):
    new_process()
    return module_key(plant / "law.py")


@pytest.mark.usefixtures("memo")
def test_nothing_is_parsed_twice_and_what_was_edited_is(plant, parsed):
    before = key(plant)
    assert not parsed
    (plant / "gains.py").write_text("LIMIT = 3.0\n")
    assert key(plant) != before
    assert parsed == ["LIMIT = 3.0\n"]
    assert key(plant) == without(plant)


@pytest.mark.usefixtures("memo")
def test_an_edit_of_equal_length_at_the_same_time_counts(plant):
    path = plant / "gains.py"
    before, times = key(plant), (path.stat().st_atime_ns, path.stat().st_mtime_ns)
    with path.open("r+") as file:
        file.write("LIMIT = 3.0\n")
    os.utime(path, ns=times)
    assert (path.stat().st_mtime_ns, path.stat().st_size) == (times[1], len(GAINS))
    assert key(plant) != before


def test_a_text_means_something_else_in_another_package(plant, memo):
    deep = plant / "deep"
    deep.mkdir()
    for name, text in (
        ("__init__.py", ""),
        ("law.py", "from .gains import LIMIT\n"),
        ("gains.py", "LIMIT = 5.0\n"),
    ):
        (deep / name).write_text(text)
    (plant / "law.py").write_text("from .gains import LIMIT\nfrom .deep import law\n")
    before = key(plant)
    remember(memo.parents[1])
    (plant / "deep" / "gains.py").write_text("LIMIT = 6.0\n")
    assert key(plant) != before


DAMAGE = {
    "empty": lambda data: b"",
    "cut": lambda data: data[:-40],
    "cut within the seal": lambda data: data[:20],
    "one bit": lambda data: data[:-40] + bytes([data[-40] ^ 1]) + data[-39:],
    "no text": lambda data: b"\xff" * len(data),
    "nothing but a seal": lambda data: data.partition(b"\n")[0],
}


@pytest.mark.parametrize("damage", DAMAGE.values(), ids=DAMAGE)
def test_a_damaged_memo_is_parsed_anew_and_written_anew(plant, memo, parsed, damage):
    whole = memo.read_bytes()
    memo.write_bytes(damage(whole))
    assert key(plant) == without(plant)
    assert LAW in parsed
    key(plant)
    remember(memo.parents[1])
    assert memo.read_bytes() == whole
    assert [path.name for path in memo.parent.iterdir()] == [memo.name]


def lie(memo):
    """Say, with a seal, that no source imports anything and all mean the same."""
    told = SourceMemo(None, "")
    told._path = memo
    for name in told._load():
        told.note(name, ("0", ()))
    told.save()


def of_another(path):
    if os.geteuid() == 0:
        os.chown(path, 12345, 12345)
    else:
        path.chmod(path.stat().st_mode | 0o022)  # anybody may have written it


def test_a_lie_under_a_right_seal_would_be_believed(plant, memo):
    """So the tests below would notice."""
    lie(memo)
    assert key(plant) != without(plant)


@pytest.mark.parametrize("which", ["file", "its folder", "the folder above"])
def test_a_memo_that_another_user_may_have_written_is_not_believed(plant, memo, which):
    lie(memo)
    of_another({"file": memo, "its folder": memo.parent, "the folder above": memo.parents[1]}[which])
    assert key(plant) == without(plant)


@pytest.mark.parametrize("mode", [0o620, 0o602])
def test_a_memo_that_others_may_write_is_not_believed(plant, memo, mode):
    lie(memo)
    memo.chmod(mode)
    assert key(plant) == without(plant)


def test_a_link_is_not_followed(plant, memo):
    lie(memo)
    memo.rename(plant.parent / "elsewhere")
    memo.symlink_to(plant.parent / "elsewhere")
    assert key(plant) == without(plant)


def test_it_is_for_this_user_alone(plant, memo):
    assert [path.stat().st_mode & 0o777 for path in (memo, memo.parent, memo.parents[1])] == [
        0o600,
        0o700,
        0o700,
    ]


def test_what_another_process_wrote_meanwhile_stays(tmp_path, memo):
    mine, other = SourceMemo(tmp_path / "compiled", "x"), SourceMemo(tmp_path / "compiled", "x")
    mine.note("mine", ("1", ("a", "b")))
    other.note("other", ("2", ()))
    other.save()
    mine.save()
    both = SourceMemo(tmp_path / "compiled", "x")
    assert (both.get("mine"), both.get("other"), both.get("none")) == (("1", ("a", "b")), ("2", ()), None)
    assert SourceMemo(tmp_path / "compiled", "another Python").get("mine") is None


def test_it_does_not_grow_for_ever(tmp_path, monkeypatch):
    monkeypatch.setattr(source_memo, "MOST_ENTRIES", 3)
    for process in range(9):
        memo = SourceMemo(tmp_path, "x")
        memo.get("old")
        memo.note("old" if process == 0 else str(process), ("1", ()))
        memo.save()
        known = SourceMemo(tmp_path, "x")
        assert known.get("old")
        assert sum(known.get(str(n)) is not None for n in range(9)) <= 2


def test_where_it_cannot_be_written_nothing_is_lost_but_time(plant, memo):
    before = key(plant)
    memo.unlink()
    memo.mkdir()
    assert key(plant) == before
    remember(memo.parents[1])
    assert [path.name for path in memo.parent.iterdir()] == [memo.name]


def test_the_sources_of_the_project_fit():
    root = Path(compile_key.__file__).parents[1]
    modules = sum(1 for top in compile_key.PROJECT for _ in (root / top).rglob("*.py"))
    assert 2 * modules < source_memo.MOST_ENTRIES
