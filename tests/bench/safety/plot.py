"""Pictures of the safety benchmark: collisions against the share passed, and one scenario with the ways driven."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import cv2
import numpy as np
from safety.figures import Figures
from safety.gates import MakeGate
from safety.pilots import Pilots
from safety.robots import TICK, BenchRobot
from safety.run import Run
from safety.worlds import NOWHERE, Batch, make_place

from telepresence.video.draw_text import text_width, write

FINE = 16
"""Sub-pixel steps of OpenCV's drawing, as a power of two: shift 4."""
INK, GREY, PALE = (40, 40, 40), (120, 120, 120), (225, 225, 225)
COLOURS = {
    "no gate": (120, 120, 120),
    "uniform scaling": (190, 120, 60),
    "bubble, gap 0.10": (40, 150, 235),
    "bubble, gap 0.20": (20, 95, 190),
    "gate": (90, 160, 40),
    "gate, careful": (40, 110, 0),
}
"""BGR."""
PANEL = 470
HEIGHT = 470
FLOOR = 0.01
"""Collisions per 1000 commands drawn as "none" [1/1000]; the scale is logarithmic."""
TOP = 20.0
Box = tuple[float, float, float, float]
"""Left, top, right, bottom [pixel]."""


def draw_results(path: Path, panels: Mapping[str, Mapping[str, Figures]]) -> None:
    """One panel per robot: share passed across, collisions with 95 % bounds up, one mark per gate."""
    pictures = [_panel(title, gates) for title, gates in panels.items()]
    cv2.imwrite(str(path), np.concatenate(pictures, axis=1))


