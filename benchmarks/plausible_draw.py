"""Random screens as engineers build them, and a judge of what is told of their motion.

Unlike ``machine_draw.py``, which scatters the values of one machine, each screen is dimensioned: an
isolation of 1.5 to 4 Hz, a stroke of 1 to 6 mm, a shear frequency of 0.6 to 1.5 times the working
speed, stops up to twelve times as stiff as the shear springs.
"""

import math
import sys
from pathlib import Path

import numpy as np

import flipflow as ff
from flipflow.studies.feasible import working_motion
from flipflow.studies.landmarks import analysed_range

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from reference import integrate

RPM = 30.0 / math.pi
KINDS = "plain", "light", "uneven", "law", "tight", "hanging"
LAWS = "compression-only", "undamped-rebound", "elasto-gap"
UNEVEN = 0.5, 0.9, 0.99, 1.1, 1.5, 3.0, math.inf  # gap of the minus side over that of the plus side
STEP = 1e-6  # of the motion's size, for differences of the flow
FINE = 1000  # steps a turn in which no short contact is overlooked


def draw(seed, number):
    """Kind, screen and working speed in rad/s of screen ``number`` of ``seed``."""
    rng = np.random.default_rng([seed, number])
    kind = KINDS[number % len(KINDS)]
    main = between(rng, 300.0, 6000.0)
    floating = main * rng.uniform(0.12, 0.6)
    total, reduced = main + floating, main * floating / (main + floating)
    speed = round(rng.uniform(550.0, 1000.0)) / RPM
    isolation = total * (2.0 * math.pi * rng.uniform(1.5, 4.0)) ** 2
    shear = reduced * (rng.uniform(0.6, 1.5) * speed) ** 2
    stop = shear * between(rng, 1.0, 12.0)
    screen = ff.FlipFlowScreen(
        main_mass=main,
        floating_mass=floating,
        eccentric_moment=between(rng, 1e-3, 6e-3) * total,
        isolation_stiffness=isolation,
        isolation_damping=2.0 * rng.uniform(0.02, 0.3) * math.sqrt(isolation * total),
        shear_stiffness=shear,
        shear_damping=2.0 * rng.uniform(0.005, 0.1) * math.sqrt(shear * reduced),
        stop_stiffness=stop,
        stop_damping=2.0 * rng.uniform(0.01, 0.4) * math.sqrt(stop * reduced),
        clearance=rng.uniform(1.5e-3, 12e-3),
    )
    return kind, screen.replace(**changes(rng, kind, screen)), speed


def between(rng, low, high):
    """Log-uniform."""
    return math.exp(rng.uniform(math.log(low), math.log(high)))


def changes(rng, kind, screen):
    """What makes a screen one of its kind."""
    if kind == "light":
        dampers = ("isolation_damping", "shear_damping", "stop_damping")
        share = between(rng, 0.05, 1.0)
        lighter = {name: share * getattr(screen, name) for name in dampers}
        return lighter | {"stop_stiffness": screen.stop_stiffness * between(rng, 1.0, 16.0)}
    return {
        "plain": {},
        "uneven": {"clearance_minus": screen.clearance * rng.choice(UNEVEN)},
        "law": {"stop_law": str(rng.choice(LAWS))},
        "tight": {"clearance": rng.uniform(0.0, 1.5e-3)},
        "hanging": {
            "deck_angle": math.radians(rng.uniform(5.0, 25.0)),
            "clearance_measured": "drawn",
        },
    }[kind]


def examine(seed, number):
    """What is told of a screen, and what event-located integration says of it."""
    kind, screen, speed = draw(seed, number)
    region = ff.operating_region(screen, omega=analysed_range(screen, speed))
    rng = np.random.default_rng([seed, number, 1])
    record = {"screen": number, "kind": kind, "complete": region.branch.complete}
    record["working"] = judged(screen, working_motion(screen, region.branch, speed))
    for name, intervals in (("inside", region.feasible), ("outside", gaps(region))):
        if intervals:
            low, high = max(intervals, key=lambda one: one[1] - one[0])
            omega = rng.uniform(low, high)
            record[name] = judged(screen, working_motion(screen, region.branch, omega))
    return record


def gaps(region):
    """Parts of the operating region in which the motion is not told to be allowed."""
    ends = [region.lower, *(end for one in region.feasible for end in one), region.upper]
    pairs = zip(ends[::2], ends[1::2], strict=True)
    return [(low, high) for low, high in pairs if high > low * (1.0 + 1e-6)]


def judged(screen, working):
    """Word, amplitude in m, and by integration: residual and largest multiplier."""
    if working is None:
        return {"told": "none"}
    orbit = working.orbit
    told = {"told": orbit.stability, "amplitude": orbit.amplitude("relative")}
    own = float(np.abs(orbit.multipliers).max())
    residual, largest = integrated(screen, orbit)
    if residual > 1e-8 or abs(largest - own) > 1e-5 * max(1.0, own):
        # A contact shorter than a step is overlooked.
        residual, largest = integrated(screen, orbit, steps=FINE)
    return told | {"residual": residual, "largest": largest, "own": own}


def integrated(screen, orbit, steps=integrate.STEPS_PER_TURN):
    """Residual over a turn relative to the motion, and largest multiplier of differences."""
    machine, omega = integrate.Machine.of(screen.system()), orbit.omega
    size = max(np.abs(orbit.state[:2]).max(), orbit.amplitude("relative"))
    scale = size * np.array([1.0, 1.0, omega, omega])

    def end(shift):
        z = orbit.state + scale * shift
        flow = integrate.flow(machine, z, omega, 0.0, orbit.period, rtol=1e-10, steps=steps)
        return (flow.final - orbit.state) / scale

    unit = STEP * np.eye(4)
    columns = [(end(one) - end(-one)) / (2.0 * STEP) for one in unit]
    return float(np.abs(end(np.zeros(4))).max()), float(np.abs(np.linalg.eigvals(columns)).max())


def wrong(record):
    """Sentences on what integration contradicts, or on an answer that is missing."""
    found = [] if record["complete"] else ["the branch is not complete"]
    for place in ("working", "inside", "outside"):
        one = record.get(place, {"told": "left out"})
        if one["told"] == "none" and place != "outside":
            found.append(f"{place}: no motion")
        if "residual" not in one:
            continue
        if one["residual"] > 1e-8:
            found.append(f"{place}: it does not come back, {one['residual']:.1e}")
        if abs(one["largest"] - 1.0) > 1e-3 and (one["told"] == "stable") != (one["largest"] < 1.0):
            found.append(f"{place}: told {one['told']}, multiplier {one['largest']:.6f}")
        if place == "inside" and one["told"] != "stable":
            found.append(f"inside: told {one['told']}")
    return found
