"""Seeded places for the safety benchmark: rooms with a door, corners, furniture, poles and walking people.

A batch holds many places side by side in padded arrays (first axis: place), so that one numpy call processes all of
them. Circles are poles, legs of chairs and tables, and legs of people; segments are walls and sides of boxes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

KINDS = ("wall", "door frame", "box", "pole 2-5 cm", "pole 10-40 cm", "chair leg", "table leg", "person")
WALL, FRAME, BOX, THIN, THICK, CHAIR, TABLE, PERSON = range(len(KINDS))
POLES = (0.02, 0.03, 0.05, 0.10, 0.20, 0.40)
"""Diameters [m]."""
LEG_RADIUS = 0.06
LEG_APART = 0.11
"""A person is two legs of this radius, each this far from the middle [m]."""
START_CLEAR = 0.30
"""Free space around the robot's outline at the start [m]."""
WAITS, TURNS, IGNORES = range(3)
"""What a person does with a robot in the way ..."""
MANNERS = (0.4, 0.4, 0.2)
"""... and how often."""
WALKER_ACCELERATION = 2.0
"""[m/s²]"""
GOALS = 40
BEFORE_DOOR = 0.6
"""Pilots go to this distance before a door, then through it [m]."""
NOWHERE = 1e3
"""Padding lies here [m]."""
INFRARED_REACH = 0.45
"""How far Robotino's infrared sensors see [m]; the vendor promises 0.30."""


@dataclass
class Place:
    """One scenario. Lengths in m."""

    circles: list[tuple[float, float, float, int]] = field(default_factory=list)  # x, y, radius, kind
    segments: list[tuple[float, float, float, float, int]] = field(default_factory=list)  # ax, ay, bx, by, kind
    walkers: list[tuple[float, float, float, int]] = field(default_factory=list)  # x, y, speed, manner
    width: float = 0.0
    depth: float = 0.0
    start: tuple[float, float, float] = (0.0, 0.0, 0.0)
    goals: np.ndarray = field(default_factory=lambda: np.zeros((GOALS, 2)))
    door: tuple[tuple[float, float], tuple[float, float]] | None = None  # a place before it on either side

    def clearance(self, points: np.ndarray) -> np.ndarray:
        """Distance of points (n, 2) from everything that stands [m]."""
        nearest = np.full(len(points), math.inf)
        for x, y, radius, _ in self.circles:
            nearest = np.minimum(nearest, np.hypot(points[:, 0] - x, points[:, 1] - y) - radius)
        for ax, ay, bx, by, _ in self.segments:
            edge = np.array([bx - ax, by - ay])
            offset = points - (ax, ay)
            along = np.clip(offset @ edge / (edge @ edge), 0.0, 1.0)
            nearest = np.minimum(nearest, np.hypot(*(offset - along[:, None] * edge).T))
        return nearest


def make_place(seed: int, index: int, radius: float, people: int | None = None) -> Place:
    """The scenario `index` of a seed, for a robot of this outer radius; always the same for the same arguments."""
    rng = np.random.default_rng([seed, index])
    while True:
        place = _furnish(rng, people)
        if _choose_ways(place, rng, radius):
            return place


def _furnish(rng: np.random.Generator, people: int | None) -> Place:
    width, depth = rng.uniform(4.0, 7.0, 2)
    place = Place(width=float(width), depth=float(depth))
    _rectangle(place, 0.5 * width, 0.5 * depth, width, depth, 0.0, WALL)
    if rng.random() < 0.5:
        _wall_with_door(place, rng)
    if rng.random() < 0.5:  # a pillar or cupboard that makes corners
        side = rng.uniform(0.3, 1.0, 2)
        corner = rng.integers(0, 2, 2)
        _rectangle(
            place, abs(corner[0] * width - 0.5 * side[0]), abs(corner[1] * depth - 0.5 * side[1]), *side, 0.0, WALL
        )
    for _ in range(rng.integers(1, 4)):
        x, y, turn = _spot(place, rng)
        _rectangle(place, x, y, *rng.uniform(0.15, 0.6, 2), turn, BOX)
    for _ in range(rng.integers(4, 8)):
        x, y, _ = _spot(place, rng)
        diameter = float(rng.choice(POLES))
        place.circles.append((x, y, 0.5 * diameter, THIN if diameter <= 0.05 else THICK))
    for _ in range(rng.integers(1, 4)):
        _legs(place, *_spot(place, rng), 0.4, 0.4, 0.015, CHAIR)
    for _ in range(rng.integers(0, 2)):
        _legs(place, *_spot(place, rng), *rng.uniform((0.6, 0.9), (0.9, 1.6)), 0.025, TABLE)
    for _ in range(rng.integers(0, 3) if people is None else people):
        x, y, _ = _spot(place, rng)
        place.walkers.append((x, y, float(rng.uniform(0.2, 1.6)), int(rng.choice(3, p=MANNERS))))
    return place


