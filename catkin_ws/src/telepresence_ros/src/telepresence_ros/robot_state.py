"""The node that publishes where the parts of a robot's body are, from its description and the angles of its joints.

Subscribes: joint_states (sensor_msgs/JointState).
Publishes:  /tf (tf2_msgs/TFMessage): joints that move; /tf_static (latched): those that do not.
Parameters: robot_description: URDF, searched for upwards; ~publish_frequency (50): at most [Hz]; ~ignore_timestamp
            (false): publish for every message; ~use_tf_static (true): false repeats the fixed joints on /tf, at the
            same rate.

The same topics and parameters as roscpp's robot_state_publisher, which it replaces: that one listens on every address
of the machine whatever ROS_IP says. Only tf_prefix is not read: drivers and sensors do not put it before their frames,
so half a tree would carry it. Several robots have a topic tf each.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass

import numpy as np
import rospy
from geometry_msgs.msg import Quaternion, TransformStamped, Vector3
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage

from telepresence_ros.node import Node

FREQUENCY = 50.0
"""[Hz]"""
TURNING = ("revolute", "continuous")


@dataclass(frozen=True)
class Joint:
    """A joint of a URDF.

    Attributes:
        kind: revolute, continuous, prismatic or fixed.
        origin: x, y, z [m] of the child in the parent's frame, at zero.
        rotation: Unit quaternion (x, y, z, w) of the child in the parent's frame, at zero.
        axis: Unit vector in the joint's frame.
        mimic: Name of the joint that this one follows, or empty, with the factor and the offset [rad or m].
    """

    name: str
    kind: str
    parent: str
    child: str
    origin: np.ndarray
    rotation: np.ndarray
    axis: np.ndarray
    mimic: tuple[str, float, float] = ("", 1.0, 0.0)

    def pose(self, position: float) -> tuple[np.ndarray, np.ndarray]:
        """Return origin [m] and unit quaternion (x, y, z, w) of the child at a position [rad or m]."""
        if self.kind in TURNING:
            turn = np.append(np.sin(position / 2.0) * self.axis, np.cos(position / 2.0))
            return self.origin, product(self.rotation, turn)
        if self.kind == "prismatic":
            return self.origin + rotated(self.rotation, position * self.axis), self.rotation
        return self.origin, self.rotation


def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the quaternion (x, y, z, w) of the rotation `b` in the frame of `a`."""
    ax, ay, az, aw = a.tolist()  # numbers are quicker than arrays of four
    bx, by, bz, bw = b.tolist()
    return np.array(
        [
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        ]
    )


