"""Which parameter of a machine matters most to a quantity."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flipflow import __version__
from flipflow.compiled.arrays import Real
from flipflow.model.arguments import (
    checked_count,
    checked_generator,
    checked_monitor,
)
from flipflow.model.monitor import Monitor
from flipflow.model.parameters import value_of
from flipflow.model.quantities import BranchWord
from flipflow.model.sampling import Columns
from flipflow.model.system import Machine
from flipflow.model.vary import Distribution, Variation, Vary, variations
from flipflow.results.result import Result
from flipflow.studies.sensitivity_samples import (
    Question,
    checked_threads,
    closed_form_values,
    motion_values,
    nearest_turn,
    nominal_values,
    question_of,
)
from flipflow.studies.sobol import LEAST_GROUPS, SobolIndices, saltelli_sample, sobol_indices


@dataclass(frozen=True, eq=False)
class Sensitivity(Result):
    """Sobol indices of a quantity; it is what :func:`flipflow.sensitivity` returns.

    Arrays over the D fields are (D,) where ``omega`` is one frequency or None, and (n_omega, D)
    where it is an array; arrays over frequency are then numbers, or (n_omega,).

    Parameters
    ----------
    machine
        The machine about which the fields vary.
    quantity
        Name of the quantity, one of the table in :mod:`flipflow.model.quantities`.
    branch
        Which motion is meant where several exist.
    names, distributions
        The fields in the order given, and how each varies.
    omega
        Frequencies in rad/s; the interval analysed where the quantity is one of a whole response.
    n
        Groups drawn; n (D + 2) samples were evaluated.
    first_order, total
        First-order and total indices S_i and S_Ti. 0 where the quantity does not vary; NaN where
        too few samples were left.
    first_order_confidence, total_confidence
        Half widths of their 95 % confidence intervals.
    mean, variance
        Of the quantity over all independent samples, SI.
    failed
        Share of samples without a value. The whole group of D + 2 samples around a failed one is
        left out, so that all pairs still differ in one field alone.
    nominal
        The quantity of the machine itself, SI; NaN where its motion is unstable, as of samples.
    at_low, at_high
        The quantity with one field at the low or the high end of its range, SI.
    own
        The machine's own value of each field.
    notes
        A sentence for each thing to keep in mind.
    version
        Version of flipflow.
    """

    machine: Machine
    quantity: str
    branch: str
    names: tuple[str, ...]
    distributions: tuple[Distribution, ...]
    omega: float | Real | tuple[float, float]
    n: int
    first_order: Real
    total: Real
    first_order_confidence: Real
    total_confidence: Real
    mean: float | Real
    variance: float | Real
    failed: float | Real
    nominal: float | Real
    at_low: Real
    at_high: Real
    own: tuple[object, ...]
    notes: tuple[str, ...]
    version: str

    def __repr__(self) -> str:
        fields = ", ".join(self.names)
        return f"Sensitivity({self.quantity} on {fields}; {self.n} groups)"

    @property
    def screen(self) -> Machine:
        """The machine, by the name it has where it is a screen."""
        return self.machine

    @property
    def over_frequency(self) -> bool:
        """Whether the indices are given over an array of frequencies."""
        return self.total.ndim == 2

    @property
    def ends(self) -> tuple[tuple[object, object], ...]:
        """Low and high end of each field's range, for which ``at_low`` and ``at_high`` stand."""
        return tuple(distribution.ends for distribution in self.distributions)


@dataclass(frozen=True, eq=False)
class OneAtATime:
    """A quantity with one field at a time at the ends of its range, all else as it is.

    Parameters
    ----------
    machine, quantity, names, distributions, omega, nominal, at_low, at_high, own
        As in :class:`Sensitivity`, at one frequency in rad/s.
    """

    machine: Machine
    quantity: str
    names: tuple[str, ...]
    distributions: tuple[Distribution, ...]
    omega: float
    nominal: float
    at_low: Real
    at_high: Real
    own: tuple[object, ...]

    @property
    def over_frequency(self) -> bool:
        """Whether there is more than one frequency: there is not."""
        return False

    @property
    def ends(self) -> tuple[tuple[object, object], ...]:
        """Low and high end of each field's range."""
        return tuple(distribution.ends for distribution in self.distributions)


FEW_GROUPS = 64  # groups below which intervals of 95 % hold less often: benchmarks/sobol.py
N_MOST = 2**20  # groups of samples that may be asked for
# Values held at once: all samples at as many frequencies as fit.
BLOCK_VALUES = 2_000_000


