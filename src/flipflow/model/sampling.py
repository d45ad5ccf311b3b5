"""Which machines a study looks at: every combination, a list, or a sample.

The words of ``vary`` are those of :mod:`flipflow.model.vary`; here they become columns of values,
one row a machine.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from flipflow.compiled.arrays import Real
from flipflow.errors import InputError
from flipflow.model.arguments import checked_count, checked_numbers, checked_word
from flipflow.model.system import Machine
from flipflow.model.vary import Choice, Normal, Variation, Vary, variations

Columns = Mapping[str, NDArray[Any]]
Drawn = Literal["sobol", "latin-hypercube", "monte-carlo"]
Listed = Literal["grid", "list"]
MOST_MACHINES = 2**24
LEAST_SHARE = 2.0**-53  # a share of 0 lies at minus infinity of a normal distribution
SAMPLING = 'give "grid", "list" or an ff.Sample, such as ff.Sample(n=1024)'


@dataclass(frozen=True, kw_only=True)
class Sample:
    """How machines are drawn from the distributions of ``vary``.

    Parameters
    ----------
    n
        Machines; of "sobol" best a power of two.
    method
        ``"sobol"``: Sobol's scrambled sequence; ``"latin-hypercube"``: every field once in each of
        n equal shares of its distribution; ``"monte-carlo"``: independent draws.
    seed
        Of the scrambling, or of the draws.
    covariance
        Covariance in SI of all fields in the order of ``vary``, (D, D); None: they vary
        independently. Fields that vary together are :class:`~flipflow.Normal`, and the diagonal is
        the square of their deviation.

    Raises
    ------
    InputError
        For a value that makes no sample.
    """

    n: int = 1024
    method: Drawn = "sobol"
    seed: int = 0
    covariance: tuple[tuple[float, ...], ...] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "n", checked_count("n", self.n, MOST_MACHINES, least=2))
        checked_word("method", self.method, get_args(Drawn))
        object.__setattr__(self, "seed", checked_count("seed", self.seed, 2**63 - 1, least=0))
        if self.covariance is not None:
            remedy = "give a row and a column for each field of vary, (D, D), in SI"
            matrix = checked_numbers("covariance", self.covariance, remedy)
            if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1]:
                raise InputError("covariance", self.covariance, remedy)
            if not np.array_equal(matrix, matrix.T):
                remedy = "a covariance is symmetric; give the same number in (i, j) and (j, i)"
                raise InputError("covariance", self.covariance, remedy)
            rows = tuple(tuple(map(float, row)) for row in matrix)
            object.__setattr__(self, "covariance", rows)


@dataclass(frozen=True, eq=False)
class Design:
    """The machines of a study.

    Parameters
    ----------
    varied
        Fields and how each varies, in the order given.
    sampling
        ``"grid"``, ``"list"``, or the method of a sample.
    sample
        How they were drawn; None for a grid and a list.
    columns
        Values of each field, SI, (S,) each; of a grid the last field runs fastest.
    """

    varied: tuple[Variation, ...]
    sampling: str
    sample: Sample | None
    columns: Columns

    @property
    def size(self) -> int:
        """Number of machines S."""
        return len(next(iter(self.columns.values())))

    @property
    def digest(self) -> str:
        """SHA-256 of all values."""
        return digest_of(self.columns)


def digest_of(columns: Columns) -> str:
    """SHA-256 of columns: names, numbers bit for bit, words."""
    found = hashlib.sha256()
    for name, column in columns.items():
        found.update(f"{name}\0{len(column)}\0".encode())
        words = column.dtype.kind not in "fiu"
        text = "\0".join(map(str, column)).encode() if words else b""
        found.update(text or np.ascontiguousarray(column, "<f8").tobytes())
    return found.hexdigest()


def design_of(machine: Machine, vary: Vary, sampling: object = None) -> Design:
    """The machines of a study.

    Parameters
    ----------
    machine
        The machine whose fields vary.
    vary
        Fields with an interval, an array or a list of values, :class:`~flipflow.Normal` or
        :class:`~flipflow.Choice`.
    sampling
        ``"grid"``: every combination of the values of arrays and choices; ``"list"``: the k-th
        values of all arrays together; a :class:`Sample`; None: a grid where every field has
        values of its own, else ``Sample()``.

    Raises
    ------
    InputError
        As :func:`~flipflow.model.vary.variations`; for a grid of an interval, a list of unequal
        lengths, a covariance that fits no field.
    """
    varied = variations(vary, machine)
    if sampling is None:
        own = all(isinstance(one.distribution, Choice) for one in varied)
        sampling = "grid" if own else Sample()
    if isinstance(sampling, Sample):
        return Design(varied, sampling.method, sampling, _drawn(varied, sampling))
    if not isinstance(sampling, str) or sampling not in get_args(Listed):
        raise InputError("sampling", sampling, SAMPLING)
    columns = _grid(varied) if sampling == "grid" else _listed(varied, vary)
    return Design(varied, sampling, None, columns)


def _values(one: Variation, sampling: str) -> Choice:
    """The values that a field has; a range has none."""
    if not isinstance(one.distribution, Choice):
        remedy = f"a {sampling} needs values; give an array, or draw an ff.Sample"
        raise InputError(f"vary {one.name}", one.distribution, remedy)
    return one.distribution


def _grid(varied: Sequence[Variation]) -> Columns:
    axes = [np.asarray(_values(one, "grid").values) for one in varied]
    count = np.prod([axis.size for axis in axes], dtype=float)
    if count > MOST_MACHINES:
        remedy = f"give fewer values, at most {MOST_MACHINES} combinations"
        raise InputError("vary", f"{count:.6g} combinations", remedy)
    grids = np.meshgrid(*axes, indexing="ij")
    return {one.name: grid.ravel() for one, grid in zip(varied, grids, strict=True)}


def _listed(varied: Sequence[Variation], vary: Vary) -> Columns:
    """Columns as given: an array's distribution has its values sorted."""
    columns: dict[str, NDArray[Any]] = {}
    for one in varied:
        given, known = vary[one.name], _values(one, "list")
        as_given = isinstance(given, (np.ndarray, list))
        columns[one.name] = np.array(given if as_given else known.values)
        if columns[one.name].dtype.kind in "iu":
            columns[one.name] = columns[one.name].astype(float)
    sizes = {name: column.size for name, column in columns.items()}
    if len(set(sizes.values())) > 1:
        told = ", ".join(f"{name}: {size}" for name, size in sizes.items())
        raise InputError("vary", told, "a list has as many values of every field")
    return columns


