"""Numba's cache of one function, in a folder named by the key of the module (`hw.compile_key`).

Numba's own looks at the text of the outermost function's file only, and at the line where the function
stands."""

from __future__ import annotations

import fcntl
import hashlib
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from types import CodeType
from typing import Any

from llvmlite import binding

from hw import installed_anew
from hw.compile_key import module_key, remember
from hw.numba_alone import caching, nrt
from hw.private_cache import OwnFiles, make_private
from hw.undefined_symbols import undefined_symbols


def keep(dispatcher: Any, root: Path, options: str) -> None:  # noqa: ANN401 - its `_cache` is in no stub
    """Have a compiled function kept below `root`, if its source says all that it is made of.

    A function with a closure is compiled anew by every process, and so is one without a file."""
    function = dispatcher.py_func
    # a closure's values are no part of the source: code kept with one would serve another
    if function.__closure__ is None and (key := _key(function, options, root)):
        dispatcher._cache = CodeCache(function, root / f"{function.__module__}-{key}")
        may_be_made.append(repr(function))


_keys: dict[tuple[str, Path, str], tuple[object, str]] = {}


def _key(function: Callable[..., Any], options: str, root: Path) -> str:
    """Key of a function's module, found out once for each time that the module is imported (or reloaded);
    nothing where it has no file."""
    file, spec = function.__code__.co_filename, function.__globals__.get("__spec__")
    known = _keys.get((file, root, options))
    if known is None or spec is None or known[0] is not spec:
        key = module_key(Path(file), options, root) if Path(file).is_file() else ""
        known = _keys[file, root, options] = spec, key
    return known[1]


made_here: list[str] = []
"""Names of the functions that this process has compiled, in order: those that were not kept, or of before an
update."""

loaded_here: list[str] = []
"""Names of the functions whose machine code this process has found, in order."""

may_be_made: list[str] = []
"""Names of the functions that this process has imported: what it compiles is among these."""

on_compiled: list[Callable[[int], None]] = []
"""Called with the length of `made_here` whenever it has grown."""


class CodeCache(caching.FunctionCache):
    """Files of one function in `folder`: made for this user alone when first asked for, as is the memo of
    sources beside it."""

    def __init__(self, function: Callable[..., Any], folder: Path) -> None:
        self._name = repr(function)
        self._py_func = function
        self._cache_path = str(folder)
        self._usable: bool | None = None
        self._enabled = True

    # a start imports some hundred functions and asks for the code of eight
    @cached_property
    def _impl(self) -> _Files:
        return _Files(self._py_func, Path(self._cache_path))

    @cached_property
    def _cache_file(self) -> OwnFiles:  # type: ignore[override]
        return OwnFiles(self._cache_path, self._impl.filename_base, Path(self._cache_path).name)  # type: ignore[no-untyped-call]

    def usable(self) -> bool:
        """Whether the folder can be had."""
        if self._usable is None:
            folder = Path(self._cache_path)
            self._usable = make_private(folder, levels=2)
            if self._usable:
                remember(folder.parent)
        return self._usable

    def load_overload(self, sig: object, target_context: object) -> object:
        """What was compiled before for these types, or None.

        Numba would first have itself ready to compile anything, which takes .3 s of every start
        (`_Files.rebuild`)."""
        if not self.usable():
            return None
        numbas: Any = nrt
        # loaded code may allocate: this much of Numba has to be ready in any case
        numbas.rtsys.initialize(target_context)
        before: Any = super()
        found = before._load_overload(sig, target_context)
        if found is not None:
            loaded_here.append(self._name)
        return found

    def save_overload(self, sig: object, data: object) -> None:
        """Keep what was compiled, one process at a time, and tell that it was.

        Two that add code for different types at once would give it the same file name; the index that is
        written last could then name the code of the other's types."""
        made_here.append(self._name)
        for hear in on_compiled:
            hear(len(made_here))
        numbas: Any = super()
        # else the key may be of one version's sources, the constants in the code of another's
        if self.usable() and not installed_anew():
            with alone(Path(self._cache_path)):
                numbas.save_overload(sig, data)


def made_elsewhere(dispatcher: Any, program: str) -> None:  # noqa: ANN401 - its `_cache` is in no stub
    """Where no machine code of a function is kept, have the Python `program` make it in a process of its own.

    A process that compiles keeps some hundred MB for as long as it lives; the host lives for months. What
    could not be made there, or not be kept, is made here."""
    kept: CodeCache = dispatcher._cache
    if kept.usable() and not Path(kept._cache_file._index_path).is_file():
        # what it says belongs to nobody: whatever fails there is done here, and said here
        quiet: dict[str, Any] = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.DEVNULL)
        subprocess.run([sys.executable, "-c", program], check=False, **quiet)


@contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Wait for every other process that is alone with `folder`. The kernel lets go for a process that
    dies."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        # of the folder, not of a file: Numba replaces its files, and a lock on the old one holds nobody
        fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


class _Files(caching.CompileResultCacheImpl):
    """How the files are named and written."""

    def __init__(self, function: Callable[..., Any], folder: Path) -> None:
        code = function.__code__
        self._lineno = code.co_firstlineno
        self._locator = _Place(Path(code.co_filename), folder, _fingerprint(code, function.__doc__))
        numbas: Any = self
        self._filename_base = numbas.get_filename_base(function.__qualname__, sys.abiflags)

    def rebuild(self, target_context: Any, payload: Sequence[Any]) -> object:  # noqa: ANN401 - as in Numba
        """Load machine code that was kept; as Numba does where it may want more of Numba than is ready."""
        if not _wants_nothing_more(payload):
            target_context.refresh()
        numbas: Any = super()
        return numbas.rebuild(target_context, payload)


def _wants_nothing_more(payload: Sequence[Any]) -> bool:
    """Whether kept code can be linked to what this process has by now; LLVM would end the process where it
    cannot."""
    try:
        (_, kind, data), *_, when_loaded, _ = payload
        if kind != "object" or when_loaded:
            return False
        ready: Any = binding.address_of_symbol
        return all(ready(name) is not None for name in undefined_symbols(data[0]))
    except (ValueError, IndexError, TypeError):  # another Numba keeps it in another way
        return False


class _Place(caching._CacheLocator):
    """Where the files are, in Numba's terms."""

    def __init__(self, file: Path, folder: Path, fingerprint: str) -> None:
        self._py_file = str(file)
        self._folder = folder
        self._fingerprint = fingerprint

    def ensure_cache_path(self) -> None:
        """The folder is there: `CodeCache.usable`."""

    def get_cache_path(self) -> str:
        return str(self._folder)

    def get_source_stamp(self) -> str:
        return self._folder.name

    def get_disambiguator(self) -> str:
        return self._fingerprint


def _fingerprint(code: CodeType, doc: str | None) -> str:
    """Tells functions of one name in one module apart (`if ... def f ... else def f`), by code and not by
    line."""
    constants = [
        _fingerprint(x, None) if isinstance(x, CodeType) else repr(x) for x in code.co_consts if x != doc
    ]
    told = f"{code.co_code.hex()} {constants} {code.co_names} {code.co_varnames} {code.co_freevars}"
    return hashlib.sha256(told.encode()).hexdigest()[:12]