def sensitivity(
    machine: Machine,
    vary: Vary,
    quantity: str,
    omega: ArrayLike | None = None,
    *,
    n: int = 4096,
    rng: int | np.random.Generator = 0,
    threads: int | None = None,
    monitor: Monitor | None = None,
    branch: BranchWord = "from-below",
) -> Sensitivity:
    r"""Sobol indices of a quantity on fields of a machine that vary independently.

    The first-order index :math:`S_i = \mathrm{Var}(E(y | x_i)) / \mathrm{Var}(y)` is the share of
    the variance that goes away when field i is known; the total index
    :math:`S_{Ti} = 1 - \mathrm{Var}(E(y | x_{\sim i})) / \mathrm{Var}(y)` is what remains when all
    others are. n (D + 2) samples are drawn from Sobol's scrambled sequence in Saltelli's scheme.
    A screen without stop is evaluated in closed form; otherwise a motion is solved for in every
    sample. A sample without a value does not end the work: its group of D + 2 is left out, and
    ``failed`` says how many there were.

    Parameters
    ----------
    machine
        The machine about which the fields vary: a screen, any frozen dataclass with ``.system()``,
        or a :class:`~flipflow.MechanicalSystem`.
    vary
        Fields of the screen or of the dataclass, or places in the system such as
        ``"springs[0].clearance"``; each with an interval as a tuple (low, high), an array or a list
        that is sampled as it stands, :class:`~flipflow.Normal` or :class:`~flipflow.Choice`; SI.
    quantity
        A quantity of a motion, such as ``"relative_amplitude"`` or ``"main_frame_acceleration"``,
        or one of the whole response: ``"peak_amplitude"``, ``"peak_frequency"``, ``"omega_ea"``,
        ``"omega_ar"``, ``"omega_cs"``, ``"omega_lb"``, ``"omega_ub"``. A machine that is no
        screen has ``"amplitude[0]"``, ``"phase[0]"`` and so on of its degrees of freedom,
        ``"left_amplitude"``, ``"left_phase"`` of a coordinate named "left"; ``"stop_force"``,
        the greatest of all its stops; ``"contact_share"``, ``"dissipated_power"``,
        ``"jump_margin"``, ``"largest_multiplier"``; and of the whole response those above but for
        ``"omega_ea"`` and ``"omega_ar"``. Its peak is that of the coordinate "relative", else of
        the first that is named, else of the first degree of freedom.
    omega
        Frequency in rad/s, one or (n_omega,). For a quantity of the whole response the interval
        (low, high) analysed; None: from well below the first natural frequency of the machine to
        well above the last with the stop engaged.
    n
        Groups; best a power of two.
    rng
        Seed or generator.
    threads
        Threads over chunks of samples where motions are solved for; None: one for each processor,
        but one alone for a quantity of the whole response, most of whose work cannot run beside
        itself. The result is the same.
    monitor
        Called with a sentence and the share done, 0 to 1. What it raises ends the work.
    branch
        The motion that is meant where several exist: ``"from-below"`` is met when the speed is
        raised slowly. Of this one and the one met when it is lowered, ``"upper"`` has the larger
        relative amplitude and ``"lower"`` the smaller; of a machine that is no screen, amplitude of
        the coordinate of its peak. A motion between folds that neither way meets is none of them;
        ``jump_margin`` alone looks at all motions of the branch that are not unstable.

    Returns
    -------
    Sensitivity
        Indices (D,) for one frequency, (n_omega, D) for several, with confidence intervals.

    Raises
    ------
    InputError
        For an unknown field or quantity, with those that the machine has; for a range that physics
        forbids, and data that the quantity needs and a screen does not have.
    MissingExtra
        When SALib is not installed.

    References
    ----------
    Saltelli and others, Computer Physics Communications 181 (2010) 259-270, for the estimators.
    """
    question = question_of(machine, quantity, omega, branch)
    varied = variations(vary, machine)
    workers = checked_threads(question, threads)
    groups = checked_count("n", n, N_MOST, least=LEAST_GROUPS)
    generator = checked_generator(rng)
    checked_monitor(monitor)
    nominal = nominal_values(question, tuple(one.name for one in varied))
    points = saltelli_sample(len(varied), groups, generator)
    u = points.reshape(-1, len(varied))
    columns = {one.name: one.distribution.quantile(u[:, i]) for i, one in enumerate(varied)}
    draws = np.random.default_rng(generator.integers(2**63)).bit_generator.state
    blocks = [
        _analysed(values.reshape(*points.shape[:2], -1), draws)
        for values in _values(question, columns, nominal, workers, monitor)
    ]
    found, failed = _joined(blocks)
    rows = _ends(machine, varied)
    ends = np.concatenate(list(_values(question, rows, nominal, workers, None)), axis=1)
    return _result(question, varied, groups, found, failed, nominal, ends, omega)


