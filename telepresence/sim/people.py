"""People of a simulated world: where they stand, walk and look, and moving them.

A person is a figure of `scenes/parts/people.xml` or the engineer of the arena: mocap bodies, which stop robots like
furniture and are moved by nobody but this module. `World.people` holds those of a world. SI units; x forward, y left,
counter-clockwise positive.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from telepresence.geometry import wrap_angle, yaw_of
from telepresence.sim.rotation import rotation_of

if TYPE_CHECKING:
    from telepresence.sim.world import World

Point = tuple[float, float, float]

PERIOD = 0.02
"""People are moved this often [s]."""
WALKING_SPEED = 0.7
"""A stroll [m/s]."""
TURNING_SPEED = 2.5
"""How fast a walking person turns, and a head [rad/s]."""
ROOM_FOR_ROBOTS = 0.75
"""A person walks no nearer towards a robot than this [m]."""
WATCHED_FROM, WATCHED_ASIDE, WATCHED_BELOW = 4.0, math.radians(75.0), math.radians(40.0)
"""Robots are looked at from no farther than this [m], and a head turns and bows no farther than this [rad]."""
WAVING_RATE, WAVING_ANGLE = 1.4, math.radians(28.0)
"""A waving forearm swings this often [Hz] and this far to either side [rad]."""
_ARRIVED = 0.01


@dataclass(frozen=True)
class Figure:
    """What a person looks like. Places are [m]; those of the head count from `neck`, where the head turns.

    Args:
        posture: "standing" or "seated".
        neck, chest: In the frame of the body, whose origin is on the floor and which looks along x.
        head: Middle of the head; `top` is the height of its highest point.
        eyes: Left and right, the person's own.
        nose, lips: Middle of each; `lips_width` from corner to corner.
        face_width: From cheek to cheek.
        age: In years, as a passer-by would guess it from the picture.
        female: The same.
        smile: 0 none ... 1 broad, as the lips are drawn.
        shirt: Red, green and blue of what covers the chest, 0...1.
        elbow: Where the forearm of the body `_arm` turns, in the frame of the body; None if the figure has no such arm.
        hand: Middle of its hand, counted from the elbow.
    """

    posture: str
    neck: Point
    chest: Point
    head: Point
    top: float
    eyes: tuple[Point, Point]
    nose: Point
    lips: Point
    lips_width: float
    face_width: float
    age: int
    female: bool
    smile: float
    shirt: tuple[float, float, float]
    elbow: Point | None = None
    hand: Point | None = None


FIGURES: Mapping[str, Figure] = {
    "person_standing": Figure(
        posture="standing",
        neck=(0.005, 0.0, 1.475),
        chest=(0.0, 0.0, 1.20),
        head=(0.020, 0.0, 0.130),
        top=0.272,
        eyes=((0.102, 0.030, 0.138), (0.102, -0.030, 0.138)),
        nose=(0.134, 0.0, 0.113),
        lips=(0.109, 0.0, 0.073),
        lips_width=0.05,
        face_width=0.156,
        age=30,
        female=True,
        smile=0.8,
        shirt=(0.20, 0.58, 0.60),
        elbow=(0.02, -0.285, 1.14),
        hand=(0.195, -0.017, 0.27),
    ),
    "person_seated": Figure(
        posture="seated",
        neck=(-0.085, 0.0, 1.06),
        chest=(-0.06, 0.0, 0.82),
        head=(0.030, 0.0, 0.125),
        top=0.278,
        eyes=((0.109, 0.029, 0.134), (0.109, -0.029, 0.134)),
        nose=(0.141, 0.0, 0.110),
        lips=(0.117, 0.0, 0.071),
        lips_width=0.048,
        face_width=0.156,
        age=75,
        female=True,
        smile=0.8,
        shirt=(0.62, 0.45, 0.62),
    ),
    "person": Figure(
        posture="standing",
        neck=(0.005, 0.0, 1.52),
        chest=(0.0, 0.0, 1.20),
        head=(0.020, 0.0, 0.130),
        top=0.272,
        eyes=((0.113, 0.030, 0.140), (0.113, -0.030, 0.140)),
        nose=(0.116, 0.0, 0.115),
        lips=(0.113, 0.0, 0.075),
        lips_width=0.052,
        face_width=0.158,
        age=45,
        female=False,
        smile=0.0,
        shirt=(0.95, 0.95, 0.96),
    ),
}
"""Name of the body, without what stands before its last slash -> the figure."""


class Person:
    """One person. Methods may be called from any thread."""

    def __init__(self, world: World, name: str, body: str, figure: Figure) -> None:
        model = world.model
        self.name = name
        self.figure = figure
        self._world = world
        self._mocap = int(model.body(body).mocapid[0])
        self._head = _mocap_of(model, body + "_head")
        self._arm = _mocap_of(model, body + "_arm")
        self.bodies: frozenset[int] = frozenset(
            int(model.body(part).id) for part in (body, body + "_head", body + "_arm") if _has_body(model, part)
        )
        """Numbers of this person's bodies in the model."""
        self._start: tuple[tuple[Point, ...], float, bool, bool] = ((), WALKING_SPEED, False, False)
        self._points: tuple[Point, ...] = ()
        self._speed = WALKING_SPEED
        self._next = 0
        self._waving = False
        self._watching = False
        self._swing = 0.0
        self._gaze = (0.0, 0.0)

    # --- what the person does ----------------------------------------------------------------------------------------

    def place(self, x: float, y: float, heading: float | None = None) -> None:
        """Stand at (x, y) in the world [m], turned to `heading` [rad] or as before; ends a walk."""
        with self._world.locked() as data:
            self._points = ()
            self._put(data, x, y, self.heading if heading is None else heading)

    def walk(self, points: Sequence[tuple[float, float]], speed: float = WALKING_SPEED) -> None:
        """Walk through points of the world [m] again and again, waiting for robots on the way; none: stand still."""
        with self._world.locked():
            self._points = tuple((float(x), float(y), 0.0) for x, y in points)
            self._speed, self._next = speed, 0

    def wave(self, waving: bool) -> None:
        """Wave with the forearm, or stop. Only a figure with a free forearm can."""
        with self._world.locked():
            self._waving = waving and self._arm is not None

    def watch_robots(self, watching: bool) -> None:
        """Turn the head to the nearest robot in front, or look straight ahead."""
        with self._world.locked():
            self._watching = watching and self._head is not None

    def begin_with_this(self) -> None:
        """Do after every restart of the world what this person does now."""
        with self._world.locked():
            self._start = (self._points, self._speed, self._waving, self._watching)

    # --- where the person is -----------------------------------------------------------------------------------------

    @property
    def position(self) -> Point:
        """Where the person stands in the world [m]."""
        with self._world.locked() as data:
            x, y, z = data.mocap_pos[self._mocap].tolist()
        return x, y, z

    @property
    def heading(self) -> float:
        """Where the person's chest points in the world [rad]."""
        with self._world.locked() as data:
            return yaw_of(*data.mocap_quat[self._mocap].tolist())

    def head_pose(self) -> tuple[np.ndarray, np.ndarray]:
        """Return rotation (3, 3) and place (3,) of the neck in the world; the face looks along x [m]."""
        with self._world.locked() as data:
            if self._head is not None:
                return rotation_of(data.mocap_quat[self._head]), data.mocap_pos[self._head].copy()
            rotation = rotation_of(data.mocap_quat[self._mocap])
            return rotation, data.mocap_pos[self._mocap] + rotation @ self.figure.neck

    def chest(self) -> np.ndarray:
        """Return the middle of the chest in the world, (3,) [m]."""
        with self._world.locked() as data:
            rotation = rotation_of(data.mocap_quat[self._mocap])
            return data.mocap_pos[self._mocap] + rotation @ self.figure.chest

    def hand(self) -> np.ndarray | None:
        """Return the hand of the free forearm in the body's frame, (3,) [m]; None without such an arm."""
        if self._arm is None or self.figure.hand is None:
            return None
        with self._world.locked() as data:
            place = data.mocap_pos[self._arm] + rotation_of(data.mocap_quat[self._arm]) @ self.figure.hand
            return rotation_of(data.mocap_quat[self._mocap]).T @ (place - data.mocap_pos[self._mocap])

    # --- inside, lock held -------------------------------------------------------------------------------------------

    def restart(self) -> None:
        """Do what the person does at the start; the world has put the bodies back."""
        self._points, self._speed, self._waving, self._watching = self._start
        self._next, self._swing, self._gaze = 0, 0.0, (0.0, 0.0)

    def move(self, data: mujoco.MjData, dt: float, watched: Sequence[int], robots: Sequence[int]) -> None:
        """Advance by `dt` [s]. `watched` are bodies that are worth looking at, `robots` those one does not run into."""
        if self._points:
            self._step(data, dt, robots)
        if self._waving or self._swing:
            self._swing = (self._swing + WAVING_RATE * dt) % 1.0 if self._waving else 0.0
            self._put_arm(data)
        gaze = self._wanted_gaze(data, watched) if self._watching else (0.0, 0.0)
        if gaze != self._gaze:
            reach = TURNING_SPEED * dt
            self._gaze = tuple(  # type: ignore[assignment]
                now + min(max(wanted - now, -reach), reach) for now, wanted in zip(self._gaze, gaze, strict=True)
            )
            self._put_head(data)

    def _step(self, data: mujoco.MjData, dt: float, robots: Sequence[int]) -> None:
        x, y, _ = data.mocap_pos[self._mocap].tolist()
        ahead = self._points[self._next]
        dx, dy = ahead[0] - x, ahead[1] - y
        distance = math.hypot(dx, dy)
        if distance < _ARRIVED:
            self._next = (self._next + 1) % len(self._points)
            return
        course, heading = math.atan2(dy, dx), yaw_of(*data.mocap_quat[self._mocap].tolist())
        turn = wrap_angle(course - heading)
        heading += min(max(turn, -TURNING_SPEED * dt), TURNING_SPEED * dt)
        way = min(self._speed * dt, distance)
        if abs(turn) > 0.5 or any(_blocks(data.xpos[robot], x, y, course) for robot in robots):
            way = 0.0
        self._put(data, x + way * dx / distance, y + way * dy / distance, heading)

    def _put(self, data: mujoco.MjData, x: float, y: float, heading: float) -> None:
        data.mocap_pos[self._mocap][:2] = x, y
        data.mocap_quat[self._mocap] = (math.cos(0.5 * heading), 0.0, 0.0, math.sin(0.5 * heading))
        self._put_head(data)
        self._put_arm(data)

    def _put_head(self, data: mujoco.MjData) -> None:
        if self._head is None:
            return
        body = rotation_of(data.mocap_quat[self._mocap])
        data.mocap_pos[self._head] = data.mocap_pos[self._mocap] + body @ self.figure.neck
        yaw, pitch = self._gaze
        turn, bow = np.zeros(4), np.zeros(4)
        mujoco.mju_axisAngle2Quat(turn, np.array([0.0, 0.0, 1.0]), yaw)
        mujoco.mju_axisAngle2Quat(bow, np.array([0.0, 1.0, 0.0]), pitch)
        mujoco.mju_mulQuat(turn, turn.copy(), bow)
        mujoco.mju_mulQuat(data.mocap_quat[self._head], data.mocap_quat[self._mocap], turn)

    def _put_arm(self, data: mujoco.MjData) -> None:
        if self._arm is None or self.figure.elbow is None:
            return
        body = rotation_of(data.mocap_quat[self._mocap])
        data.mocap_pos[self._arm] = data.mocap_pos[self._mocap] + body @ self.figure.elbow
        swing = np.zeros(4)
        angle = WAVING_ANGLE * math.sin(math.tau * self._swing)
        mujoco.mju_axisAngle2Quat(swing, np.array([1.0, 0.0, 0.0]), angle)
        mujoco.mju_mulQuat(data.mocap_quat[self._arm], data.mocap_quat[self._mocap], swing)

    def _wanted_gaze(self, data: mujoco.MjData, watched: Sequence[int]) -> tuple[float, float]:
        rotation = rotation_of(data.mocap_quat[self._mocap])
        neck = data.mocap_pos[self._mocap] + rotation @ self.figure.neck
        eyes = neck + rotation @ (0.0, 0.0, self.figure.eyes[0][2])
        nearest: tuple[float, float, float] | None = None
        for body in watched:
            x, y, z = (rotation.T @ (data.xpos[body] - eyes)).tolist()
            distance, yaw, pitch = math.hypot(x, y), math.atan2(y, x), math.atan2(-z, math.hypot(x, y))
            seen = distance < WATCHED_FROM and abs(yaw) < WATCHED_ASIDE and abs(pitch) < WATCHED_BELOW
            if seen and (nearest is None or distance < nearest[0]):
                nearest = distance, yaw, pitch
        return (0.0, 0.0) if nearest is None else nearest[1:]


