"""Compiled functions called by their address: one compiled loop for functions that it was not compiled with.

Numba compiles a caller anew for each function that it calls, and keeps neither such a caller nor one that
takes functions as arguments beyond the process. Called by address, only the types of the arguments matter:
the loop is compiled once for each kind of device, within a second or two, and the law in it is the machine
code that everything else runs, bit for bit."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
from numba.core import cgutils as _cgutils
from numba.core import types
from numba.core.extending import intrinsic

from hw.jit import JIT_DISABLED, type_of

_build: Any = _cgutils  # it has no types

Address: TypeAlias = "int | Callable[..., Any]"
"""Where a compiled function is; the function itself where nothing is compiled."""


def entry_point(function: Callable[..., Any], *arguments: np.ndarray | tuple[np.ndarray, ...]) -> Address:
    """Address of a compiled function for arguments of these types, arrays or tuples of arrays; compiled (or
    loaded) now.

    Where nothing is compiled it is the function, which `call` calls.

    Raises
    ------
    TypeError
        It returns anything but nothing or an integer of 64 bits: those are what `call` and `call_for_int` can
        take."""
    if JIT_DISABLED:
        return function
    dispatcher: Any = function
    of = tuple(type_of(array) for array in arguments)
    dispatcher.compile(of)
    made = dispatcher.overloads[of]
    untyped: Any = types
    returned = untyped.unliteral(made.signature.return_type)
    if returned not in (types.none, types.int64):
        raise TypeError(f"{function} must return nothing or an integer of 64 bits, not {returned}")
    return int(made.library.get_pointer_to_function(made.fndesc.llvm_func_name))


def _caller(returned: Any) -> Any:  # noqa: ANN401
    """Makes the compiled call of functions that return this."""

    def typed(_context: Any, address: Any, arguments: Any) -> Any:  # noqa: ANN401 - Numba passes types by name
        def generate(context: Any, builder: Any, _signature: Any, values: Any) -> Any:  # noqa: ANN401
            target, packed = values
            conv, of = context.call_conv, tuple(arguments)
            pointer = builder.inttoptr(target, conv.get_function_type(returned, of).as_pointer())
            given = _build.unpack_tuple(builder, packed)
            status, result = conv.call_function(builder, pointer, returned, of, given)
            # an exception of the called function is the caller's, too: it must not go on with no result
            with _build.if_unlikely(builder, status.is_error):
                conv.return_status_propagate(builder, status)
            return result

        return returned(types.intp, arguments), generate

    return typed


def _called(function: Callable[..., Any], arguments: tuple[Any, ...]) -> object:
    return function(*arguments)


if JIT_DISABLED:
    call: Any = _called
    call_for_int: Any = _called
else:
    call = intrinsic(_caller(types.none))
    """In compiled code: `call(address, arguments)` with a tuple of arguments, those of `entry_point`."""

    call_for_int = intrinsic(_caller(types.int64))
    """`call` for a function that returns an integer; returns that."""
