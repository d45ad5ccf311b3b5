"""A periodic motion with its derivatives in the imaginary parts of all that is read off it.

A formula f of numbers x_k with derivatives x_kp has the derivative Im f(x_k + i h x_kp) / h, exact
to rounding for a tiny h, so that the one table of quantities serves for their derivatives, too.
Columns stand for P parameters and for omega; along the motion one more stands for time.

W. Squire, G. Trapp, Using complex variables to estimate derivatives of real functions, SIAM Review
40 (1998) 110.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from flipflow.batch.slope_readings import AGREE, TIED
from flipflow.compiled.arrays import Complex, Real
from flipflow.dynamics.machine_columns import Named, stop_columns
from flipflow.dynamics.motion import nodes_on, phase_of
from flipflow.errors import IncompleteError
from flipflow.model.contact_law import WHOLE, carries_force, engaged_side, shares
from flipflow.model.screen import FlipFlowScreen
from flipflow.model.system import Coordinate, MechanicalSystem
from flipflow.periodic.derivatives import MotionDerivatives
from flipflow.periodic.orbit import Orbit
from flipflow.studies.quantity_values import FRAMES, Vector, number_or_nan

Pieces = NDArray[np.intp]
TILT = 1e-60  # size of an imaginary part, as a share of the derivative it stands for
LOWER = 0.01  # share by which a sample of the grid may lie below the highest and lead to it
MOST_PEAKS = 64  # that are compared


@dataclass(frozen=True, eq=False)
class Path:
    """A motion at K times: states, and cosine and sine of the phase of the force, all tilted."""

    t: Real  # (K,)
    piece: Pieces  # (K,)
    x: Complex  # (K, N, P + 2)
    v: Complex
    a: Complex
    cos: Complex  # (K, P + 2)
    sin: Complex


Formula = Callable[[Path], Complex]


@dataclass(frozen=True, eq=False)
class TiltedNormal:
    """Motion normal to the surface, y = Re((along + i across) exp(i omega t)), tilted."""

    omega: Complex
    along: Complex
    across: Complex
    stiffness: Complex
    damping: Complex

    @property
    def amplitude(self) -> Complex:
        """Amplitude in m."""
        return np.asarray(np.sqrt(self.along**2 + self.across**2))

    def acceleration(self, path: Path) -> Complex:
        """y'' in m/s^2, (K, P + 2)."""
        return np.asarray(-(self.omega**2) * self._displacement(path))

    def foundation_force(self, path: Path) -> Complex:
        """k1n y + c1n y' in N, (K, P + 2)."""
        velocity = -self.omega * (self.along * path.sin + self.across * path.cos)
        return np.asarray(self.stiffness * self._displacement(path) + self.damping * velocity)

    def _displacement(self, path: Path) -> Complex:
        return np.asarray(self.along * path.cos - self.across * path.sin)


@dataclass(frozen=True, eq=False)
class TiltedStop:
    """The numbers of a stop, tilted, (P + 2,) each; the direction (N, P + 2)."""

    stiffness: Complex
    damping: Complex
    gaps: tuple[Complex, ...]
    direction: Complex


