"""ALMotion: where the parts of the body are. Metres and radians.

Frames: 0 FRAME_TORSO, 1 FRAME_WORLD (odometry), 2 FRAME_ROBOT (on the floor under the wheels).
"""

from __future__ import annotations

import math

import numpy as np

from pepper_sim.body.description import WHEEL_CENTRES
from pepper_sim.body.frames import ROOT
from pepper_sim.naoqi.joint_names import LEFT_ARM, RIGHT_ARM, joints_of
from pepper_sim.naoqi.service import ServiceError, one_of, remote, shown
from pepper_sim.robot import STEREO_CAMERA, Pepper

_HAND = (0.0695, 0.0, -0.0303)
_EFFECTORS: dict[str, tuple[str, tuple[float, float, float]]] = {
    "Head": ("Head", (0.0, 0.0, 0.0)),
    "Torso": ("torso", (0.0, 0.0, 0.0)),
    "LArm": ("l_wrist", _HAND),
    "RArm": ("r_wrist", _HAND),
    "Leg": ("base_footprint", (0.0, 0.0, 0.0)),
}
"""Effector -> (link, offset in it [m]); NAOqi 2.8 documentation, bodyparts_pep and links_pep."""

_ARM_LINKS = ("Shoulder", "Bicep", "Elbow", "ForeArm", "_wrist", "_gripper")
_JOINT_LINKS: dict[str, str] = {
    "HeadYaw": "Neck",
    "HeadPitch": "Head",
    "HipRoll": "Hip",
    "HipPitch": "Pelvis",
    "KneePitch": "Tibia",
    **{
        joint: (side.lower() if link.startswith("_") else side) + link
        for side, joints in (("L", LEFT_ARM), ("R", RIGHT_ARM))
        for joint, link in zip(joints, _ARM_LINKS, strict=True)
    },
}
"""Joint -> the link it moves, whose origin lies on the joint's axis."""

SENSORS: dict[str, str] = {
    "CameraTop": "CameraTop_frame",
    "CameraBottom": "CameraBottom_frame",
    "CameraDepth": "CameraDepth_frame",
    STEREO_CAMERA: "CameraDepth_frame",  # the left eye; only where the head has it
    "Head/Touch/Front": "HeadTouchFront_frame",
    "Head/Touch/Middle": "HeadTouchMiddle_frame",
    "Head/Touch/Rear": "HeadTouchRear_frame",
    "LHand/Touch/Back": "LHandTouchBack_frame",
    "RHand/Touch/Back": "RHandTouchBack_frame",
    "ChestButton": "ChestButton_frame",
    "Tablet": "Tablet_frame",
    "Accelerometer": "ImuTorsoAccelerometer_frame",
    "Gyrometer": "ImuTorsoGyrometer_frame",
    "AccelerometerBase": "ImuBaseAccelerometer_frame",
    "SonarFront": "SonarFront_frame",
    "SonarBack": "SonarBack_frame",
    "FrontLeftBumper": "BumperFL_frame",
    "FrontRightBumper": "BumperFR_frame",
    "BackBumper": "BumperB_frame",
    "LaserFront": "SurroundingFrontLaser_frame",
    "LaserLeft": "SurroundingLeftLaser_frame",
    "LaserRight": "SurroundingRightLaser_frame",
}
"""Sensor name of getSensorNames -> frame of the URDF (ros-naoqi/pepper_robot)."""

MASS = 28.68
"""Sum of the URDF's links (ros-naoqi/pepper_robot) [kg]."""
_BASE_LINK = "Tibia"
"""The link under the knee, whose mass the simulated body has in one with the base."""

FRAME_LINKS: dict[int, str | None] = {0: "torso", 1: None, 2: "base_footprint"}
"""Frame of reference -> its link; None for the world."""


class MotionFrames:
    """Kinematic part of ALMotion."""

    def __init__(self, robot: Pepper) -> None:
        self._robot = robot

    @remote("[f](sib)")
    def getPosition(self, name: str, space: int, useSensorValues: bool) -> list[float]:
        """Returns [x, y, z, wx, wy, wz] of an effector, joint or sensor; the angles are those of R = Rz Ry Rx.

        Measured angles are used in either case.
        """
        pose = self._pose(name, space)
        pitch = math.asin(max(-1.0, min(1.0, -float(pose[2, 0]))))
        roll = math.atan2(float(pose[2, 1]), float(pose[2, 2]))
        yaw = math.atan2(float(pose[1, 0]), float(pose[0, 0]))
        return [*pose[:3, 3].tolist(), roll, pitch, yaw]

    @remote("[f](sib)")
    def getTransform(self, name: str, space: int, useSensorValues: bool) -> list[float]:
        """Returns the homogeneous matrix of an effector, joint or sensor, 16 numbers, row by row."""
        return self._pose(name, space).ravel().tolist()

    @remote("f(s)")
    def getMass(self, pName: str) -> float:
        """Returns the mass of a joint's link, of a chain, or of the whole robot, "Body" [kg]."""
        return MASS if pName == "Body" else self._robot.center_of_mass(_links(pName))[0]

    @remote("[f](sib)")
    def getCOM(self, pName: str, pSpace: int, pUseSensorValues: bool) -> list[float]:
        """Returns the centre of mass [x, y, z] of a joint's link, of a chain, or of the whole robot, "Body".

        Measured angles are used in either case.
        """
        one_of(pSpace, FRAME_LINKS, "pSpace")
        with self._robot.world.locked():
            center = self._robot.center_of_mass(_links(pName))[1]
            return (np.linalg.inv(self._reference(pSpace)) @ [*center, 1.0])[:3].tolist()

    @remote("[[f]](ib)")
    def getSupportPolygon(self, pFrame: int, pUseSensorValues: bool) -> list[list[float]]:
        """Returns the corners [x, y] of the area between the wheels, counter-clockwise, in frame 1 or 2."""
        one_of(pFrame, (1, 2), "pFrame")
        x, y, theta = self._robot.snapshot().odometry if pFrame == 1 else (0.0, 0.0, 0.0)
        c, s = math.cos(theta), math.sin(theta)
        return [[x + c * wx - s * wy, y + s * wx + c * wy] for wx, wy in WHEEL_CENTRES]

    @remote("[s]()")
    def getSensorNames(self) -> list[str]:
        """Lists the sensors."""
        return sorted(name for name in SENSORS if name != STEREO_CAMERA or name in self._robot.cameras)

    def _pose(self, name: str, space: int) -> np.ndarray:
        one_of(space, FRAME_LINKS, "space")
        link, offset = _EFFECTORS.get(name, (_JOINT_LINKS.get(name) or SENSORS.get(name), (0.0, 0.0, 0.0)))
        if link is None:
            raise ServiceError(f"name: unknown chain, joint or sensor {shown(name)}")
        with self._robot.world.locked():  # both links at the same instant
            pose, reference = self._robot.link_pose(link), self._reference(space)
        pose[:3, 3] += pose[:3, :3] @ offset
        return np.linalg.inv(reference) @ pose

    def _reference(self, space: int) -> np.ndarray:
        frame = FRAME_LINKS[space]
        return np.eye(4) if frame is None else self._robot.link_pose(frame)


def _links(name: str) -> list[str]:
    """Return the links whose mass counts for a joint or chain: those that its joints move."""
    if name == "Torso":
        return ["torso"]
    links = [_JOINT_LINKS[joint] for joint in joints_of(name, "pName")]
    links = [ROOT if link == _BASE_LINK else link for link in links]
    return [*links, "torso"] if name in ("Body", "Joints", "JointActuators") else links
