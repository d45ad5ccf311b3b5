r"""Eigenvalues and eigenvectors of small real matrices, in place: Hessenberg form and Francis' QR.

The matrix is balanced by powers of two, brought to Hessenberg form by Householder reflections,
and to the quasi-triangular real Schur form A = Q T Q^T by implicit double shifts, so that complex
eigenvalues come in exact conjugate pairs. Eigenvectors follow by back substitution in T.

Simple eigenvalues are right to a few times eps |A| times their condition number, as LAPACK's are.
At a double eigenvalue with one eigenvector both split by about sqrt(eps) |A|, 1e-8, as any
backward stable method does; their mean is right to eps. One with two eigenvectors, as equal parts
of a machine give it, keeps both: their residuals are those of simple ones.

G. H. Golub, C. F. Van Loan, Matrix Computations, 4th ed., sections 7.4 to 7.6.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from flipflow.compiled.arrays import Complex, Real
from flipflow.compiled.by_reference import by_reference
from flipflow.compiled.compile import kernel

EPS = 2.220446049250313e-16  # relative rounding: spacing of floating-point numbers at 1
MOST_SWEEPS = 300  # of one block, which usually splits after two or three
STUCK = 10  # sweeps after which a shift from outside breaks a cycle
BALANCED = 0.95  # a scaling that saves less than this is not worth its pass
MOST_PASSES = 20  # of balancing over all rows


@by_reference
class Schur(NamedTuple):
    """Scratch for one matrix of n rows."""

    T: Real  # (n, n) given: the matrix; left: its Schur form
    Q: Real  # (n, n) orthogonal
    scale: Real  # (n,) the balanced matrix is D^-1 A D with D = diag(scale)
    v: Real  # (n,) reflection
    w: Real  # (n,) its answer, column by column
    value: Complex  # (n,) eigenvalues, a conjugate pair side by side, +imag first
    y: Complex  # (n,) eigenvector of T
    vector: Complex  # (n,) eigenvector of the balanced matrix, Q y


@kernel
def balance(work: Schur) -> None:
    """Scale rows and columns of work.T by powers of two until their norms are alike."""
    n = work.T.shape[0]
    for i in range(n):
        work.scale[i] = 1.0
    for _ in range(MOST_PASSES):
        settled = True
        for i in range(n):
            if _rescale(work, i):
                settled = False
        if settled:
            return


@kernel
def _rescale(work: Schur, i: int) -> bool:
    """Balance row and column i; whether that was worth it."""
    T = work.T
    n = T.shape[0]
    row = 0.0
    column = 0.0
    for j in range(n):
        if j != i:
            row += abs(T[i, j])
            column += abs(T[j, i])
    if not (0.0 < row < math.inf and 0.0 < column < math.inf):
        return False
    if row <= 2.0 * column and column <= 2.0 * row:
        return False  # the nearest power of two is 1, as it mostly is: no logarithm is needed
    factor = 2.0 ** round(0.5 * math.log2(row / column))
    if column * factor + row / factor >= BALANCED * (column + row):
        return False
    work.scale[i] *= factor
    for j in range(n):
        T[i, j] /= factor
    for j in range(n):
        T[j, i] *= factor
    return True


@kernel
def hessenberg(work: Schur, whole: bool) -> None:
    """T <- Q^T T Q with zeros below the first subdiagonal; Q only when ``whole``."""
    T, Q, v = work.T, work.Q, work.v
    n = T.shape[0]
    for i in range(n):
        for j in range(n):
            Q[i, j] = 1.0 if i == j else 0.0
    for k in range(n - 2):
        square = _reflection(T, v, k)
        if square == 0.0:
            continue
        _reflect_columns(T, v, work.w, k, k + 1, square)
        for i in range(k + 2, n):
            T[i, k] = 0.0
        for i in range(n):
            _reflect_row(T, v, i, k + 1, n, square)
            if whole:
                _reflect_row(Q, v, i, k + 1, n, square)


@kernel(inline=True)
def _reflection(T: Real, v: Real, k: int) -> float:
    """Householder's v that leaves column k one number below the diagonal; its square."""
    n = T.shape[0]
    square = 0.0
    for i in range(k + 1, n):
        v[i] = T[i, k]
        square += v[i] * v[i]
    size = math.sqrt(square)
    v[k + 1] += size if v[k + 1] > 0.0 else -size
    square = 0.0
    for i in range(k + 1, n):
        square += v[i] * v[i]
    return square


