"""FFS0827 by pyHarm-os: its own harmonic balance and its own continuation."""

import contextlib
import io
import logging
import warnings
from importlib.metadata import version

import numpy as np
import peer
from numba import njit
from pyHarm.Elements.NodeToNodeElements.NodeToNodeElement import NodeToNodeElement
from pyHarm.Maestro import Maestro

LENIENT = {
    "root": {"method": "hybr", "options": {"xtol": 1e-5}},
    "end_status_accepted": [1, 4, 5],
    "residual_tolerance": 100.0,  # newtons; the exciter alone gives 60 kN at 120 rad/s
}
# Lengths are divided by lc, speeds by wc; nti is the number of samples in a period.
RAW = {"lc": 1.0, "wc": 1.0, "nti": 128, "step": 2.0, "corrector": "arc_length", "solver": {}}
SCALED = RAW | {"lc": 1e-2, "wc": 100.0, "nti": 1024}
PSEUDO = SCALED | {"corrector": "pseudo_arc_length"}
TUNED = PSEUDO | {"lc": 2e-2, "step": 1.9, "solver": LENIENT}
SETTINGS = {
    "defaults": RAW,
    "defaults-1": RAW | {"step": 1.0},
    "defaults-0.25": RAW | {"step": 0.25},
    "scaled": SCALED,
    "scaled-pseudo": PSEUDO,
    "scaled-pseudo-0.5": PSEUDO | {"step": 0.5},
    "tuned-128": TUNED | {"nti": 128},
    "tuned-1024": TUNED,
    "tuned-2048": TUNED | {"nti": 2048},
    "tuned-4096": TUNED | {"nti": 4096},
    "tuned-8192": TUNED | {"nti": 8192},
    "tuned-8192-fine": TUNED | {"nti": 8192, "step": 0.5},
}


@njit
def stop_residual(x, omega, operators, law):
    select, nabla, to_time, to_harmonics = operators
    k, c, gap = law
    q = select @ x
    displacement = q @ to_time
    velocity = omega * ((nabla @ q) @ to_time)
    force = np.zeros_like(displacement)
    for i in range(displacement.size):
        if displacement[i] > gap:
            force[i] = k * (displacement[i] - gap) + c * velocity[i]
        elif displacement[i] < -gap:
            force[i] = k * (displacement[i] + gap) + c * velocity[i]
    return select.T @ (force @ to_harmonics)


@njit
def stop_jacobian(x, omega, operators, law):
    select, nabla, to_time, to_harmonics = operators
    k, c, gap = law
    q = select @ x
    closed = (np.abs(q @ to_time) > gap) * 1.0
    share = ((to_time * closed) @ to_harmonics).T
    by_x = k * share + (c * omega) * (share @ nabla)
    by_omega = c * (share @ (nabla @ q))
    return select.T @ by_x @ select, select.T @ by_omega


class StopSpring(NodeToNodeElement):
    """The two-sided stop k3 (x2 -+ e) + c3 x2', as a plug-in element of pyHarm."""

    factory_keyword = "StopSpring"

    def __post_init__(self):
        """Take the constants from the input dictionary."""
        self.k, self.c, self.gap = self.data["k"], self.data["c"], self.data["gap"]
        self.arguments = None

    def __flag_update__(self):
        """Declare the element nonlinear, evaluated in time."""
        self.flag_nonlinear = True
        self.flag_AFT = True

    def adim(self, lc, wc):
        """Scale the constants as pyHarm scales its own elements."""
        self.k, self.c, self.gap = self.k * lc, self.c * lc * wc, self.gap / lc
        self.flag_adim = True

    def _arguments(self):
        if self.arguments is None:
            select = np.ascontiguousarray(self.Pdir[0] @ (self.Pslave - self.Pmaster))
            operators = (select, self.nabla, self.D["ft"], self.D["tf"])
            self.arguments = (operators, (self.k, self.c, self.gap))
        return self.arguments

    def evalResidual(self, xg, om):  # noqa: N802
        """Contact force per harmonic."""
        self.R = stop_residual(xg[self.indices], om, *self._arguments())
        return self.R

    def evalJacobian(self, xg, om):  # noqa: N802
        """Give its derivatives by the displacements and by the speed."""
        self.J, self.dJdom = stop_jacobian(xg[self.indices], om, *self._arguments())
        return self.J, self.dJdom


