"""Plots as SVG for a page that needs no other file or library, so that it can be opened anywhere, years later."""

from __future__ import annotations

import html
import math
from collections.abc import Sequence

import numpy as np

WIDTH, HEIGHT = 860, 230
LEFT, RIGHT, TOP, BOTTOM = 52, 14, 30, 30
MOST_POINTS = 1500
"""Points of one line; more could not be seen."""


def nice_step(span: float, wanted: int = 5) -> float:
    """Return 1, 2 or 5 times a power of ten, so that about `wanted` steps make the span."""
    if not span > 0.0:
        return 1.0
    power = 10.0 ** math.floor(math.log10(span / wanted))
    return next(power * factor for factor in (1.0, 2.0, 5.0, 10.0) if span / (power * factor) <= wanted + 0.5)


def time_plot(
    lines: Sequence[tuple[str, str, np.ndarray]],
    unit: str,
    duration: float,
    bands: Sequence[tuple[float, float, str, str]] = (),
) -> str:
    """Return a plot of values over time.

    Args:
        lines: (name, CSS class, (n, 2) time [s] and value) of each.
        bands: (from [s], to [s], CSS class, what it is) behind the lines.
    """
    values = np.concatenate([line[2][:, 1] for line in lines] or [np.zeros(0)])
    values = values[np.isfinite(values)]
    low = min(0.0, float(values.min())) if len(values) else 0.0
    high = max(low + 1e-3, float(values.max()) * 1.05 if len(values) else 1.0)
    width, height = WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM
    x = lambda t: LEFT + width * t / max(duration, 1e-3)  # noqa: E731
    y = lambda v: TOP + height * (high - v) / (high - low)  # noqa: E731
    parts = [f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img">']
    for begin, end, kind, what in bands:
        wide = max(1.5, x(end) - x(begin))
        parts.append(
            f'<rect class="{kind}" x="{x(begin):.1f}" y="{TOP}" width="{wide:.1f}" height="{height}">'
            f"<title>{html.escape(what)}</title></rect>"
        )
    step = nice_step(high - low, 4)
    for number in range(math.ceil(low / step), math.floor(high / step) + 1):
        at = y(number * step)
        parts.append(f'<line class="grid" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{at:.1f}" y2="{at:.1f}"/>')
        parts.append(f'<text x="{LEFT - 6}" y="{at + 4:.1f}" text-anchor="end">{number * step:g}</text>')
    step = nice_step(duration, 8)
    for number in range(math.floor(duration / step) + 1):
        parts.append(
            f'<text x="{x(number * step):.1f}" y="{HEIGHT - 10}" text-anchor="middle">{number * step:g} s</text>'
        )
    for index, (name, kind, points) in enumerate(lines):
        parts.append(_polyline(kind, [(x(t), y(v)) for t, v in _thinned(points) if math.isfinite(v)]))
        at = LEFT + 8 + 170 * index
        parts.append(f'<text class="name {kind}" x="{at}" y="{TOP - 12}">{html.escape(name)}</text>')
    parts.append(f'<text x="{WIDTH - RIGHT}" y="{TOP - 12}" text-anchor="end">{html.escape(unit)}</text></svg>')
    return "".join(parts)


def path_plot(path: np.ndarray, marks: Sequence[tuple[float, str]] = ()) -> str:
    """Return a plot of the robot's path, seen from above.

    Args:
        path: (n, 4) t, x, y [m], heading.
        marks: (time [s], what happened) of events, drawn where the robot was.
    """
    if not len(path):
        return "<p>The recording holds no odometry.</p>"
    side, edge = 420, 34
    low, high = path[:, 1:3].min(axis=0), path[:, 1:3].max(axis=0)
    span = max(0.5, float((high - low).max()) * 1.1)
    middle = (low + high) / 2
    scale = (side - 2 * edge) / span
    place = lambda px, py: (side / 2 + (px - middle[0]) * scale, side / 2 - (py - middle[1]) * scale)  # noqa: E731
    parts = [f'<svg viewBox="0 0 {side} {side}" class="square" role="img">']
    step = nice_step(span)
    for axis in (0, 1):
        first = math.ceil((middle[axis] - span / 2) / step)
        for number in range(first, math.floor((middle[axis] + span / 2) / step) + 1):
            if axis == 0:
                at, _ = place(number * step, 0.0)
                parts.append(f'<line class="grid" x1="{at:.1f}" x2="{at:.1f}" y1="{edge}" y2="{side - edge}"/>')
                parts.append(f'<text x="{at:.1f}" y="{side - 14}" text-anchor="middle">{number * step:g}</text>')
            else:
                _, at = place(0.0, number * step)
                parts.append(f'<line class="grid" x1="{edge}" x2="{side - edge}" y1="{at:.1f}" y2="{at:.1f}"/>')
                parts.append(f'<text x="{edge - 6}" y="{at + 4:.1f}" text-anchor="end">{number * step:g}</text>')
    parts.append(_polyline("given", [place(px, py) for px, py in _thinned(path)[:, 1:3]]))
    for name, index in (("start", 0), ("end", -1)):
        px, py = place(*path[index, 1:3])
        parts.append(f'<circle class="{name}" cx="{px:.1f}" cy="{py:.1f}" r="6"><title>{name}</title></circle>')
    for t, what in marks:
        index = min(len(path) - 1, int(np.searchsorted(path[:, 0], t)))
        px, py = place(*path[index, 1:3])
        title = f"<title>{html.escape(what)}</title>"
        parts.append(f'<circle class="mark" cx="{px:.1f}" cy="{py:.1f}" r="4">{title}</circle>')
    parts.append(f'<text x="{side - 8}" y="{side - 14}" text-anchor="end">m</text></svg>')
    return "".join(parts)


def _polyline(kind: str, points: Sequence[tuple[float, float]]) -> str:
    text = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    return f'<polyline class="{kind}" points="{text}"/>'


def _thinned(points: np.ndarray) -> np.ndarray:
    return points[:: max(1, len(points) // MOST_POINTS)]
