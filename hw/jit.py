"""The one way functions are compiled here: Numba, cached under a key that covers every source they inline.

Numba's own cache looks only at the file of the outermost function; a changed callee in another file
would leave stale machine code in use. For code that moves a rig that is not acceptable, so the cache
folder is named after a hash of what all the sources mean that may be inlined (`hw.compile_key`)."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any, TypeAlias, TypeVar, cast

import numpy as np

from hw.code_cache import keep
from hw.compile_key import versions
from hw.numba_alone import config as numba_config
from hw.numba_alone import numba, numpy_support
from hw.outside import user_folder

F = TypeVar("F", bound=Callable[..., Any])


def _content_name(record: numba.types.Record) -> tuple[str, tuple[str]]:
    """What stands for a record in the symbol of a compiled function: a hash of its fields.

    Numba takes a number that counts the types a process has met. Symbols in its cache then depend on the
    order of events in the process that filled it: two rigs of different size, cached by two processes, may
    carry the same symbols, and whoever loads both runs one rig's machine code on the other rig's records."""
    return "Record", (hashlib.sha256(record.name.encode()).hexdigest()[:20],)


numba.types.Record.mangling_args = property(_content_name)  # type: ignore[assignment]

JIT_DISABLED = bool(numba_config.DISABLE_JIT)  # type: ignore[attr-defined] # set at import, untyped


def cache_root() -> Path:
    """Folder of everything rtctl may rebuild: `RTCTL_CACHE_DIR`, systemd's, or the user's cache."""
    names = "RTCTL_CACHE_DIR", "CACHE_DIRECTORY", "XDG_CACHE_HOME", "HOME"
    return _cache_root(*(os.environ.get(name) for name in names))


@cache
# `user_folder` looks at both of the others, so another one is another answer
def _cache_root(own: str | None, service: str | None, _user: str | None, _home: str | None) -> Path:
    # what somebody says first, then the service's own folder, which nobody else can write
    return Path(own or service or user_folder("XDG_CACHE_HOME", ".cache") / "rtctl")


def compiled_folder() -> Path:
    """Folder of compiled code, one folder per module and what it imports; for this user alone."""
    return cache_root() / "compiled"


def source_key(*roots: Path) -> str:
    """Hash of every byte of every Python file below `roots`, of the interpreter, and of Numba itself (hex).

    It is for what is written once and read years later. Compiled code has a key of its own
    (`hw.compile_key`)."""
    digest = hashlib.sha256(versions().encode())
    for root in roots:
        for path in sorted(root.rglob("*.py")):
            digest.update(path.relative_to(root).as_posix().encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()[:20]


def compiler(*, nogil: bool = False, inline: bool = False) -> Callable[[F], F]:
    """Make the decorator that compiles functions, kept under the key of their module (`hw.compile_key`).

    With `nogil` other threads run meanwhile; the functions must then share nothing with them. With `inline` a
    compiled caller has the function's code within its own.

    No fast-math: results are the same bit for bit inside the loop, in a simulation and in a replay.
    Division by zero follows IEEE 754 (inf, nan); the law checks its results itself."""

    def compiled(function: F) -> F:
        made = numba.njit(error_model="numpy", nogil=nogil, forceinline=inline)(function)
        # switched off nothing is compiled, and there is nothing to keep
        if not JIT_DISABLED:
            keep(made, compiled_folder(), f"nogil={nogil} inline={inline}")
        return cast("F", made)

    return compiled


compiled = compiler()
"""Compiles a function that may hold the lock of the interpreter."""

inlined = compiler(inline=True)
"""Compiles a function that is called in one place and in every tick, or in every step of a simulated rig.

A call costs more than its jump: what it returns goes through memory, and what is known on one side of it is
not on the other. LLVM by itself inlines small functions alone. What is called in several places, or seldom,
is better `compiled`: code of its own for each place has to be compiled, and fetched."""


Argument: TypeAlias = "np.ndarray | tuple[Argument, ...]"


def bound(function: Callable[..., Any], *arguments: Argument) -> Callable[[], Any]:
    """A compiled function tied to the arrays (or tuples of arrays, or of tuples) it will always be called
    with: compiled now, called without looking.

    Numba finds out the types of all arguments at each call, which costs more than the control law itself
    (0.86 us against 0.27 us for five records). Here that is done once; the call then goes straight to the
    machine code. The arrays are kept alive and must be changed in place only."""
    if JIT_DISABLED:
        return partial(function, *arguments)
    dispatcher: Any = function
    return partial(dispatcher.compile(tuple(type_of(array) for array in arguments)), *arguments)


def type_of(value: Argument) -> numba.types.Type:
    """Numba's type of an array or a tuple: `numba.typeof`, which spells out every field of a record each
    time."""
    if isinstance(value, tuple):
        of = tuple(type_of(one) for one in value)
        together: numba.types.Type = numba.types.BaseTuple.from_types(of)  # type: ignore[no-untyped-call]
        return together
    if type(value) is not np.ndarray or value.dtype.fields is None:
        alone: numba.types.Type = numba.typeof(value)  # type: ignore[no-untyped-call]
        return alone
    layout = numpy_support.map_layout(value)
    record = _record(value.dtype, value.dtype.isalignedstruct)
    return numba.types.Array(record, value.ndim, layout, readonly=not value.flags.writeable)


@cache
def _record(dtype: np.dtype[Any], _aligned: bool) -> numba.types.Type:
    """Numba's type of these fields. Aligned or not, NumPy takes two of the same fields for equal."""
    fields: numba.types.Type = numba.from_dtype(dtype)
    return fields


def plain(function: F) -> F:
    """A compiled function as the Python it is made of, for a caller that needs no speed: nothing is compiled
    or loaded."""
    return cast("F", getattr(function, "py_func", function))


def records(array: np.ndarray) -> np.ndarray:
    """Give a structured array in the form compiled functions take.

    Compiled code reads fields as attributes (`tick.position_rad[axis]`). With `NUMBA_DISABLE_JIT=1` the
    same source runs as plain Python, where only a record array offers that."""
    return array.view(np.recarray) if JIT_DISABLED else array
