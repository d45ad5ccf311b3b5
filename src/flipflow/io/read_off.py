"""Numbers read off a result that stand in its file for other readers, SI.

They are not needed to open it again.
"""

from __future__ import annotations

import dataclasses
from functools import singledispatch
from typing import Any

from flipflow.io.run_up import run_up_summary
from flipflow.periodic.orbit import Orbit
from flipflow.results.codec import plain
from flipflow.studies.basins import Basins
from flipflow.transient.history import History
from flipflow.transient.startup import RunUp


@singledispatch
def read_off(_result: object) -> dict[str, Any]:
    """Nothing, where the fields of a result say it all."""
    return {}


@read_off.register
def orbit_numbers(orbit: Orbit) -> dict[str, Any]:
    """The motion over its period, its contacts, multipliers and error."""
    named = orbit.system.named
    return {
        "multipliers": plain(orbit.multipliers),
        "error": plain(orbit.error),
        "t": plain(orbit.t),
        "displacement": {str(which): plain(orbit.displacement(which)) for which in named},
        "velocity": {str(which): plain(orbit.velocity(which)) for which in named},
        "stop_force": [
            plain(orbit.stop_force(j)) for j in range(len(orbit.machine.system().springs))
        ],
        "contacts": [plain(dataclasses.asdict(touch)) for touch in orbit.contact_intervals],
    }


@read_off.register
def history_numbers(history: History) -> dict[str, Any]:
    """Named coordinates over time, and the force of each stop."""
    named = history.system.named
    return {
        "displacement": {str(which): plain(history.displacement(which)) for which in named},
        "velocity": {str(which): plain(history.velocity(which)) for which in named},
        "acceleration": {str(which): plain(history.acceleration(which)) for which in named},
        "stop_force": [plain(history.stop_force(j)) for j in range(history.force.shape[1])],
    }


@read_off.register
def basins_numbers(basins: Basins) -> dict[str, Any]:
    """Shares of the cells with their 95 % confidence intervals."""
    return {
        "complete": basins.complete,
        "shares": plain(basins.shares),
        "share_intervals": plain(basins.share_intervals),
        "unsettled": basins.unsettled,
    }


read_off.register(RunUp, run_up_summary)