def _panel(title: str, gates: Mapping[str, Figures]) -> np.ndarray:
    picture = np.full((HEIGHT, PANEL, 3), 255, np.uint8)
    left, right, top, bottom = 70, PANEL - 25, 60, HEIGHT - 60
    least = min(0.6, math.floor(10 * min(f.passed for f in gates.values())) / 10)

    def across(passed: float) -> float:
        return left + (passed - least) / (1.02 - least) * (right - left)

    def up(value: float) -> float:
        share = math.log(max(value, FLOOR) / FLOOR) / math.log(TOP / FLOOR)
        return bottom - share * (bottom - top)

    write(picture, title, left, 18, 13, INK, weight=1.5)
    for value in (FLOOR, 0.1, 1.0, 10.0):
        y = round(up(value))
        cv2.line(picture, (left, y), (right, y), PALE, 1)
        label = "none" if value == FLOOR else f"{value:g}"
        write(picture, label, left - 8 - text_width(label, 9), y - 5, 9, GREY)
    for tenth in range(round(10 * least), 11, 1 if least > 0.45 else 2):
        x = round(across(tenth / 10))
        cv2.line(picture, (x, top), (x, bottom), PALE, 1)
        write(picture, f"{10 * tenth} %", x, bottom + 10, 9, GREY, align=0.5)
    write(picture, "share of the command passed", (left + right) // 2, bottom + 34, 10, INK, align=0.5)
    write(picture, "collisions per 1000 commands, 95 %", left, 40, 10, GREY)
    taken: list[Box] = []
    labels: list[Box] = []
    for name, f in sorted(gates.items(), key=lambda item: item[1].per_1000.value):
        x, y, colour = across(f.passed), up(f.per_1000.value), COLOURS[name]
        _line(picture, (x, up(f.per_1000.low)), (x, up(f.per_1000.high)), colour, 2)
        for end in (f.per_1000.low, f.per_1000.high):
            if end > FLOOR:
                _line(picture, (x - 5, up(end)), (x + 5, up(end)), colour, 2)
        _disc(picture, (x, y), 6, colour)
        taken.append((x - 6, up(f.per_1000.high), x + 6, up(f.per_1000.low)))
    for name, f in gates.items():
        _label(picture, name, (across(f.passed), up(f.per_1000.value)), taken, labels, (left, PANEL))
    return picture


def _label(
    picture: np.ndarray, name: str, mark: tuple[float, float], taken: list[Box], labels: list[Box],
    sides: tuple[int, int],
) -> None:  # fmt: skip
    """Beside its mark, where nothing else is; a thin line leads to it when that is farther off, past other labels."""
    (x, y), width = mark, text_width(name, 10, 1.3)
    for dy in (0, -18, 18, -36, 36, -54, 54, -72, 72):
        for x0 in (x - 14 - width, x + 14):
            box = x0 - 2, y - 9 + dy, x0 + width + 2, y + 9 + dy
            end = box[2] if x0 < x else box[0]
            line = min(end, x), min(y, y + dy), max(end, x), max(y, y + dy)
            free = not any(_overlap(box, other) for other in taken) and not any(_overlap(line, one) for one in labels)
            if free and x0 > sides[0] and x0 + width < sides[1]:
                taken += [box, line] if dy else [box]
                labels.append(box)
                if dy:
                    _line(picture, (end, y + dy), (x, y), COLOURS[name], 1)
                write(picture, name, round(x0), round(y - 5 + dy), 10, COLOURS[name], weight=1.3)
                return


def _overlap(one: Box, other: Box) -> bool:
    return one[0] <= other[2] and other[0] <= one[2] and one[1] <= other[3] and other[1] <= one[3]


def drive_one(
    robot: BenchRobot, make_gate: MakeGate, seed: int, index: int, speed: float, seconds: float
) -> tuple[np.ndarray, Run]:
    """Drive one scenario without people; return its path (ticks, 3) and the run at its end."""
    radius = robot.profile.outline.outer_radius
    batch = Batch([make_place(seed, index, radius, 0)], seed)
    run = Run(robot, make_gate(robot, 1), batch, Pilots(batch, index, speed, radius, seed), (seed, index))
    path = []
    for tick in range(round(seconds / TICK)):
        run.step(tick)
        path.append(run.pose[0].copy())
    return np.array(path), run


def draw_scenario(
    path: Path, robot: BenchRobot, gates: Mapping[str, MakeGate], seed: int, index: int, speed: float, seconds: float
) -> None:
    """The same scenario and pilot behind several gates, side by side."""
    pictures = []
    for name, make_gate in gates.items():
        way, run = drive_one(robot, make_gate, seed, index, speed, seconds)
        pictures.append(_room(name, robot, run, way))
    height = max(picture.shape[0] for picture in pictures)
    pictures = [
        cv2.copyMakeBorder(p, 0, height - p.shape[0], 0, 0, cv2.BORDER_CONSTANT, value=(255, 255, 255))
        for p in pictures
    ]
    cv2.imwrite(str(path), np.concatenate(pictures, axis=1))


def _room(name: str, robot: BenchRobot, run: Run, way: np.ndarray) -> np.ndarray:
    place, scale, margin = run.batch.places[0], 66.0, 24
    size = (round(place.depth * scale) + 2 * margin + 46, round(place.width * scale) + 2 * margin, 3)
    picture = np.full(size, 255, np.uint8)

    def at(x: float, y: float) -> tuple[float, float]:
        return margin + x * scale, size[0] - margin - y * scale

    for ax, ay, bx, by, _ in place.segments:
        _line(picture, at(ax, ay), at(bx, by), INK, 2)
    for x, y, radius, _ in place.circles:
        if x < NOWHERE:
            _disc(picture, at(x, y), max(radius * scale, 2.0), INK)
    colour = COLOURS[name]
    outline = robot.profile.outline
    veil = picture.copy()
    for pose in way[::20]:
        _disc(veil, at(pose[0], pose[1]), outline.outer_radius * scale, tuple(int(200 + 0.2 * c) for c in colour))
    picture = np.minimum(picture, veil)
    corners = np.array([at(x, y) for x, y, _ in way])
    points = np.round(corners * FINE).astype(np.int32)
    cv2.polylines(picture, [points.reshape(-1, 1, 2)], False, colour, 2, cv2.LINE_AA, 4)
    _disc(picture, tuple(corners[0]), 5, colour)
    contacts = run.out.contacts
    for contact in contacts:
        pose = way[min(round(contact.time / TICK), len(way) - 1)]
        x = pose[0] + outline.outer_radius * math.cos(pose[2] + contact.bearing)
        y = pose[1] + outline.outer_radius * math.sin(pose[2] + contact.bearing)
        px, py = at(x, y)
        for dx in (-7, 7):
            _line(picture, (px - dx, py - 7), (px + dx, py + 7), (30, 30, 220), 3)
    count = len(contacts)
    goals = int(run.pilots.reached[0])
    write(picture, name, margin, 10, 14, colour, weight=1.6)
    words = f"{count or 'no'} collision{'' if count == 1 else 's'}, {goals} goal{'' if goals == 1 else 's'} reached"
    write(picture, words, margin, 34, 10, GREY)
    return picture


def _line(picture: np.ndarray, a: Sequence[float], b: Sequence[float], colour: tuple, width: int) -> None:
    ends = [tuple(round(v * FINE) for v in end) for end in (a, b)]
    cv2.line(picture, *ends, colour, width, cv2.LINE_AA, 4)


def _disc(picture: np.ndarray, centre: Sequence[float], radius: float, colour: tuple) -> None:
    middle = tuple(round(v * FINE) for v in centre)
    cv2.circle(picture, middle, round(radius * FINE), colour, -1, cv2.LINE_AA, 4)
