"""What tests see and do on a ROS graph: watches topics, drives, calls services, looks up transforms and nodes."""

from __future__ import annotations

import contextlib
import math
import threading
import time
import xmlrpc.client
from typing import Any

import rosgraph
import rosnode
import rospy
import tf2_ros
from geometry_msgs.msg import PoseStamped, Twist
from roslib.message import get_message_class, get_service_class
from std_msgs.msg import Int32

from telepresence.teleop.movement import REPORT_HEADER


class Probe:
    """Eyes and hands of a test, in a process that is a rospy node already. What it returns can be written as JSON.

    Args:
        drive_topic: Where `drive` publishes. A node that both publishes there and listens counts as a keyboard.
    """

    def __init__(self, drive_topic: str = "/cmd_vel") -> None:
        self._seen: dict[str, list[tuple[float, list[Any]]]] = {}
        self._publishers: dict[str, rospy.Publisher] = {}
        self._transforms: tf2_ros.Buffer | None = None
        self._twist: Twist | None = None
        self._last_command = 0.0
        self._cmd_vel = rospy.Publisher(drive_topic, Twist, queue_size=1)
        threading.Thread(target=self._repeat, daemon=True).start()

    def watch(self, topic: str, kind: str, fields: list[str]) -> None:
        """Record the time of every message and these fields of it, e.g. "pose.pose.position.x" or "len(ranges)"."""
        self._seen[topic] = []

        def record(message: Any) -> None:
            self._seen[topic].append((time.time(), [read_field(message, field) for field in fields]))

        rospy.Subscriber(topic, get_message_class(kind), record, queue_size=10)

    def seen(self, topic: str) -> list[tuple[float, list[Any]]]:
        return self._seen[topic]

    def newest(self, topic: str) -> tuple[float, list[Any]] | None:
        """The last message; for topics that are watched for minutes."""
        return self._seen[topic][-1] if self._seen[topic] else None

    def forget(self, topic: str) -> None:
        self._seen[topic].clear()

    def drive(self, vx: float, vy: float, wz: float) -> float:
        """Publish a velocity ten times a second until `silence`."""
        twist = Twist()
        twist.linear.x, twist.linear.y, twist.angular.z = (math.nan if part is None else part for part in (vx, vy, wz))
        self._twist = twist
        return time.time()

    def silence(self) -> float:
        """Publish no more; the time of the last command."""
        self._twist = None
        return self._last_command

    def subscribers(self) -> int:
        """How many nodes listen to our velocities."""
        return self._cmd_vel.get_num_connections()

    def goal(self, frame: str, x: float, y: float, theta: float, stamp: float = 0.0) -> None:
        """Publish a goal, once somebody listens; `stamp` is the date at which it was given, if it says so."""
        publisher = self._publishers.setdefault(
            "goal", rospy.Publisher("/move_base_simple/goal", PoseStamped, queue_size=1)
        )
        deadline = time.monotonic() + 10
        while not publisher.get_num_connections() and time.monotonic() < deadline:
            time.sleep(0.05)
        message = PoseStamped()
        message.header.frame_id = frame
        message.header.stamp = rospy.Time.from_sec(stamp)
        message.pose.position.x, message.pose.position.y = x, y
        message.pose.orientation.z, message.pose.orientation.w = math.sin(theta / 2), math.cos(theta / 2)
        publisher.publish(message)

    def call(self, service: str, kind: str, request: dict[str, Any]) -> list[Any]:
        """True and the fields of the answer, or False and the error text."""
        service_class = get_service_class(kind)
        try:
            rospy.wait_for_service(service, timeout=10)
            message = service_class._request_class()
            for name, value in request.items():
                write_field(message, name, value)
            answer = rospy.ServiceProxy(service, service_class)(message)
        except (rospy.ServiceException, rospy.ROSException) as error:
            return [False, str(error)]
        return [True, {name: getattr(answer, name) for name in answer.__slots__}]

    def order(self, topic: str, movement: int) -> None:
        """Publish one std_msgs/Int32, once somebody listens."""
        publisher = self._publishers.get(topic) or rospy.Publisher(topic, Int32, queue_size=1)
        self._publishers[topic] = publisher
        deadline = time.monotonic() + 10
        while not publisher.get_num_connections() and time.monotonic() < deadline:
            time.sleep(0.01)
        publisher.publish(movement)

    def report(self, topic: str, movement: int) -> None:
        """Publish one std_msgs/Int32 as a window does that drives by velocities."""
        publisher = self._publishers.get("report")
        if publisher is None:
            self._publishers["report"] = publisher = rospy.Publisher(topic, Int32, headers=REPORT_HEADER, queue_size=10)
            deadline = time.monotonic() + 10
            while publisher.get_num_connections() < 2 and time.monotonic() < deadline:
                time.sleep(0.01)  # the simulator, and whoever watches
        publisher.publish(movement)

    def call_often(self, service: str, kind: str, count: int) -> int:
        """Call a std_srvs/Trigger `count` times over one connection; how often it succeeded."""
        rospy.wait_for_service(service, timeout=10)
        with contextlib.closing(rospy.ServiceProxy(service, get_service_class(kind), persistent=True)) as proxy:
            return sum(proxy().success for _ in range(count))

    def topics(self) -> dict[str, str]:
        return dict(rospy.get_published_topics())

    def nodes(self) -> list[str]:
        """Names that the master knows."""
        return rosnode.get_node_names()

    def pid(self, node: str) -> int:
        """The process of a node that runs.

        Raises:
            OSError, rosnode.ROSNodeException: The master does not know it, or it does not answer.
        """
        uri = rosnode.get_api_uri(rosgraph.Master(rospy.get_name()), node, skip_cache=True)
        if uri is None:
            raise rosnode.ROSNodeException(f"the master knows no node {node}")
        answer: Any = xmlrpc.client.ServerProxy(uri).getPid(rospy.get_name())  # XML-RPC answers have no types
        return answer[2]

    def transform(self, parent: str, child: str) -> list[float] | None:
        """Where the origin of `child` is in `parent` [m]; None when they do not hang together (yet)."""
        if self._transforms is None:
            self._transforms = tf2_ros.Buffer()
            tf2_ros.TransformListener(self._transforms)
        try:
            found = self._transforms.lookup_transform(parent, child, rospy.Time(0)).transform.translation
        except tf2_ros.TransformException:
            return None
        return [found.x, found.y, found.z]

    def parameter(self, name: str) -> Any:
        return rospy.get_param(name, None)

    def _repeat(self) -> None:
        while True:
            twist = self._twist
            if twist is not None:
                self._last_command = time.time()
                self._cmd_vel.publish(twist)
            time.sleep(0.1)


def read_field(message: Any, field: str) -> Any:
    """A field in a form that JSON can carry; of bytes only the first twelve."""
    counted = field.startswith("len(")
    value = message
    for part in field.removeprefix("len(").removesuffix(")").split("."):
        value = value[int(part)] if part.isdigit() else getattr(value, part)
    if counted:
        return len(value)
    if isinstance(value, bytes):
        return list(value[:12])
    if isinstance(value, list | tuple):
        # diagnostic_msgs/KeyValue[] is the only list of messages that a test reads.
        return [[item.key, item.value] if hasattr(item, "key") else item for item in value]
    return value.to_sec() if hasattr(value, "to_sec") else value


def write_field(message: Any, name: str, value: Any) -> None:
    """Set a field; of a std_msgs wrapper its `data`. None stands for a value that is not a number."""
    value = math.nan if value is None else value
    target = getattr(message, name)
    if hasattr(target, "data"):
        target.data = value
    else:
        setattr(message, name, value)
