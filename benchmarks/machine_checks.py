"""One random machine, solved twice and held against itself."""

import time

import numpy as np
from machine_draw import draw, speeds
from special_checks import Beside, distinct, independent, nearest_neighbours, partners

import flipflow as ff

HARMONICS = 25
ROUNDING = 1e-12  # m; below this a difference is arithmetic
COVER = 3.0
GRID = 512


def examine(seed, number, harmonics=HARMONICS):
    """What happened with one machine, as a plain dictionary."""
    begin = time.perf_counter()
    screen = draw(seed, number)
    interval = speeds(screen)
    exact = ff.frequency_response(screen, interval)
    balance = ff.frequency_response(screen, interval, ff.HarmonicBalance(harmonics))
    record = {
        "seed": seed,
        "machine": number,
        "interval": [round(omega, 3) for omega in interval],
        "exact": branch_record(exact),
        "balance": branch_record(balance),
        "errors": compare(balance, exact.formulation.solver()),
        "special": compare_special(screen, exact, balance),
    }
    return record | {"seconds": round(time.perf_counter() - begin, 3)}


def branch_record(branch):
    """How a branch ended, with the sentence it says."""
    points = branch.special_points
    return {
        "status": branch.status.name,
        "complete": branch.complete,
        "says": branch.status.value,
        "points": int(branch.omega.size),
        "notes": len(branch.notes),
        "undetermined": int(np.sum(branch.stability == "undetermined")),
        "special_points": len(points),
        "repeated": len(points) - len(distinct(points)) if len(points) < 2000 else len(points),
        "no_promise": int(np.sum(~np.isfinite(branch.error))),
    }


def compare(balance, exact_solver):
    """Stated against true error of the series, at the same omega and the same motion."""
    # balance.omega may not be written to, for which a kernel would be compiled anew.
    stated, omega = balance.error, balance.traced.omega
    states = balance.formulation.solver().states(balance.traced.u, omega)
    harmonics, series = balance.formulation.solver().series(balance.traced.u, omega)
    theta = 2.0 * np.pi * np.arange(GRID) / GRID
    basis = np.exp(1j * np.outer(harmonics, theta))
    true = np.full(omega.size, np.inf)
    amplitudes = np.full((omega.size, 2), np.inf)
    for i in np.flatnonzero(np.isfinite(stated)):
        point = exact_solver.solve(states[i], omega[i])
        if point is None:
            continue
        x = exact_solver.motion(point.u, omega[i]).derivative(theta / omega[i], 0)
        true[i] = np.abs(x - (basis.T @ series[i]).real).max()
        low, high, _ = exact_solver.extremes(point.u[None], omega[i : i + 1], np.eye(2))
        amplitudes[i] = (high[0] - low[0]) / 2.0
    return error_record(balance, stated, true, amplitudes)


def error_record(balance, stated, true, amplitudes):
    """Counts over the points where an error is stated and is more than rounding."""
    promised = np.isfinite(stated)
    beyond = promised & (np.maximum(stated, np.where(np.isfinite(true), true, 1.0)) > ROUNDING)
    ratio = true[beyond] / stated[beyond]
    ours = np.stack([balance.amplitude("main"), balance.amplitude("floating")], axis=1)
    off = np.abs(ours - amplitudes).max(axis=1)[beyond]
    outside = np.flatnonzero(beyond)[(ratio > COVER) | (ratio < 1.0 / COVER)]
    return {
        "points": int(stated.size),
        "promised": int(promised.sum()),
        "beyond_rounding": int(beyond.sum()),
        "no_exact_motion": int(np.sum(promised & ~np.isfinite(true))),
        "true_above_stated_x3": int(np.sum(ratio > COVER)),
        "true_below_stated_by_3": int(np.sum(ratio < 1.0 / COVER)),
        "amplitude_within_stated": int(np.sum(off <= stated[beyond])),
        "amplitude_within_stated_x3": int(np.sum(off <= COVER * stated[beyond])),
        "largest_stated": float(stated[promised].max(initial=0.0)),
        "first_outside": [round(float(omega), 5) for omega in balance.omega[outside][:3]],
    }


