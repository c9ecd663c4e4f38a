"""Eigenvalues of many small matrices, compiled: what `rtctl check` and the tuning of an observer spend most
of their time on.

What is a state of its own is taken out first. Then Householder's reduction to Hessenberg form, and Francis'
QR steps with double shifts, as in EISPACK: no part of it errs by more than rounding does. LAPACK, which NumPy
calls, is made for large matrices and takes two to three times as long for the 10 to 20 rows of loops here."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from rtctl.control.jit import compiled, inlined, made_elsewhere, plain

MOST_STEPS = 60
"""QR steps for one eigenvalue, or pair; every tenth is an exceptional one. Five are usual."""
_EPSILON = 2.0**-52


def eigenvalues_of_each(stack: np.ndarray) -> np.ndarray:
    """All eigenvalues of real, finite matrices, shape (k, n, n): complex, shape (k, n), in any order.

    As plain Python, and for a matrix on which the steps do not end, NumPy's."""
    work = np.array(stack, dtype=float, order="C")
    if plain(_all) is _all:
        return np.asarray(np.linalg.eigvals(work), dtype=complex)
    _have_it_made()
    found = np.empty(work.shape[:2], dtype=complex)
    ended = np.empty(len(work), dtype=np.bool_)
    _all(work, found, ended)
    for at in np.flatnonzero(~ended):
        found[at] = np.linalg.eigvals(stack[at])
    return found


@cache
def _have_it_made() -> None:
    made_elsewhere(_all, f"from {__name__} import make; make()")


def make() -> None:
    """Compile, or load."""
    _all(np.zeros((1, 2, 2)), np.zeros((1, 2), complex), np.zeros(1, np.bool_))


@compiled
def _all(work: np.ndarray, found: np.ndarray, ended: np.ndarray) -> None:
    """Overwrites `work`; `ended`: which could be found."""
    for at in range(len(work)):
        left = _isolate(work[at], found[at])
        within = work[at].ravel()[: left * left].reshape(left, left)
        _balance(within)
        _reduce(within)
        ended[at] = _deflate(within, found[at])


@compiled
def _isolate(A: np.ndarray, found: np.ndarray) -> int:
    """Take out what reads no other state, or is read by none: its own eigenvalue stands on the diagonal. A
    rigid joint has no link, a force without low-pass no state.

    The others, as many as is returned, move to the front of the memory, closely; eigenvalues taken out are
    last."""
    n, flat, to = len(A), A.ravel(), 0
    kept, left, again = np.ones(n, np.bool_), n, True
    while again:
        again = False
        for i in range(n):
            if kept[i]:
                reads = is_read = False
                for j in range(n):
                    if kept[j] and j != i:
                        reads |= A[i, j] != 0.0
                        is_read |= A[j, i] != 0.0
                if not (reads and is_read):
                    kept[i], again, left = False, True, left - 1
                    found[left] = A[i, i]
    for i in range(n):
        if kept[i]:
            for j in range(n):
                if kept[j]:
                    flat[to] = A[i, j]
                    to += 1
    return left


@compiled
def _balance(A: np.ndarray) -> None:
    """Scale by powers of two, which rounds nothing, until rows and columns are alike: states have units."""
    n = len(A)
    again = True
    while again:
        again = False
        for i in range(n):
            column = row = 0.0
            for j in range(n):
                if j != i:
                    column += abs(A[j, i])
                    row += abs(A[i, j])
            if column == 0.0 or row == 0.0:
                continue
            factor, sum_before = 1.0, column + row
            while column < row / 2.0:
                factor, column = factor * 2.0, column * 4.0
            while column >= row * 2.0:
                factor, column = factor / 2.0, column / 4.0
            if (column + row) / factor < 0.95 * sum_before:
                again = True
                for j in range(n):
                    A[i, j] /= factor
                for j in range(n):
                    A[j, i] *= factor


@compiled
def _reduce(A: np.ndarray) -> None:
    """To Hessenberg form, by reflections."""
    n = len(A)
    v, along = np.empty(n), np.empty(n)  # here, once: making them takes as long as a reflection
    for m in range(1, n - 1):
        size = 0.0
        for i in range(m + 1, n):
            size = max(size, abs(A[i, m - 1]))
        if size > 0.0:
            size = max(size, abs(A[m, m - 1]))
            squares = 0.0
            for i in range(m, n):
                v[i] = A[i, m - 1] / size
                squares += v[i] * v[i]
            norm = -math.copysign(math.sqrt(squares), v[m])
            by = 1.0 / (squares - v[m] * norm)
            v[m] -= norm
            _reflect(A, m, v, by, along)
            A[m, m - 1] = size * norm
            A[m + 1 :, m - 1] = 0.0


@compiled
def _reflect(A: np.ndarray, m: int, v: np.ndarray, by: float, along: np.ndarray) -> None:
    """I - by v v' from both sides, v nil above row m: columns from m on, and all rows. `along`: room."""
    n = len(A)
    along[m:] = 0.0
    for i in range(m, n):  # rows outside, here and below: their elements lie together
        for j in range(m, n):
            along[j] += by * v[i] * A[i, j]
    for i in range(m, n):
        for j in range(m, n):
            A[i, j] -= v[i] * along[j]
    for i in range(n):
        share = 0.0
        for j in range(m, n):
            share += A[i, j] * v[j]
        for j in range(m, n):
            A[i, j] -= by * share * v[j]