class TiltedMotion:
    """What :class:`~flipflow.studies.quantity_values.Motions` asks for, tilted, (P + 2,) each.

    Parameters
    ----------
    orbit
        The motion.
    parameters
        With respect to which it is differentiated.
    slopes
        Its derivatives with respect to them and to omega.
    """

    def __init__(
        self, orbit: Orbit, parameters: Sequence[Named], slopes: MotionDerivatives
    ) -> None:
        self.orbit, self.parameters, self.slopes = orbit, tuple(parameters), slopes
        self.motion, self.machine = slopes.motion, orbit.machine
        self.period = orbit.period

    @cached_property
    def omega(self) -> Complex:
        """Frequency in rad/s."""
        return self._tilted(self.orbit.omega, len(self.parameters))

    def field(self, name: str) -> Complex:
        """A field of the screen."""
        value = getattr(self.machine, name) if isinstance(self.machine, FlipFlowScreen) else None
        names = [one.name for one in self.parameters]
        return self._tilted(number_or_nan(value), names.index(name) if name in names else None)

    def amplitude(self, which: Coordinate) -> Complex:
        """Half peak-to-peak of a coordinate in m."""
        high, low = self._extremes(which)
        return np.asarray(0.5 * (high - low))

    def mean(self, which: Coordinate) -> Complex:
        """Middle between the greatest and the least value of a coordinate, in m."""
        high, low = self._extremes(which)
        return np.asarray(0.5 * (high + low))

    def phase(self, which: Coordinate) -> Complex:
        """Phase of the first harmonic against the exciting force in rad."""
        d = self.orbit.system.coordinate(which)
        cosine = self._average(lambda path: (d @ path.x) * path.cos)
        sine = self._average(lambda path: (d @ path.x) * path.sin)
        harmonic = cosine.real - 1j * sine.real
        phase = phase_of(harmonic, self.amplitude(which).real)
        slope = ((cosine.imag - 1j * sine.imag) / harmonic).imag
        return np.asarray(phase + 1j * np.where(np.isnan(phase), np.nan, slope))

    def offset(self) -> Complex:
        """How far the middle of the relative motion lies beside zero, in m."""
        high, low = self._extremes("relative")
        mean = 0.5 * (high + low)
        if beside_zero(mean, high, low)[:-1].any():
            raise IncompleteError(
                "The middle of the motion stands at zero, and its distance from there grows to "
                "each side."
            )
        return np.where(mean.real < 0.0, -mean, mean)

    def reach(self) -> Complex:
        """Greatest size of the relative displacement in m."""
        d = self.orbit.system.coordinate("relative")
        return self._peak(lambda path: d @ path.x)

    def normal_amplitude(self) -> Complex:
        """Amplitude normal to the surface in m."""
        return self._normal.amplitude

    def peak(self, vector: Vector) -> Complex:
        """Greatest length of a vector in SI, both directions together."""
        if vector == "foundation":
            return self._peak(self._on_foundation())
        if vector == "shear":
            return self._peak(self._shear())
        if vector == "bearing":
            return self._peak(self._bearing())
        degree, normal = FRAMES.index(vector), self._normal
        return self._peak(lambda path: _length(path.a[:, degree], normal.acceleration(path)))

    def stop_force(self) -> Complex:
        """Greatest force of the stop springs of one side in N."""
        acting = [j for j, one in enumerate(self._given.springs) if one.acts]
        peaks = [peak for j in acting for peak in self._force_peaks(j)]
        return self._highest(peaks, "stop forces")

    def stop_force_peak(self, spring: int = 0) -> Complex:
        """Greatest |H| of a stop over the period in N."""
        return self._highest(self._force_peaks(spring), "stop forces")

    def depth(self, spring: int, side: int) -> Complex:
        """Greatest depth in m beyond a gap of a stop that opens and closes, counted among those."""
        stop = self._stop(self._given.opening[spring])
        d, gap = stop.direction, stop.gaps[0 if side > 0 else 1]
        sign = 1.0 if side > 0 else -1.0
        return np.asarray(self._summit(lambda path: sign * np.sum(d * path.x, axis=1)) - gap)

    def contact_share(self, spring: int = 0) -> Complex:
        """Share of the period during which a stop has a force."""
        own, kept = self._given.springs[spring], self._given.opening
        if own.bonded or spring not in kept:
            return self._tilted(float(own.bonded))
        engaged = engaged_side(own.law, self.motion.regime[:, kept.index(spring)]) != 0
        share = float(self.motion.length[engaged].sum()) / self.period
        slope = np.diff(self.slopes.shifts, axis=0)[engaged].sum(axis=0) / self.period
        return np.append(share + 1j * TILT * slope, share)

    def longest_contact(self) -> Complex:
        """Greatest share of the period during which a stop has a force."""
        acting = [j for j, one in enumerate(self._given.springs) if one.acts]
        return self._highest([self.contact_share(j) for j in acting], "times of contact")

    def shear_power(self) -> Complex:
        """Mean power of all shear springs in W."""
        return np.asarray(self.field("shear_damping") * self.mean_square_velocity("relative"))

    def mean_square_velocity(self, which: Coordinate) -> Complex:
        """Mean of (d x')^2 over the period in m^2/s^2."""
        d = self.orbit.system.coordinate(which)
        return self._average(lambda path: (d @ path.v) ** 2)

    def approach_speed(self) -> Complex:
        """Greatest relative speed in m/s at which a contact begins; 0 without contact."""
        d = self.orbit.system.coordinate("relative")
        regime = self.motion.regime
        held = [
            engaged_side(one.law, regime[:, j]) != 0
            for j, one in enumerate(self.slopes.solver.springs)
        ]
        begins = [
            e
            for e in range(1, self.motion.start.size)
            if any(touched[e] and not touched[e - 1] for touched in held)
        ]
        if not begins:
            return self._tilted(0.0)
        path = self._path(self.motion.start[begins], np.array(begins))
        speed = d @ path.v
        speed = speed * np.sign(speed.real)
        moved = speed[:, -1:].imag * self._shifts[begins]
        return self._highest(list(speed + 1j * moved), "speeds of approach")

    def largest_multiplier(self) -> Complex:
        """Size of the largest Floquet multiplier."""
        values, slopes = self.slopes.multipliers
        sizes = size_of_multiplier(values[:, None], slopes)
        return self._highest([np.append(one, one[0].real) for one in sizes], "multipliers")

    def input_power(self) -> Complex:
        """Mean power that the excitation feeds in, W."""
        terms = [(one.order, *term) for one in self.orbit.system.excitations for term in one.terms]
        slope = self.slopes.columns.parts["force"]
        slope = slope[:, : len(terms)] + 1j * slope[:, len(terms) :]

        def power(path: Path) -> Complex:
            total = np.zeros(path.cos.shape, np.complex128)
            for e, (order, exponent, vector) in enumerate(terms):
                turn = np.exp(1j * order * self.orbit.omega * path.t)[:, None, None]
                change = np.zeros((vector.size, path.cos.shape[1]), np.complex128)
                change[:, : len(self.parameters)] = slope[:, e].T
                tilted = (turn * vector[:, None]).real + 1j * TILT * (turn * change).real
                total += self.omega**exponent * np.sum(tilted * path.v, axis=1)
            return total

        return self._average(power)

    def dissipated_power(self) -> Complex:
        """Mean power that all dampers take, both directions together, in W."""
        if not isinstance(self.machine, FlipFlowScreen):
            return self.input_power()
        normal = self._normal
        across = 0.5 * normal.damping * (self.omega * normal.amplitude) ** 2
        return np.asarray(self.input_power() + across)

    def jump_margin(self) -> Complex:
        """Distance from the nearest fold: no quantity of the motion alone."""
        return self._tilted(math.nan)

    @cached_property
    def _given(self) -> MechanicalSystem:
        """The machine with all its springs, those too that never open or never act."""
        return self.machine.system()

    @cached_property
    def _shifts(self) -> Real:
        """How the limits of the pieces move at a fixed phase, (E + 1, P + 2), not in time."""
        shifts = self.slopes.shifts
        return np.column_stack([shifts, np.zeros(shifts.shape[0])])

    @cached_property
    def _normal(self) -> TiltedNormal:
        """Motion normal to the surface: Y = -i s m0r omega^2 / (k - omega^2 m + i omega c)."""
        k, c = self.field("normal_stiffness"), self.field("normal_damping")
        mass = self.field("main_mass") + self.field("floating_mass")
        sense = self.machine.normal_sense if isinstance(self.machine, FlipFlowScreen) else 1.0
        force = sense * self.field("eccentric_moment") * self.omega**2
        spring, damper = k - self.omega**2 * mass, self.omega * c
        square = spring**2 + damper**2
        return TiltedNormal(self.omega, -force * damper / square, -force * spring / square, k, c)

    @cached_property
    def _stops(self) -> dict[str, Real]:
        """Derivatives of the numbers of every spring that acts, by the names of the columns."""
        if all(one.opens for one in self._given.springs):
            return dict(self.slopes.columns.parts)
        return stop_columns(self._given, self.parameters)

    def _tilted(self, value: float, column: int | None = None) -> Complex:
        """A number; one that is a parameter itself has the derivative 1 in its column."""
        tilted = np.full(len(self.parameters) + 2, complex(value))
        if column is not None:
            tilted[column] += 1j * TILT
        return tilted

    def _extremes(self, which: Coordinate) -> tuple[Complex, Complex]:
        """Greatest and least value of a coordinate."""
        d = self.orbit.system.coordinate(which)
        high = self._summit(lambda path: d @ path.x)
        return high, -self._summit(lambda path: -(d @ path.x))

    def _force_peaks(self, spring: int) -> list[Complex]:
        """The highest |H| of a stop, those that are as high among them; none without contact."""
        own = self._given.springs[spring]
        regimes = np.full(self.motion.start.size, WHOLE)
        if not own.bonded:
            if spring not in self._given.opening:
                return []
            regimes = self.motion.regime[:, self._given.opening.index(spring)]
        held = carries_force(own.law, regimes)
        if not held.any():
            return []
        stop = self._stop(spring)

        def force(path: Path) -> Complex:
            regime = regimes[path.piece]
            f_k, f_c = (share[:, None] for share in shares(own.law, regime))
            side = np.sign(regime)[:, None]
            edge = np.where(side > 0, stop.gaps[0], -stop.gaps[1])
            y, v = (np.sum(stop.direction * part, axis=1) for part in (path.x, path.v))
            return np.asarray(f_k * stop.stiffness * (y - edge) + f_c * stop.damping * v)

        return self._summits(_size_of(force))

    def _stop(self, spring: int) -> TiltedStop:
        """The numbers of a spring that acts, tilted."""
        own = self._given.springs[spring]
        at = [j for j, one in enumerate(self._given.springs) if one.acts].index(spring)
        stop, gap, turned = (self._stops[name] for name in ("stop", "gap", "direction"))
        # No motion reaches an infinite gap.
        gaps = [e if math.isfinite(e) else 0.0 for e in own.gaps]
        return TiltedStop(
            self._sloped(own.stiffness, stop[:, 0, at]),
            self._sloped(own.damping, stop[:, 1, at]),
            tuple(self._sloped(e, gap[:, at, side]) for side, e in enumerate(gaps)),
            np.stack([self._sloped(e, turned[:, at, n]) for n, e in enumerate(own.direction)]),
        )

    def _sloped(self, value: float, slope: Real) -> Complex:
        """A number with derivatives (P,) with respect to the parameters."""
        return np.asarray(value + 1j * TILT * np.append(slope, [0.0, 0.0]))

    def _path(self, t: Real, piece: Pieces) -> Path:
        """The tilted motion at times in given pieces."""
        states = []
        for order, slope in enumerate(self.slopes.at(t, piece)):
            value = self.motion.piece_derivative(t, piece, order)
            states.append(value[:, :, None] + 1j * TILT * slope)
        angle = self.orbit.omega * t[:, None] * np.ones(states[0].shape[2])
        turned = np.zeros(angle.shape[1])
        turned[-1] = TILT * self.orbit.omega
        cos = np.cos(angle) - 1j * turned * np.sin(angle)
        sin = np.sin(angle) + 1j * turned * np.cos(angle)
        return Path(t, piece, states[0], states[1], states[2], cos, sin)

    @cached_property
    def _grid(self) -> Path:
        """The motion on its own grid, with both ends of every piece."""
        return self._path(*self.motion.samples())

    @cached_property
    def _nodes(self) -> tuple[Path, Real]:
        """The motion at Gauss nodes on all pieces, and their weights as shares of the period."""
        t, piece, weight = nodes_on(self.motion)
        return self._path(t, piece), weight

    def _average(self, formula: Formula) -> Complex:
        """Mean over the period of what does not jump at a change of contact."""
        path, weights = self._nodes
        return np.asarray(weights @ formula(path))

    def _on_foundation(self) -> Formula:
        """Force of the isolation springs."""
        k, c = self.field("isolation_stiffness"), self.field("isolation_damping")
        across = self._normal.foundation_force
        return lambda path: _length(k * path.x[:, 0] + c * path.v[:, 0], across(path))

    def _shear(self) -> Formula:
        """Force of all shear springs."""
        k, c = self.field("shear_stiffness"), self.field("shear_damping")
        d = np.array([1.0, -1.0])
        return lambda path: k * (d @ path.x) + c * (d @ path.v)

    def _bearing(self) -> Formula:
        """Load on all exciter bearings together, with the frame's motion."""
        normal, mass = self._normal, self.field("rotating_mass")
        force = self.field("eccentric_moment") * self.omega**2
        sense = self.machine.normal_sense if isinstance(self.machine, FlipFlowScreen) else 1.0

        def load(path: Path) -> Complex:
            along = force * path.cos - mass * path.a[:, 0]
            across = sense * force * path.sin - mass * normal.acceleration(path)
            return _length(along, across)

        return load

    def _peak(self, formula: Formula) -> Complex:
        """Greatest size of a formula over the period."""
        return self._summit(_size_of(formula))

    def _summit(self, formula: Formula) -> Complex:
        """Greatest value of a formula over the period."""
        return self._highest(self._summits(formula), "peaks")

    def _highest(self, peaks: list[Complex], what: str) -> Complex:
        """The highest of some peaks; 0 where there is none.

        Raises
        ------
        IncompleteError
            Where two are as high and move differently.
        """
        if not peaks:
            return self._tilted(0.0)
        best = max(peaks, key=lambda peak: float(peak[0].real))
        top = float(best[0].real)
        tied = [peak.imag for peak in peaks if peak[0].real >= top - TIED * abs(top)]
        size = np.abs(tied).max(axis=0)
        if np.any(np.ptp(tied, axis=0)[:-1] > AGREE * size[:-1]):
            raise IncompleteError(
                f"Two {what} are as high, and one of them grows faster than the other: the "
                "greatest has another derivative to each side."
            )
        return best

    def _summits(self, formula: Formula) -> list[Complex]:
        """The highest summits over the period, tilted; the times of none count but at edges."""
        grid = self._grid
        values = formula(grid)
        height = values[:, 0].real
        before, after = np.roll(height, 1), np.roll(height, -1)
        level = height.max() - LOWER * (height.max() - height.min())
        tops = np.flatnonzero((height >= level) & (height >= before) & (height >= after))
        return [self._climbed(formula, values, int(k)) for k in tops[:MOST_PEAKS]]

    def _climbed(self, formula: Formula, values: Complex, k: int) -> Complex:
        """The summit beside a sample."""
        piece, t = self._grid.piece, self._grid.t
        slope = values[k, -1].imag
        step = 1 if slope > 0.0 else -1
        other = (k + step) % t.size
        wrapped = other != k + step
        if wrapped or piece[other] != piece[k]:
            # The same moment, beyond a change of contact or at the other end of the period.
            height, beyond = values[k, 0].real, values[other, 0].real
            if abs(beyond - height) > TIED * abs(height) or not values[other, -1].imag * step > 0.0:
                limit = int(piece[k]) + (1 if step > 0 else 0)
                return np.asarray(values[k] + 1j * slope * self._shifts[limit])
            k, other = other, other + step

        def rate(at: float) -> float:
            path = self._path(np.array([at]), piece[k : k + 1])
            return float(formula(path)[0, -1].imag / TILT)

        a, b = sorted((float(t[k]), float(t[other])))
        if values[k, -1].imag * values[other, -1].imag > 0.0:
            # Within a contact that hardly lasts, samples are as high and no summits yet.
            level = abs(values[other, 0].real - values[k, 0].real) <= TIED * abs(values[k, 0].real)
            return self._climbed(formula, values, other) if level else np.asarray(values[k])
        at = float(brentq(rate, a, b, xtol=1e-15 * self.period, rtol=1e-14))
        return np.asarray(formula(self._path(np.array([at]), piece[k : k + 1]))[0])


def beside_zero(mean: Complex, high: Complex, low: Complex) -> NDArray[np.bool_]:
    """Where the mean of two tilted numbers is zero and moves, so that its size has a kink."""
    moves = np.abs(mean.imag) > AGREE * (np.abs(high.imag) + np.abs(low.imag))
    return np.asarray(moves & (np.abs(mean.real) <= TIED * np.abs(high.real)))


def size_of_multiplier(value: Complex, slope: Complex) -> Complex:
    """|mu| of multipliers (..., 1) with derivatives (..., P), tilted; 0 has none."""
    size = np.abs(value)
    found = np.empty(slope.shape, np.complex128)
    with np.errstate(invalid="ignore"):
        found.real, found.imag = size, TILT * (value.conjugate() * slope).real / size
    return found


def _size_of(formula: Formula) -> Formula:
    """The size of a formula's values."""

    def size(path: Path) -> Complex:
        values = formula(path)
        return np.asarray(values * np.sign(values.real))

    return size


def _length(along: Complex, across: Complex) -> Complex:
    """Length of a vector."""
    return np.asarray(np.sqrt(along**2 + across**2))
