"""One robot of the page: its topics, its pictures and its drive_lease, as `telepresence.page.station.Station`."""

from __future__ import annotations

import time
from collections.abc import Awaitable, Callable
from dataclasses import replace
from typing import Any

import cv2
import rospy
from sensor_msgs.msg import Image
from std_msgs.msg import String
from telepresence_msgs.msg import DriveState, SafetyState

from pilot_page.conversation import Conversation
from pilot_page.floor import RobotFloor
from pilot_page.head import Head
from pilot_page.health import Health
from pilot_page.lease_services import LeaseLink, LeaseServices
from telepresence.security.outside_text import clean
from telepresence.teleop.lease_messages import Account
from telepresence.teleop.lease_topics import LeaseState, read_lease_state
from telepresence.teleop.robot_kinds import KINDS, RobotKind
from telepresence.teleop.robot_readings import GATE_LIFE, camera_info_of
from telepresence.video.displayable import as_bgr
from telepresence.video.images import LatestImage, read_image_message


def robot_kind(word: str) -> RobotKind:
    """Return what a word of the command line names, KIND[:NAMESPACE[:TOPIC OF ITS PICTURES]]; the calibration is
    beside the pictures. Raises ValueError."""
    name, *places = word.split(":")
    if name not in KINDS or len(places) > 2:
        raise ValueError(f"{word!r} is not one of {', '.join(KINDS)}, or more than KIND:NAMESPACE:TOPIC")
    kind, (namespace, picture) = KINDS[name], (*places, "", "")[:2]
    return replace(kind, namespace=namespace or kind.namespace, picture=picture or kind.picture)


class RobotStation:
    """Joins one robot's topics, on rospy's threads, and the page, on an event loop.

    Args:
        lease_changed: Called with what its drive_lease says, on rospy's threads.
    """

    def __init__(self, kind: RobotKind, services: LeaseServices, lease_changed: Callable[[LeaseState], None]) -> None:
        self.kind, self._services = kind, services
        self._lease_changed = lease_changed
        self.picture = LatestImage()
        self.floor = RobotFloor(kind.namespace, camera_info_of(kind.picture), kind.profile, kind.farthest, self.picture)
        self._gate: tuple[SafetyState, float] | None = None
        self._picture_topic: rospy.Subscriber | None = None
        others = {other.namespace for other in KINDS.values()} - {kind.namespace, "/"}
        self._health = Health(kind.title, kind.namespace, others, self._topic(kind.battery))
        self._head = Head(self._topic("head/state"), self._topic(kind.picture))
        self.conversation = Conversation(self._topic)
        self._requests: dict[str, Callable[[Any, Account], Awaitable[None]]] = {
            "say": self.conversation.say,
            "listen": _refuse_without_webrtc,
            "face": _refuse_without_webrtc,
        }
        self._looking = rospy.Publisher(self._topic("looking"), String, queue_size=1, latch=True)

    def start(self) -> None:
        """Listen to the robot: from now on `lease_changed` is called."""
        rospy.Subscriber(self._topic("drive/state"), DriveState, self._on_lease, queue_size=1, tcp_nodelay=True)
        rospy.Subscriber(self._topic("safety"), SafetyState, self._on_gate, queue_size=1, tcp_nodelay=True)

    def lease_link(self, name: str) -> LeaseLink:
        return self._services.link(name)

    def watch(self, wanted: bool) -> None:
        """Take pictures, and what is needed to drive by them, only while somebody looks."""
        self.floor.watch(wanted)
        if wanted and self._picture_topic is None:
            topic = self._topic(self.kind.picture)
            self._picture_topic = rospy.Subscriber(
                topic, Image, self._on_picture, queue_size=1, buff_size=2**24, tcp_nodelay=True
            )
        elif not wanted and self._picture_topic is not None:
            self._picture_topic.unregister()
            self._picture_topic = None

    def show_who_looks(self, names: list[str]) -> None:
        """Publish them, a line each; see `com_cam` and the windows."""
        self._looking.publish("\n".join(names))

    def state(self) -> dict[str, Any]:
        """Return what the page shows of the robot besides who drives."""
        top = [self.floor.top_speed, self.floor.top_turn]
        shown = {"gate": self._gate_state(), "ring": self._ring(), "top": top, "head": self._head.state()}
        return shown | self._health.state()

    async def request(self, action: str, value: Any, account: Account) -> None:
        """Do what a browser asks of the robot besides driving."""
        await self._requests[action](value, account)

    def _gate_state(self) -> dict[str, Any] | None:
        gate = self._gate
        if gate is None or time.monotonic() - gate[1] > GATE_LIFE:
            return None
        message = gate[0]
        return {
            "state": clean(message.state),
            "reason": clean(message.reason),
        }

    def _ring(self) -> list[float] | None:
        """The speed that is allowed in each direction [m/s], see telepresence_msgs/SafetyState."""
        gate = self._gate
        if gate is None or time.monotonic() - gate[1] > GATE_LIFE:
            return None
        return [round(speed, 2) for speed in gate[0].allowed]

    def _topic(self, name: str) -> str:
        return name if name.startswith("/") else f"{self.kind.namespace.rstrip('/')}/{name}"

    def _on_picture(self, message: Image) -> None:
        try:
            bgr = as_bgr(read_image_message(message), message.encoding)
        except ValueError as error:
            rospy.logwarn_throttle(10.0, "the picture cannot be shown: %s", error)
            return
        height, width = bgr.shape[0] // 2 * 2, bgr.shape[1] // 2 * 2
        if bgr.ndim == 2:
            bgr = cv2.cvtColor(bgr, cv2.COLOR_GRAY2BGR)
        planes = cv2.cvtColor(bgr[:height, :width], cv2.COLOR_BGR2YUV_I420)
        self.picture.put(planes, message.header.stamp.to_sec())

    def _on_lease(self, message: DriveState) -> None:
        try:
            state = read_lease_state(message, time.monotonic())
        except ValueError as error:
            rospy.logwarn_throttle(10.0, "drive/state cannot be read: %s", error)
            return
        self._lease_changed(state)

    def _on_gate(self, message: SafetyState) -> None:
        self._gate = message, time.monotonic()
        self.floor.on_gate(message)
        self._health.on_gate()


async def _refuse_without_webrtc(_value: Any, _account: Account) -> None:
    raise ValueError("Sound and face need WebRTC, which this connection lacks.")
