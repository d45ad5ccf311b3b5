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
        w01 and w02 in rad/s: undamped, without contact; a stop without gap counts as a spring.
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
    from flipflow.dynamics.linear_response import (  # noqa: PLC0415  slow to import
        antiresonance_frequency,
        equal_amplitude_frequency,
        natural_frequencies,
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
    low, high = natural_frequencies(screen).tolist()
    return Derived(
        natural_frequencies=(low, high),
        omega_ea=equal_amplitude_frequency(screen),
        omega_ar=float(antiresonance_frequency(screen) or math.nan),
        static_amplitude=screen.eccentric_moment / (m1 + m2),
        damping_ratios=ratios,
    )


def _ratio(k: float, c: float, m: float) -> float:
    return c / (2.0 * math.sqrt(k * m))
