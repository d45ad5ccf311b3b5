"""Attractors of a soft-impact oscillator by brute force, with a flow of its own.

x'' + 2 z x' + x + k (x - g)+ = a w^2 cos(w t): from many states, settled, sorted by period. A
fixed scan finds the contacts and bisection on the closed form locates them; nothing of flipflow
takes part. ``tests/acceptance/test_cases_of_others.py`` holds its table.
"""

import argparse
import math

import numba
import numpy as np

K, GAP, Z, A = 29.0, 1.26, 0.01, 0.7
SPEEDS = (0.72, 0.74, 0.80, 0.81, 0.82, 0.8528, 0.86, 1.0, 1.1)
SCAN, BISECTIONS = 96, 60
SETTLING_TURNS, LONGEST = 3000, 12
SAME = 1e-8


@numba.njit
def carried(x, v, t, dt, k, f, w):
    """State after dt of x'' + 2 Z x' + k x = f + A w^2 cos(w t)."""
    push = A * w * w / complex(k - w * w, 2.0 * Z * w)
    before, after = push * np.exp(1j * w * t), push * np.exp(1j * w * (t + dt))
    y, u = x - f / k - before.real, v - (1j * w * before).real
    rate, decay = math.sqrt(k - Z * Z), math.exp(-Z * dt)
    c, s = math.cos(rate * dt), math.sin(rate * dt)
    b = (u + Z * y) / rate
    moved = decay * (y * c + b * s)
    speed = decay * rate * (b * c - y * s) - Z * moved
    return moved + f / k + after.real, speed + (1j * w * after).real


@numba.njit
def turn(x, v, w):
    """State a forcing period later."""
    step = 2.0 * math.pi / w / SCAN
    inside = x > GAP or (x == GAP and v > 0.0)
    for i in range(SCAN):
        t, left = i * step, step
        while left > 0.0:
            k, f = (1.0 + K, K * GAP) if inside else (1.0, 0.0)
            high, (y, u) = left, carried(x, v, t, left, k, f, w)
            if (y < GAP) != inside and v * u < 0.0:  # an extremum within, perhaps beyond the gap
                high = bisected(x, v, t, left, k, f, w, inside, True)
                y, _ = carried(x, v, t, high, k, f, w)
            if (y < GAP) != inside:
                x, v = carried(x, v, t, left, k, f, w)
                break
            high = bisected(x, v, t, high, k, f, w, inside, False)
            x, v = carried(x, v, t, high, k, f, w)
            t, left, inside = t + high, left - high, not inside
    return x, v


@numba.njit
def bisected(x, v, t, high, k, f, w, inside, of_speed):
    """Time to the extremum within ``high``, or to the crossing of the gap."""
    low = 0.0
    for _ in range(BISECTIONS):
        middle = (low + high) / 2.0
        y, u = carried(x, v, t, middle, k, f, w)
        if (u * v < 0.0) if of_speed else ((y < GAP) == inside):
            high = middle
        else:
            low = middle
    return high


@numba.njit
def settled(start, w):
    """States a period apart after settling, (2 LONGEST + 1, 2)."""
    x, v = start
    for _ in range(SETTLING_TURNS):
        x, v = turn(x, v, w)
    states = np.empty((2 * LONGEST + 1, 2))
    for i in range(states.shape[0]):
        states[i] = x, v
        x, v = turn(x, v, w)
    return states


def attractors(w, starts, rng):
    """[periods, state, how many starts end there] of each, and how many ends repeat later."""
    found, others = [], 0
    for start in rng.uniform([-4.0, -4.0], [GAP + 0.5, 4.0], (starts, 2)):
        states = settled(start, w)
        back = np.abs(states[1:] - states[0]).max(axis=1) < SAME
        if not back.any():
            others += 1
            continue
        p = int(back.argmax()) + 1
        near = [
            one for one in found if one[0] == p and np.abs(states[:p] - one[1]).max(1).min() < 1e-6
        ]
        if near:
            near[0][2] += 1
        else:
            found.append([p, states[0], 1])
    return sorted(found, key=lambda one: one[0]), others


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--starts", type=int, default=400)
    options = parser.parse_args()
    rng = np.random.default_rng(0)
    for w in SPEEDS:
        found, others = attractors(w, options.starts, rng)
        for periods, state, count in found:
            print(f"{w:7.4f}  period {periods:2}  {state[0]:.6f} {state[1]:.6f}  {count} starts")
        print(f"{w:7.4f}  longer than {LONGEST} periods, or never: {others}", flush=True)


if __name__ == "__main__":
    main()
