"""The node rto_camera_receiver: the robot's camera by WebRTC, from the camera sender that runs on the robot.

Receives while somebody subscribes; the newest picture only. Reconnects automatically.

Publishes:  img_raw (sensor_msgs/Image, bgr8; stamped with the time taken if ~measure and the clocks agree, else with
            the time of arrival); img_raw/camera_info; camera_state (std_msgs/String, latched): "live", "idle",
            "no picture: <why>", "waiting: <for what>"; picture_age (std_msgs/Float32 [s], with ~measure);
            /diagnostics.
Parameters: ~sender (127.0.0.1): host, host:port or http://host:port; the port is 8083 unless given; ~frame_id
            (camera_optical_frame); ~calibration_file, ~focal_length: see `camera_calibration`; ~measure (false): ask
            for pictures that carry the time they were taken, in blocks at their lower edge, and report their age;
            ~signaling ("http", or "copy-paste": the offer is read from this terminal and the answer printed, as the
            Robotino guide has it); ~address (all but loopback): of this machine, for copy and paste: the fewer
            addresses, the shorter the line.
"""

from __future__ import annotations

import asyncio
import time

import av
import numpy as np
import rospy
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Float32, String
from telepresence_ros.diagnostics import ERROR, OK, Diagnostics
from telepresence_ros.node import Node

from rto_node.camera_calibration import CameraCalibration
from rto_node.link import REMINDER_PERIOD
from rto_node.webrtc_camera import WebrtcCamera, receive_by_copy_and_paste
from telepresence.start_patience import StartPatience
from telepresence.station import heartbeat
from telepresence.video.copy_paste_signaling import CopyPasteSignaling
from telepresence.video.images import fill_image_message
from telepresence.video.webrtc import release_early

LOOK_PERIOD = 0.1
"""Seconds between two checks for subscribers while there is no picture."""
STATE_PERIOD = 0.5
"""Seconds after which an unchanged state is repeated, so that readers notice a dead node."""
SIGNALING = ("http", "copy-paste")
SENDER = "rosrun rto_bringup robotino_onboard camera --copy-paste"
"""What runs on the robot's side of an exchange by copy and paste."""


class CameraReceiver:
    def __init__(self) -> None:
        self._node = Node("rto_camera_receiver")
        self._frame = rospy.get_param("~frame_id", "camera_optical_frame")
        self._measure = bool(rospy.get_param("~measure", False))
        self._calibration = CameraCalibration()
        self._image = rospy.Publisher("img_raw", Image, queue_size=1)
        self._info = rospy.Publisher("img_raw/camera_info", CameraInfo, queue_size=1)
        self._state = rospy.Publisher("camera_state", String, queue_size=1, latch=True)
        self._age = rospy.Publisher("picture_age", Float32, queue_size=1) if self._measure else None
        self._reported, self._reported_due, self._reminder = "", 0.0, 0.0
        self._patience = StartPatience()
        signaling = rospy.get_param("~signaling", SIGNALING[0])
        if signaling not in SIGNALING:
            raise SystemExit(f"{rospy.get_name()}: ~signaling is {signaling!r}; it can be {' or '.join(SIGNALING)}")
        self._by_hand, self._failed = signaling == "copy-paste", False
        self._address = str(rospy.get_param("~address", "")) or None
        self._camera: WebrtcCamera | None = None
        if not self._by_hand:
            try:
                self._camera = WebrtcCamera(str(rospy.get_param("~sender", "127.0.0.1")), self._measure)
            except ValueError as error:
                raise SystemExit(f"{rospy.get_name()}: {error}") from None
        self._diagnostics = Diagnostics("webrtc camera", self._camera.url if self._camera else "copy and paste")

    def run(self) -> int:
        """Run until the node is shut down; return the exit code."""
        status = self._node.run(self._paste if self._by_hand else self._receive)
        return 1 if self._failed else status

    def _receive(self) -> None:
        camera = self._camera
        assert camera is not None, "with copy and paste there is no connection to keep"
        sequence, counted_at, counted, due = 0, time.monotonic(), 0, 0.0
        while not self._node.stop.is_set():
            heartbeat.beat()
            watched = self._measure or any(topic.get_num_connections() for topic in (self._image, self._info))
            camera.want(watched)
            picture = camera.image.wait_newer(sequence, LOOK_PERIOD)
            if picture is not None:
                sequence = picture.sequence
                if self._age is not None and camera.age is not None:
                    self._age.publish(camera.age)
                self._publish(picture.content, picture.stamp)
            now = time.monotonic()
            if now < due:
                continue
            due = now + LOOK_PERIOD
            self._report(now, "idle" if not watched else f"no picture: {camera.problem}" if camera.problem else "live")
            level = OK if not (watched and camera.problem) else ERROR
            rate = (camera.received - counted) / max(1e-3, now - counted_at)
            message = camera.problem if level == ERROR else f"{rate:.1f} pictures/s" if watched else "nobody looks"
            if self._diagnostics.report(now, level, message, {"connections made": camera.connections}):
                counted_at, counted = now, camera.received
        camera.close()

    def _paste(self) -> None:
        """Receive by one exchange that a person pastes; the node ends with it, as the next one must be pasted again."""

        def take(frame: av.VideoFrame) -> None:
            self._publish(frame.to_ndarray(format="bgr24"), time.time())
            now = time.monotonic()
            self._report(now, "live")
            self._diagnostics.report(now, OK, "pictures come")

        async def exchange() -> None:
            signaling = CopyPasteSignaling(f"the sender's terminal ({SENDER})")
            work = asyncio.ensure_future(receive_by_copy_and_paste(signaling, take, self._address))
            while not work.done() and not self._node.stop.is_set():
                await asyncio.wait({work}, timeout=0.2)
            if work.done():
                work.result()
            work.cancel()

        self._report(time.monotonic(), "waiting: paste the line that the sender printed into this terminal")
        try:
            asyncio.run(exchange())
        except ValueError as error:
            rospy.logfatal("the exchange failed: %s", error)
            self._failed = True

    def _publish(self, pixels: np.ndarray, stamp: float) -> None:
        message = fill_image_message(Image(), pixels, "bgr8")
        message.header.stamp, message.header.frame_id = rospy.Time.from_sec(stamp), self._frame
        self._image.publish(message)
        if self._info.get_num_connections():
            self._info.publish(self._calibration.info(message))

    def _report(self, now: float, state: str) -> None:
        if state == self._reported and now < self._reported_due:
            return
        lost = state.startswith("no picture")
        if state == "live":
            self._patience.works()
        elif state == "idle":  # the next connection begins anew
            self._patience = StartPatience()
        if lost and self._patience.over and (not self._reported.startswith("no picture") or now > self._reminder):
            self._reminder = now + REMINDER_PERIOD
            rospy.logerr(
                "%s; trying again. Does `rto_bringup.onboard camera` run on the robot? Its own pictures are on %s",
                state, rospy.resolve_name("image_raw"),
            )  # fmt: skip
        elif not lost and state != self._reported:
            rospy.loginfo("camera: %s", state)
        self._reported, self._reported_due = state, now + STATE_PERIOD
        self._state.publish(state)


def main() -> int:
    """Run the node; the exit code."""
    release_early()
    return CameraReceiver().run()
