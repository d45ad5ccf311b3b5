"""How much each field of a machine matters to a quantity: Sobol indices, and their document."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flipflow.errors import StoreError
from flipflow.model.screen import FlipFlowScreen
from flipflow.model.vary import Choice, Distribution, Interval, Normal
from flipflow.results.codec import array, plain
from flipflow.results.document import Document, machine_document, screen_from

Real = NDArray[np.float64]
KINDS: Mapping[str, type[Interval | Normal | Choice]] = {
    "Interval": Interval,
    "Normal": Normal,
    "Choice": Choice,
}


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Sobol indices of a quantity; it is what :func:`flipflow.sensitivity` returns.

    Arrays over the D fields are (D,) where ``omega`` is one frequency or None, and (n_omega, D)
    where it is an array; arrays over frequency are then numbers, or (n_omega,).

    Parameters
    ----------
    screen
        The machine about which the fields vary.
    quantity
        Name of the quantity, a key of the registry.
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
        The quantity of the machine itself, SI.
    at_low, at_high
        The quantity with one field at the low or the high end of its range, SI.
    notes
        A sentence for each thing to keep in mind.
    version
        Version of flipflow.
    """

    screen: FlipFlowScreen
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
    notes: tuple[str, ...]
    version: str

    def __repr__(self) -> str:
        fields = ", ".join(self.names)
        return f"Sensitivity({self.quantity} on {fields}; {self.n} groups)"

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
    screen, quantity, names, distributions, omega, nominal, at_low, at_high
        As in :class:`Sensitivity`, at one frequency in rad/s.
    """

    screen: FlipFlowScreen
    quantity: str
    names: tuple[str, ...]
    distributions: tuple[Distribution, ...]
    omega: float
    nominal: float
    at_low: Real
    at_high: Real

    @property
    def over_frequency(self) -> bool:
        """Whether there is more than one frequency: there is not."""
        return False

    @property
    def ends(self) -> tuple[tuple[object, object], ...]:
        """Low and high end of each field's range."""
        return tuple(distribution.ends for distribution in self.distributions)


ARRAYS = (
    "first_order", "total", "first_order_confidence", "total_confidence", "mean", "variance",
    "failed", "nominal", "at_low", "at_high",
)  # fmt: skip


def sensitivity_document(result: Sensitivity) -> Document:
    """A sensitivity with all it takes to open it again."""
    return {
        "version": result.version,
        "machine": machine_document(result.screen),
        "quantity": result.quantity,
        "branch": result.branch,
        "names": list(result.names),
        "vary": [distribution_document(one) for one in result.distributions],
        "omega": plain(result.omega),
        "interval": isinstance(result.omega, tuple),
        "n": result.n,
        **{name: plain(getattr(result, name)) for name in ARRAYS},
        "notes": list(result.notes),
    }


def sensitivity_from(document: Mapping[str, Any]) -> Sensitivity:
    """The sensitivity that :func:`sensitivity_document` wrote.

    Raises
    ------
    StoreError
        When the document holds something this version does not know.
    """
    arrays = {name: _numbers(document[name]) for name in ARRAYS}
    omega = document["omega"]
    return Sensitivity(
        screen=screen_from(document["machine"]),
        quantity=document["quantity"],
        branch=document["branch"],
        names=tuple(document["names"]),
        distributions=tuple(distribution_from(one) for one in document["vary"]),
        omega=(float(omega[0]), float(omega[1])) if document["interval"] else _numbers(omega),
        n=int(document["n"]),
        notes=tuple(document["notes"]),
        version=document["version"],
        **arrays,
    )


def distribution_document(distribution: Distribution) -> Document:
    """How a field varies, by name and numbers."""
    fields = dataclasses.asdict(distribution)  # type: ignore[call-overload]
    return {"kind": type(distribution).__name__, **plain(fields)}


def distribution_from(document: Mapping[str, Any]) -> Distribution:
    """The distribution of a document.

    Raises
    ------
    StoreError
        For a distribution that this version does not know.
    """
    if document["kind"] not in KINDS:
        raise StoreError(f"the distribution {document['kind']!r} is not known; update flipflow")
    values = {key: value for key, value in document.items() if key != "kind"}
    if "values" in values:
        values["values"] = tuple(values["values"])
    return KINDS[document["kind"]](**values)


def _numbers(values: object) -> Any:
    """An array, or the number where it is one."""
    found = array(values)
    return float(found) if found.ndim == 0 else found