@compiled
def _deflate(H: np.ndarray, found: np.ndarray) -> bool:
    """Eigenvalues of a Hessenberg matrix, from below; False where the steps do not end."""
    last, shifted, steps = len(H) - 1, 0.0, 0
    whole = 0.0
    for i in range(len(H)):
        for j in range(max(i - 1, 0), len(H)):
            whole += abs(H[i, j])
    while last >= 0:
        first = last
        while first > 0:
            beside = abs(H[first - 1, first - 1]) + abs(H[first, first])
            if abs(H[first, first - 1]) <= _EPSILON * (beside if beside > 0.0 else whole):
                H[first, first - 1] = 0.0
                break
            first -= 1
        if first >= last - 1:
            if first == last:
                found[last] = H[last, last] + shifted
            else:
                _pair(H, found, last, shifted)
            last, steps = first - 1, 0
            continue
        if steps == MOST_STEPS:
            return False
        x, y = H[last, last], H[last - 1, last - 1]
        w = H[last, last - 1] * H[last - 1, last]
        if steps % 10 == 9:
            shifted += x
            for i in range(last + 1):
                H[i, i] -= x
            # EISPACK's exceptional shift: any that no symmetry of the matrix shares ends a cycle
            x = y = 0.75 * (abs(H[last, last - 1]) + abs(H[last - 1, last - 2]))
            w = -0.4375 * (x / 0.75) ** 2
        steps += 1
        _step(H, first, last, x, y, w)
    return True


@compiled
def _pair(H: np.ndarray, found: np.ndarray, last: int, shifted: float) -> None:
    """The two eigenvalues of the block at the end."""
    x = H[last, last]
    p = 0.5 * (H[last - 1, last - 1] - x)
    q = p * p + H[last, last - 1] * H[last - 1, last]
    z = math.sqrt(abs(q))
    x += shifted
    if q >= 0.0:
        z = p + math.copysign(z, p)
        found[last - 1] = x + z
        found[last] = x - H[last, last - 1] * H[last - 1, last] / z if z != 0.0 else x + z
    else:
        found[last - 1], found[last] = complex(x + p, z), complex(x + p, -z)


@compiled
def _top(
    H: np.ndarray, first: int, last: int, x: float, y: float, w: float
) -> tuple[int, float, float, float]:
    """Where a step may begin, as two small elements above each other part what is above, and its first
    reflection."""
    top = last - 2
    while True:
        z = H[top, top]
        r, s = x - z, y - z
        p = (r * s - w) / H[top + 1, top] + H[top, top + 1]
        q, r = H[top + 1, top + 1] - z - r - s, H[top + 2, top + 1]
        s = 1.0 / (abs(p) + abs(q) + abs(r))
        p, q, r = p * s, q * s, r * s
        if top == first:
            return top, p, q, r
        small = abs(H[top, top - 1]) * (abs(q) + abs(r))
        around = abs(H[top - 1, top - 1]) + abs(z) + abs(H[top + 1, top + 1])
        if small <= _EPSILON * abs(p) * around:
            return top, p, q, r
        top -= 1


@inlined
def _from_the_right(
    H: np.ndarray, first: int, to: int, k: int, three: bool, x: float, y: float, z: float, q: float, r: float
) -> None:
    """The reflection of a step on columns k to k + 2, or to k + 1."""
    for i in range(first, to + 1):
        along = x * H[i, k] + y * H[i, k + 1]
        if three:
            along += z * H[i, k + 2]
            H[i, k + 2] -= along * r
        H[i, k + 1] -= along * q
        H[i, k] -= along


@compiled
def _step(H: np.ndarray, first: int, last: int, x: float, y: float, w: float) -> None:
    """One QR step with both shifts of sum x + y and product x y - w, on the rows and columns first to last.

    A bulge of three rows is chased downwards; only what eigenvalues need is kept."""
    top, p, q, r = _top(H, first, last, x, y, w)
    for i in range(top + 2, last + 1):
        H[i, i - 2] = 0.0
        if i > top + 2:
            H[i, i - 3] = 0.0
    for k in range(top, last):
        three = k < last - 1
        if k > top:
            p, q, r = H[k, k - 1], H[k + 1, k - 1], H[k + 2, k - 1] if three else 0.0
            x = abs(p) + abs(q) + abs(r)
            if x == 0.0:
                continue
            by = 1.0 / x
            p, q, r = p * by, q * by, r * by
        s = math.copysign(math.sqrt(p * p + q * q + r * r), p)
        if k > top:
            H[k, k - 1] = -s * x
        elif first != top:
            H[k, k - 1] = -H[k, k - 1]
        p += s
        by, along = 1.0 / s, 1.0 / p
        x, y, z = p * by, q * by, r * by
        q, r = q * along, r * along
        for j in range(k, last + 1):
            along = H[k, j] + q * H[k + 1, j]
            if three:
                along += r * H[k + 2, j]
                H[k + 2, j] -= along * z
            H[k + 1, j] -= along * y
            H[k, j] -= along * x
        _from_the_right(H, first, min(last, k + 3), k, three, x, y, z, q, r)
