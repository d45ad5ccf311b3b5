"""FFS0827 by mousai: its own harmonic balance, stepped in speed up and down."""

import contextlib
import io
import time
import warnings
from importlib.metadata import version

import mousai
import numpy as np
import peer
from scipy.optimize import NoConvergence

LENGTH = 1e-2  # unknowns in centimetres
JUMP = 5.0  # mm between neighbours
LOOSE = {"f_tol": 1e-3, "maxiter": 30}
PLAIN = {"solver": "hb_freq", "step": 1.0, "options": {}, "extrapolate": False, "linear": False}
TUNED = PLAIN | {"options": LOOSE, "extrapolate": True, "linear": True}
SETTINGS = {
    "defaults-2": PLAIN | {"step": 2.0},
    "defaults": PLAIN,
    "defaults-0.25": PLAIN | {"step": 0.25},
    "hb_time": PLAIN | {"solver": "hb_time"},
    "hb_time-tuned": TUNED | {"solver": "hb_time"},
    "tuned-2": TUNED | {"step": 2.0},
    "tuned": TUNED,
    "tuned-0.5": TUNED | {"step": 0.5},
    "tuned-201": TUNED | {"options": LOOSE | {"num_time_steps": 201}},
    "tuned-201-2": TUNED | {"options": LOOSE | {"num_time_steps": 201}, "step": 2.0},
    "tuned-401": TUNED | {"options": LOOSE | {"num_time_steps": 401}},
    "tuned-401-2": TUNED | {"options": LOOSE | {"num_time_steps": 401}, "step": 2.0},
    "tuned-loose": TUNED | {"options": LOOSE | {"f_tol": 1e-2}},
    "tuned-loose-2": TUNED | {"options": LOOSE | {"f_tol": 1e-2}, "step": 2.0},
}


def acceleration(x, v, params):
    omega = params["omega"]
    x2, v2 = x[0] - x[1], v[0] - v[1]
    gap = peer.GAP / LENGTH
    spring = peer.K2 * x2 + peer.C2 * v2
    if x2 > gap:
        spring += peer.K3 * (x2 - gap) + peer.C3 * v2
    elif x2 < -gap:
        spring += peer.K3 * (x2 + gap) + peer.C3 * v2
    exciter = peer.M0R / LENGTH * omega**2 * np.cos(omega * params["cur_time"])
    main = exciter - peer.K1 * x[0] - peer.C1 * v[0] - spring
    return np.array([[main / peer.M1], [spring / peer.M2]])


def linear(omega, harmonics):
    """Motion of the machine that never touches the stop, as a start."""
    shear = peer.K2 + 1j * omega * peer.C2
    isolation = peer.K1 + 1j * omega * peer.C1
    stiffness = np.array(
        [
            [isolation + shear - omega**2 * peer.M1, -shear],
            [-shear, shear - omega**2 * peer.M2],
        ]
    )
    x = np.linalg.solve(stiffness, [peer.M0R * omega**2 / LENGTH, 0.0])
    angle = np.linspace(0.0, 2.0 * np.pi, 2 * harmonics + 1, endpoint=False)
    return np.real(x[:, None] * np.exp(1j * angle))


def amplitude(x):
    """Relative amplitude in mm."""
    q = np.fft.rfft(1e3 * LENGTH * (x[0] - x[1])) / x.shape[1]
    return float(peer.half_peak_to_peak(q[0].real, 2.0 * q[1:].real, -2.0 * q[1:].imag))


def converge(s, omega, harmonics, starts):
    """Try the starts in turn; None when mousai converges from none of them."""
    solver = getattr(mousai, s["solver"])
    for x0 in starts:
        try:
            with contextlib.redirect_stdout(io.StringIO()):
                found = solver(
                    acceleration,
                    x0=x0,
                    omega=omega,
                    num_harmonics=harmonics,
                    params={},
                    **s["options"],
                )
        except (NoConvergence, ValueError, ArithmeticError, np.linalg.LinAlgError):
            continue
        return found[1]
    return None


def sweep(s, speeds, harmonics, deadline, others=()):
    """Step through the speeds; None where nothing converged or time ran out."""
    result = [None] * len(speeds)
    last, before = linear(speeds[0], harmonics), None
    for i, omega in enumerate(speeds):
        if time.perf_counter() > deadline:
            break
        starts = [last]
        if s["extrapolate"] and before is not None:
            starts.insert(0, 2.0 * last - before)
        if s["linear"]:
            starts += [linear(omega, harmonics), *(o[i] for o in others if o[i] is not None)]
        x = converge(s, omega, harmonics, starts)
        if x is None:
            before = None
            continue
        before = last if i and result[i - 1] is not None else None
        last = result[i] = x
    return result


def once(setting, harmonics, limit):
    s = SETTINGS[setting]
    count = round((peer.OMEGA_END - peer.OMEGA_START) / s["step"])
    speeds = np.append(peer.OMEGA_START + s["step"] * np.arange(count), peer.OMEGA_END)
    speeds = np.unique(np.append(speeds, 120.0))
    deadline = time.perf_counter() + limit
    up = sweep(s, speeds, harmonics, deadline)
    down = sweep(s, speeds[::-1], harmonics, deadline, (up[::-1],))[::-1]
    up, down = (
        np.array([np.nan if x is None else amplitude(x) for x in way]) for way in (up, down)
    )
    return speeds, up, down


def jumps(speeds, values):
    """Middles of the steps over which the amplitude leaps."""
    where = np.flatnonzero(np.abs(np.diff(values)) > JUMP)
    return [round(float(speeds[i] + speeds[i + 1]) / 2.0, 3) for i in where]


def impossible(speeds, values):
    """Count the points far from the only motion there is: large below the folds, small above."""
    below = (speeds > 185.0) & (speeds < peer.TRUE_FOLDS[1]) & (values < 25.0)
    above = (speeds > peer.TRUE_FOLDS[0] + 0.1) & (values > 20.0)
    return int(below.sum() + above.sum())


def solve(setting, harmonics, limit):
    warnings.simplefilter("ignore")
    (speeds, up, down), seconds = peer.timed(lambda: once(setting, harmonics, limit))
    failed = np.concatenate([speeds[np.isnan(up)], speeds[np.isnan(down)]])
    reached = speeds[: np.argmax(np.isnan(up))] if np.isnan(up).any() else speeds
    at_120 = float(up[speeds == 120.0][0])
    s = SETTINGS[setting]
    return {
        "tool": "mousai",
        "version": version("mousai"),
        "setting": setting,
        "harmonics": harmonics,
        "seconds": round(seconds, 4),
        "points": int(np.isfinite(up).sum() + np.isfinite(down).sum()),
        "completed": len(failed) == 0,
        "reached": round(float(reached[-1]), 3) if len(reached) else None,
        "turning_points": 0,
        "false_turning_points": 0,
        "folds": [],
        "jumps_up": jumps(speeds, up),
        "jumps_down": jumps(speeds, down),
        "impossible_points": impossible(speeds, up) + impossible(speeds, down),
        "failed_points": len(failed),
        "failed_at": sorted({float(f) for f in failed})[:20],
        "amplitude_at_120_mm": round(at_120, 4) if np.isfinite(at_120) else None,
        "note": (
            f"{s['solver']} stepped by {s['step']} rad/s up and down, options {s['options']}, "
            f"start from {'extrapolated, ' if s['extrapolate'] else ''}previous"
            f"{', linear, other sweep' if s['linear'] else ''} solution; "
            "it has no continuation, so no folds and no unstable branch"
        ),
    }


if __name__ == "__main__":
    peer.main(__file__, SETTINGS, "tuned-201", solve)