def one_at_a_time(machine: Machine, vary: Vary, quantity: str, omega: float) -> OneAtATime:
    """Move each field alone to the ends of its range: what a tornado chart shows.

    Parameters
    ----------
    machine, vary, quantity
        As for :func:`sensitivity`; the motion is the one reached from below.
    omega
        One frequency in rad/s.

    Raises
    ------
    InputError
        As for :func:`sensitivity`.
    """
    question = question_of(machine, quantity, omega, "from-below")
    varied = variations(vary, machine)
    nominal = nominal_values(question, tuple(one.name for one in varied))
    rows = _ends(machine, varied)
    ends = np.concatenate(list(_values(question, rows, nominal, 1, None)), axis=1)[:, 0]
    return OneAtATime(
        machine=machine,
        quantity=quantity,
        names=tuple(variation.name for variation in varied),
        distributions=tuple(variation.distribution for variation in varied),
        omega=float(omega),
        nominal=float(nominal[0, 0]),
        at_low=ends[: len(varied)],
        at_high=ends[len(varied) :],
        own=_own(machine, varied),
    )


def _own(machine: Machine, varied: Sequence[Variation]) -> tuple[object, ...]:
    return tuple(value_of(machine, one.name) for one in varied)


def _values(
    question: Question,
    columns: Columns,
    nominal: Real,
    threads: int,
    monitor: Monitor | None,
) -> Iterator[Real]:
    """Values (S, K) of all samples, a block of frequencies after the other."""
    rows = len(next(iter(columns.values())))

    def tell(share: float) -> None:
        if monitor is not None:
            monitor(f"{question.quantity.label}: {rows} samples", share)

    if not question.in_closed_form(tuple(columns)):
        yield nearest_turn(question, motion_values(question, columns, threads, tell), nominal)
        return
    step = max(BLOCK_VALUES // rows, 1)
    for begin in range(0, question.omega.size, step):
        part = slice(begin, begin + step)
        values = closed_form_values(question, columns, question.omega[part])
        yield nearest_turn(question, values, nominal[:, part])
        tell(min((begin + step) / question.omega.size, 1.0))


def _analysed(values: Real, draws: Any) -> tuple[SobolIndices, Real]:
    """Indices and share of failed samples of a block; all blocks draw the same resamples."""
    generator = np.random.default_rng()
    generator.bit_generator.state = draws
    return sobol_indices(values, generator), 1.0 - np.isfinite(values).mean(axis=(0, 1))


def _joined(blocks: Sequence[tuple[SobolIndices, Real]]) -> tuple[SobolIndices, Real]:
    names = SobolIndices.__dataclass_fields__
    tables = [np.concatenate([getattr(one, name) for one, _ in blocks]) for name in names]
    return SobolIndices(*tables), np.concatenate([failed for _, failed in blocks])


def _ends(machine: Machine, varied: Sequence[Variation]) -> Columns:
    """Rows that change one field at a time: all low ends, then all high ends."""
    count = len(varied)
    columns: dict[str, NDArray[Any]] = {}
    for i, one in enumerate(varied):
        column = np.full(2 * count, value_of(machine, one.name), dtype=object)
        column[i], column[count + i] = one.distribution.ends
        columns[one.name] = column
    return columns


def _result(
    question: Question,
    varied: Sequence[Variation],
    n: int,
    found: SobolIndices,
    failed: Real,
    nominal: Real,
    ends: Real,
    omega: object,
) -> Sensitivity:
    response = question.quantity.of == "response"
    one = response or np.ndim(omega) == 0  # type: ignore[arg-type]

    def over(table: Real) -> Any:
        picked = table[0] if one else table
        return float(picked) if np.ndim(picked) == 0 else picked

    count = len(varied)
    return Sensitivity(
        machine=question.machine,
        quantity=question.quantity.name,
        branch=question.branch,
        names=tuple(variation.name for variation in varied),
        distributions=tuple(variation.distribution for variation in varied),
        omega=question.span if response else over(question.omega),
        n=n,
        first_order=over(found.first_order),
        total=over(found.total),
        first_order_confidence=over(found.first_order_confidence),
        total_confidence=over(found.total_confidence),
        mean=over(found.mean),
        variance=over(found.variance),
        failed=over(failed),
        nominal=over(nominal[0]),
        at_low=over(ends[:count].T),
        at_high=over(ends[count:].T),
        own=_own(question.machine, varied),
        notes=tuple(_notes(n, found, failed)),
        version=__version__,
    )


def _notes(n: int, found: SobolIndices, failed: Real) -> Iterator[str]:
    if n & (n - 1):
        yield f"n = {n} is no power of two: the samples cover the ranges less evenly."
    if np.any(failed > 0.0):
        least = int(found.groups.min())
        yield (
            f"Up to {100.0 * failed.max():.3g} % of the samples have no finite value; the whole "
            f"group around each is left out, and at least {least} of {n} groups remain."
        )
    if np.any(found.groups < FEW_GROUPS):
        yield (
            f"Fewer than {FEW_GROUPS} groups tell: confidence intervals are too narrow; give a "
            "greater n."
        )
    if np.any(found.groups < LEAST_GROUPS):
        yield "Where fewer than two groups remain no index is given."
    if np.any(found.constant):
        at = "" if found.constant.size == 1 else f" at {found.constant.sum()} of the frequencies"
        yield f"The quantity does not vary{at}: its indices are zero there."
