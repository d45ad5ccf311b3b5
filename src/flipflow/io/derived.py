"""What follows from a screen's values at once: natural frequencies, ratios, the tuned speeds."""

from __future__ import annotations

import math
from dataclasses import dataclass

from flipflow.model.screen import FlipFlowScreen


@dataclass(frozen=True)
class Derived:
    """Figures that show at a glance whether a machine is what its maker meant.

    Parameters
    ----------
    natural_frequencies
        w01 and w02 in rad/s: undamped, without contact.
    omega_ea
        w_ea in rad/s, where both frames swing alike; None where damping rules it out.
    omega_ar
        w_ar in rad/s, antiresonance of the main frame.
    static_amplitude
        m0r / (m1 + m2) in m, the amplitude far above resonance.
    damping_ratios
        Of isolation, shear springs and, where there are any, stops, by section of the file.
    """

    natural_frequencies: tuple[float, float]
    omega_ea: float | None
    omega_ar: float
    static_amplitude: float
    damping_ratios: dict[str, float]


def derive(screen: FlipFlowScreen) -> Derived:
    """Compute the derived figures of a screen."""
    from flipflow.analyses.linear import (  # noqa: PLC0415  slow to import
        antiresonance_frequency,
        equal_amplitude_frequency,
    )

    m1, m2 = screen.main_mass, screen.floating_mass
    k2, c2 = screen.shear_stiffness, screen.shear_damping
    reduced = m1 * m2 / (m1 + m2)
    ratios = {
        "isolation": _ratio(screen.isolation_stiffness, screen.isolation_damping, m1 + m2),
        "shear_springs": _ratio(k2, c2, reduced),
    }
    if screen.has_stop and screen.stop_stiffness > 0.0:
        ratios["stops"] = _ratio(screen.stop_stiffness, screen.stop_damping, reduced)
    return Derived(
        natural_frequencies=_natural_frequencies(screen),
        omega_ea=equal_amplitude_frequency(screen),
        omega_ar=float(antiresonance_frequency(screen) or math.nan),
        static_amplitude=screen.eccentric_moment / (m1 + m2),
        damping_ratios=ratios,
    )


def _ratio(k: float, c: float, m: float) -> float:
    return c / (2.0 * math.sqrt(k * m))


def _natural_frequencies(screen: FlipFlowScreen) -> tuple[float, float]:
    """Solve K v = w^2 M v."""
    import scipy.linalg  # noqa: PLC0415  slow to import, and not every reader of a file needs it

    system = screen.system()
    squares = scipy.linalg.eigh(system.K, system.M, eigvals_only=True)
    low, high = (math.sqrt(max(float(square), 0.0)) for square in squares)
    return low, high
