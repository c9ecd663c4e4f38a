"""Compiled code of one function on the disk: who may write when, and what is never kept."""

import fcntl
import importlib
import os

import pytest
from numba.core.caching import NullCache

import hw
from hw import code_cache, compile_key, jit
from hw.private_cache import OwnFiles

pytestmark = pytest.mark.compiled


def double(x):
    return 2 * x


@pytest.fixture
def compiled(monkeypatch, tmp_path):
    monkeypatch.setenv("RTCTL_CACHE_DIR", str(tmp_path))
    return jit.compiled


def test_processes_that_add_code_for_other_types_do_so_one_after_the_other(monkeypatch, compiled):
    """Numba names a file by counting those of the index: two at once would take the same name for different
    code.
    """
    function, alone = compiled(double), []
    saves = OwnFiles.save

    def save(files, key, data):
        descriptor = os.open(files._cache_path, os.O_RDONLY)
        with pytest.raises(BlockingIOError):
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        os.close(descriptor)
        alone.append(key)
        saves(files, key, data)

    monkeypatch.setattr(OwnFiles, "save", save)
    assert (function(1), function(1.5)) == (2, 3.0)
    assert len(alone) == 2
    again = compiled(double)
    assert (again(1.5), again(1)) == (3.0, 2)
    assert sum(again.stats.cache_hits.values()) == 2


def test_what_a_function_closes_over_is_not_in_its_source_so_it_is_not_kept(compiled, tmp_path):
    def scaled_by(share):
        return compiled(lambda x: share * x)

    assert (scaled_by(2.0)(1.0), scaled_by(3.0)(1.0)) == (2.0, 3.0)
    assert isinstance(scaled_by(4.0)._cache, NullCache)
    assert not list(tmp_path.rglob("*.nbc"))


def test_what_is_compiled_of_a_package_that_was_replaced_is_not_kept(compiled, monkeypatch, tmp_path):
    """Its key is of the sources on the disk, its constants may be of those before."""
    function = compiled(double)
    monkeypatch.setattr(hw, "_found", (0, 0))
    assert function(1) == 2
    assert not list(tmp_path.rglob("*.nbc"))


def test_a_module_has_one_key_however_many_functions_until_it_is_loaded_again(
    compiled, monkeypatch, tmp_path
):
    asked = []
    monkeypatch.setattr(
        code_cache, "module_key", lambda *told: asked.append(told) or compile_key.module_key(*told)
    )
    path = tmp_path / "two_functions.py"
    path.write_text(
        "from hw.jit import compiled\nK = 1\nf = compiled(lambda x: K)\ng = compiled(lambda x: K + x)\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    import two_functions as module

    first = {module.f._cache.cache_path, module.g._cache.cache_path}
    assert (len(first), len(asked)) == (1, 1)
    path.write_text(path.read_text().replace("K = 1", "K = 10"))
    importlib.reload(module)
    assert len(asked) == 2
    assert first.isdisjoint({module.f._cache.cache_path, module.g._cache.cache_path})
    assert module.f(0) == 10


@pytest.mark.parametrize(
    ("kept", "private", "made"), [(False, True, True), (True, True, False), (False, False, False)]
)
def test_a_function_is_made_elsewhere_where_it_is_not_kept_and_can_be(
    monkeypatch, compiled, tmp_path, kept, private, made
):
    """Where the folder is another user's nothing can be kept: whoever had it made would make it again."""
    function, asked = compiled(double), tmp_path / "asked"
    if kept:
        function(1)
    monkeypatch.setattr(function._cache, "_usable", private)
    code_cache.made_elsewhere(function, f"open({str(asked)!r}, 'a').write('x')")
    assert asked.exists() == made
