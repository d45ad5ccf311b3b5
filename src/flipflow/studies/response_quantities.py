"""The registry of quantities, those of a whole response included: peaks and landmarks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from flipflow.continuation.branch import Branch, SpecialPoint
from flipflow.continuation.frequency_response import frequency_response
from flipflow.dynamics.linear_response import antiresonance_frequency, equal_amplitude_frequency
from flipflow.errors import IncompleteError, InputError
from flipflow.model.screen import FlipFlowScreen
from flipflow.studies.operating_region import Landmarks, landmarks
from flipflow.studies.quantities import QUANTITIES, Quantity, Working


@dataclass(frozen=True, eq=False)
class Response:
    """A screen over an interval of speed; its branch is followed when first asked for.

    Parameters
    ----------
    screen
        The screen as loaded.
    span
        The interval (low, high) in rad/s.
    """

    screen: FlipFlowScreen
    span: tuple[float, float]

    @cached_property
    def branch(self) -> Branch:
        """Its motions over the interval.

        Raises
        ------
        IncompleteError
            When the branch could not be followed to the end of the interval.
        """
        branch = frequency_response(self.screen, self.span)
        if not branch.complete:
            raise IncompleteError(branch.status.value)
        return branch

    @cached_property
    def peak(self) -> SpecialPoint:
        """The motion of largest relative amplitude."""
        return self.branch.peak("relative")

    @cached_property
    def marks(self) -> Landmarks:
        """The landmarks of the branch."""
        return landmarks(self.screen, self.branch)


@dataclass(frozen=True)
class ResponseQuantity(Quantity[Response]):
    """One number of a whole response over speed, read off a :class:`Response`."""


_ALL = (
    ResponseQuantity(
        "peak_amplitude", "peak relative amplitude", "max |x2|", "m", "mm",
        "Largest relative amplitude over speed.",
        lambda r: r.peak.amplitude("relative"),
    ),
    ResponseQuantity(
        "peak_frequency", "speed of the peak", "w_peak", "rad/s", "rpm",
        "Speed of the largest relative amplitude.",
        lambda r: r.peak.omega,
    ),
    ResponseQuantity(
        "omega_ea", "speed of equal amplitudes", "w_ea", "rad/s", "rpm",
        "Speed at which main and relative amplitude are equal without contact.",
        lambda r: equal_amplitude_frequency(r.screen),
    ),
    ResponseQuantity(
        "omega_ar", "antiresonance of the main frame", "w_ar", "rad/s", "rpm",
        "Speed at which the main frame stands nearly still without contact.",
        lambda r: antiresonance_frequency(r.screen),
    ),
    ResponseQuantity(
        "omega_cs", "speed at which contact begins", "w_cs", "rad/s", "rpm",
        "Speed at which the stop is first touched, the last rising one before the main peak.",
        lambda r: r.marks.omega_cs,
    ),
    ResponseQuantity(
        "omega_lb", "lower jump speed", "w_lb", "rad/s", "rpm",
        "The lower of the two folds: the amplitude jumps here when the speed falls.",
        lambda r: r.marks.omega_lb,
    ),
    ResponseQuantity(
        "omega_ub", "upper jump speed", "w_ub", "rad/s", "rpm",
        "The higher of the two folds: the amplitude jumps here when the speed rises.",
        lambda r: r.marks.omega_ub,
    ),
)  # fmt: skip

REGISTRY: Mapping[str, Quantity[Working] | ResponseQuantity] = {
    **QUANTITIES,
    **{quantity.name: quantity for quantity in _ALL},
}


def quantity_named(name: object) -> Quantity[Working] | ResponseQuantity:
    """A quantity of a motion or of a whole response.

    Raises
    ------
    InputError
        For a name that is not known.
    """
    if not isinstance(name, str) or name not in REGISTRY:
        raise InputError("quantity", name, f"choose one of {', '.join(REGISTRY)}")
    return REGISTRY[name]
