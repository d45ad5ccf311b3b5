"""The foundation of a screen: a drawing of its supports, and bars of what goes into the ground."""

from __future__ import annotations

import math

from flipflow.plotting.drawing import Drawing
from flipflow.plotting.figure import Figure
from flipflow.plotting.layout import NAME_LETTERS, within
from flipflow.plotting.palette import COLOURS, INK
from flipflow.plotting.panels import Axis, Bar, Panel, rows_axis
from flipflow.plotting.scales import KN
from flipflow.studies.foundation_loads import Components, FoundationLoads

WIDTH, HEIGHT = 690, 216
GROUND, LEFT, RIGHT = 190.0, 40.0, 320.0  # ground line and ends of the frame in the side view
DEPTH, LIFT = 34.0, 44.0  # depth of the frame, and height of its lower end above the ground
STEEPEST = math.radians(28.0)  # of what is drawn; a steeper deck is drawn like this
PLAN = (470.0, 52.0, 640.0, 164.0)
MOST_COLUMNS = 6  # pairs of supports for whose names the drawing has room
HEAD = (
    f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" '
    f'height="{HEIGHT}" role="img" aria-label="Supports of the machine, side view and plan" '
    'font-family="Arial, Helvetica, sans-serif" font-size="11">'
)
WAYS = (("vertical", "relative"), ("horizontal", "main"))
ALONG = (("normal", "relative"), ("along", "main"))


def foundation_drawing(loads: FoundationLoads) -> Drawing:
    """Side view and plan with the names of the supports and the directions of the loads."""
    columns = _columns(loads.supports)
    parts = [HEAD, _side_view(loads, columns), _plan(columns), "</svg>"]
    caption = (
        "Side view, the surface rising to the right, and plan. Loads count along: up the slope; "
        "normal: into the foundation, at right angles to the surface; horizontal: the way in which "
        f"the surface rises; vertical: downwards. The curved arrow shows the unbalance, "
        f"{loads.rotation}."
    )
    return Drawing("Supports and directions", caption, "".join(parts))


def _columns(names: tuple[str, ...]) -> list[tuple[str, ...]]:
    """Names by column, from the lower end up the slope: two abreast, one on each side."""
    columns = [names[k : k + 2] for k in range(0, len(names), 2)]
    if len(columns) <= MOST_COLUMNS:
        return columns
    # The rest is told by first and last alone.
    return [columns[0], ("...",), columns[-1]]


def _side_view(loads: FoundationLoads, columns: list[tuple[str, ...]]) -> str:
    angle = min(max(loads.deck_angle or 0.0, -STEEPEST), STEEPEST)
    rise = math.tan(angle) * (RIGHT - LEFT)
    low = GROUND - LIFT + min(rise, 0.0)
    foot = [(LEFT, low), (RIGHT, low - rise)]
    across = (-DEPTH * math.sin(angle), -DEPTH * math.cos(angle))
    corners = [*foot, *((x + across[0], y + across[1]) for x, y in reversed(foot))]
    outline = " ".join(f"{x:.1f},{y:.1f}" for x, y in corners)
    lines = [
        f'<polygon points="{outline}" fill="#f0f2f4"/>',
        f'<path d="M{LEFT - 20} {GROUND}H{RIGHT + 20}"/>',
        _turning(loads, (LEFT + RIGHT) / 2.0 + across[0] / 2.0, low - rise / 2.0 + across[1] / 2.0),
    ]
    words = []
    for x, names in zip(_places(len(columns) or 2, LEFT + 24.0, RIGHT - 24.0), columns or [()] * 2,
                        strict=True):  # fmt: skip
        lines.append(_spring(x, low - rise * (x - LEFT) / (RIGHT - LEFT)))
        words.append(_words(x, GROUND + 16.0, ", ".join(names), bold=True))
    if not columns:
        words.append(_words((LEFT + RIGHT) / 2.0, GROUND + 16.0, "number of supports not given"))
    if loads.deck_angle is not None:
        words.append(_words(RIGHT - 40.0, 18.0, f"deck {math.degrees(loads.deck_angle):.4g} deg"))
    drawn = f'<g stroke="{INK}" stroke-width="1.4" fill="none">{"".join(lines)}</g>'
    return drawn + "".join(words) + _directions(angle, 388.0, 112.0)


def _places(count: int, first: float, last: float) -> list[float]:
    if count == 1:
        return [(first + last) / 2.0]
    return [first + (last - first) * k / (count - 1) for k in range(count)]


def _spring(x: float, top: float) -> str:
    step = (GROUND - top) / 10.0
    zigzag = "".join(
        f"L{x + (5 if k % 2 else -5):.1f} {top + step * (k + 1.5):.1f}" for k in range(7)
    )
    foot = f"L{x} {GROUND - step:.1f}V{GROUND}M{x - 12} {GROUND}h24"
    return f'<path d="M{x} {top:.1f}v{step:.1f}{zigzag}{foot}"/>'


