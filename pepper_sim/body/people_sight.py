"""Which people Pepper's eyes can see: field of view, distance, and what stands in between. SI units, no NAOqi words.

Who is where comes from the world, and a ray from the camera tells whether something hides it. So nobody is seen through
a wall, behind the robot's back or beyond its reach, and nothing is taken for a person. Angles in the picture count from
its middle in the camera's frame: `yaw` to the left, `pitch` down.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from pepper_sim.body.frames import roll_pitch_yaw
from pepper_sim.robot import Pepper
from telepresence.sim.people import Figure, Person

Vector = tuple[float, float, float]
Angles = tuple[float, float]
"""Yaw and pitch in the picture [rad]."""

TOP_CAMERA, DEPTH_CAMERA = "CameraTop", "CameraDepth"
ASPECT = 4.0 / 3.0
"""Width over height of the pictures."""
NEAREST = 0.5
"""A person who stands nearer than this is not told from the background [m] (NAOqi 2.8, page alpeopleperception)."""
FARTHEST_TURN = math.radians(70.0)
"""When a head is turned away by more than this, nothing of its face is seen [rad]."""
_ORIGIN_GROUP = 5  # geoms that rays pass through
_MAX_PASSES = 40


@dataclass(frozen=True)
class SeenFace:
    """A face in the picture of the top camera.

    Args:
        middle: Where it is; `width` and `height` are its size [rad].
        turn: How the head is turned: (yaw, pitch, roll) [rad], zeros if it faces the camera; yaw to its own left,
            pitch down.
        eyes: Left and right, the person's own.
        nose, lips: Middle of each; `lips_width` [rad].
    """

    middle: Angles
    width: float
    height: float
    turn: Vector
    eyes: tuple[Angles, Angles]
    nose: Angles
    lips: Angles
    lips_width: float


@dataclass(frozen=True)
class SeenPerson:
    """A person who can be seen.

    Args:
        person: Who it is; `figure` is what the person looks like.
        distance: From the top camera to the head [m]; `angles` say in which direction.
        in_torso, in_robot, in_world: The head in the frames of the torso, of the robot on the floor, of odometry [m].
        height: Of the top of the head above the floor [m].
        face: None if the face is hidden, outside the picture or turned away.
        hand: The hand that could wave, in the person's own frame [m]; None if there is none.
    """

    person: Person
    distance: float
    angles: Angles
    in_torso: Vector
    in_robot: Vector
    in_world: Vector
    height: float
    face: SeenFace | None
    hand: Vector | None

    @property
    def figure(self) -> Figure:
        return self.person.figure


@dataclass(frozen=True)
class Sight:
    """What was seen at one instant.

    Args:
        stamp: Wall-clock time [s since 1970].
        time: Simulation time [s].
        camera_in_torso, camera_in_robot: Pose of the top camera (x, y, z [m], roll, pitch, yaw [rad]).
        people: Nearest first.
    """

    stamp: float
    time: float
    camera_in_torso: tuple[float, ...]
    camera_in_robot: tuple[float, ...]
    people: tuple[SeenPerson, ...]


@dataclass(frozen=True)
class _Camera:
    rotation: np.ndarray
    place: np.ndarray
    half_width: float
    half_height: float

    def angles(self, point: np.ndarray) -> Angles:
        x, y, z = (self.rotation.T @ (point - self.place)).tolist()
        return math.atan2(y, x), math.atan2(-z, x)

    def shows(self, point: np.ndarray) -> bool:
        yaw, pitch = self.angles(point)
        return abs(yaw) <= self.half_width and abs(pitch) <= self.half_height


class PeopleSight:
    """Sees people with one robot's eyes. Any thread may call."""

    def __init__(self, robot: Pepper) -> None:
        self._robot = robot
        self._world = robot.world
        model = self._world.model
        self._cameras = {
            name: (model.site(f"{robot.prefix}{name}_frame").id, *_half_view(model, robot.prefix + name))
            for name in (TOP_CAMERA, DEPTH_CAMERA)
        }
        self._root = int(model.body_rootid[model.body(robot.prefix + "base_footprint").id])
        self._groups = np.ones(6, np.uint8)
        self._groups[_ORIGIN_GROUP] = 0

    def look(self, reach: float) -> Sight:
        """See who is within `reach` [m] and not hidden."""
        robot = self._robot
        with self._world.locked() as data:
            top, depth = self._camera(data, TOP_CAMERA), self._camera(data, DEPTH_CAMERA)
            torso, base = robot.true_pose("torso"), robot.true_pose("base_footprint")
            camera = np.eye(4)
            camera[:3, :3], camera[:3, 3] = top.rotation, top.place
            odometry = robot.link_pose("base_footprint")
            found = [
                seen
                for person in self._world.people
                if (seen := self._see(data, person, top, depth, reach, (torso, base, odometry))) is not None
            ]
            found.sort(key=lambda seen: seen.distance)
            return Sight(
                self._world.stamp,
                self._world.time,
                _six(np.linalg.inv(torso) @ camera),
                _six(np.linalg.inv(base) @ camera),
                tuple(found),
            )

    def shows(self, in_world: Vector) -> bool:
        """Whether a place of the odometry frame [m] is in the picture now, whatever hides it."""
        robot = self._robot
        with self._world.locked() as data:
            there = np.linalg.inv(robot.link_pose("base_footprint")) @ (*in_world, 1.0)
            return self._camera(data, TOP_CAMERA).shows((robot.true_pose("base_footprint") @ there)[:3])

    # --- inside, lock held -------------------------------------------------------------------------------------------

    def _camera(self, data: mujoco.MjData, name: str) -> _Camera:
        site, half_width, half_height = self._cameras[name]
        return _Camera(data.site_xmat[site].reshape(3, 3), data.site_xpos[site].copy(), half_width, half_height)

    def _see(
        self,
        data: mujoco.MjData,
        person: Person,
        top: _Camera,
        depth: _Camera,
        reach: float,
        frames: tuple[np.ndarray, np.ndarray, np.ndarray],
    ) -> SeenPerson | None:
        figure = person.figure
        turned, neck = person.head_pose()
        head = neck + turned @ figure.head
        distance = float(np.linalg.norm(head - top.place))
        if distance > reach or np.linalg.norm((head - top.place)[:2]) < NEAREST:
            return None
        chest = person.chest()
        ways = ((top, head), (depth, head), (depth, chest))
        if not any(camera.shows(point) and self._free(data, camera.place, point, person) for camera, point in ways):
            return None
        torso, base, odometry = frames
        in_robot = np.linalg.inv(base) @ (*head, 1.0)
        hand = person.hand()
        return SeenPerson(
            person,
            distance,
            top.angles(head),
            _vector(np.linalg.inv(torso) @ (*head, 1.0)),
            _vector(in_robot),
            _vector(odometry @ in_robot),
            float(neck[2]) + figure.top - person.position[2],
            self._face(data, person, top, turned, neck),
            None if hand is None else _vector(hand),
        )

    def _face(
        self, data: mujoco.MjData, person: Person, camera: _Camera, turned: np.ndarray, neck: np.ndarray
    ) -> SeenFace | None:
        figure = person.figure
        nose = neck + turned @ figure.nose
        if not camera.shows(nose):
            return None
        back = turned.T @ (camera.place - nose)
        yaw, pitch = math.atan2(float(back[1]), float(back[0])), math.atan2(-float(back[2]), math.hypot(*back[:2]))
        if max(abs(yaw), abs(pitch)) > FARTHEST_TURN or not self._free(data, camera.place, nose, person):
            return None
        distance = float(np.linalg.norm(nose - camera.place))
        upright = camera.rotation.T @ turned[:, 2]
        roll = math.atan2(float(upright[1]), float(upright[2]))
        eyes = [camera.angles(neck + turned @ eye) for eye in figure.eyes]
        return SeenFace(
            middle=camera.angles(neck + turned @ (figure.nose[0] * 0.8, 0.0, figure.nose[2])),
            width=2.0 * math.atan2(0.5 * figure.face_width, distance),
            height=2.0 * math.atan2(0.65 * figure.face_width, distance),
            turn=(-yaw, -pitch, roll),
            eyes=(eyes[0], eyes[1]),
            nose=camera.angles(nose),
            lips=camera.angles(neck + turned @ figure.lips),
            lips_width=2.0 * math.atan2(0.5 * figure.lips_width, distance),
        )

    def _free(self, data: mujoco.MjData, start: np.ndarray, end: np.ndarray, person: Person) -> bool:
        """Whether nothing but the robot itself and the person stands between two places."""
        model = self._world.model
        way = end - start
        rest = float(np.linalg.norm(way))
        direction, place = way / rest, start.copy()
        hit = np.zeros(1, np.int32)
        for _ in range(_MAX_PASSES):
            distance = mujoco.mj_ray(model, data, place, direction, self._groups, True, -1, hit)
            if hit[0] < 0 or distance >= rest:
                return True
            body = int(model.geom_bodyid[hit[0]])
            if body in person.bodies:
                return True
            if int(model.body_rootid[body]) != self._root:
                return False
            step = distance + 1e-4
            place += step * direction
            rest -= step
        return False


def _half_view(model: mujoco.MjModel, camera: str) -> tuple[float, float]:
    """Return half the width and half the height of a camera's picture [rad]."""
    height = math.radians(float(model.camera(camera).fovy[0])) / 2.0
    return math.atan(math.tan(height) * ASPECT), height


def _six(pose: np.ndarray) -> tuple[float, ...]:
    return (*(float(value) for value in pose[:3, 3]), *roll_pitch_yaw(pose[:3, :3]))


def _vector(values: np.ndarray) -> Vector:
    return float(values[0]), float(values[1]), float(values[2])
