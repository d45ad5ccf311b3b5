"""How a quantity changes along a family of machines, and whether the paper says so."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from flipflow.compiled.arrays import Real
from flipflow.continuation.branch import SpecialPoint
from flipflow.paper.claims import (
    Claim,
    Evaluation,
    Name,
    Number,
    Part,
    Verdict,
    bands,
    decide,
    runs,
)
from flipflow.plotting.scales import MM
from flipflow.studies.response_family import Member, ResponseFamily

NOTHING_NEW = 1e-9
SLIGHT, LITTLE = 0.10, 0.05
UP, DOWN = 1, -1
BORN = (
    "Where folds are born along the way, the region's upper end jumps from the peak of the "
    "relative motion to w_lb."
)


@dataclass(frozen=True, eq=False)
class FamilyPair:
    """A family solved exactly, and by the paper's third-order harmonic balance.

    Parameters
    ----------
    labels
        The values in words, one for each member: "2 mm".
    drawn
        Which members the figure shows.
    """

    exact: ResponseFamily
    balance: ResponseFamily
    labels: tuple[str, ...]
    drawn: tuple[int, ...]


@dataclass(frozen=True)
class Quantity:
    """A number of each member: name, unit, SI to unit, and how it is read off."""

    name: str
    unit: str
    of: Callable[[Member], float]
    scale: float = 1.0

    def along(self, family: ResponseFamily) -> Real:
        """Values in the unit shown, (n,); NaN where a member has none."""
        return self.scale * np.array([self.of(member) for member in family.members])


def _peak(index: int, amplitude: bool) -> Callable[[Member], float]:
    def read(member: Member) -> float:
        peaks = member.main_peaks
        if len(peaks) < 2:
            return float("nan")
        return peaks[index].amplitude("main") if amplitude else peaks[index].omega

    return read


def _relative(member: Member) -> float:
    return _amplitude(member.relative_peak, "relative")


def _amplitude(point: SpecialPoint | None, which: str) -> float:
    return float("nan") if point is None else point.amplitude(which)


def _width(member: Member) -> float:
    return float("nan") if member.marks is None else member.marks.upper - member.marks.lower


FIRST = Quantity("first resonance w01 of the main frame", "rad/s", _peak(0, amplitude=False))
FIRST_PEAK = Quantity("first peak of the main frame", "mm", _peak(0, amplitude=True), MM)
SECOND = Quantity("second resonance w02 of the main frame", "rad/s", _peak(-1, amplitude=False))
SECOND_PEAK = Quantity("second peak of the main frame", "mm", _peak(-1, amplitude=True), MM)
RELATIVE_PEAK = Quantity("peak of the relative motion", "mm", _relative, MM)
ZONE = Quantity("width of the zone of several solutions", "rad/s", lambda member: member.zone)
REGION = Quantity("width of the operating region", "rad/s", _width)
ANTIRESONANCE = Quantity(
    "least main-frame amplitude between the resonances", "mm",
    lambda member: _amplitude(member.antiresonance, "main"), MM,
)  # fmt: skip


@dataclass(frozen=True)
class Trend:
    """A quantity rises (``UP``) or falls (``DOWN``) with the field, by a little if ``slight``."""

    quantity: Quantity
    direction: int
    slight: bool = False

    def evaluate(self, family: ResponseFamily, labels: Sequence[str]) -> Evaluation:
        """Every step between neighbouring values has the sign claimed."""
        values = self.quantity.along(family)
        parts = list(runs(labels, [self._step(a, b) for a, b in _steps(values)]))
        if self.slight:
            ends = _moves(float(values[0]), float(values[-1]), self.direction)
            little = None if ends is None else ends and _within(values, SLIGHT)
            parts.append(Part("slightly (by less than 10 %)", little))
        found = decide(parts, _numbers(self.quantity, labels, values))
        if self.quantity is REGION and found.verdict is not Verdict.HOLDS and _folds_born(family):
            return replace(found, note=BORN)
        return found

    def _step(self, before: float, after: float) -> bool | None:
        return _moves(before, after, self.direction)


@dataclass(frozen=True)
class ZoneTrend:
    """A zone of several solutions exists somewhere, and widens or shrinks with the field."""

    direction: int
    appears: bool = False

    def evaluate(self, family: ResponseFamily, labels: Sequence[str]) -> Evaluation:
        """Steps along which no zone exists say nothing."""
        values = ZONE.along(family)
        kept = [k for k, (a, b) in enumerate(_steps(values)) if max(a, b) > 0.0]
        parts = [Part("there is a zone", bool(np.any(values > 0.0)))]
        if self.appears:
            ends = bool(values[0] == 0.0 and values[-1] > 0.0)
            parts.append(Part("none at the first value, one at the last", ends))
        if kept:
            shown = labels[kept[0] : kept[-1] + 2]
            some = values[kept[0] : kept[-1] + 2]
            parts += runs(shown, [_moves(a, b, self.direction) for a, b in _steps(some)])
        return decide(parts, _numbers(ZONE, labels, values))


@dataclass(frozen=True)
class AmplitudeTrend:
    """The relative amplitude rises or falls with the field all over the region all members share.

    With ``near_antiresonance`` only where the nominal member's main frame moves least.
    """

    direction: int
    near_antiresonance: bool = False

    def evaluate(self, family: ResponseFamily, labels: Sequence[str]) -> Evaluation:
        """Every step at every common speed has the sign claimed."""
        omega, table = self._table(family)
        if omega.size == 0:
            return decide([Part("a speed in the region of all members", None)])
        answers = [self._follows(column) for column in table.T]
        middle = omega.size // 2
        numbers: dict[Name, Number] = {
            (f"relative amplitude at {omega[k]:.4g} rad/s", label): Number(
                MM * float(table[j, k]), "mm"
            )
            for k in sorted({0, middle, omega.size - 1})
            for j, label in enumerate(labels)
        }
        return decide(list(bands(omega, answers)), numbers)

    def _table(self, family: ResponseFamily) -> tuple[Real, Real]:
        if not self.near_antiresonance:
            # At its lower end one member is about to touch its stop: there amplitudes are equal.
            return family.common_frequencies[1:], family.relative_amplitude[:, 1:]
        feet = [m.antiresonance.omega for m in family.members if m.antiresonance is not None]
        if not feet:
            return np.zeros(0), np.zeros((len(family.members), 0))
        omega = np.array([min(feet), max(feet)])
        return omega, np.array(
            [[m.relative_amplitude(float(w)) for w in omega] for m in family.members]
        )

    def _follows(self, column: Real) -> bool | None:
        steps = [_moves(a, b, self.direction) for a, b in _steps(column)]
        return None if None in steps else all(steps)


@dataclass(frozen=True)
class Unchanged:
    """Some quantities change by less than 5 % over the whole family."""

    quantities: tuple[Quantity, ...]

    def evaluate(self, family: ResponseFamily, labels: Sequence[str]) -> Evaluation:
        """Spread of each quantity over its mean."""
        parts: list[Part] = []
        numbers: dict[Name, Number] = {}
        for quantity in self.quantities:
            values = quantity.along(family)
            parts.append(Part(quantity.name, _within(values, LITTLE)))
            numbers |= _numbers(quantity, labels, values)
            numbers[f"change of {quantity.name}"] = Number(100.0 * _spread(values), "%")
        return decide(parts, numbers)


Rule = Trend | ZoneTrend | AmplitudeTrend | Unchanged


def trend_claim(id_: str, where: str, statement: str, rule: Rule) -> Claim[FamilyPair]:
    """A claim on a family, decided exactly; harmonic balance is mentioned where it disagrees."""

    def evaluate(pair: FamilyPair) -> Evaluation:
        exact = rule.evaluate(pair.exact, pair.labels)
        balance = rule.evaluate(pair.balance, pair.labels)
        if balance.verdict is exact.verdict:
            return exact
        also = f"By third-order harmonic balance: {balance.verdict}. {balance.where}"
        return replace(exact, note=f"{exact.note} {also}".strip())

    return Claim(id_, where, statement, evaluate)


def _folds_born(family: ResponseFamily) -> bool:
    zones = ZONE.along(family)
    return bool(np.any(zones > 0.0) and np.any(zones == 0.0))


def _steps(values: Real) -> Iterator[tuple[float, float]]:
    yield from zip(values[:-1].tolist(), values[1:].tolist(), strict=True)


def _moves(before: float, after: float, direction: int) -> bool | None:
    if not (np.isfinite(before) and np.isfinite(after)):
        return None
    return direction * (after - before) > NOTHING_NEW * abs(before)


def _within(values: Real, share: float) -> bool | None:
    return bool(_spread(values) < share) if np.isfinite(values).all() else None


def _spread(values: Real) -> float:
    return float(np.ptp(values) / np.abs(values).mean())


def _numbers(quantity: Quantity, labels: Sequence[str], values: Real) -> dict[Name, Number]:
    return {
        (quantity.name, label): Number(float(value), quantity.unit)
        for label, value in zip(labels, values, strict=True)
    }