class People:
    """All people of one world, by name. A world without any costs nothing."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._people: dict[str, Person] = {}
        self._watched: list[int] = []
        self._robots: list[int] = []
        for index in range(world.model.nbody):
            body = world.model.body(index)
            before, _, last = body.name.rpartition("/")
            if last in FIGURES and body.mocapid[0] >= 0:
                name = before or last
                self._people[name] = Person(world, name, body.name, FIGURES[last])
        if self._people:
            world.every(PERIOD, self._move)
            world.on_reset(self._restart)

    def __iter__(self) -> Iterator[Person]:
        return iter(self._people.values())

    def __len__(self) -> int:
        return len(self._people)

    def __getitem__(self, name: str) -> Person:
        """Return the person called `name`.

        Raises:
            KeyError: There is none; the message names those that exist.
        """
        if name not in self._people:
            raise KeyError(f"there is no {name!r}; people: {', '.join(self._people) or 'none'}")
        return self._people[name]

    def meet(self, robot: str, head: str) -> None:
        """Let people know a robot: they wait for its body `robot` and may look at its body `head`."""
        self._robots.append(int(self._world.model.body(robot).id))
        self._watched.append(int(self._world.model.body(head).id))

    def _move(self, now: float) -> None:
        with self._world.locked() as data:
            for person in self._people.values():
                person.move(data, PERIOD, self._watched, self._robots)

    def _restart(self) -> None:
        for person in self._people.values():
            person.restart()


def _blocks(robot: np.ndarray, x: float, y: float, course: float) -> bool:
    dx, dy = float(robot[0]) - x, float(robot[1]) - y
    return math.hypot(dx, dy) < ROOM_FOR_ROBOTS and abs(wrap_angle(math.atan2(dy, dx) - course)) < math.pi / 2


def _has_body(model: mujoco.MjModel, name: str) -> bool:
    return mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name) >= 0


def _mocap_of(model: mujoco.MjModel, name: str) -> int | None:
    return int(model.body(name).mocapid[0]) if _has_body(model, name) else None
