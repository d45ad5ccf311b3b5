"""Every public number of random machines, written down, or held against a file written before.

Only the public face is used, so that what lies behind it may move. Numbers are compared relative
to the natural size of their quantity: lengths to the largest amplitude of the motion, forces to
what springs give at that amplitude, phases, shares and multipliers to 1. Points of a branch are
nobody's numbers; what is solved for at a given speed, and refined special points, are. A name
with "searched" hangs on the place of an extremum: rounding moves that by up to 1e-7.
"""

import argparse
import dataclasses
import gzip
import json
import math
import re
import sys
import warnings
from functools import partial
from multiprocessing import get_context
from operator import attrgetter
from pathlib import Path

import numpy as np
from machine_draw import PARAMETERS
from one_core import stay_on_one_core

import flipflow as ff

KINDS = 10  # machine n is of kind n % 10, and asked the longer questions by its round n // 10
SHARES = (0.0, 0.15, 0.4, 0.6, 0.75, 0.9, 1.0)  # of the interval: speeds of what is solved for
ROWS = ("multipliers", "points", "motions", "intervals", "jumps", "feasible", "searched")
WORDS = ("stable", "undetermined", "unstable")
NUMBER = re.compile(r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?")
LAWS = ("paper", "compression-only")
LOAD = ff.Load(stiffness_factor=1.1, main_mass=20.0)
SOBOL = "first_order total mean variance failed nominal at_low at_high"
RUN = "outcome final_speed duration passing time_to_speed peaks power notes history.energy"


def drawn(seed, number):
    """Machine ``number`` of ``seed``: seven kinds of screens near and far, three of systems."""
    rng = np.random.default_rng([seed, number])
    kind, odd = number % KINDS, number // KINDS % 2
    if kind >= 7:
        return system(rng, 1 if kind == 7 else 4 if kind == 9 else 2 + odd)
    base, factor = ff.load("ffs0827"), 1.1 if kind < 2 else 3.0
    changes = {name: getattr(base, name) * factor ** rng.uniform(-1.0, 1.0) for name in PARAMETERS}
    light = factor ** -rng.uniform(0.0, 2.0)
    changes |= {name: light * changes[name] for name in PARAMETERS if name.endswith("damping")}
    law = LAWS[kind % 2 if kind < 4 else rng.integers(2)]
    gap = rng.uniform(0.5e-3, 12e-3) if kind > 1 else 6e-3 * rng.uniform(0.9, 1.1)
    single, none = (math.inf, gap) if odd else (gap, math.inf), (0.0 if odd else math.inf, None)
    gaps = {4: (gap, gap * rng.uniform(0.2, 2.0)), 5: single, 6: none}
    plus, minus = gaps.get(kind, (gap, None))
    return base.replace(clearance=plus, clearance_minus=minus, stop_law=law, **changes)


def system(rng, size):
    """A chain of masses from the ground, with one to three stops within the linear motion."""
    stiffness, damping = 10.0 ** rng.uniform(5.5, 6.5, size), rng.uniform(0.01, 0.06)
    B = np.eye(size) - np.eye(size, k=-1)
    M, K = np.diag(10.0 ** rng.uniform(1.7, 2.7, size)), B.T @ np.diag(stiffness) @ B
    C = damping * (K / 50.0 + 10.0 * M)
    force = np.zeros(size, complex)
    force[rng.integers(size)] = rng.uniform(0.5, 3.0) * np.exp(1j * rng.uniform(-1.0, 1.0))
    excitation = ff.Unbalance(force) if rng.uniform() < 0.7 else ff.HarmonicForce(2e3 * force)
    w = np.linspace(1.0, math.sqrt(np.linalg.eigvals(np.linalg.solve(M, K)).real.max()), 200)
    w = w[:, None, None]
    X = np.linalg.solve(K - w**2 * M + 1j * w * C, excitation.vector[:, None] * w**excitation.power)
    springs = []
    for _ in range(rng.integers(1, 4)):
        direction = (B if rng.uniform() < 0.6 else np.eye(size))[rng.integers(size)]
        gap = np.abs(direction @ X).max() * rng.uniform(0.1, 0.7) * (rng.uniform() > 0.05)
        minus = (gap, gap * rng.uniform(0.5, 2.0), math.inf)[rng.choice(3, p=(0.5, 0.25, 0.25))]
        k, law = stiffness.mean() * rng.uniform(0.5, 5.0), LAWS[rng.integers(2)]
        springs.append(ff.ClearanceSpring(direction, k, 1e-3 * k * damping, gap, minus, law))
    return ff.MechanicalSystem(M, C, K, springs, excitation)


def speeds(machine):
    """From a fifth of the first frequency to beyond the last with all stops engaged, rad/s."""
    s = machine.system()
    stops = sum(j.stiffness * np.outer(j.direction, j.direction) for j in s.springs)
    low, high = (np.linalg.eigvals(np.linalg.solve(s.M, K)).real for K in (s.K, s.K + stops))
    return np.interp(SHARES, (0.0, 1.0), np.sqrt([0.04 * low.min(), 1.334 * high.max()])).tolist()


class Record(dict):
    """Name -> words, or [values, natural size] in SI; None is written as NaN."""

    def put(self, name, values, size=None):
        """Numbers; their own largest is the size where none is given, of rows each its own."""
        a = np.asarray(values)
        a = np.stack([a.real, a.imag], axis=-1) if np.iscomplexobj(a) else a.astype(float)
        own = np.abs(a) if name.endswith(ROWS) else np.abs(a[np.isfinite(a)]).max(initial=0.0)
        self[name] = [a.tolist(), np.asarray(own if size is None else size, float).tolist()]

    def say(self, name, *words):
        """Words; numbers in them, such as the end of a branch given up, are left out."""
        self[name] = "; ".join(NUMBER.sub("#", str(word)) for word in words)

    def take(self, name, result, attributes, size=None):
        """Attributes of a result, numbers or words."""
        for attribute in attributes.split():
            value = attrgetter(attribute)(result)
            value = tuple(value.values()) if hasattr(value, "values") else value
            several = value if isinstance(value, tuple) else (value,)
            if any(isinstance(one, (str, bool)) for one in several):
                self.say(f"{name} {attribute}", *several)
            elif several and dataclasses.is_dataclass(several[0]):
                self.put(f"{name} {attribute}", [dataclasses.astuple(one) for one in several])
            else:
                self.put(f"{name} {attribute}", value, size)

    def along(self, name, result, methods, *args, size=None):
        """What is asked for each coordinate."""
        for method in methods.split():
            found = [getattr(result, method)(c, *args) for c in result.system.named]
            self.put(f"{name} {method}", found, size)

    def ask(self, name, put, question, *args, **options):
        """What a call answers, put down by a function or by its attributes; an error is a word."""
        put = partial(Record.take, attributes=put) if isinstance(put, str) else put
        answer = None
        try:
            answer = question(*args, **options)
            if answer is not None:
                put(self, name, answer)
        except Exception as error:  # noqa: BLE001  whatever it is, it is written down
            self.say(f"{name} raises", type(error).__name__, error)
        return answer


def lengths(orbit):
    """Amplitudes and means, and the largest amplitude, which is their natural size."""
    amplitudes = [orbit.amplitude(c) for c in orbit.system.named]
    return [*amplitudes, *map(orbit.mean, orbit.system.named)], max(amplitudes)


def put_motion(record, name, orbit):
    """One periodic motion, and the forces of its stops."""
    omega, given, (_, size) = orbit.omega, orbit.machine.system(), lengths(orbit)
    record.take(name, orbit, "stability periods touches", 1.0)
    record.along(name, orbit, "amplitude mean", size=size)
    record.along(name, orbit, "phase", size=1.0)
    scale, most = np.repeat([1.0, 1.0 / omega], given.size), abs(orbit.multipliers[0])
    record.put(f"{name} multipliers", orbit.multipliers, max(1.0, most))
    record.put(f"{name} monodromy", orbit.monodromy * scale[:, None] / scale, max(1.0, most))
    record.take(name, orbit, "error", size)
    t = orbit.period * np.array([0.0, 0.37, 0.81])
    for k, method in enumerate(("displacement", "velocity", "acceleration")):
        record.along(name, orbit, method, t, size=size * omega**k)
    record.along(name, orbit, "mean_square_velocity", size=(omega * size) ** 2)
    record.put(f"{name} spectrum", ff.spectrum(orbit, given.named[0]).amplitudes[:8], size)
    for j, stop in enumerate(given.springs):
        force = (stop.stiffness + stop.damping * omega) * size
        forces = [orbit.stop_force_peak(j), *orbit.stop_force(j, t)]
        record.put(f"{name} stop {j} force", forces, force)
        record.put(f"{name} stop {j} contact share", orbit.contact_share(j), 1.0)
    touches = [(c.spring, c.side, c.start * omega, c.end * omega) for c in orbit.contact_intervals]
    record.put(f"{name} contacts", touches, 1.0)
    force = np.abs(given.excitation.vector).max() * omega**given.excitation.power
    record.put(f"{name} input power", orbit.input_power(), 0.5 * force * omega * size)


def put_motions(record, name, found):
    """Motions at one speed, whatever their order and the turn in which each begins."""
    rows, sizes = [], []
    for orbit in found:
        (own, size), moduli = lengths(orbit), np.abs(orbit.multipliers)
        rows.append([orbit.periods, WORDS.index(orbit.stability), *own, *moduli])
        sizes.append([1.0, 1.0, *[size] * len(own), *np.maximum(1.0, moduli)])
    record.put(f"{name} motions", rows, sizes)


def put_branch(record, name, branch):
    """How a branch ended, its special points, and over a field its ends, which are at bounds."""
    record.say(f"{name} status", branch.status.name, branch.complete, *branch.notes)
    record.say(f"{name} special kinds", *(p.kind for p in branch.special_points))
    for kind in sorted({p.kind for p in branch.special_points}):
        rows, sizes = [], []
        for p in branch.points_of(kind):
            (own, size), at = lengths(p.orbit), [p.omega, getattr(p, "value", 0.0)]
            rows.append([*at, p.spring, p.side, *own])
            sizes.append([*at, 1.0, 1.0, *[size] * len(own)])
        record.put(f"{name} {kind} points", rows, sizes)
    for i in (0, -1) if branch.complete and hasattr(branch, "values") else ():
        end = branch.values[i], branch.omega[i], *lengths(branch.orbit(i))[0]
        record.put(f"{name} end {i}", end, [*end[:2], *[max(end[2:])] * len(end[2:])])


def put_response(record, name, branch):
    """A branch, its peaks and troughs, and the motions on it at five speeds."""
    put_branch(record, name, branch)
    for k, omega in enumerate(speeds(branch.machine)[1:-1]):
        orbits = record.ask(f"{name} at {k}", put_motions, branch.orbits_at, omega) or ()
        for i, orbit in enumerate(orbits):
            put_motion(record, f"{name} at {k} motion {i}", orbit)
        record.ask(f"{name} at {k} from below", "stability", branch.orbit_from_below, omega)
    for c in branch.system.named if branch.complete else ():
        for tops in (branch.peaks, branch.troughs):
            found = tops(c)
            record.put(f"{name} {c} {tops.__name__}", [p.amplitude(c) for p in found])
            record.put(f"{name} {c} {tops.__name__} searched", [p.omega for p in found])


def put_sweep(record, name, w):
    """Settled motions; what has not settled may be chaotic, and is no number to keep."""
    found = np.array([w.amplitude(c) for c in w.system.named])
    record.put(f"{name} amplitude", np.where(w.settled, found, np.nan))
    record.take(name, w, "periods turns settled jumps", 1.0)


def put_history(record, name, h):
    """A motion in time; of its distance from the settled one the motion is the size."""
    record.take(name, h, "x v a force energy counters status settled notes")
    record.take(name, h, "distance", np.abs(h.x).max())
    if h.normal is not None:
        record.put(f"{name} normal", h.normal, np.abs(h.normal).max(axis=0))


def put_region(record, name, r):
    """The operating region, and the speeds at which each limit is met in each load case."""
    marks = "omega_ea omega_ar omega_cs omega_lb omega_ub lower ends feasible notes"
    record.take(name, r, f"{marks} contact_speeds")
    record.put(f"{name} upper{'' if r.upper in (r.omega_lb, r.omega_ar) else ' searched'}", r.upper)
    record.say(f"{name} binding", *((one.limit, one.case) for ends in r.binding for one in ends))
    for k, case in enumerate(r.cases):
        record.say(f"{name} case {k} unchecked", *case.unchecked, *case.notes)
        for limit, found in case.intervals.items():
            record.put(f"{name} case {k} {limit} intervals", found)


def put_loading(record, name, loaded):
    """What a load changes over a region; the change itself is small beside the amplitudes."""
    for part in ("without_stop", "with_stop"):
        both = getattr(loaded, part)
        for which in ("region", "from_loaded") if both else ():
            change, marks = getattr(both, which), both.unloaded_marks
            if change is not None:
                sharp = change.upper in (marks.omega_lb, marks.omega_ar)
                at = f"{name} {part} {which}{'' if sharp else ' searched'}"
                record.take(at, change, "lower upper unloaded loaded")
                record.take(at, change, "least.change greatest.change", np.nanmax(change.unloaded))
                record.take(f"{at} searched", change, "least.omega greatest.omega")


def numbers_of(number, seed):
    """What every machine is asked, some of it of a part of them."""
    warnings.simplefilter("ignore", RuntimeWarning)
    record, machine, round_ = Record(), drawn(seed, number), number // KINDS
    low, *five, high = speeds(machine)
    span, omega, named = (low, high), five[2 + number % 2], machine.system().named
    words = "natural_frequencies omega_ea omega_ar shapes complex_amplitudes"
    linear = record.ask("linear", words, ff.linear_response, machine, five)
    for c in named if linear else ():
        record.ask(f"linear {c} peaks searched", Record.put, linear.peaks, c)
    exact = record.ask("exact", put_response, ff.frequency_response, machine, span)
    series = ff.HarmonicBalance(9 if round_ % 4 == 3 else 3)
    record.ask("series", put_response, ff.frequency_response, machine, span, series)
    record.ask("sweep", put_sweep, ff.sweep, machine, [*five, *five[::-1]], most_turns=500)
    t = 40.0 * math.pi / omega * np.array([0.0, 0.013, 0.124, 0.47, 0.781, 0.963, 1.0])
    blows = [ff.Impulse(0.265 * t[-1], named[-1], 20.0)] * (round_ % 2)
    if isinstance(machine, ff.FlipFlowScreen) and blows:
        blows += [ff.LoadStep(0.405 * t[-1], LOAD), ff.Lump(0.585 * t[-1], "floating", 15.0, 0.4)]
    record.ask("history", put_history, ff.simulate, machine, omega, 20, disturbances=blows, t=t)
    record.ask("section", "states", ff.poincare_section, machine, omega, 5, skip=20)
    record.ask("coexisting", put_motions, ff.periodic_orbits, machine, omega, 2)
    if round_ % 4 == 1:
        x, words = np.linspace(-0.02, 0.02, 5), "labels turns shares"
        grid = {named[-1]: x}, {named[-1]: omega * x[::2]}
        record.ask("basins", words, ff.basins, machine, omega, *grid, most_turns=200, threads=1)
    if exact is not None:
        followed(record, exact, span, omega, round_)
    if isinstance(machine, ff.FlipFlowScreen):
        asked_of_screens(record, machine, round_)
    return dict(record)


def followed(record, branch, span, omega, round_):
    """A motion over frequency and over a field, a fold over a field, a branch that leans."""
    gap = getattr(branch.machine, "clearance", 0.0)
    field = "clearance" if 0.0 < gap < math.inf else "shear_stiffness"
    over = field, np.array([0.99, 1.01]) * getattr(branch.machine, field, 1.0)
    orbit = record.ask("followed", put_motion, branch.orbit_from_below, omega)
    if orbit is not None:
        along = "omega", (0.95 * omega, 1.05 * omega)
        record.ask("over omega", put_branch, ff.continue_orbit, orbit, *along)
    if orbit is not None and round_ % 4 == 0:
        record.ask("over field", put_branch, ff.continue_orbit, orbit, *over)
    if branch.folds and round_ % 4 == 2:
        record.ask("fold over field", put_branch, ff.continue_fold, branch.folds[0], *over)
    for point in branch.points_of("symmetry breaking")[:1]:
        ends = max(span[0], 0.99 * point.omega), min(span[1], 1.01 * point.omega)
        record.ask("leaning", put_branch, ff.switch_branch, point, ends)


def asked_of_screens(record, machine, round_):
    """Region under the bundled limits, loading, starts, sensitivity, the risk of a jump."""
    own = ff.load_project("ffs0827")
    record.ask("region", put_region, ff.operating_region, machine, own.limits, own.load_cases[::2])
    record.ask("loading", put_loading, ff.loading, machine, LOAD)
    if round_ % 4 == 1:
        record.ask("start up", RUN, ff.start_up, machine, speed=90.0)
    if round_ % 4 == 3:
        record.ask("coast down", RUN, ff.coast_down, machine, 90.0, duration=20.0)
        record.ask("jump risk", "impulse lump notes", ff.jump_risk, machine, 100.0, threads=1)
        record.ask("ramp", "history.energy jumps", ff.ramp, machine, (100.0, 120.0), 20.0)
    if round_ % 4 == 2:
        k = machine.shear_stiffness
        vary = {"shear_stiffness": ff.Normal(k, 0.03 * k), "stop_damping": (1e3, 3e3)}
        given = machine, vary, "relative_amplitude", 100.0
        record.ask("sensitivity", SOBOL, ff.sensitivity, *given, n=8)


def computed(count, seed, jobs):
    """Every machine's numbers, by its number as a word, with progress on stderr."""
    found = {}
    with get_context("spawn").Pool(jobs) as pool:
        for record in pool.imap(partial(numbers_of, seed=seed), range(count)):
            found[str(len(found))] = record
            print(f"\r{len(found)} of {count} machines", end="", file=sys.stderr, flush=True)
    return {"seed": seed, "version": ff.__version__, "machines": found}


def compared(name, one, two):
    """Values of an entry as (before, after, distance over the natural size)."""
    if not (isinstance(one, list) and isinstance(two, list)):
        return [(one, two, 0.0 if one == two else math.inf)]
    (a, size), (b, other) = (map(np.asarray, entry) for entry in (one, two))
    if name.endswith(ROWS) and a.ndim == b.ndim == 2:
        return nearest(a, b, np.broadcast_to(size, a.shape))
    if a.shape != b.shape:
        return [(f"shape {a.shape}", f"shape {b.shape}", math.inf)]
    far = apart(a, b, np.where(size > 0.0, size, other), angle=name.endswith("phase"))
    return zip(a.ravel().tolist(), b.ravel().tolist(), far.ravel(), strict=True)


def nearest(a, b, size):
    """Rows in pairs, the nearest first; what has no partner is alone."""
    left, right = set(range(len(a))), set(range(len(b)))
    far = {(i, j): apart(a[i], b[j], size[i]).max() for i in left for j in right}
    for i, j in sorted(far, key=far.get):
        if i in left and j in right:
            left, right = left - {i}, right - {j}
            yield a[i].tolist(), b[j].tolist(), far[i, j]
    yield from ((a[i].tolist(), None, math.inf) for i in left)
    yield from ((None, b[j].tolist(), math.inf) for j in right)


def apart(a, b, size, *, angle=False):
    """|a - b| over the natural size; 0 for equal ones, NaN and infinity too."""
    with np.errstate(all="ignore"):
        gap = np.abs(a - b) if not angle else np.abs(np.angle(np.exp(1j * (a - b))))
        far = np.nan_to_num(gap / size, nan=np.inf, posinf=np.inf)
    return np.where((a == b) | (np.isnan(a) & np.isnan(b)), 0.0, far)


def report(before, after, tolerance):
    """Print what was compared, by kind of quantity, and every value that differs by more."""
    kinds, lines = {}, []
    for number, two in after.items():
        one = before.get(number, {})
        for name in sorted({*one, *two}):
            kind = kinds.setdefault(" ".join(NUMBER.sub("", name).split()), [])
            for k, (old, new, far) in enumerate(compared(name, one.get(name), two.get(name))):
                kind.append(far)
                if far > tolerance:
                    lines.append(f"{number:>4}  {name} [{k}]  {old}  {new}  ({far:.1e})")
    print(f"{'kind':60} {'compared':>8} {'equal':>8} {'largest':>8}")
    for kind, far in sorted(kinds.items()):
        equal = sum(one <= tolerance for one in far)
        print(f"{kind:60} {len(far):8} {equal:8} {max(far, default=0.0):8.1e}")
    values = sum(map(len, kinds.values()))
    print(f"\n{len(lines)} of {values} values of {len(after)} machines differ", *lines, sep="\n")
    return bool(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    for name, value in (("machines", 200), ("seed", 0), ("jobs", 2), ("tolerance", 1e-12)):
        parser.add_argument(f"--{name}", type=type(value), default=value)
    parser.add_argument("--out", type=Path, help="write the numbers here (.json.gz)")
    parser.add_argument("--against", type=Path, help="compute anew and compare with this file")
    parser.add_argument("--compare", type=Path, nargs=2, help="compare two files, compute nothing")
    options = parser.parse_args()
    paths = options.compare or filter(None, [options.against])
    files = [json.loads(gzip.decompress(path.read_bytes())) for path in paths]
    if len(files) < 2:
        seed = files[0]["seed"] if files else options.seed
        files.append(computed(options.machines, seed, options.jobs))
    if options.out:
        options.out.write_bytes(gzip.compress(json.dumps(files[-1]).encode(), mtime=0))
    return report(*(file["machines"] for file in files), options.tolerance) if len(files) > 1 else 0


if __name__ == "__main__":
    stay_on_one_core()
    sys.exit(main())