@kernel(inline=True)
def _reflect_columns(T: Real, v: Real, w: Real, column: int, first: int, square: float) -> None:
    """Columns from ``column`` on of (I - 2 v v^T / square) T, row by row as memory has them."""
    n = T.shape[0]
    for j in range(column, n):
        w[j] = 0.0
    for i in range(first, n):
        for j in range(column, n):
            w[j] += v[i] * T[i, j]
    for i in range(first, n):
        factor = 2.0 / square * v[i]
        for j in range(column, n):
            T[i, j] -= factor * w[j]


@kernel(inline=True)
def _reflect_row(T: Real, v: Real, i: int, first: int, end: int, square: float) -> None:
    """Row i of T (I - 2 v v^T / square)."""
    total = 0.0
    for j in range(first, end):
        total += T[i, j] * v[j]
    total *= 2.0 / square
    for j in range(first, end):
        T[i, j] -= total * v[j]


@kernel(shared=True)
def real_schur(work: Schur, whole: bool) -> bool:
    """Schur form of work.T and its eigenvalues; False when the iteration does not end.

    ``whole``: T and Q as well, for eigenvectors; else only the eigenvalues are right.
    """
    T = work.T
    n = T.shape[0]
    for i in range(n):
        for j in range(n):
            if not math.isfinite(T[i, j]):
                return False
    balance(work)
    hessenberg(work, whole)
    norm = 0.0
    for i in range(n):
        for j in range(n):
            norm = max(norm, abs(T[i, j]))
    high, sweeps = n - 1, 0
    while high >= 0:
        # What does not shrink beside its neighbours is small enough beside the whole.
        low = _block_start(T, high, norm if sweeps > STUCK else 0.0)
        if low >= high - 1:
            _deflate(work, low, high, whole)
            high, sweeps = low - 1, 0
            continue
        sweeps += 1
        if sweeps > MOST_SWEEPS:
            return False
        _double_shift(work, low, high, sweeps % STUCK == 0, whole)
    return True


@kernel(inline=True)
def _block_start(T: Real, high: int, norm: float) -> int:
    """First row of the unreduced block that ends at ``high``; what is negligible becomes zero."""
    for low in range(high, 0, -1):
        beside = abs(T[low - 1, low - 1]) + abs(T[low, low])
        if abs(T[low, low - 1]) <= EPS * max(beside, norm):
            T[low, low - 1] = 0.0
            return low
    return 0


@kernel
def _deflate(work: Schur, low: int, high: int, whole: bool) -> None:
    """Eigenvalues of a block of one or two rows; two real ones make it triangular."""
    T = work.T
    if low == high:
        work.value[low] = T[low, low] + 0j
        return
    a, b, c, d = T[low, low], T[low, high], T[high, low], T[high, high]
    half = 0.5 * (a - d)
    inside = half * half + b * c
    if inside < 0.0:
        root = math.sqrt(-inside)
        work.value[low] = complex(d + half, root)
        work.value[high] = complex(d + half, -root)
        return
    z = half + math.sqrt(inside) if half >= 0.0 else half - math.sqrt(inside)
    work.value[low] = d + z + 0j
    work.value[high] = (d - b * c / z if z != 0.0 else d) + 0j
    if whole:
        # (z, c) is an eigenvector of the block: turned onto the first axis.
        size = math.hypot(z, c)
        if size > 0.0:
            _rotate(work, low, high, z / size, c / size)
        T[high, low] = 0.0


@kernel(inline=True)
def _rotate(work: Schur, low: int, high: int, cos: float, sin: float) -> None:
    T, Q = work.T, work.Q
    n = T.shape[0]
    for j in range(n):
        one, two = T[low, j], T[high, j]
        T[low, j] = cos * one + sin * two
        T[high, j] = cos * two - sin * one
    for i in range(n):
        one, two = T[i, low], T[i, high]
        T[i, low] = cos * one + sin * two
        T[i, high] = cos * two - sin * one
    for i in range(n):
        one, two = Q[i, low], Q[i, high]
        Q[i, low] = cos * one + sin * two
        Q[i, high] = cos * two - sin * one