def _spot(place: Place, rng: np.random.Generator) -> tuple[float, float, float]:
    return (
        float(rng.uniform(0.3, place.width - 0.3)),
        float(rng.uniform(0.3, place.depth - 0.3)),
        float(rng.uniform(0.0, math.tau)),
    )


def _rectangle(place: Place, x: float, y: float, width: float, depth: float, turn: float, kind: int) -> None:
    c, s = math.cos(turn), math.sin(turn)
    corners = [
        (x + c * dx - s * dy, y + s * dx + c * dy)
        for dx, dy in ((-0.5 * width, -0.5 * depth), (0.5 * width, -0.5 * depth), (0.5 * width, 0.5 * depth),
                       (-0.5 * width, 0.5 * depth))
    ]  # fmt: skip
    for i in range(4):
        place.segments.append((*corners[i], *corners[(i + 1) % 4], kind))


def _wall_with_door(place: Place, rng: np.random.Generator) -> None:
    """A wall 10 cm thick across the room, with a door frame of 0.70 to 0.90 m in it."""
    across = float(rng.uniform(0.35, 0.65))
    opening = float(rng.uniform(0.70, 0.90))
    if rng.random() < 0.5:
        at = float(rng.uniform(0.5, place.depth - 0.5 - opening))
        x = across * place.width
        _rectangle(place, x, 0.5 * at, 0.1, at, 0.0, FRAME)
        rest = place.depth - at - opening
        _rectangle(place, x, place.depth - 0.5 * rest, 0.1, rest, 0.0, FRAME)
        place.door = (x - BEFORE_DOOR, at + 0.5 * opening), (x + BEFORE_DOOR, at + 0.5 * opening)
    else:
        at = float(rng.uniform(0.5, place.width - 0.5 - opening))
        y = across * place.depth
        _rectangle(place, 0.5 * at, y, at, 0.1, 0.0, FRAME)
        rest = place.width - at - opening
        _rectangle(place, place.width - 0.5 * rest, y, rest, 0.1, 0.0, FRAME)
        place.door = (at + 0.5 * opening, y - BEFORE_DOOR), (at + 0.5 * opening, y + BEFORE_DOOR)


def _legs(place: Place, x: float, y: float, turn: float, width: float, depth: float, radius: float, kind: int) -> None:
    c, s = math.cos(turn), math.sin(turn)
    for dx in (-0.5 * width, 0.5 * width):
        for dy in (-0.5 * depth, 0.5 * depth):
            place.circles.append((x + c * dx - s * dy, y + s * dx + c * dy, radius, kind))


def _choose_ways(place: Place, rng: np.random.Generator, radius: float) -> bool:
    """Start and goals in free space; False if the place is too full for that."""
    candidates = rng.uniform((0.0, 0.0), (place.width, place.depth), (600, 2))
    candidates = candidates[place.clearance(candidates) > radius + START_CLEAR]
    if len(candidates) < 5:
        return False
    at = candidates[0]
    place.start = (float(at[0]), float(at[1]), float(rng.uniform(-math.pi, math.pi)))
    # Nobody stands where the robot starts.
    place.walkers = [w for w in place.walkers if math.hypot(w[0] - at[0], w[1] - at[1]) > radius + 0.8]
    goals: list[np.ndarray] = []
    while len(goals) < GOALS:
        far = candidates[np.hypot(*(candidates - at).T) > 1.5]
        if not len(far):
            return False
        goal = far[rng.integers(len(far))]
        if place.door is not None:
            here, there = (np.array(side) for side in place.door)
            across = there - here
            middle = 0.5 * (here + there)
            if (at - middle) @ across > 0.0:
                here, there = there, here
            if ((at - middle) @ across) * ((goal - middle) @ across) < 0.0:
                if place.clearance(np.array([here, there])).min() < radius + 0.1:
                    candidates = candidates[((candidates - middle) @ across) * ((at - middle) @ across) > 0.0]
                    continue
                goals += [here, there]
        goals.append(goal)
        at = goal
    place.goals = np.array(goals[:GOALS])
    return True