def _turning(loads: FoundationLoads, x: float, y: float) -> str:
    """An arc over the shaft with its arrow: with the flow the top moves down the slope, left."""
    sign = -1.0 if loads.rotation == "with-flow" else 1.0
    tip = x + sign * 12.0
    sweep = 0 if sign < 0.0 else 1
    return (
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{INK}"/>'
        f'<path d="M{x - sign * 12:.1f} {y:.1f}A12 12 0 0 {sweep} {tip:.1f} {y:.1f}"/>'
        f'<path d="M{tip - 4:.1f} {y - 6:.1f}L{tip:.1f} {y:.1f}L{tip + 4:.1f} {y - 6:.1f}"/>'
    )


def _directions(angle: float, x: float, y: float) -> str:
    """The four directions from one point."""
    c, s = math.cos(angle), math.sin(angle)
    surface, earth = COLOURS["main"], COLOURS["floating"]
    return "".join(
        (
            _arrow(x, y, 46.0 * c, -46.0 * s, surface, "along"),
            _arrow(x, y, 46.0 * s, 46.0 * c, surface, "normal"),
            _arrow(x, y, 46.0, 0.0, earth, "horizontal", low=True),
            _arrow(x, y, 0.0, 46.0, earth, "vertical", low=True),
        )
    )


def _arrow(
    x: float, y: float, dx: float, dy: float, colour: str, name: str, *, low: bool = False
) -> str:
    length = math.hypot(dx, dy)
    ux, uy = dx / length, dy / length
    tip = (x + dx, y + dy)
    barbs = "".join(
        f"M{tip[0]:.1f} {tip[1]:.1f}l{-7 * ux + 3.5 * side * uy:.1f} "
        f"{-7 * uy - 3.5 * side * ux:.1f}"
        for side in (-1, 1)
    )
    upright = abs(dy) > abs(dx)
    if upright:
        at, anchor = (tip[0] + (-4.0 if low else 4.0), tip[1] + 12.0), "end" if low else "start"
    else:
        at, anchor = (tip[0] + 5.0, tip[1] + (12.0 if low else -4.0)), "middle"
    return (
        f'<path d="M{x} {y}L{tip[0]:.1f} {tip[1]:.1f}{barbs}" stroke="{colour}" '
        f'stroke-width="1.6" fill="none"/><text x="{at[0]:.1f}" y="{at[1]:.1f}" '
        f'text-anchor="{anchor}" fill="{colour}">{name}</text>'
    )


def _plan(columns: list[tuple[str, ...]]) -> str:
    left, top, right, bottom = PLAN
    frame = (
        f'<rect x="{left}" y="{top}" width="{right - left}" height="{bottom - top}" rx="4" '
        f'fill="#f0f2f4" stroke="{INK}" stroke-width="1.4"/>'
    )
    parts = [frame, _words((left + right) / 2.0, top - 24.0, "plan")]
    parts += [
        _words(left + 6.0, top - 8.0, "lower end", anchor="start"),
        _words(right - 6.0, top - 8.0, "upper end", anchor="end"),
    ]
    for x, names in zip(_places(len(columns), left + 22.0, right - 22.0), columns, strict=True):
        # The first of a column stands on the near side, below.
        rows = (bottom - 22.0, top + 22.0) if len(names) == 2 else ((top + bottom) / 2.0,)
        for y, name in zip(rows, names, strict=True):
            parts.append(
                f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5" fill="white" stroke="{INK}" '
                f'stroke-width="1.4"/>'
            )
            beside = 17.0 if y > (top + bottom) / 2.0 else -9.0
            parts.append(_words(x, y + beside, name, bold=True))
    return "".join(parts)


def _words(x: float, y: float, words: str, *, bold: bool = False, anchor: str = "middle") -> str:
    weight = ' font-weight="bold"' if bold else ""
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{INK}"{weight}>{words}</text>'
    )


def foundation_figure(loads: FoundationLoads) -> Figure:
    """Bars of all supports together, vertical and horizontal; along and normal without angle."""
    rows: list[tuple[str, Components]] = [(one.name, one.running) for one in loads.cases]
    rows += [(one.name, one.peaks) for one in loads.runs]
    ways = WAYS if loads.deck_angle is not None else ALONG
    bars = []
    for k, (_, peaks) in enumerate(rows):
        for place, (way, colour) in enumerate(ways):
            force = getattr(peaks, way)
            if force is not None:
                at = float(len(rows) - 1 - k) + 0.2 - 0.4 * place
                bars.append(Bar(way, at, 0.0, force * KN, 0.36, colour, legend=k == 0))
    top = 1.1 * max((bar.high for bar in bars), default=1.0)
    panel = Panel(
        Axis("greatest dynamic force", "kN", (0.0, top)),
        rows_axis([within(name, NAME_LETTERS, 2) for name, _ in rows]), bars=tuple(bars),
    )  # fmt: skip
    caption = " ".join(["All supports together.", *loads.notes])
    return Figure("Loads on the foundation", caption, (panel,), 1, 80 + 44 * len(rows))