@kernel
def _double_shift(work: Schur, low: int, high: int, outside: bool, whole: bool) -> None:
    """One implicit double-shift sweep of rows low ... high: a bulge is chased down."""
    T = work.T
    n = T.shape[0]
    total = T[high - 1, high - 1] + T[high, high]
    product = T[high - 1, high - 1] * T[high, high] - T[high - 1, high] * T[high, high - 1]
    if outside:
        size = abs(T[high, high - 1]) + abs(T[high - 1, high - 2])
        at = 0.75 * size + T[high, high]
        total, product = 2.0 * at, at * at + 0.4375 * size * size
    head = T[low, low]
    x = head * head + T[low, low + 1] * T[low + 1, low] - total * head + product
    y = T[low + 1, low] * (head + T[low + 1, low + 1] - total)
    z = T[low + 1, low] * T[low + 2, low + 1]
    first, last = (0, n) if whole else (low, high + 1)
    for k in range(low, high):
        end = min(k + 3, high + 1)
        z = z if end - k == 3 else 0.0
        size = math.sqrt(x * x + y * y + z * z)
        if size > 0.0:
            x = x + size if x > 0.0 else x - size
            _sweep_step(work, k, end - 1, (x, y, z), (max(first, k - 1), last, first), whole)
            if k > low:
                # Below the subdiagonal only rounding is left of what was reflected.
                T[k + 1, k - 1] = 0.0
                if end - k == 3:
                    T[k + 2, k - 1] = 0.0
        if k < high - 1:
            x, y = T[k + 1, k], T[k + 2, k]
            z = T[k + 3, k] if k < high - 2 else 0.0


@kernel(inline=True)
def _sweep_step(
    work: Schur,
    k: int,
    bottom: int,
    v: tuple[float, float, float],
    span: tuple[int, int, int],
    whole: bool,
) -> None:
    """Reflect rows and columns k to ``bottom``, two or three of them, along v.

    With two the third number of v is zero and its row, which is the second again, stays.
    """
    T, Q = work.T, work.Q
    x, y, z = v
    column, last, row = span
    factor = 2.0 / (x * x + y * y + z * z)
    for j in range(column, last):
        total = factor * (x * T[k, j] + y * T[k + 1, j] + z * T[bottom, j])
        T[k, j] -= total * x
        T[k + 1, j] -= total * y
        T[bottom, j] -= total * z
    for i in range(row, min(k + 4, last)):
        total = factor * (x * T[i, k] + y * T[i, k + 1] + z * T[i, bottom])
        T[i, k] -= total * x
        T[i, k + 1] -= total * y
        T[i, bottom] -= total * z
    if whole:
        for i in range(T.shape[0]):
            total = factor * (x * Q[i, k] + y * Q[i, k + 1] + z * Q[i, bottom])
            Q[i, k] -= total * x
            Q[i, k + 1] -= total * y
            Q[i, bottom] -= total * z


@kernel
def eigenvector(work: Schur, k: int) -> None:
    """Right eigenvector of eigenvalue k of the balanced matrix into work.vector, of norm 1.

    For a conjugate pair k is its first place. That of A itself is scale times it.
    """
    T, y = work.T, work.y
    n = T.shape[0]
    value = work.value[k]
    largest = 0.0
    for i in range(n):
        y[i] = 0.0
        for j in range(n):
            largest = max(largest, abs(T[i, j]))
    least = EPS * largest
    y[k] = 1.0
    if value.imag != 0.0:
        if abs(T[k, k + 1]) >= abs(T[k + 1, k]):
            y[k + 1] = (value - T[k, k]) / T[k, k + 1]
        else:
            y[k] = (value - T[k + 1, k + 1]) / T[k + 1, k]
            y[k + 1] = 1.0
    last = k + 1 if value.imag != 0.0 else k
    i = k - 1
    while i >= 0:
        if i > 0 and T[i, i - 1] != 0.0:
            _two_rows(work, i - 1, last, value, least)
            i -= 2
        else:
            y[i] = -_row_sum(T, y, i, i + 1, last) / _kept_off_zero(T[i, i] - value, least)
            i -= 1
    _turned_back(work, last)


