"""The symmetric motion with one touch on each side, without a guess: a scalar problem.

One spring with equal gaps is touched for the share s of each half turn. Counting time from the
moment of contact, the half turn is an engaged piece of length s pi / omega and an open one, and
the state at its end is minus the state at its beginning. Given omega and s, this condition and
y = e at both ends of the touch are linear in the state z at contact and in the complex size F of
the force (in units of the machine's own force): one 2 N x 2 N solve, then a 2 x 2 one. Motions of
the machine are the zeros of

    f(s) = |F(s, omega)| - 1,

a fold is f_s = 0, a cusp f_s = f_ss = 0. Shooting must confirm each zero.

F has poles, beside each of which two zeros may lie close together. With the determinant D of all
those equations for z and F the numbers (F D, D) have none, so that whether |F| crosses 1 between
two shares is asked of these: there |F D|^2 - D^2 changes its sign.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from flipflow.compiled.arrays import Int, Real
from flipflow.compiled.by_reference import by_reference
from flipflow.compiled.compile import kernel
from flipflow.compiled.dense import lu_determinant, lu_factor, lu_solve
from flipflow.dynamics.contact_search import exponential
from flipflow.dynamics.equation_of_motion import MachineArrays
from flipflow.dynamics.flow import Flow, new_flow, prepare_drive
from flipflow.dynamics.modes import Modes, prepare
from flipflow.model.contact_law import NUMBER

if TYPE_CHECKING:
    from flipflow.model.system import MechanicalSystem

PAPER = NUMBER["paper"]
OPEN_SLOT, PLUS_SLOT = 0, 1  # numbers of the contact states: stop open, stop engaged
MOST_ROOT_STEPS = 60  # steps of the search for one zero of f; twenty are usual
SAMPLES = 48  # of the contact share, between which a zero of f is sought
# Of the contact share, between which motions are counted. F grows without bound towards 1.
FIRST_SHARE, LAST_SHARE = 1e-6, 0.999
NARROWEST, NARROW, WIDEST = 1.0 / 512.0, 1.0 / 16.0, 1.0 / 8.0  # steps: least, first, greatest
MOST_LOOKED = 64  # values of F on the way, beyond which no step is made shorter
SHARP = 1e-14  # |f| of a zero, and the share within which it is
ON_ZERO = 1e-10  # |f| from which a state is so near to the motion's that Newton confirms it at once
MOST_MOTIONS = 8  # zeros of f that are kept at one frequency


class Homogeneous(NamedTuple):
    """F as homogeneous coordinates: real and imaginary part of F D, and D."""

    x: float
    y: float
    w: float


@by_reference
class TwoEvent(NamedTuple):
    """Scratch of the scalar problem for 2 N states."""

    engaged: Real  # (2 N, 2 N) exp(A t) over the touch
    open: Real  # (2 N, 2 N) over the open piece
    A: Real  # (2 N, 2 N)
    pivot: Int  # (2 N,)
    column: Real  # (2 N,)
    begin: Real  # (2 N, 3) state at contact: constant, per real and per imaginary part of F
    end: Real  # (2 N, 3) the same at release
    z: Real  # (2 N,) state at contact, and at last at phase 0
    determinant: Real  # (1,) D of the last F


def new_two_event(machine: MachineArrays) -> TwoEvent:
    """Scratch of the scalar problem of a machine."""
    size = 2 * machine.direction.shape[1]
    square = (size, size)
    return TwoEvent(
        engaged=np.zeros(square),
        open=np.zeros(square),
        A=np.zeros(square),
        pivot=np.zeros(size, np.int64),
        column=np.zeros(size),
        begin=np.zeros((size, 3)),
        end=np.zeros((size, 3)),
        z=np.zeros(size),
        determinant=np.zeros(1),
    )


@kernel
def piece_exponential(modes: Modes, slot: int, length: float, out: Real) -> None:
    """out = exp(A length) of one contact state, by its modes."""
    size = out.shape[0]
    for r in range(size):
        for c in range(size):
            out[r, c] = 0.0
    for i in range(modes.mode_count[slot]):
        factor = modes.weight[slot, i] * exponential(modes.rate[slot, i] * length)
        for r in range(size):
            v = modes.right[slot, r, i] * factor
            for c in range(size):
                left = modes.left[slot, i, c]
                out[r, c] += v.real * left.real - v.imag * left.imag


@kernel
def required_force(
    machine: MachineArrays, flow: Flow, work: TwoEvent, omega: float, s: float
) -> complex:
    """F of the motion that touches for the share s; its state at contact into work.z."""
    size = work.z.shape[0]
    half = math.pi / omega
    for slot in (OPEN_SLOT, PLUS_SLOT):
        if flow.modes.ready[slot] == 0:
            prepare(machine, flow.modes, slot)
        if flow.modes.ready[slot] < 0:
            return complex(math.nan, math.nan)
        prepare_drive(machine, flow, slot, omega)
    piece_exponential(flow.modes, PLUS_SLOT, s * half, work.engaged)
    piece_exponential(flow.modes, OPEN_SLOT, (1.0 - s) * half, work.open)
    turn = exponential(1j * (s * math.pi))
    _end_of_touch(machine, flow, work, turn)
    # -z = open z_end + ..., with z_end = engaged z + end: (I + open engaged) z = right sides.
    for r in range(size):
        for c in range(size):
            total = 1.0 if r == c else 0.0
            for k in range(size):
                total += work.open[r, k] * work.engaged[k, c]
            work.A[r, c] = total
    if not lu_factor(work.A, work.pivot):
        return complex(math.nan, math.nan)
    work.determinant[0] = lu_determinant(work.A, work.pivot)
    for part in range(3):
        _solve_begin(flow, work, turn, part)
    return _solve_force(machine, work, s * half)


@kernel
def _end_of_touch(machine: MachineArrays, flow: Flow, work: TwoEvent, turn: complex) -> None:
    """work.end: the state at release less exp(A t) z, constant and per part of F."""
    size = work.z.shape[0]
    n, gap = size // 2, machine.stops.gap[0, 0]
    for r in range(size):
        drive = flow.drive[PLUS_SLOT, 0, r] * turn
        constant, real, imag = 0.0, drive.real, -drive.imag
        if r < n:
            constant = gap * flow.modes.rest[PLUS_SLOT, 0, r]
        for c in range(size):
            before = flow.drive[PLUS_SLOT, 0, c]
            if c < n:
                constant -= work.engaged[r, c] * gap * flow.modes.rest[PLUS_SLOT, 0, c]
            real -= work.engaged[r, c] * before.real
            imag += work.engaged[r, c] * before.imag
        work.end[r, 0], work.end[r, 1], work.end[r, 2] = constant, real, imag


@kernel
def _solve_begin(flow: Flow, work: TwoEvent, turn: complex, part: int) -> None:
    """One column of work.begin, and of work.end with exp(A t) z added."""
    size = work.z.shape[0]
    for r in range(size):
        # At the end of the half turn the drive has the opposite sign.
        drive = flow.drive[OPEN_SLOT, 0, r]
        total = 0.0 if part == 0 else drive.real if part == 1 else -drive.imag
        for c in range(size):
            before = flow.drive[OPEN_SLOT, 0, c] * turn
            driven = 0.0 if part == 0 else before.real if part == 1 else -before.imag
            total -= work.open[r, c] * (work.end[c, part] - driven)
        work.column[r] = total
    lu_solve(work.A, work.pivot, work.column)
    for r in range(size):
        work.begin[r, part] = work.column[r]
    for r in range(size):
        for c in range(size):
            work.end[r, part] += work.engaged[r, c] * work.column[c]


@kernel
def _solve_force(machine: MachineArrays, work: TwoEvent, touch: float) -> complex:
    """F from y = e at both ends of the touch; the second as a difference quotient."""
    n = machine.direction.shape[1]
    gap = machine.stops.gap[0, 0]
    first0, first1, first2 = -gap, 0.0, 0.0
    next0, next1, next2 = 0.0, 0.0, 0.0
    for k in range(n):
        d = machine.direction[0, k]
        first0 += d * work.begin[k, 0]
        first1 += d * work.begin[k, 1]
        first2 += d * work.begin[k, 2]
        next0 += d * (work.end[k, 0] - work.begin[k, 0]) / touch
        next1 += d * (work.end[k, 1] - work.begin[k, 1]) / touch
        next2 += d * (work.end[k, 2] - work.begin[k, 2]) / touch
    det = first1 * next2 - first2 * next1
    work.determinant[0] *= det
    a = (first2 * next0 - first0 * next2) / det
    b = (first0 * next1 - first1 * next0) / det
    for k in range(work.z.shape[0]):
        work.z[k] = work.begin[k, 0] + a * work.begin[k, 1] + b * work.begin[k, 2]
    return complex(a, b)


@kernel
def force_excess(
    machine: MachineArrays, flow: Flow, work: TwoEvent, omega: float, s: float
) -> float:
    """f(s) = |F| - 1."""
    return _excess(required_force(machine, flow, work, omega, s))


@kernel
def _excess(F: complex) -> float:
    return math.sqrt(F.real * F.real + F.imag * F.imag) - 1.0


@kernel
def root_between(
    machine: MachineArrays, flow: Flow, work: TwoEvent, omega: float, a: float, b: float,
    f_a: float, f_b: float, tolerance: float,
) -> float:  # fmt: skip
    """Zero of f in [a, b] by false position with halving of the stale end (Illinois)."""
    for _ in range(MOST_ROOT_STEPS):
        s = (a * f_b - b * f_a) / (f_b - f_a)
        f = force_excess(machine, flow, work, omega, s)
        if abs(f) < tolerance or abs(b - a) < SHARP:
            return s
        if f * f_b < 0.0:
            a, f_a = b, f_b
        else:
            f_a *= 0.5
        b, f_b = s, f
    return b


@kernel(entry=True)
def two_event_states(
    machine: MachineArrays, flow: Flow, work: TwoEvent, omega: float, samples: int, states: Real,
    shares: Real,
) -> int:  # fmt: skip
    """All zeros of f that lie more than one sample apart: states at t = 0 and shares; their number.

    Whether their touches are those assumed is for the caller to see.
    """
    found = 0
    before, f_before = 0.0, math.nan
    for i in range(samples):
        s = (i + 0.5) / samples
        f = force_excess(machine, flow, work, omega, s)
        if f * f_before < 0.0 and found < states.shape[0]:
            root = root_between(machine, flow, work, omega, before, s, f_before, f, SHARP)
            F = required_force(machine, flow, work, omega, root)
            to_phase_zero(machine, flow, work, omega, root, F)
            for k in range(work.z.shape[0]):
                states[found, k] = work.z[k]
            shares[found] = root
            found += 1
        before, f_before = s, f
    return found


@kernel
def only_motion(machine: MachineArrays, flow: Flow, work: TwoEvent, omega: float) -> float:
    """Share of contact of the only motion at omega, its state at phase 0 into work.z.

    0 stands for the motion without contact, the limit of these motions. NaN where there are more,
    or may be.
    """
    if not has_two_events(machine):
        return math.nan
    s, s_before, step = FIRST_SHARE, 0.75 * NARROW, NARROW  # no half of a step ends there
    here = _homogeneous(machine, flow, work, omega, s)
    before = _homogeneous(machine, flow, work, omega, s_before)
    free = _square(here) > 0.0
    count, low, high, f_low, f_high = 1 if free else 0, 0.0, 0.0, 0.0, 0.0
    looked = 0
    while s < LAST_SHARE:
        looked += 1
        end = min(s + step, LAST_SHARE)
        ahead = _homogeneous(machine, flow, work, omega, end)
        bulge = _bend(before, here, ahead, s - s_before, end - s) * (end - s) ** 2
        changes = (_square(here) > 0.0) != (_square(ahead) > 0.0)
        if not _is_told(here, ahead, changes, bulge):
            if end - s > NARROWEST and looked < MOST_LOOKED:
                step = 0.5 * (end - s)
                continue
            if not changes:
                return math.nan
        if changes:
            count += 1
            low, high, f_low, f_high = s, end, _excess_of(here), _excess_of(ahead)
        if count > 1:
            return math.nan
        before, s_before, here, s, step = here, s, ahead, end, min(2.0 * step, WIDEST)
    if free or count == 0:
        return 0.0 if free else math.nan
    share = root_between(machine, flow, work, omega, low, high, f_low, f_high, ON_ZERO)
    F = required_force(machine, flow, work, omega, share)
    to_phase_zero(machine, flow, work, omega, share, F)
    return share


@kernel(entry=True)
def only_share(machine: MachineArrays, flow: Flow, work: TwoEvent, omega: float) -> float:
    """:func:`only_motion` for Python."""
    return only_motion(machine, flow, work, omega)


@kernel(inline=True)
def _homogeneous(
    machine: MachineArrays, flow: Flow, work: TwoEvent, omega: float, s: float
) -> Homogeneous:
    F = required_force(machine, flow, work, omega, s)
    D = work.determinant[0]
    return Homogeneous(F.real * D, F.imag * D, D)


@kernel(inline=True)
def _square(one: Homogeneous) -> float:
    """|F D|^2 - D^2."""
    return one.x * one.x + one.y * one.y - one.w * one.w


@kernel(inline=True)
def _excess_of(one: Homogeneous) -> float:
    """|F| - 1."""
    return math.hypot(one.x, one.y) / abs(one.w) - 1.0


@kernel(inline=True)
def _bend(
    before: Homogeneous, here: Homogeneous, ahead: Homogeneous, back: float, on: float
) -> float:
    """Half the size of the second derivative through three values."""
    x = (ahead.x - here.x) / on - (here.x - before.x) / back
    y = (ahead.y - here.y) / on - (here.y - before.y) / back
    w = (ahead.w - here.w) / on - (here.w - before.w) / back
    return math.sqrt(x * x + y * y + w * w) / abs(on + back)


@kernel
def _is_told(start: Homogeneous, end: Homogeneous, changes: bool, bulge: float) -> bool:
    """Whether |F| crosses 1 between two values once where their sides differ, else never.

    The straight way between them, which (F D, D) leaves by no more than the bulge, has to keep
    its distance from |F| = 1, or to cross it more steeply than a way of that bulge turns.
    """
    x, y, w = end.x - start.x, end.y - start.y, end.w - start.w
    slope = 2.0 * (start.x * x + start.y * y - start.w * w)
    curve = x * x + y * y - w * w  # |F D|^2 - D^2 is its value at the start + slope t + curve t^2
    largest = max(start.x**2 + start.y**2 + start.w**2, end.x**2 + end.y**2 + end.w**2)
    margin = 2.0 * bulge * math.sqrt(2.0 * largest)
    if changes:
        steepest = slope if abs(slope) < abs(slope + 2.0 * curve) else slope + 2.0 * curve
        return slope * (slope + 2.0 * curve) > 0.0 and abs(steepest) > 4.0 * margin
    side = 1.0 if _square(start) > 0.0 else -1.0
    least = min(side * _square(start), side * _square(end))
    down, up = -side * slope, side * curve
    if 0.0 < down < 2.0 * up:
        least = side * _square(start) - 0.25 * down * down / up
    return least > margin


@kernel
def has_two_events(machine: MachineArrays) -> bool:
    """Whether a machine, an even one, has the one stop and the one force of these motions."""
    one = machine.direction.shape[0] == 1 and machine.power.shape[0] == 1
    return one and machine.order[0] == 1 and machine.stops.law[0] == PAPER


@kernel
def to_phase_zero(
    machine: MachineArrays, flow: Flow, work: TwoEvent, omega: float, s: float, F: complex
) -> None:
    """Carry the state at contact to phase 0 of the force, or to pi and turn it round."""
    phase, size = math.atan2(F.imag, F.real), work.z.shape[0]
    ahead = -phase if phase <= 0.0 else math.pi - phase
    begin = 0.0 if ahead < s * math.pi else s * math.pi
    slot = PLUS_SLOT if begin == 0.0 else OPEN_SLOT
    modes, drive = flow.modes, flow.drive
    turned, at_end = F * exponential(1j * begin), F * exponential(1j * ahead)
    for k in range(size):
        z = work.z[k]
        if begin > 0.0:
            z = work.end[k, 0] + F.real * work.end[k, 1] + F.imag * work.end[k, 2]
        rest = _rest(machine, flow, slot, k)
        work.column[k] = z - rest - (turned * drive[slot, 0, k]).real
        work.z[k] = rest + (at_end * drive[slot, 0, k]).real
    for i in range(modes.mode_count[slot]):
        q = 0j
        for k in range(size):
            q += modes.left[slot, i, k] * work.column[k]
        q *= modes.weight[slot, i] * exponential(modes.rate[slot, i] * ((ahead - begin) / omega))
        for k in range(size):
            work.z[k] += (modes.right[slot, k, i] * q).real
    for k in range(size if phase > 0.0 else 0):
        work.z[k] = -work.z[k]


@kernel
def _rest(machine: MachineArrays, flow: Flow, slot: int, k: int) -> float:
    """State k at rest without drive: an engaged stop holds the machine beside its gap."""
    if slot == OPEN_SLOT or k >= machine.direction.shape[1]:
        return 0.0
    return float(machine.stops.gap[0, 0] * flow.modes.rest[PLUS_SLOT, 0, k])


class TwoEventProblem:
    """The scalar problem f(s) = |F(s, omega)| - 1 of a machine with one symmetric stop."""

    def __init__(self, machine: MachineArrays, flow: Flow | None = None) -> None:
        self._machine = machine
        self._flow = new_flow(machine) if flow is None else flow
        self._work = new_two_event(machine)

    @staticmethod
    def applies(system: MechanicalSystem) -> bool:
        """Whether the machine has one stop, the same on both sides, with the paper's law.

        It is excited once a turn, and nothing pulls it to one side.
        """
        springs = system.springs
        if len(springs) != 1 or springs[0].law != "paper":
            return False
        return system.symmetric and system.orders == (1,)

    def only(self, omega: float) -> tuple[float, Real]:
        """Share of contact of the only motion at ``omega``, and its state at t = 0, (2 N,).

        The share is NaN where there are more motions, or may be, and 0 where that one has no
        contact; the state has no meaning then.
        """
        share = only_share(self._machine, self._flow, self._work, omega)
        return share, self._work.z.copy()

    def states(self, omega: float) -> tuple[Real, Real]:
        """States at t = 0, (k, 2 N), and contact shares, (k,), of the candidates at ``omega``."""
        states = np.empty((MOST_MOTIONS, self._work.z.size))
        shares = np.empty(MOST_MOTIONS)
        found = two_event_states(
            self._machine, self._flow, self._work, omega, SAMPLES, states, shares
        )
        return states[:found], shares[:found]
