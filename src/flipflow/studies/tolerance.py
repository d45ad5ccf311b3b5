"""What tolerances cost: the share of machines, as they are built, that meet every limit."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flipflow import __version__
from flipflow.batch.reasons import FOUND
from flipflow.compiled.arrays import Real
from flipflow.errors import InputError
from flipflow.model.arguments import checked_kind
from flipflow.model.limits import PASSAGES, PASSING_FIELDS, Limits, limit_bounds
from flipflow.model.quantities import QUANTITIES, missing_words
from flipflow.model.system import Machine
from flipflow.model.vary import Choice, Distribution, Interval, Normal
from flipflow.results.result import Result
from flipflow.studies.study import Study

Flags = NDArray[np.bool_]
CONFIDENCE = 0.95
# Fewer machines say little of the share of those that pass.
LEAST_MACHINES = 30.0
FACTORS = np.linspace(0.2, 1.0, 17)
HALF = 0.5
FOLDS = ("omega_lb", "omega_ub")
MARGIN = "jump_margin"


@dataclass(frozen=True, eq=False)
class Tolerance(Result):
    """Shares of machines at F frequencies; it is what :func:`flipflow.tolerance` returns.

    An interval is (low, high), 95 %, along the last dimension.

    Parameters
    ----------
    machine
        The machine whose fields vary.
    names, distributions
        The fields, and how each varies.
    cases
        Load cases, (C,).
    omega
        Frequencies in rad/s, (F,).
    limits
        What was to be met.
    checked
        Names of the limits that were looked at, (B,); "every limit" below means these.
    size
        Number of machines S.
    passing
        Which machines meet every limit in every case, (S, F).
    share, share_interval
        Their share, (F,), and its confidence interval, (F, 2).
    by_limit
        Share of the machines that meet one limit in every case, (B, F).
    by_case
        Share that meet every limit in one case, (C, F).
    unknown
        Share of which a motion has no values, (F,); they count as not passing.
    jumped
        Whether the working motion of a machine has jumped, in some case, where that of the
        nominal machine has not, or the other way round, (S, F).
    jump_share, jump_interval
        Share of these machines, (F,) and (F, 2); NaN where the study did not ask for
        ``omega_lb`` and ``omega_ub``. Jumps at other folds than these, as at a resonance of a
        multiple of the speed, are not seen; a note tells where there may be some.
    coexisting
        Share of machines with another motion at that speed, in some case, (F,): the speed lies
        between ``omega_lb`` and ``omega_ub``, or ``jump_margin``, where the study asked for it, is
        0. NaN where the study did not ask for the first two.
    halved, halved_interval
        The share where the tolerance of one field alone is half as wide, (D, F) and (D, F, 2);
        NaN where too few machines tell.
    factors
        Factors on all tolerances together, (K,).
    scaled, scaled_interval
        The share with these, (K, F) and (K, F, 2).
    notes
        A sentence for each thing to keep in mind.
    version
        Version of flipflow.
    """

    machine: Machine
    names: tuple[str, ...]
    distributions: tuple[Distribution, ...]
    cases: tuple[str, ...]
    omega: Real
    limits: Limits
    checked: tuple[str, ...]
    size: int
    passing: Flags
    share: Real
    share_interval: Real
    by_limit: Real
    by_case: Real
    unknown: Real
    jumped: Flags
    jump_share: Real
    jump_interval: Real
    coexisting: Real
    halved: Real
    halved_interval: Real
    factors: Real
    scaled: Real
    scaled_interval: Real
    notes: tuple[str, ...]
    version: str

    def __repr__(self) -> str:
        shares = ", ".join(f"{100.0 * one:.4g} %" for one in self.share[:4])
        more = ", ..." if self.share.size > 4 else ""
        return f"Tolerance({shares}{more} of {self.size} machines meet {len(self.checked)} limits)"

    @property
    def gain(self) -> Real:
        """What half the tolerance of one field adds to the share, (D, F)."""
        return np.asarray(self.halved - self.share)

    def costliest(self, at: int = 0) -> str | None:
        """The field whose tolerance costs most at the frequency of index ``at``.

        None where no gain stands out of the confidence intervals.
        """
        gain = np.where(stands_out(self)[:, at], self.gain[:, at], 0.0)
        return self.names[int(np.argmax(gain))] if (gain > 0.0).any() else None


def tolerance(study: Study, limits: Limits) -> Tolerance:
    """The share of the machines of a study that meet every limit in every load case.

    A machine whose motion is not known does not pass. Where the fold that ends the working motion
    moves through the working speed, a share of the machines jumps: it is counted, and no quantity
    is averaged over motions before and after the jump. Shares at narrower tolerances are those of
    the same machines, weighted by how likely each is at the narrower tolerance: a uniform field
    keeps the middle of its range, the deviation of a normal one shrinks, a choice stays.

    Parameters
    ----------
    study
        What :func:`flipflow.study` returns, of a sample or of a list of machines.
    limits
        What is to be met; every quantity that is limited is one of the study's.

    Returns
    -------
    Tolerance
        Shares with 95 % confidence intervals by Clopper and Pearson; with weights, of as many
        machines as these are worth, (sum w)^2 / sum w^2.

    Raises
    ------
    InputError
        For a grid, whose machines are not drawn; for a study that is not complete, or lacks the
        quantity of a limit.

    References
    ----------
    Clopper and Pearson, Biometrika 26 (1934) 404-413.
    """
    checked_kind("study", study, Study, "give what ff.study returns")
    checked_kind("limits", limits, Limits, "give an ff.Limits, as ff.load_project(file).limits")
    if study.sampling == "grid":
        remedy = "the machines of a grid are not built by chance; draw an ff.Sample"
        raise InputError("study", study.sampling, remedy)
    if not study.complete:
        raise InputError("study", "not complete", "let it come to its end first")
    checked, unchecked = _limits_of(study, limits)
    met = np.stack([_met(study, limits, name) for name in checked])  # (B, S, C, F)
    known = np.asarray(study.reason == FOUND)
    passing = np.asarray((met.all(axis=0) & known).all(axis=1))
    jumped, coexisting = _jumps(study)
    share, interval = _shares(passing)
    jumping, jump_interval = _shares(jumped)
    if not folds_known(study):
        jumping, jump_interval = np.full_like(share, np.nan), np.full_like(interval, np.nan)
    halved, halved_interval = _halved(study, passing)
    scaled, scaled_interval = _scaled(study, passing)
    return Tolerance(
        machine=study.machine,
        names=study.names,
        distributions=study.distributions,
        cases=study.cases,
        omega=study.omega,
        limits=limits,
        checked=checked,
        size=study.size,
        passing=passing,
        share=share,
        share_interval=interval,
        by_limit=(met & known).all(axis=2).mean(axis=1),
        by_case=(met.all(axis=0) & known).mean(axis=0),
        unknown=1.0 - known.all(axis=1).mean(axis=0),
        jumped=jumped,
        jump_share=jumping,
        jump_interval=jump_interval,
        coexisting=coexisting,
        halved=halved,
        halved_interval=halved_interval,
        factors=FACTORS,
        scaled=scaled,
        scaled_interval=scaled_interval,
        notes=tuple(_notes(study, unchecked)),
        version=__version__,
    )


def stands_out(found: Tolerance) -> Flags:
    """Where half a tolerance changes the share by more than chance, (D, F).

    Neither share lies within the confidence interval of the other.
    """
    share, interval = found.share, found.share_interval
    low, high = found.halved_interval[..., 0], found.halved_interval[..., 1]
    above = (found.halved > interval[:, 1]) & (low > share)
    below = (found.halved < interval[:, 0]) & (high < share)
    return np.asarray(above | below)


def limits_in_words(limits: Limits, checked: tuple[str, ...]) -> str:
    """What a machine that passes has met: "every limit", or "the 3 limits looked at"."""
    if not limits_left_out(limits, checked):
        return "every limit"
    return f"the {len(checked)} limits looked at" if len(checked) > 1 else "the one limit looked at"


def limits_left_out(limits: Limits, checked: tuple[str, ...]) -> tuple[str, ...]:
    """The limits that were given and not looked at, in words."""
    running = [QUANTITIES[name].label for name in limits.given if name not in checked]
    passing = [
        f"{QUANTITIES[field.name].label} at {passage}"
        for passage in PASSAGES
        for field in PASSING_FIELDS[passage]
        if getattr(getattr(limits, passage), field.name) is not None
    ]
    return (*running, *passing)


def limits_known(study: Study, limits: Limits) -> tuple[str, ...]:
    """Names of the limits whose quantities a study holds."""
    return tuple(
        name for name in limits.given if name in study.values or QUANTITIES[name].of == "operation"
    )


def folds_known(study: Study) -> bool:
    """Whether a study has asked for both ends of the region of two motions."""
    return all(name in study.values for name in FOLDS)


def jumped_motions(study: Study) -> Flags:
    """Motions that lie beyond the jump speed, (S, C, F), of a study that asked for folds."""
    end = study.values[FOLDS[0] if study.branch == "lower" else FOLDS[1]]
    return np.asarray(study.omega > end[:, :, np.newaxis])


def _limits_of(study: Study, limits: Limits) -> tuple[tuple[str, ...], dict[str, str]]:
    """Limits that can be checked, and why others cannot."""
    unchecked = {
        name: missing_words(absent)
        for name in limits.given
        if (absent := QUANTITIES[name].missing(study.machine))
    }
    checked = tuple(name for name in limits.given if name not in unchecked)
    for name in checked:
        if name not in study.values and QUANTITIES[name].of != "operation":
            remedy = f"the study did not ask for {name}, add it to its quantities"
            raise InputError("limits", name, remedy)
    if not checked:
        raise InputError("limits", limits.given, "none can be checked; give at least one that can")
    return checked, unchecked


def _met(study: Study, limits: Limits, name: str) -> Flags:
    """Where a limit is met, (S, C, F)."""
    low, high = limit_bounds(limits, name)
    operation = QUANTITIES[name].of == "operation"
    values = study.omega if operation else study.values[name]
    met = (values >= low) & (values <= high)
    return np.broadcast_to(met, study.reason.shape)


def _jumps(study: Study) -> tuple[Flags, Real]:
    """Machines on the other side of the jump than the nominal one, and the share of two motions."""
    frequencies = study.omega.size
    if not folds_known(study):
        return np.zeros((study.size, frequencies), bool), np.full(frequencies, np.nan)
    low, high = (study.values[name][:, :, np.newaxis] for name in FOLDS)
    word = FOLDS[0] if study.branch == "lower" else FOLDS[1]
    nominal = study.omega > study.nominal[word][:, np.newaxis]
    known = study.reason == FOUND
    moved = ((jumped_motions(study) != nominal) & known).any(axis=1)
    two = (study.omega >= low) & (study.omega <= high)
    if MARGIN in study.values:
        two |= study.values[MARGIN] == 0.0
    return moved, two.any(axis=1).mean(axis=0)


def _jump_elsewhere(study: Study) -> int:
    """How many machines may jump at folds that are not those asked for."""
    folds = np.stack([study.values[name] for name in FOLDS])
    elsewhere = np.asarray(np.isnan(folds).all(axis=0))
    if MARGIN in study.values:
        elsewhere = elsewhere & np.any(np.isfinite(study.values[MARGIN]), axis=2)
    return int(np.count_nonzero(elsewhere.any(axis=1)))


def _shares(flags: Flags) -> tuple[Real, Real]:
    """Shares of machines, (F,), and their intervals, (F, 2)."""
    return _weighted(flags, np.ones(len(flags)))


def _weighted(flags: Flags, weights: Real) -> tuple[Real, Real]:
    """The same of machines with weights, (S,); NaN where they are worth too few."""
    frequencies = flags.shape[1]
    total, worth = weights.sum(), 0.0
    if total > 0.0:
        worth = total**2 / (weights**2).sum()
    whole = bool((weights == 1.0).all())
    if worth < LEAST_MACHINES and not whole:
        return np.full(frequencies, np.nan), np.full((frequencies, 2), np.nan)
    share = weights @ flags / total
    return share, confidence_interval(share * worth, worth)


def confidence_interval(passing: Real, count: float) -> Real:
    """(low, high) of Clopper and Pearson for shares ``passing / count``, (F, 2)."""
    from scipy.special import betaincinv  # noqa: PLC0415  slow to import

    tail = (1.0 - CONFIDENCE) / 2.0
    failing = np.maximum(count - passing, 0.0)
    low = np.where(passing > 0.0, betaincinv(np.maximum(passing, 1e-9), failing + 1.0, tail), 0.0)
    high = np.where(
        failing > 1e-9, betaincinv(passing + 1.0, np.maximum(failing, 1e-9), 1.0 - tail), 1.0
    )
    return np.stack([low, high], axis=-1)


def _halved(study: Study, passing: Flags) -> tuple[Real, Real]:
    """Shares with one tolerance half as wide."""
    frequencies, count = study.omega.size, len(study.names)
    share, interval = (
        np.full((count, frequencies), np.nan),
        np.full((count, frequencies, 2), np.nan),
    )
    for i, one in enumerate(study.distributions):
        if study.sample is not None and not isinstance(one, Choice):
            scale = np.where(np.arange(count) == i, HALF, 1.0)
            share[i], interval[i] = _weighted(passing, _weights(study, scale))
    return share, interval


def _scaled(study: Study, passing: Flags) -> tuple[Real, Real]:
    """Shares with all tolerances times each of the factors."""
    if study.sample is None:
        frequencies = study.omega.size
        nothing = np.full((FACTORS.size, frequencies), np.nan)
        return nothing, np.full((FACTORS.size, frequencies, 2), np.nan)
    count = len(study.names)
    found = [_weighted(passing, _weights(study, np.full(count, s))) for s in FACTORS]
    return np.stack([share for share, _ in found]), np.stack([interval for _, interval in found])


def _weights(study: Study, scale: Real) -> Real:
    """How much likelier each machine is with tolerances times ``scale``, (D,); shape (S,)."""
    weights = np.ones(study.size)
    z, wide = [], []
    for k, (name, one) in enumerate(zip(study.names, study.distributions, strict=True)):
        if isinstance(one, Interval):
            x = np.asarray(study.columns[name], float)
            off = np.abs(x - (one.low + one.high) / 2.0) / ((one.high - one.low) / 2.0)
            weights *= (off <= scale[k] * (1.0 + 1e-12)) / scale[k]
        elif isinstance(one, Normal):
            z.append((np.asarray(study.columns[name], float) - one.mean) / one.std)
            wide.append(scale[k])
    if not z:
        return weights
    shape = np.linalg.inv(_correlation(study))
    here = np.stack(z, axis=1)
    there = here / np.array(wide)
    change = _square(there, shape) - _square(here, shape)
    return np.asarray(weights * np.exp(-0.5 * change) / np.prod(wide))


def _square(z: NDArray[Any], shape: NDArray[Any]) -> Real:
    return np.asarray(((z @ shape) * z).sum(axis=1))


def _correlation(study: Study) -> Real:
    """Correlation of the normal fields."""
    normal = [k for k, one in enumerate(study.distributions) if isinstance(one, Normal)]
    if study.sample is None or study.sample.covariance is None:
        return np.eye(len(normal))
    covariance = np.array(study.sample.covariance)[np.ix_(normal, normal)]
    std = np.sqrt(np.diag(covariance))
    return np.asarray(covariance / np.outer(std, std))


def _notes(study: Study, unchecked: dict[str, str]) -> Iterator[str]:
    yield from study.notes
    for name, why in unchecked.items():
        yield f"The limit on {QUANTITIES[name].label} is not checked: {why}."
    if not folds_known(study):
        yield "Which machines jump is not known: ask the study for omega_lb and omega_ub, too."
    elif count := _jump_elsewhere(study):
        may = "jump" if MARGIN in study.values else f"may jump, as {MARGIN} would tell,"
        yield (
            f"{count} of {study.size} machines {may} at other folds than omega_lb and omega_ub: "
            "whether they have jumped is not known."
        )
    if study.sample is None:
        yield "The machines are a list: what narrower tolerances would bring is not known."
