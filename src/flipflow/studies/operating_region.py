"""Where a screen may run: the paper's region, and the window in which all limits are met."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from flipflow.continuation.branch import Branch
from flipflow.continuation.frequency_response import frequency_response
from flipflow.errors import InputError
from flipflow.model.arguments import checked_all, checked_interval, checked_monitor
from flipflow.model.limits import Limits
from flipflow.model.monitor import Monitor
from flipflow.model.numerals import case_words
from flipflow.model.quantities import QUANTITIES
from flipflow.model.screen import FlipFlowScreen, Load
from flipflow.periodic.options import Method, checked_method
from flipflow.results.result import Result
from flipflow.studies.feasible import Bound, CaseWindow, Intervals, case_window, common_window
from flipflow.studies.landmarks import analysed_range, contact_speeds, within_speeds

CONTACT_WORDS, EQUAL_WORDS = "contact begins (w_cs)", "equal amplitudes (w_ea)"
JUMP_WORDS = "jump when the speed falls (w_lb)"
ANTIRESONANCE_WORDS = "antiresonance of the main frame (w_ar)"
PEAK_WORDS = "peak of the relative amplitude"


@dataclass(frozen=True, eq=False)
class OperatingRegion(Result):
    """Characteristic frequencies of a screen and where it may run; all in rad/s.

    Parameters
    ----------
    screen
        The empty machine.
    branch
        Its motions over :func:`analysed_range`.
    omega_ea, omega_ar
        w_ea and w_ar: equal amplitudes, antiresonance of the main frame.
    omega_cs
        w_cs: contact begins, the last rising one before the main peak; None if it never does.
        With unequal gaps this is the side touched last: from there on both stops work.
        :attr:`contact_speeds` holds both sides.
    omega_lb, omega_ub
        The two saddle-nodes of the main resonance; None without folds.
    lower, upper
        The paper's operating region: [w_cs, w_lb] with a stop that is reached (without folds up
        to the peak of the relative amplitude), else [w_ea, w_ar].
    feasible
        Intervals of that region in which every limit is met in every load case.
    binding
        What ends each of them below and above.
    cases
        Per load case, the intervals of each limit by itself.
    branches
        Per load case, the motions.
    notes
        What was not checked, and why.
    """

    screen: FlipFlowScreen
    branch: Branch
    omega_ea: float | None
    omega_ar: float | None
    omega_cs: float | None
    omega_lb: float | None
    omega_ub: float | None
    lower: float
    upper: float
    feasible: Intervals
    binding: tuple[tuple[Bound, Bound], ...]
    cases: tuple[CaseWindow, ...]
    branches: tuple[Branch, ...]
    notes: tuple[str, ...]

    def __repr__(self) -> str:
        ends = f"{self.lower:.6g} to {self.upper:.6g} rad/s"
        allowed = f"{len(self.feasible)} allowed intervals over {len(self.cases)} load cases"
        return f"OperatingRegion({ends}, {allowed})"

    @property
    def contact_speeds(self) -> Mapping[int, float]:
        """Where each side's contact begins, rad/s, by side: +1, -1.

        The last rising one up to ``omega_cs``. With equal gaps both sides begin together and only
        +1 is there; a side that is not touched up to ``omega_cs`` is left out.
        """
        return contact_speeds(self.branch, self.omega_cs)

    @property
    def ends(self) -> tuple[str, str]:
        """Words for what ends the region below and above."""
        below = {self.omega_cs: CONTACT_WORDS, self.omega_ea: EQUAL_WORDS}
        above = {self.omega_lb: JUMP_WORDS, self.omega_ar: ANTIRESONANCE_WORDS}
        highest = float(self.branch.omega.max())
        return (
            below.get(self.lower, "lowest speed analysed"),
            above.get(
                self.upper, "highest speed analysed" if self.upper == highest else PEAK_WORDS
            ),
        )


def operating_region(
    screen: FlipFlowScreen,
    limits: Limits | None = None,
    load_cases: Sequence[Load] = (),
    *,
    monitor: Monitor | None = None,
    omega: tuple[float, float] | None = None,
    method: Method | None = None,
) -> OperatingRegion:
    """The operating region of a screen and its feasible window over all load cases.

    Parameters
    ----------
    screen
        The empty machine.
    limits
        What it may do; None or a limit at None does not narrow the window.
    load_cases
        Loads under which the limits must hold; the empty machine where none is given.
    monitor
        Called with a sentence and the share done, 0 to 1.
    omega
        Frequencies (low, high) in rad/s to analyse; None: from well below the first natural
        frequency to well above the last with all stops engaged.
    method
        :class:`~flipflow.PiecewiseExact` (default) or :class:`~flipflow.HarmonicBalance`.

    Raises
    ------
    InputError
        For anything but a screen, whose frames the region speaks of, limits and loads, for a bad
        interval, and for a load that gives the air's temperature: it depends on the speed how
        much warmer the rubber is.
    """
    if not isinstance(screen, FlipFlowScreen):
        raise InputError("screen", type(screen).__name__, "give a FlipFlowScreen")
    if limits is not None and not isinstance(limits, Limits):
        raise InputError("limits", limits, "give an ff.Limits, or None for no limits")
    remedy = "give a list of ff.Load, such as [ff.Load()]"
    loads = checked_all("load_cases", load_cases, Load, remedy) or (Load(name="empty"),)
    say, method = checked_monitor(monitor), checked_method(method)
    span = analysed_range(screen) if omega is None else checked_interval("omega", omega)
    say("empty machine", 0.0)
    branch = frequency_response(screen, span, method)
    wanted = limits or Limits()
    window = wanted.speed if wanted.speed is not None else span
    within = (max(window[0], span[0]), min(window[1], span[1]))
    cases, branches = [], []
    for k, load in enumerate(loads):
        say(load.name or f"load case {k + 1}", (k + 1) / (len(loads) + 1))
        loaded = screen.loaded(load)
        own = branch if loaded == screen else frequency_response(loaded, span, method)
        branches.append(own)
        cases.append(case_window(loaded, load, own, wanted, within))
    marks = within_speeds(screen, branch)
    feasible, binding = common_window((marks.lower, marks.upper), tuple(cases))
    notes = [*_unchecked_notes(cases)]
    if within[0] >= within[1]:
        notes.append("The limit on speed lies outside the speeds analysed.")
    named = zip(
        ("empty", *(case.name for case in cases)), (branch, *branches),
        ((), *(case.notes for case in cases)), strict=True,
    )  # fmt: skip
    unfinished = dict.fromkeys(
        f"{case_words(name, capital=True)}: {text}"
        for name, one, own_notes in named
        for text in (*one.notes, *own_notes, *([] if one.complete else [one.status.value]))
    )
    return OperatingRegion(
        screen, branch, marks.omega_ea, marks.omega_ar, marks.omega_cs, marks.omega_lb,
        marks.omega_ub, marks.lower, marks.upper, feasible, binding,
        tuple(cases), tuple(branches), (*notes, *unfinished, *marks.notes),
    )  # fmt: skip


def _unchecked_notes(cases: Sequence[CaseWindow]) -> Iterator[str]:
    """A sentence for each reason why limits are not checked, which names them all."""
    reasons: dict[str, dict[str, None]] = {}
    for case in cases:
        for name, why in case.unchecked.items():
            reasons.setdefault(why, {})[QUANTITIES[name].label] = None
    for why, labels in reasons.items():
        *others, last = labels
        named = f"limits on {', '.join(others)} and {last} are" if others else f"limit on {last} is"
        yield f"The {named} not checked: {why}."