def rotated(rotation: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Return a vector of the rotated frame in the frame that it is rotated in."""
    across = 2.0 * np.cross(rotation[:3], vector)
    return np.asarray(vector + rotation[3] * across + np.cross(rotation[:3], across))


def from_roll_pitch_yaw(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """Return the unit quaternion (x, y, z, w) of turns about fixed x, y, z [rad], in this order."""
    result = np.array([0.0, 0.0, 0.0, 1.0])
    for axis, angle in ((2, yaw), (1, pitch), (0, roll)):
        turn = np.zeros(4)
        turn[axis], turn[3] = np.sin(angle / 2.0), np.cos(angle / 2.0)
        result = product(result, turn)
    return result


def read_joints(description: str) -> list[Joint]:
    """Read the joints of a URDF that have one degree of freedom or none.

    Raises:
        ValueError: It is no URDF.
    """
    try:
        robot = ElementTree.fromstring(description)
        if robot.tag != "robot":
            raise ValueError(f"robot_description is no URDF: it begins with <{robot.tag}>, not <robot>")
        return [_joint(element) for element in robot.iterfind("joint") if element.get("type") in _KINDS]
    except (ElementTree.ParseError, KeyError, AttributeError) as error:
        raise ValueError(f"robot_description is no URDF: {error}") from error


_KINDS = (*TURNING, "prismatic", "fixed")


def _joint(element: ElementTree.Element) -> Joint:
    def numbers(tag: str, name: str, default: str) -> np.ndarray:
        found = element.find(tag)
        return np.array([float(word) for word in (default if found is None else found.get(name, default)).split()])

    axis = numbers("axis", "xyz", "1 0 0")
    mimic = element.find("mimic")
    followed = ("", 1.0, 0.0)
    if mimic is not None:
        followed = (mimic.attrib["joint"], float(mimic.get("multiplier", 1)), float(mimic.get("offset", 0)))
    return Joint(
        element.attrib["name"],
        element.attrib["type"],
        element.find("parent").attrib["link"],  # type: ignore[union-attr]  # read_joints says what is missing
        element.find("child").attrib["link"],  # type: ignore[union-attr]
        numbers("origin", "xyz", "0 0 0"),
        from_roll_pitch_yaw(*numbers("origin", "rpy", "0 0 0")),
        axis / (np.linalg.norm(axis) or 1.0),
        followed,
    )


class BodyState:
    """Turns angles of joints into transforms. Makes each message once and changes its numbers.

    Args:
        joints: Of the robot.
    """

    def __init__(self, joints: list[Joint]) -> None:
        self._messages = {joint.name: _message(joint) for joint in joints}
        self._moving = {joint.name: joint for joint in joints if joint.kind != "fixed"}
        self._followers = [joint for joint in self._moving.values() if joint.mimic[0]]
        self.fixed = [self._messages[joint.name] for joint in joints if joint.kind == "fixed"]
        """Transforms that never change; their stamps are the caller's."""

    def moving(self, positions: dict[str, float], stamp: rospy.Time) -> list[TransformStamped]:
        """Return the transforms of the joints with these positions [rad or m], and of those that follow them."""
        for follower in self._followers:
            name, factor, offset = follower.mimic
            if name in positions:
                positions.setdefault(follower.name, factor * positions[name] + offset)
        found = []
        for name, position in positions.items():
            joint = self._moving.get(name)
            if joint is None or not np.isfinite(position):
                continue
            message = self._messages[name]
            message.header.stamp = stamp
            _fill(message, *joint.pose(position))
            found.append(message)
        return found


def _message(joint: Joint) -> TransformStamped:
    message = TransformStamped()
    message.header.frame_id, message.child_frame_id = joint.parent, joint.child
    _fill(message, joint.origin, joint.rotation)
    return message


def _fill(message: TransformStamped, origin: np.ndarray, rotation: np.ndarray) -> None:
    message.transform.translation = Vector3(*origin.tolist())
    message.transform.rotation = Quaternion(*rotation.tolist())


class RobotState(Node):
    """The node."""

    def __init__(self) -> None:
        super().__init__("robot_state_publisher")
        try:
            joints = read_joints(str(_searched("robot_description", "")))
        except ValueError as error:
            raise SystemExit(f"{rospy.get_name()}: {error}") from None
        if prefix := str(_searched("tf_prefix", "")):
            rospy.logwarn("tf_prefix is not used; for transforms of this robot's own:  tf:=/%s/tf", prefix.strip("/"))
        self._body = BodyState(joints)
        self._period = rospy.Duration.from_sec(1.0 / max(1e-3, float(rospy.get_param("~publish_frequency", FREQUENCY))))
        self._every_message = bool(rospy.get_param("~ignore_timestamp", False))
        self._published: dict[str, rospy.Time] = {}
        self._seen = rospy.Time()
        self._transforms = rospy.Publisher("/tf", TFMessage, queue_size=100)
        self._fixed_latched = bool(rospy.get_param("~use_tf_static", True))
        if self._fixed_latched:
            self._fixed = rospy.Publisher("/tf_static", TFMessage, queue_size=100, latch=True)
            self._fixed.publish(self._fixed_transforms(rospy.Time.now()))
        else:
            rospy.Timer(self._period, lambda _: self._transforms.publish(self._fixed_transforms(rospy.Time.now())))
        rospy.Subscriber("joint_states", JointState, self._on_joints, queue_size=10, tcp_nodelay=True)

    def _fixed_transforms(self, stamp: rospy.Time) -> TFMessage:
        for message in self._body.fixed:
            message.header.stamp = stamp
        return TFMessage(self._body.fixed)

    def _on_joints(self, message: JointState) -> None:
        stamp, now = message.header.stamp, rospy.Time.now()
        if now < self._seen:
            self._published.clear()  # time began again, as it does when a recording is repeated
        self._seen = now
        last = min((self._published.get(name, rospy.Time()) for name in message.name), default=now)
        if not self._every_message and stamp < last + self._period:
            return
        for name in message.name:
            self._published[name] = stamp
        transforms = self._body.moving(dict(zip(message.name, message.position, strict=False)), stamp)
        if transforms:
            self._transforms.publish(TFMessage(transforms))


def _searched(name: str, default: str) -> object:
    """The value of a parameter of this node's namespace, or of the nearest one above."""
    found = rospy.search_param(name)
    return rospy.get_param(found, default) if found else default


def main() -> int:
    """Run the node; the exit code."""
    return RobotState().run()
