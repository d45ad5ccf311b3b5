"""Special points looked at by other means than those that found them.

A special point is confirmed by the other method (same kind, same speed), or on its own:

- fold: omega turns there, as seen on motions beside it whose return is checked by the flow itself;
- loss of symmetry: det(I - M) changes sign, M the monodromy by differences of the flow, or
  asymmetric motions stand beside it;
- Neimark-Sacker: prod (1 - mu_i mu_j) of that M changes sign;
- contact: the closed-form linear amplitude equals the gap and rises or falls as the kind says.

Where a point of harmonic balance has no partner, the same is asked of the exact motions that Newton
reaches from the series on both sides of it.
"""

import math

import numpy as np
from machine_draw import linear_relative_amplitude

from flipflow.errors import IncompleteError
from flipflow.periodic.exact_solver import ExactSolver

SAME_SPEED = 5e-3
CONTACT_TOLERANCE = 1e-7
RETURNS = 1e-7  # of the motion's size: a state comes back to itself over a turn
REPEATED = 1e-9
STEP = 1e-6
BESIDE = 0.25, 0.05, 0.01, 0.001, 1e-4  # shares of a step beside the point to look at
FOLD, SYMMETRY, NEIMARK_SACKER = "fold", "symmetry breaking", "Neimark-Sacker"


class Beside:
    """Exact motions beside a special point of a branch, by either method."""

    def __init__(self, screen, branch, exact_solver):
        self.screen, self.branch, self.exact = screen, branch, exact_solver
        self.full = ExactSolver(screen.system(), half_turn=False)
        self.is_exact = branch.formulation.kind is ExactSolver

    def at(self, position):
        """State and omega of the exact motion at a position along the branch; None if none."""
        index = min(max(int(position), 0), self.branch.omega.size - 2)
        try:
            solver = self.branch.formulation.solver()
            point = solver.between(self.branch.traced, index, position - index)
        except IncompleteError:
            return None
        if self.is_exact:
            return point.u, point.omega
        at = point.u[None], np.array([point.omega])
        state = self.branch.formulation.solver().states(*at)[0]
        reached = self.exact.solve(state, point.omega)
        return None if reached is None else (reached.u, point.omega)

    def returns(self, state, omega):
        """Whether the flow over a whole turn brings the state back."""
        off = self.flow(state, omega) - state
        return np.abs(off / self.size(state, omega)).max() < RETURNS

    def flow(self, state, omega):
        """State one turn later."""
        return self.full.settled(state, omega, 1)

    def size(self, state, omega):
        """Size of each component of a state: one length, and that length times omega."""
        n = state.size // 2
        length = max(np.abs(state[:n]).max(), np.abs(state[n:]).max() / omega)
        return np.repeat([length, length * omega], n)

    def monodromy(self, state, omega):
        """The linearised turn by central differences of the flow."""
        columns = []
        for k, size in enumerate(self.size(state, omega)):
            step = np.zeros(state.size)
            step[k] = STEP * size
            ahead, behind = self.flow(state + step, omega), self.flow(state - step, omega)
            columns.append((ahead - behind) / (2.0 * step[k]))
        return np.array(columns).T

    def asymmetric_beside(self, state, omega):
        """Whether a motion that is not its own mirror image stands near this one."""
        M = self.monodromy(state, omega)
        values, vectors = np.linalg.eig(M)
        shape = vectors[:, np.abs(values - 1.0).argmin()].real
        shape *= self.size(state, omega).max() / np.abs(shape).max() / omega
        for share in (0.003, 0.01, 0.03, 0.1):
            for off in (0.0, 1e-5, -1e-5, 1e-4, -1e-4, 1e-3, -1e-3, 5e-3, -5e-3):
                speed = omega * (1.0 + off)
                point = self.full.solve(state + share * shape, speed)
                if point is not None and self._leans(point, speed):
                    return True
        return False

    def _leans(self, point, speed):
        motion = self.full.motion(point.u, speed)
        half = math.pi / speed
        mirror = -np.concatenate([motion.derivative(half, 0), motion.derivative(half, 1)])
        off = np.abs((mirror - point.u) / self.size(point.u, speed)).max()
        return off > 1e-5 and self.returns(point.u, speed)


def test_value(kind, M):
    """The number whose sign changes at a special point of a kind, of the full turn."""
    if kind == NEIMARK_SACKER:
        mu = np.linalg.eigvals(M)
        i, j = np.triu_indices(mu.size, k=1)
        return float(np.prod(1.0 - mu[i] * mu[j]).real)
    return float(np.linalg.det(np.eye(len(M)) - M))


def independent(beside, point, nearest):
    """None when the point is confirmed on its own, else why it is not."""
    if point.kind.startswith("contact"):
        return contact_reason(beside.screen, point)
    reason = "too close to another special point"
    for share in BESIDE:
        if share > 0.5 * nearest:
            continue
        reason = crossing_reason(beside, point, share)
        if reason is None:
            return None
    if point.kind == SYMMETRY:
        here = beside.at(point.position)
        if here is not None and beside.asymmetric_beside(*here):
            return None
        reason += ", no asymmetric motion beside it"
    return reason


def crossing_reason(beside, point, share):
    """None when the kind's number changes sign from one side of the point to the other."""
    sides = [beside.at(point.position + sign * share) for sign in (-1.0, 1.0)]
    if any(side is None for side in sides):
        return "no exact motion beside it"
    if not all(beside.returns(*side) for side in sides):
        return "the flow does not return to the motions beside it"
    values = [test_value(point.kind, beside.monodromy(*side)) for side in sides]
    if not values[0] * values[1] < 0.0:
        return "the multipliers do not cross"
    if point.kind == FOLD and beside.is_exact:
        turns = [side[1] - point.omega for side in sides]
        if turns[0] * turns[1] <= 0.0:
            return "omega does not turn"
    return None


def contact_reason(screen, point):
    """None when the linear machine just reaches the gap here, rising at a begin."""
    amplitude = linear_relative_amplitude(screen, point.omega)
    if abs(amplitude / screen.clearance - 1.0) > CONTACT_TOLERANCE:
        return f"the linear amplitude is {amplitude:.9g} m, the gap {screen.clearance:.9g} m"
    rises = linear_relative_amplitude(screen, point.omega * (1.0 + 1e-5)) > amplitude
    if rises != (point.kind == "contact begin"):
        return "the linear amplitude runs the other way"
    return None


def partners(ours, theirs):
    """For each of our points the nearest free one of the same kind and speed, or None."""
    pairs = [
        (abs(a.omega - b.omega), i, j)
        for i, a in enumerate(ours)
        for j, b in enumerate(theirs)
        if a.kind == b.kind and abs(a.omega - b.omega) <= SAME_SPEED * a.omega
    ]
    found, taken = [None] * len(ours), set()
    for _, i, j in sorted(pairs):
        if found[i] is None and j not in taken:
            found[i] = j
            taken.add(j)
    return found


def distinct(points):
    """The points without those met before: a branch that runs over itself repeats them."""
    kept = []
    for point in points:
        known = any(
            point.kind == other.kind
            and abs(point.omega - other.omega) <= REPEATED * other.omega
            and abs(point.amplitude("relative") / other.amplitude("relative") - 1.0) < 1e-6
            for other in kept
        )
        if not known:
            kept.append(point)
    return kept


def nearest_neighbours(points):
    """Distance of each point to the next special point, along the branch, in steps."""
    positions = np.array([point.position for point in points])
    apart = np.abs(positions[:, None] - positions[None, :]) + np.diag(np.full(len(points), np.inf))
    return apart.min(axis=1, initial=np.inf)