class Batch:
    """Many places side by side, with people who walk.

    Args:
        infrared_reach: How far infrared sensors see there [m].
    Attributes (S places; padded):
        circle (S, C, 3): x, y, radius [m]; circle_kind (S, C); circle_speed (S, C, 2) [m/s], zero for things.
        segment (S, W, 4); segment_kind (S, W).
        start (S, 3); goals (S, GOALS, 2).
    """

    def __init__(self, places: list[Place], seed: int, infrared_reach: float = INFRARED_REACH) -> None:
        self.places = places
        self.infrared_reach = infrared_reach
        count = len(places)
        people = max(len(p.walkers) for p in places)
        things = max(len(p.circles) for p in places)
        walls = max(len(p.segments) for p in places)
        self.circle = np.tile(np.array([NOWHERE, NOWHERE, 0.0]), (count, things + 2 * people, 1))
        self.circle_kind = np.full((count, things + 2 * people), THIN)
        self.circle_speed = np.zeros((count, things + 2 * people, 2))
        self.segment = np.full((count, walls, 4), NOWHERE)
        self.segment[:, :, 2] += 1.0
        self.segment_kind = np.full((count, walls), WALL)
        self.walker = np.full((count, people, 2), NOWHERE)
        self.walker_speed = np.zeros((count, people))
        self.manner = np.zeros((count, people), int)
        for i, place in enumerate(places):
            for j, (x, y, radius, kind) in enumerate(place.circles):
                self.circle[i, j] = x, y, radius
                self.circle_kind[i, j] = kind
            for j, (*ends, kind) in enumerate(place.segments):
                self.segment[i, j] = ends
                self.segment_kind[i, j] = kind
            for j, (x, y, speed, manner) in enumerate(place.walkers):
                self.walker[i, j] = x, y
                self.walker_speed[i, j] = speed
                self.manner[i, j] = manner
        self.start = np.array([p.start for p in places])
        self.goals = np.stack([p.goals for p in places])
        self._size = np.array([(p.width, p.depth) for p in places])
        self._legs = things
        self.circle_kind[:, things:] = PERSON
        self._rng = np.random.default_rng([seed, 7])
        self._present = self.walker[..., 0] < 0.5 * NOWHERE
        self._velocity = np.zeros_like(self.walker)
        self._target = self._random_spots()
        self._place_legs(np.zeros_like(self.walker))

    def __len__(self) -> int:
        return len(self.places)

    def walk(self, robot: np.ndarray, radius: float, dt: float) -> None:
        """Move the people; those who mind it wait or turn away when the robot (S, 2) is near and in their way."""
        if not self.walker.shape[1]:
            return
        way = self._target - self.walker
        left = np.sqrt((way**2).sum(2))
        direction = way / np.maximum(left, 1e-6)[..., None]
        to_robot = robot[:, None] - self.walker
        near = np.sqrt((to_robot**2).sum(2))
        in_the_way = (near < radius + 0.7) & ((direction * to_robot).sum(2) > 0.5 * near)
        waits = in_the_way & (self.manner == WAITS)
        elsewhere = (left < 0.2) | (in_the_way & (self.manner == TURNS))
        self._target = np.where(elsewhere[..., None], self._random_spots(), self._target)
        wanted = direction * (self.walker_speed * ~waits * self._present)[..., None]
        change = wanted - self._velocity
        size = np.sqrt((change**2).sum(2))
        self._velocity += change * np.minimum(1.0, WALKER_ACCELERATION * dt / np.maximum(size, 1e-9))[..., None]
        velocity = self._velocity
        self.walker += velocity * dt
        self._place_legs(velocity)

    def turn_back(self, place: int, robot: np.ndarray) -> None:
        """People of a place who touch the robot go away from it."""
        if not self.walker.shape[1]:
            return
        away = self.walker[place] - robot
        near = np.sqrt((away**2).sum(1)) < 0.8
        self._target[place, near] = self.walker[place, near] + 3.0 * away[near]

    def _random_spots(self) -> np.ndarray:
        return self._rng.uniform(0.3, 1.0, self.walker.shape) * (self._size[:, None] - 0.3)

    def _place_legs(self, velocity: np.ndarray) -> None:
        speed = np.sqrt((velocity**2).sum(2, keepdims=True))
        ahead = np.where(speed > 1e-6, velocity / np.maximum(speed, 1e-6), (1.0, 0.0))
        side = np.stack([-ahead[..., 1], ahead[..., 0]], axis=-1) * LEG_APART
        both = np.concatenate([self.walker + side, self.walker - side], axis=1)
        self.circle[:, self._legs :, :2] = np.where(
            np.concatenate([self._present, self._present], axis=1)[..., None], both, NOWHERE
        )
        self.circle[:, self._legs :, 2] = LEG_RADIUS
        self.circle_speed[:, self._legs :] = np.concatenate([velocity, velocity], axis=1)
