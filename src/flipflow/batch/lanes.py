"""Many motions of one machine at one frequency, run on threads until a neighbourhood catches them.

Chunks of lanes go to threads that hold no interpreter lock; each has scratch of its own. What a
chunk has finished is kept whatever happens to the others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flipflow.batch.side_by_side import Tell, processors, side_by_side
from flipflow.compiled import status
from flipflow.compiled.arrays import Int, Real
from flipflow.dynamics.assembly import machine_arrays
from flipflow.errors import Cancelled, InputError
from flipflow.model.system import MechanicalSystem
from flipflow.periodic.shooting import new_shooting, new_shooting_work
from flipflow.periodic.turn_by_turn import NOT_SETTLED, settle_lanes

CHUNK = 64  # lanes that one task of a thread runs
ROUNDING = 1e-9  # of a square distance from a centre
MOST_THREADS = 256  # that may be asked for


@dataclass(frozen=True, eq=False)
class Capture:
    """Ellipsoids (z - centre)^T form (z - centre) <= 1 around stroboscopic states, and owners.

    Parameters
    ----------
    centre, form
        Shapes (A, 2 N) and (A, 2 N, 2 N).
    owner
        Label of each, (A,).
    """

    centre: Real
    form: Real
    owner: Int

    @classmethod
    def nothing(cls, size: int) -> Capture:
        """A capture that catches nothing, for states of ``size`` numbers."""
        return cls(np.zeros((0, size)), np.zeros((0, size, size)), np.zeros(0, np.int64))

    def joined(self, other: Capture) -> Capture:
        """Both, those of ``self`` first."""
        return Capture(
            np.concatenate([self.centre, other.centre]),
            np.concatenate([self.form, other.form]),
            np.concatenate([self.owner, other.owner]),
        )

    def holds(self, states: Real, labels: Int) -> NDArray[np.bool_]:
        """Whether an ellipsoid with its label holds each state, (K,), but for rounding."""
        held = np.zeros(labels.size, bool)
        for centre, form, owner in zip(self.centre, self.form, self.owner, strict=True):
            own = labels == owner
            off = states[own] - centre
            held[own] |= np.einsum("ki,ij,kj->k", off, form, off) <= 1.0 + ROUNDING
        return held

    def apart_from(self, states: Real, share: float) -> Capture:
        """The same with every ellipsoid so small that states (K, 2 N) lie 1 / share or more off.

        Distances are sqrt((z - centre)^T form (z - centre)), 1 on the ellipsoid.
        """
        off = states - self.centre[:, None]
        square = np.einsum("aki,aij,akj->ak", off, self.form, off)
        square = np.fmin.reduce(square, axis=1, initial=np.inf)  # NaN: too far off for a square
        larger = np.maximum(1.0 / (share * share * square), 1.0)
        return Capture(self.centre, self.form * larger[:, None, None], self.owner)


@dataclass(frozen=True, eq=False)
class Run:
    """Where lanes ended; all arrays have the lanes first.

    Parameters
    ----------
    states
        States where a lane was caught or given up, (L, 2 N).
    label
        Owner of what caught it, -1: nothing did.
    turns
        Whole turns run; -1 where the lane was not run because the run was cancelled.
    code
        Kernel status of its last turn.
    cancelled
        Whether the caller stopped the run.
    """

    states: Real
    label: Int
    turns: Int
    code: Int
    cancelled: bool


class Lanes:
    """Runs many states of one machine at one frequency.

    Parameters
    ----------
    system
        The machine.
    omega
        Forcing frequency in rad/s.
    threads
        Threads to use; None: one for each processor that this process may use.

    Raises
    ------
    InputError
        For a number of threads below 1 or absurd.
    """

    def __init__(self, system: MechanicalSystem, omega: float, threads: int | None) -> None:
        whole = isinstance(threads, (int, np.integer)) and not isinstance(threads, bool)
        if threads is not None and not (whole and 1 <= threads <= MOST_THREADS):
            raise InputError("threads", threads, f"give a whole number from 1 to {MOST_THREADS}")
        self.machine = machine_arrays(system.with_bonded())
        self.omega = float(omega)
        self.threads = threads or processors()

    def settle(
        self,
        states: Real,
        begin: Real,
        capture: Capture,
        most: int,
        tick: Tell | None = None,
    ) -> Run:
        """Run states (L, 2 N), which hold at times (L,) of the first turn, until they are caught.

        ``tick`` is called with the share of lanes done; where it raises
        :class:`~flipflow.errors.Cancelled`, chunks that have not ended are given up.
        """
        count = states.shape[0]
        run = Run(
            np.array(states),
            np.full(count, NOT_SETTLED),
            np.full(count, -1),
            np.full(count, status.OK),
            cancelled=False,
        )
        begin = np.array(begin)

        def chunk(part: slice, stop: Int) -> None:
            self._chunk(run, part, begin, capture, most, stop)

        try:
            side_by_side(chunk, count, CHUNK, self.threads, tick)
        except Cancelled:
            return Run(run.states, run.label, run.turns, run.code, cancelled=True)
        return run

    def carry(self, states: Real, turns: int) -> Real:
        """States (L, 2 N) after a number of whole turns; NaN where the flow did not end."""
        nothing = Capture.nothing(states.shape[1])
        run = self.settle(states, np.zeros(states.shape[0]), nothing, turns)
        run.states[run.code != status.OK] = np.nan
        return run.states

    def _chunk(
        self, run: Run, part: slice, begin: Real, capture: Capture, most: int, stop: Int
    ) -> None:
        """Run a part of the lanes with scratch of its own, until ``stop`` is set.

        Results are written when all lanes have ended, so that a part is either done or not begun.
        """
        label, turns, code = (np.zeros(part.stop - part.start, np.int64) for _ in range(3))
        states = run.states[part].copy()
        nothing = np.empty((states.shape[0], 0, states.shape[1]))
        problem = new_shooting(self.machine, half_turn=False, length=1.0)
        work = new_shooting_work(self.machine)
        work = work._replace(flow=work.flow._replace(stop=stop))
        settle_lanes(
            problem, work, states, begin[part], self.omega,
            capture.centre, capture.form, capture.owner, most, nothing, label, turns, code,
        )  # fmt: skip
        if (code == status.STOPPED).any():
            return
        run.states[part], run.label[part] = states, label
        run.turns[part], run.code[part] = turns, code