def problem(setting, harmonics, limit):
    s = SETTINGS[setting]
    between = {"connect": {"main": [0], "floating": [0]}, "dirs": [0]}
    minutes, seconds = divmod(int(limit), 60)
    step = s["step"] / s["wc"]
    frf = {
        "study": "frf",
        "solver": "scipyroot",
        "solver_options": s["solver"],
        "predictor": "tangent",
        "corrector": s["corrector"],
        "stepsizer": "acceptance",
        "stopper": "bounds",
        "stopper_options": {"timeout": {"timeout": f"00:00:{minutes:02d}:{seconds:02d}"}},
        "ds0": step,
        "ds_max": step,
        "ds_min": 1e-8,
        "puls_inf": peer.OMEGA_START,
        "puls_sup": peer.OMEGA_END,
        "verbose": False,
    }
    masses = {
        "main": {"M": [[peer.M1]], "K": [[peer.K1]], "C": [[peer.C1]]},
        "floating": {"M": [[peer.M2]], "K": [[0.0]], "C": [[0.0]]},
    }
    exciter = {"type": "GOForcing", "connect": {"main": [0]}, "dirs": [0], "dto": 2, "ho": 1}
    return {
        "plugin": [StopSpring],
        "system": {
            "type": "Base",
            "nh": harmonics,
            "nti": s["nti"],
            "adim": {"status": s["lc"] != 1.0, "lc": s["lc"], "wc": s["wc"]},
        },
        "substructures": {
            name: {"matrix": {k: np.array(v) for k, v in matrices.items()}, "ndofs": 1}
            for name, matrices in masses.items()
        },
        "connectors": {
            "shear spring": between | {"type": "LinearSpring", "k": peer.K2},
            "shear damper": between | {"type": "GOElement", "dto": 1, "xo": 1, "k": peer.C2},
            "stop": between | {"type": "StopSpring", "k": peer.K3, "c": peer.C3, "gap": peer.GAP},
            "exciter": exciter | {"amp": -peer.M0R},  # dto 2: times -omega^2
        },
        "analysis": {"frf": frf},
    }


def once(setting, harmonics, limit):
    with contextlib.redirect_stdout(io.StringIO()):
        maestro = Maestro(problem(setting, harmonics, limit))
        maestro.operate()
    return maestro


def branch(maestro, setting):
    """Speeds, relative amplitudes in mm along the accepted points."""
    s = SETTINGS[setting]
    points = [p for p in maestro.nls["frf"].SolList if p.flag_accepted]
    omega = s["wc"] * np.array([p.x[-1] for p in points])
    x = 1e3 * s["lc"] * np.array([p.x[:-1] for p in points])
    table = maestro.system.expl_dofs
    q = x[:, table.index[table["sub"] == "main"]] - x[:, table.index[table["sub"] == "floating"]]
    return omega, peer.half_peak_to_peak(q[:, 0], q[:, 1::2], q[:, 2::2]), points


def solve(setting, harmonics, limit):
    logging.disable(logging.CRITICAL)
    warnings.simplefilter("ignore")
    maestro, seconds = peer.timed(lambda: once(setting, harmonics, limit))
    omega, amplitude, points = branch(maestro, setting)
    folds = peer.turning_points(omega)
    passed = np.flatnonzero((omega[:-1] <= 120.0) & (omega[1:] > 120.0))[:1]
    at_120 = [np.interp(120.0, omega[i : i + 2], amplitude[i : i + 2]) for i in passed]
    s = SETTINGS[setting]
    return {
        "tool": "pyHarm-os",
        "version": version("pyHarm-os"),
        "setting": setting,
        "harmonics": harmonics,
        "seconds": round(seconds, 4),
        "points": len(omega),
        "completed": bool(omega[-1] >= peer.OMEGA_END),
        "reached": round(float(omega.max()), 3),
        "turning_points": len(folds),
        "false_turning_points": peer.count_false(folds),
        "folds": [round(float(f), 3) for f in folds[:20]],
        "flagged_bifurcations": sum(bool(p.flag_bifurcation) for p in points),
        "amplitude_at_120_mm": round(float(at_120[0]), 4) if at_120 else None,
        "largest_step": round(float(np.abs(np.diff(omega)).max()), 3),
        "largest_residual_N": round(float(max(np.linalg.norm(p.R_solver) for p in points)), 3),
        "note": (
            f"stop as a plug-in element sampled at {s['nti']} times a period, {s['corrector']}, "
            f"lengths over {s['lc']} m and speeds over {s['wc']} rad/s, step {s['step']} rad/s, "
            f"{'loosened' if s['solver'] else 'default'} acceptance of scipy's hybr"
        ),
    }


if __name__ == "__main__":
    peer.main(__file__, SETTINGS, "tuned-4096", solve)
