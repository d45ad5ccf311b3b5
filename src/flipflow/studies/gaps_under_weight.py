"""What the weight on the shear springs does to the gaps, and what follows from it, case by case."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flipflow.continuation.branch import Branch
from flipflow.continuation.special_points import DOUBLING
from flipflow.model.screen import FlipFlowScreen
from flipflow.periodic.orbit import Orbit
from flipflow.studies.landmarks import contact_speeds, landmarks

SAMPLES = 4096  # times in a turn at which the forces of both sides are looked at


@dataclass(frozen=True)
class GapsUnderWeight:
    """The gaps of one load case and how the two sides of the stops differ.

    Parameters
    ----------
    shift
        How far in m the weight shifts the rest between the stops, towards the plus side.
    plus, minus
        Gap of each side in m, from where the machine hangs; infinite without a stop, negative
        where the weight alone closes it.
    contact_plus, contact_minus
        Speed in rad/s at which each side is first touched as the speed rises; None where it is not
        up to the main peak.
    force_plus, force_minus
        Greatest force of each side at working speed in N; None without a motion.
    doubled
        Speeds in rad/s between which the motion of one turn gives way to one of two.
    """

    shift: float
    plus: float
    minus: float
    contact_plus: float | None
    contact_minus: float | None
    force_plus: float | None
    force_minus: float | None
    doubled: tuple[tuple[float, float], ...]

    @property
    def even(self) -> bool:
        """Whether both sides are alike."""
        return self.plus == self.minus


def gaps_under_weight(
    screen: FlipFlowScreen, branch: Branch, orbit: Orbit | None
) -> GapsUnderWeight:
    """Gaps, contact speeds, stop forces and motions of two turns of a loaded screen.

    Parameters
    ----------
    screen
        The screen under its load.
    branch
        Its motions over speed.
    orbit
        Its motion at working speed, if there is one.
    """
    plus, minus = screen.stop().gaps
    contact = _contact_speeds(screen, branch)
    forces: tuple[float | None, float | None] = (None, None)
    if orbit is not None:
        forces = _forces(screen, orbit)
    return GapsUnderWeight(
        screen.gap_shift, plus, minus, contact.get(1), contact.get(-1), *forces, _doubled(branch)
    )


def _contact_speeds(screen: FlipFlowScreen, branch: Branch) -> dict[int, float]:
    """Where each side's contact begins, up to the last rising one before the main peak."""
    if not screen.has_stop or branch.omega.size == 0:
        return {}
    found = contact_speeds(branch, landmarks(screen, branch).omega_cs)
    # Sides that are alike begin together, and one point stands for both.
    if branch.system.symmetric and 1 in found:
        found[-1] = found[1]
    return found


def _forces(screen: FlipFlowScreen, orbit: Orbit) -> tuple[float, float]:
    """Greatest force of the plus and of the minus side in N."""
    if not screen.has_stop:
        return 0.0, 0.0
    t, _ = orbit.motion.samples(SAMPLES)
    force = np.abs(orbit.stop_force(0, t))
    # The sign tells no side: a damper that engages at once pulls before its stop lets go.
    plus, minus = screen.stop().gaps
    beyond = orbit.displacement("relative", t) > 0.5 * (plus - minus)
    sides = np.array([force.max(initial=0.0, where=one) for one in (beyond, ~beyond)])
    # The greater is known to the last digit.
    sides[sides.argmax()] = orbit.stop_force_peak()
    return float(sides[0]), float(sides[1])


def _doubled(branch: Branch) -> tuple[tuple[float, float], ...]:
    """Speeds between two period doublings that follow each other along the branch."""
    points = sorted(branch.points_of(DOUBLING), key=lambda point: point.position)
    pairs = zip(points[::2], points[1::2], strict=False)
    found = (sorted((one.omega, two.omega)) for one, two in pairs)
    return tuple((low, high) for low, high in found)