@kernel(inline=True)
def _row_sum(T: Real, y: Complex, i: int, first: int, last: int) -> complex:
    total = 0j
    for j in range(first, last + 1):
        total += T[i, j] * y[j]
    return total


@kernel(inline=True)
def _kept_off_zero(x: complex, least: float) -> complex:
    """A pivot that vanishes belongs to a double eigenvalue: the vector of the other is as good."""
    return x if _size(x) > least else least + 0j


@kernel
def _two_rows(work: Schur, i: int, last: int, value: complex, least: float) -> None:
    """Solve for y[i], y[i + 1] across a block of two rows, with complete pivoting.

    At a double pair the block is as good as singular, and Cramer's rule would lose all digits.
    """
    T, y = work.T, work.y
    row, column, largest = 0, 0, -1.0
    for r in range(2):
        for c in range(2):
            size = _size(_shifted(T, i + r, i + c, value))
            if size > largest:
                row, column, largest = r, c, size
    pivot = _kept_off_zero(_shifted(T, i + row, i + column, value), least)
    beside = _shifted(T, i + row, i + 1 - column, value)
    factor = _shifted(T, i + 1 - row, i + column, value) / pivot
    rest = _shifted(T, i + 1 - row, i + 1 - column, value) - factor * beside
    one = -_row_sum(T, y, i + row, i + 2, last)
    two = -_row_sum(T, y, i + 1 - row, i + 2, last) - factor * one
    y[i + 1 - column] = two / _kept_off_zero(rest, least)
    y[i + column] = (one - beside * y[i + 1 - column]) / pivot


@kernel(inline=True)
def _shifted(T: Real, r: int, c: int, value: complex) -> complex:
    """Entry of T - value I."""
    return T[r, c] - value if r == c else T[r, c] + 0j


@kernel(inline=True)
def _size(x: complex) -> float:
    return abs(x.real) + abs(x.imag)


@kernel(inline=True)
def _turned_back(work: Schur, last: int) -> None:
    """vector = Q y / |Q y|, with the first ``last`` + 1 numbers of y."""
    Q, y = work.Q, work.y
    n = Q.shape[0]
    square = 0.0
    for j in range(last + 1):
        square += y[j].real ** 2 + y[j].imag ** 2
    size = math.sqrt(square)
    for i in range(n):
        total = 0j
        for j in range(last + 1):
            total += Q[i, j] * y[j]
        work.vector[i] = total / size


def new_schur(n: int) -> Schur:
    """Scratch for matrices of n rows."""
    return Schur(
        T=np.zeros((n, n)),
        Q=np.zeros((n, n)),
        scale=np.ones(n),
        v=np.zeros(n),
        w=np.zeros(n),
        value=np.zeros(n, np.complex128),
        y=np.zeros(n, np.complex128),
        vector=np.zeros(n, np.complex128),
    )


@kernel(entry=True)
def eigenvalues_of_each(matrices: Real, work: Schur, values: Complex) -> None:
    """Eigenvalues (P, n) of matrices (P, n, n); NaN where a matrix is not finite.

    Each is scaled by a power of two, so that no square of its numbers vanishes or overflows.
    """
    n = matrices.shape[1]
    for p in range(matrices.shape[0]):
        largest = 0.0
        for i in range(n):
            for j in range(n):
                largest = max(largest, abs(matrices[p, i, j]))
        factor = 1.0
        if 0.0 < largest < math.inf:
            factor = 2.0 ** -round(math.log2(largest))
        for i in range(n):
            for j in range(n):
                work.T[i, j] = matrices[p, i, j] * factor
        known = real_schur(work, False)
        for i in range(n):
            values[p, i] = work.value[i] / factor if known else complex(math.nan, math.nan)


def eigenvalues(matrices: Real) -> Complex:
    """Eigenvalues (..., n) of real matrices (..., n, n); NaN where a matrix is not finite."""
    n = matrices.shape[-1]
    rows = np.ascontiguousarray(matrices, dtype=np.float64).reshape(-1, n, n)
    found = np.empty(rows.shape[:2], np.complex128)
    eigenvalues_of_each(rows, new_schur(n), found)
    return found.reshape(matrices.shape[:-1])