def _drawn(varied: Sequence[Variation], sample: Sample) -> Columns:
    u = _together(varied, sample, _points(len(varied), sample))
    columns = {one.name: one.distribution.quantile(u[:, i]) for i, one in enumerate(varied)}
    return {name: np.asarray(column) for name, column in columns.items()}


def _points(dimensions: int, sample: Sample) -> Real:
    """Points of the unit cube, (n, D)."""
    from scipy.stats import qmc  # noqa: PLC0415  slow to import

    generator = np.random.default_rng(sample.seed)
    if sample.method == "monte-carlo":
        return generator.random((sample.n, dimensions))
    if sample.method == "latin-hypercube":
        return np.asarray(qmc.LatinHypercube(dimensions, rng=generator).random(sample.n))
    sequence = qmc.Sobol(dimensions, scramble=True, rng=generator)
    # Drawn to the next power of two, which the sequence asks for, and cut there.
    whole = sequence.random_base2((sample.n - 1).bit_length())
    return np.asarray(whole[: sample.n])


def _together(varied: Sequence[Variation], sample: Sample, u: Real) -> Real:
    """Points whose normal fields have the covariance asked for; the others stay as they are."""
    if sample.covariance is None:
        return u
    from scipy.special import ndtr, ndtri  # noqa: PLC0415  slow to import

    factor = np.linalg.cholesky(_correlation(varied, np.array(sample.covariance)))
    z = ndtri(np.clip(u, LEAST_SHARE, 1.0 - LEAST_SHARE)) @ factor.T
    moved = np.any(factor != np.eye(len(varied)), axis=1)
    return np.where(moved, ndtr(z), u)


def _correlation(varied: Sequence[Variation], covariance: Real) -> Real:
    field = "covariance"
    if covariance.shape[0] != len(varied):
        remedy = f"give a row and a column for each of the {len(varied)} fields of vary"
        raise InputError(field, f"{covariance.shape[0]} rows", remedy)
    scale = np.ones(len(varied))
    for i, one in enumerate(varied):
        alone = not np.delete(covariance[i], i).any()
        if isinstance(one.distribution, Normal):
            scale[i] = one.distribution.std
            if not np.isclose(covariance[i, i], scale[i] ** 2, rtol=1e-6, atol=0.0):
                remedy = f"the deviation of {one.name} says {scale[i] ** 2:.6g}; give the same"
                raise InputError(f"{field}[{i}][{i}]", covariance[i, i], remedy)
        elif alone:
            covariance[i, i] = 1.0
        else:
            remedy = "only ff.Normal fields vary together; make it one, or give zeros"
            raise InputError(f"{field} of {one.name}", one.distribution, remedy)
    correlation = covariance / np.outer(scale, scale)
    np.fill_diagonal(correlation, 1.0)
    if np.linalg.eigvalsh(correlation).min() <= 0.0:
        remedy = "it is not positive definite: no fields vary like that"
        raise InputError(field, covariance.tolist(), remedy)
    return np.asarray(correlation)
