"""Poincare section and spectrum of a motion."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from flipflow.compiled.arrays import Real
from flipflow.errors import InputError
from flipflow.model.arguments import checked_count, checked_kind, checked_speed
from flipflow.model.screen import is_screen, unit_in
from flipflow.model.system import Coordinate, Machine, MechanicalSystem, system_of
from flipflow.periodic.orbit import Orbit, initial_state
from flipflow.results.result import Result
from flipflow.transient.exponents import with_word
from flipflow.transient.history import History
from flipflow.transient.settling import MAX_PERIODS, UNDECIDED, Settling, Word


@dataclass(frozen=True, eq=False)
class Section(Result):
    """States of a motion once a forcing period, when the unbalance points along +x.

    Parameters
    ----------
    system
        The machine.
    omega
        Forcing frequency in rad/s.
    states
        (x, x') in m and m/s, one row a period, (T, 2 N).
    periods
        Forcing periods after which the motion repeats once it has settled; 0 where it does not
        within 12.
    word
        What the motion is once it has settled: "periodic", "quasi-periodic", "chaotic", or
        "undecided". Sections of files that earlier versions wrote have 0 periods and are undecided.
    """

    system: MechanicalSystem
    omega: float
    states: Real
    periods: int = 0
    word: Word = UNDECIDED

    def __repr__(self) -> str:
        omega = f"{self.omega:.6g}{unit_in(self.system, 'rad/s')}"
        return f"Section({self.states.shape[0]} turns at {omega}, {self.word})"

    def displacement(self, which: Coordinate) -> Real:
        """Displacement of a coordinate in m, (T,)."""
        return np.asarray(self.states[:, : self.system.size] @ self.system.coordinate(which))

    def velocity(self, which: Coordinate) -> Real:
        """Velocity of a coordinate in m/s, (T,)."""
        return np.asarray(self.states[:, self.system.size :] @ self.system.coordinate(which))


@dataclass(frozen=True, eq=False)
class Spectrum(Result):
    """Amplitudes of the harmonic parts of a motion.

    Parameters
    ----------
    omega
        Forcing frequency in rad/s.
    frequencies
        In rad/s, rising from 0, (n,).
    amplitudes
        In m, (n,): a part a cos(w t + phi) that fits the time counts a; the mean counts once.
    which
        The coordinate.
    system
        The machine; None in files that earlier versions wrote, of a screen then.
    """

    omega: float
    frequencies: Real
    amplitudes: Real
    which: Coordinate
    system: MechanicalSystem | None = None

    def __repr__(self) -> str:
        highest = f"{self.frequencies[-1]:.6g}"
        if self.system is None or is_screen(self.system):
            highest += " rad/s"
        return f"Spectrum({self.which!r}, {self.frequencies.size} lines up to {highest})"


MOST_TURNS = 10_000_000  # forcing periods that may be asked for
WAITED = 1024  # turns after the last point, in which the motion may still settle
SAMPLES_A_TURN = 512  # times in each forcing period of an orbit whose spectrum is taken
LEAST = 2  # forcing periods in a window: within one, a Hann window blurs each line into the next
UNEVEN = 1e-9  # difference of two steps in time, over the whole time, that is rounding


def poincare_section(
    machine: Machine,
    omega: float,
    turns: int = 1000,
    *,
    initial: str | Orbit | ArrayLike = "rest",
    skip: int = 500,
) -> Section:
    """States of a motion at the beginning of each forcing period, by the exact flow.

    A periodic motion of n periods shows n points, a quasi-periodic one closed curves. The motion is
    run on from the last point until it settles, at most 1024 turns; where it does not, Lyapunov
    exponents tell what it is, as in :func:`~flipflow.lyapunov_exponents`.

    Parameters
    ----------
    machine
        A screen, a :class:`~flipflow.MechanicalSystem`, or any machine with ``.system()``.
    omega
        Speed in rad/s.
    turns
        Points wanted.
    initial
        "rest", an :class:`~flipflow.periodic.orbit.Orbit`, or a state (x, x'), (2 N,).
    skip
        Forcing periods that pass first.

    Raises
    ------
    InputError
        For a speed, count or state that makes no sense, and for a machine without damping.
    IncompleteError
        Where a turn has too many contacts to be recorded.
    """
    speed = checked_speed(omega)
    turns = checked_count("turns", turns, MOST_TURNS)
    skip = checked_count("skip", skip, MOST_TURNS, least=0)
    settling = Settling(system_of(machine), MAX_PERIODS)
    solver = settling.solver
    z = initial_state(solver.system, initial)
    if skip:
        z = solver.section(z, speed, skip)[-1]
    states = solver.section(z, speed, turns)
    end = with_word(settling, settling.settle(states[-1], speed, WAITED), speed)
    periods = end.point.formulation.turns if end.point is not None and end.settled else 0
    return Section(solver.system, speed, states, periods, end.word)


def spectrum(motion: Orbit | History, which: Coordinate, periods: int | None = None) -> Spectrum:
    """Amplitude spectrum of a coordinate.

    Of a periodic motion the harmonics of its own period; of a motion over time that of its last
    whole forcing periods under a Hann window, with lines a ``periods``-th of the forcing frequency
    apart.

    Parameters
    ----------
    motion
        An orbit, or a history at constant speed sampled evenly.
    which
        The coordinate.
    periods
        Forcing periods of a history to look at, two or more; half of them when left out.

    Raises
    ------
    InputError
        For a history that is sampled unevenly, whose speed changes, or that is shorter than the
        periods asked for, or than two.
    """
    checked_kind("motion", motion, (Orbit, History), "give an orbit or a history")
    if periods is not None:
        periods = checked_count("periods", periods, MOST_TURNS, least=LEAST)
    if isinstance(motion, Orbit):
        count = SAMPLES_A_TURN * motion.periods
        t = motion.period * np.arange(count) / count
        amplitudes = _amplitudes(motion.displacement(which, t), np.ones(count))
        lines = np.arange(amplitudes.size) * motion.omega / motion.periods
        return Spectrum(motion.omega, lines, amplitudes, which, motion.system)
    if np.ptp(motion.omega) > UNEVEN * float(motion.omega[-1]):
        told = f"speeds from {motion.omega.min():.6g} to {motion.omega.max():.6g} rad/s"
        raise InputError("motion", told, "give a history at constant speed")
    step = np.diff(motion.t)
    if motion.t.size < 3 or np.ptp(step) > UNEVEN * float(motion.t[-1]):
        raise InputError("motion", "times", "give a history sampled at even times")
    omega = float(motion.omega[-1])
    turn = 2.0 * math.pi / omega / float(step.mean())
    whole = int((motion.t.size - 1) / turn * (1.0 + UNEVEN))
    if whole < LEAST or turn < LEAST:
        remedy = f"give {LEAST} forcing periods or more, and as many times in each"
        raise InputError("motion", f"{whole} forcing periods, {turn:.3g} times in each", remedy)
    wanted = max(whole // 2, LEAST) if periods is None else periods
    checked_count("periods", wanted, whole, least=LEAST)
    count = round(wanted * turn)
    amplitudes = _amplitudes(
        motion.displacement(which)[-count - 1 : -1], np.hanning(count + 1)[:-1]
    )
    spaced = 2.0 * math.pi * np.fft.rfftfreq(count, float(step.mean()))
    return Spectrum(omega, np.asarray(spaced, float), amplitudes, which, motion.system)


def _amplitudes(x: Real, window: Real) -> Real:
    """Amplitudes at the lines of values under a window; it would spread the mean beside line 0."""
    mean = float(window @ x / window.sum())
    amplitudes = 2.0 * np.abs(np.fft.rfft(window * (x - mean))) / window.sum()
    amplitudes[0] = abs(mean)
    if x.size % 2 == 0:
        amplitudes[-1] /= 2.0  # at half the sampling rate a line and its conjugate are one
    return np.asarray(amplitudes)