def compare_special(screen, exact, balance):
    """Special points of both: matched, confirmed on their own, missed by one, not confirmed."""
    points = {"exact": distinct(exact.special_points), "balance": distinct(balance.special_points)}
    branches = {"exact": exact, "balance": balance}
    record = {"matched": 0, "alone": 0, "missed": [], "unconfirmed": []}
    for method, other in (("exact", "balance"), ("balance", "exact")):
        ours = points[method]
        partner = partners(ours, points[other])
        beside = Beside(screen, branches[method], exact.formulation.solver())
        apart = nearest_neighbours(ours)
        for i, point in enumerate(ours):
            reason = independent(beside, point, apart[i])
            record["alone"] += reason is None
            record["matched"] += partner[i] is not None
            if partner[i] is None:
                one = {"method": method, "kind": point.kind, "omega": round(point.omega, 6)}
                one["stated_error"] = stated_beside(branches[method], point)
                if reason is None:
                    record["missed"].append(one | {"method": other})
                else:
                    record["unconfirmed"].append(one | {"reason": reason})
    record["points"] = sum(len(found) for found in points.values())
    return record


def stated_beside(branch, point):
    """The smaller error in m stated at the two points around a special one; None: no promise.

    At a fold itself nothing is ever promised, beside it there is.
    """
    index = int(point.position)
    least = float(branch.error[index : index + 2].min())
    return least if np.isfinite(least) else None


def summarise(records):
    """Totals, the aims, and every failure with seed and reason."""
    solved = [record for record in records if "failed" not in record]
    total = {key: sum(r["errors"][key] for r in solved) for key in _COUNTS}
    beyond = max(total["beyond_rounding"], 1)
    outside = total["true_above_stated_x3"] + total["true_below_stated_by_3"]
    return {
        "machines": len(records),
        "raised": len(records) - len(solved),
        "complete": {m: sum(r[m]["complete"] for r in solved) for m in ("exact", "balance")},
        "points": total,
        "share_promised": total["promised"] / max(total["points"], 1),
        "share_covered": 1.0 - outside / beyond,
        "share_amplitude_within_stated": total["amplitude_within_stated"] / beyond,
        "share_amplitude_within_stated_x3": total["amplitude_within_stated_x3"] / beyond,
        "special_points": {
            "all": sum(r["special"]["points"] for r in solved),
            "matched": sum(r["special"]["matched"] for r in solved),
            "confirmed_alone": sum(r["special"]["alone"] for r in solved),
            "unconfirmed": sum(len(r["special"]["unconfirmed"]) for r in solved),
            "unconfirmed_where_error_is_stated": sum(
                one["stated_error"] is not None
                for r in solved
                for one in r["special"]["unconfirmed"]
            ),
            "missed_by_exact": _missed(solved, "exact"),
            "missed_by_balance": _missed(solved, "balance"),
        },
        "failures": [failure for record in records for failure in failures(record)],
    }


_COUNTS = (
    "points",
    "promised",
    "beyond_rounding",
    "no_exact_motion",
    "true_above_stated_x3",
    "true_below_stated_by_3",
    "amplitude_within_stated",
    "amplitude_within_stated_x3",
)


def _missed(records, method):
    return sum(one["method"] == method for r in records for one in r["special"]["missed"])


def failures(record):
    """A line for everything about one machine that is not as it should be."""
    name = {"seed": record["seed"], "machine": record["machine"]}
    if "failed" in record:
        return [name | {"what": "raised", "reason": record["failed"]}]
    found = []
    for method in ("exact", "balance"):
        branch = record[method]
        if not branch["complete"]:
            found.append({"what": f"{method} branch not finished", "reason": branch["says"]})
        if branch["repeated"]:
            reason = f"{branch['repeated']} special points stand on the branch again"
            found.append({"what": f"{method} branch runs over itself", "reason": reason})
    special = record["special"]
    for one in special["missed"]:
        what = f"{one['method']} lacks a {one['kind']} that the other has"
        found.append({"what": what, "omega": one["omega"], "stated_error": one["stated_error"]})
    for one in special["unconfirmed"]:
        what = f"{one['method']}: {one['kind']} not confirmed"
        found.append(
            {"what": what} | {key: one[key] for key in ("omega", "stated_error", "reason")}
        )
    return [name | one for one in found]
