"""Lyapunov exponents: how fast neighbouring motions of a machine part or meet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from flipflow import __version__
from flipflow.compiled.arrays import Real
from flipflow.model.arguments import checked_count, checked_monitor, checked_speed
from flipflow.model.monitor import Monitor
from flipflow.model.screen import unit_in
from flipflow.model.system import Machine, MechanicalSystem, system_of
from flipflow.periodic.orbit import Orbit, initial_state
from flipflow.results.result import Result
from flipflow.transient.exponents import BATCHES, grown
from flipflow.transient.settling import MAX_PERIODS, Settling, Word

MOST_PERIODS = 1_000_000  # forcing periods that may be asked for


@dataclass(frozen=True, eq=False)
class LyapunovExponents(Result):
    """Mean rates at which neighbouring motions part (above 0) or meet (below 0).

    Parameters
    ----------
    machine
        What was run.
    omega
        Forcing frequency in rad/s.
    exponents
        In 1/s, largest first, (2 N,).
    standard_error
        Of each, in 1/s, from the scatter of the means over batches of periods, (2 N,).
    contact_share
        Share of the time for which each spring of the machine carries a force, on either side.
    word
        What the motion is: "periodic", "quasi-periodic", "chaotic", or "undecided".
    periods, skip
        Forcing periods followed, and those that passed before.
    batches
        Means over each batch in 1/s, in order of time, (32, 2 N).
    state
        State (x, x') at the end, (2 N,), from where a longer run can go on.
    version
        Version of flipflow.
    """

    machine: Machine
    omega: float
    exponents: Real
    standard_error: Real
    contact_share: Real
    word: Word
    periods: int
    skip: int
    batches: Real
    state: Real
    version: str

    def __repr__(self) -> str:
        omega, rate = (unit_in(self.machine, unit) for unit in ("rad/s", "1/s"))
        largest = f"largest {self.exponents[0]:.4g} +- {self.standard_error[0]:.2g}{rate}"
        return f"LyapunovExponents({self.omega:.6g}{omega}, {largest}, {self.word})"

    @property
    def system(self) -> MechanicalSystem:
        """The machine as matrices and springs."""
        return self.machine.system()


def lyapunov_exponents(
    machine: Machine,
    omega: float,
    *,
    initial: str | Orbit | ArrayLike = "rest",
    periods: int = 4096,
    skip: int = 1024,
    monitor: Monitor | None = None,
) -> LyapunovExponents:
    r"""Lyapunov exponents of the motion that a machine comes to, and what that motion is.

    A frame of 2 N tangents is carried along the exact flow, saltation at every contact included,
    and made orthonormal by a QR decomposition at least once a forcing period T (Benettin et al.,
    Meccanica 15 (1980) 9-20):

    .. math:: \lambda_i = \frac{1}{P T} \sum_{p=1}^{P} \ln R_{ii}^{(p)} .

    Under the paper's law their sum is known, with :math:`s_j` the share of the time in contact:

    .. math:: \sum_i \lambda_i = -\mathrm{tr}\, M^{-1} C - \sum_j c_j s_j\, d_j^T M^{-1} d_j .

    The motion is called

    - "periodic" where it repeats after up to 12 periods, or where the largest exponent lies more
      than four standard errors below 0, or where it has come closer by half to a stable periodic
      motion: it comes to a motion that repeats, if later or after more periods;
    - "quasi-periodic" where the growth of the leading tangent keeps within bounds: over the whole
      run it ranges no more than twice as far as over a sixteenth of it;
    - "chaotic" where the largest exponent lies more than four standard errors above 0, and
      disturbances have grown more than ten times as much as the motion's own steps over some
      turns: one that only leaves an unstable periodic motion grows as its steps do;
    - "undecided" otherwise: ask for more periods.

    A chaotic motion that ends only after more periods than were asked for is called chaotic.

    Parameters
    ----------
    machine
        A screen, a :class:`~flipflow.MechanicalSystem`, or any machine with ``.system()``.
    omega
        Speed in rad/s.
    initial
        "rest", an :class:`~flipflow.periodic.orbit.Orbit`, or a state (x, x'), (2 N,).
    periods
        Forcing periods to follow, 32 or more.
    skip
        Forcing periods that pass first, while the frame turns into the directions that grow most.
    monitor
        Called with a sentence and the share done; raise from it to cancel.

    Returns
    -------
    LyapunovExponents
        Exponents in 1/s with standard errors, shares of contact, and the word.

    Raises
    ------
    InputError
        For a speed, count or state that makes no sense, and for a machine without damping.
    IncompleteError
        Where a turn has too many contacts to be recorded, or disturbances die out too fast within a
        period to be told apart.
    """
    speed = checked_speed(omega)
    periods = checked_count("periods", periods, MOST_PERIODS, least=BATCHES)
    skip = checked_count("skip", skip, MOST_PERIODS, least=0)
    say = checked_monitor(monitor)
    system = system_of(machine)
    settling = Settling(system, MAX_PERIODS)
    found = grown(settling.solver, initial_state(system, initial), speed, periods, skip, say)
    order = np.argsort(-found.exponents, kind="stable")
    # The flow knows only springs that can open and close.
    share = np.array([1.0 if spring.bonded else 0.0 for spring in system.springs])
    share[list(system.opening)] = found.contact_share
    return LyapunovExponents(
        machine, speed, found.exponents[order], found.standard_error[order], share,
        found.word(settling), periods, skip, found.batches[:, order], found.recent[-1].copy(),
        __version__,
    )  # fmt: skip
