"""The machine as a drawing: two frames, springs, dampers, stops with their gaps, unbalance."""

from __future__ import annotations

import html
import math
from collections.abc import Mapping

from flipflow.model.screen import FlipFlowScreen
from flipflow.plotting.palette import COLOURS, INK

WIDTH, HEIGHT = 690, 300
WALL, MAIN, FLOATING = 34, (186, 346), (556, 676)
TOP, FOOT = 52, 226
HEAD = (
    f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" '
    f'height="{HEIGHT}" role="img" aria-label="Schematic of the machine" '
    'font-family="Arial, Helvetica, sans-serif" font-size="11.5">'
    f'<g stroke="{INK}" stroke-width="1.5" fill="none" stroke-linejoin="round">'
)


def schematic(screen: FlipFlowScreen, values: Mapping[str, str]) -> str:
    """Draw the machine along the screen surface.

    Parameters
    ----------
    screen
        The machine; without stops none are drawn.
    values
        Text for each field that is labelled, by name: ``{"main_mass": "m1 = 916 kg"}``.

    Returns
    -------
    str
        An SVG element.
    """
    text = {name: html.escape(word) for name, word in values.items()}
    lines = [_wall(), _frame(MAIN), _frame(FLOATING), _unbalance(screen)]
    lines += [_spring(WALL, MAIN[0], 92), _damper(WALL, MAIN[0], 166)]
    lines += [_spring(MAIN[1], FLOATING[0], 74), _damper(MAIN[1], FLOATING[0], 122)]
    labels = [
        _label(110, 74, text, "isolation_stiffness"),
        _label(110, 148, text, "isolation_damping"),
        _label(451, 56, text, "shear_stiffness"),
        _label(451, 104, text, "shear_damping"),
        _label(266, 196, text, "main_mass"),
        _label(616, 146, text, "floating_mass"),
        _label(266, 178, text, "eccentric_moment"),
        _words(266, 72, "main frame", bold=True),
        _words(616, 72, "floating frame", bold=True),
        _axis(MAIN, "x1"),
        _axis(FLOATING, "xf"),
        _words(WALL, 244, "foundation"),
    ]
    if screen.has_stop:
        lines.append(_stops(screen))
        labels += [_stop_labels(screen, text)]
    return f"{HEAD}{''.join(lines)}</g>{''.join(labels)}</svg>"


def _wall() -> str:
    strokes = "".join(f"M{WALL} {y}l-12 12" for y in range(TOP + 6, FOOT - 4, 14))
    return f'<path d="M{WALL} {TOP}V{FOOT}"/><path d="{strokes}" stroke-width="1"/>'


def _frame(span: tuple[int, int]) -> str:
    left, right = span
    return (
        f'<rect x="{left}" y="{TOP}" width="{right - left}" height="{FOOT - TOP}" rx="4" '
        f'fill="#f0f2f4"/>'
    )


def _unbalance(screen: FlipFlowScreen) -> str:
    """x1 counts to the right, up the slope: with the flow it turns anticlockwise."""
    x, y, r = 266, 122, 32
    sense, sweep = (1, 0) if screen.rotation == "with-flow" else (-1, 1)
    dx, dy = sense * r * math.cos(0.8), r * math.sin(0.8)
    return (
        f'<circle cx="{x}" cy="{y}" r="{r}" fill="white"/><circle cx="{x}" cy="{y}" r="2.5" '
        f'fill="{INK}"/><path d="M{x} {y}L{x + dx:.1f} {y - dy:.1f}"/>'
        f'<circle cx="{x + 0.8 * dx:.1f}" cy="{y - 0.8 * dy:.1f}" r="7" fill="{INK}"/>'
        f'<path d="M{x - 16 * sense} {y + 6}a17 17 0 0 {sweep} {24 * sense} 8" '
        'stroke-width="1.2"/>'
        f'<path d="M{x + 8 * sense} {y + 14}l{-7 * sense} 1m{7 * sense} -1l{-2 * sense} 6" '
        'stroke-width="1.2"/>'
    )


def _spring(left: float, right: float, y: float, height: float = 9.0, turns: int = 6) -> str:
    """A zigzag between two short leads."""
    lead = 0.14 * (right - left)
    step = (right - left - 2.0 * lead) / (2 * turns)
    path = f"M{left} {y}h{lead:.1f}"
    at = left + lead
    for k in range(2 * turns):
        at += step
        path += f"L{at - step / 2.0:.1f} {y + (height if k % 2 else -height)}"
    return f'<path d="{path}L{right - lead:.1f} {y}H{right}"/>'


def _damper(left: float, right: float, y: float) -> str:
    middle, height = (left + right) / 2.0, 9.0
    cup = f"M{left} {y}H{middle - 12}M{middle + 12} {y - height}H{middle - 12}V{y + height}h24"
    return (
        f'<path d="{cup}M{middle + 2} {y - height + 3}v{2 * height - 6}M{middle + 2} {y}H{right}"/>'
    )


def _stops(screen: FlipFlowScreen) -> str:
    """A tongue of the floating frame between two stops that the main frame carries."""
    tongue, y, floor = 451, 196, 226
    parts = [
        f'<path d="M{tongue} 152V218M{tongue} 152H{FLOATING[0]}" stroke-width="3"/>',
        f'<path d="M{MAIN[1] - 40} {FOOT}v6H540" stroke-width="3"/>',
    ]
    plus, minus = screen.stop().gaps
    if math.isfinite(plus):
        parts.append(f'<path d="M362 {y - 16}V{floor + 6}M424 {y - 16}v32" stroke-width="3"/>')
        parts.append(_spring(362, 424, y, 7.0, 4))
    if math.isfinite(minus):
        parts.append(f'<path d="M540 {y - 16}V{floor + 6}M478 {y - 16}v32" stroke-width="3"/>')
        parts.append(_spring(478, 540, y, 7.0, 4))
    return "".join(parts)


def _stop_labels(screen: FlipFlowScreen, text: Mapping[str, str]) -> str:
    plus, minus = screen.stop().gaps
    gaps = []
    if math.isfinite(plus):
        gaps.append(_words(438, 174, "e" if plus == minus else "e+"))
    if math.isfinite(minus):
        gaps.append(_words(465, 174, "e" if plus == minus else "e-"))
    below = [text[n] for n in ("clearance", "clearance_minus") if n in text]
    stop = [text[n] for n in ("stop_stiffness", "stop_damping") if n in text]
    return "".join(gaps) + _words(451, 252, ", ".join(below)) + _words(451, 270, ", ".join(stop))


def _axis(span: tuple[int, int], name: str) -> str:
    middle = (span[0] + span[1]) / 2
    arrow = f"M{middle - 20} 34v10M{middle - 20} 39h36l-7 -4m7 4l-7 4"
    return (
        f'<path d="{arrow}" stroke="{COLOURS["main"]}" stroke-width="1.5" fill="none"/>'
        f'<text x="{middle + 24}" y="43" fill="{COLOURS["main"]}">{name}</text>'
    )


def _label(x: float, y: float, text: Mapping[str, str], name: str) -> str:
    return _words(x, y, text[name]) if name in text else ""


def _words(x: float, y: float, words: str, *, bold: bool = False) -> str:
    weight = ' font-weight="bold"' if bold else ""
    return f'<text x="{x}" y="{y}" text-anchor="middle" fill="{INK}"{weight}>{words}</text>'
