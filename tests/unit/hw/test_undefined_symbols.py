"""Kept machine code is loaded without Numba being ready to compile, where it wants nothing more of Numba than
is there.
"""

import subprocess
import sys
from types import SimpleNamespace

import pytest
from llvmlite import binding
from numba.core import caching
from numba.core.registry import cpu_target

from hw import code_cache
from hw.undefined_symbols import undefined_symbols

pytestmark = pytest.mark.compiled


def test_what_is_no_object_file_is_refused():
    for code in (b"", b"MZ", b"\x7fELF\x02\x01", b"\x7fELF\x01\x01" + bytes(100)):
        with pytest.raises(ValueError, match="ELF"):
            undefined_symbols(code)


PROGRAM = """
import sys
import numpy as np
from numba.core.registry import cpu_target
from hw import code_cache
from hw.jit import compiled
{module}
made_ready = []
refresh = cpu_target.target_context.refresh
cpu_target.target_context.refresh = lambda: made_ready.append(1) or refresh()
print(f(np.arange(4.0)), bool(code_cache.made_here), bool(made_ready))
"""
PLAIN = "def f(x):\n    return float(np.exp(x[0]) + x[3])"


def started(folder, module):
    """What one process says: result, whether it compiled, whether Numba was made ready."""
    (folder / "one_function.py").write_text(
        f"import numpy as np\nfrom hw.jit import compiled\n\n@compiled\n{module}\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(module="from one_function import f")],
        env={"RTCTL_CACHE_DIR": str(folder / "cache"), "PYTHONPATH": ":".join([str(folder), *sys.path])},
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.split()


def test_kept_code_is_loaded_without_making_numba_ready(tmp_path):
    assert started(tmp_path, PLAIN) == ["4.0", "True", "True"]
    assert started(tmp_path, PLAIN) == ["4.0", "False", "False"]


def object_that_calls(name):
    """Machine code of a function that calls `name`."""
    assert cpu_target.target_context.codegen() is not None, "what it links to is there from now on"
    module = binding.parse_assembly(
        f"declare void @{name}()\ndefine void @f() {{\n call void @{name}()\n ret void\n}}"
    )
    return binding.Target.from_default_triple().create_target_machine().emit_object(module)


def kept(code, kind="object", when_loaded=()):
    """As Numba keeps a compiled function, as far as it is looked at."""
    return (("library", kind, (code, b"")), "description", None, when_loaded, ())


def test_code_that_wants_more_is_loaded_when_numba_is_ready():
    """LLVM would end the process at a symbol that is not there."""
    assert undefined_symbols(object_that_calls("not_there")) == {"not_there"}
    assert code_cache._wants_nothing_more(kept(object_that_calls("getpid")))
    assert not code_cache._wants_nothing_more(kept(object_that_calls("not_there")))


def test_what_is_kept_in_another_way_is_loaded_when_numba_is_ready():
    code = object_that_calls("getpid")
    assert not code_cache._wants_nothing_more(kept(code, kind="bitcode"))
    assert not code_cache._wants_nothing_more(kept(code, when_loaded=(print,)))
    assert not code_cache._wants_nothing_more(kept(code[:100]))
    for payload in ((), (1, 2, 3), (("library", "object", None), (), ())):
        assert not code_cache._wants_nothing_more(payload)


def test_numba_is_made_ready_for_what_wants_more(monkeypatch):
    made_ready = []
    monkeypatch.setattr(caching.CompileResultCacheImpl, "rebuild", lambda _self, _context, payload: payload)
    files = object.__new__(code_cache._Files)
    context = SimpleNamespace(refresh=lambda: made_ready.append(1))
    files.rebuild(context, kept(object_that_calls("getpid")))
    assert not made_ready
    files.rebuild(context, kept(object_that_calls("not_there")))
    assert made_ready


CALLER = """
import sys
import numpy as np
from hw import code_cache
from hw.jit import compiled
from one_function import f

f(np.arange(4.0))

def again(x):
    return f(x) + x[0]

print(compiled(again)(np.arange(4.0)), len(code_cache.loaded_here))
"""


def test_after_kept_code_was_loaded_a_caller_of_it_is_compiled_as_ever(tmp_path):
    started(tmp_path, PLAIN)
    (tmp_path / "caller.py").write_text(CALLER)
    done = subprocess.run(
        [sys.executable, str(tmp_path / "caller.py")],
        env={"RTCTL_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": ":".join([str(tmp_path), *sys.path])},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split() == ["4.0", "1"]
