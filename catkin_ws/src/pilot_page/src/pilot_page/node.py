"""The node pilot_page: the page by which any browser sees through the robot and drives it.

Subscribes: the robot's pictures (sensor_msgs/Image) while somebody looks; drive/state (telepresence_msgs/DriveState);
            safety (telepresence_msgs/SafetyState).
Publishes:  drive/command (telepresence_msgs/DriveCommand): one window of drive_lease for every browser.
Calls:      drive/join, drive/ask.
Listens:    HTTPS on one tcp port; WebRTC on udp ports that the kernel gives.
"""

from __future__ import annotations

import argparse
import asyncio
import sys
import threading
import time
from pathlib import Path
from typing import Any

import cv2
import rospy
from aiohttp import web
from sensor_msgs.msg import Image
from telepresence_msgs.msg import DriveState, SafetyState
from telepresence_ros.node import Node

from pilot_page.lease_services import LeaseLink, LeaseServices
from telepresence.page.app import PilotPage
from telepresence.page.certificate import fingerprint, server_context
from telepresence.security.outside_text import clean
from telepresence.teleop.accounts import Users
from telepresence.teleop.drive_lease import PILOT, Account
from telepresence.teleop.lease_topics import read_lease_state
from telepresence.video.displayable import as_bgr
from telepresence.video.images import LatestImage, read_image_message

GATE_LIFE = 0.5
"""[s] for which what the gate said is shown."""
_NAME = 64


class PageNode:
    """Joins ROS, on threads of its own, and the page, on an event loop.

    Args:
        options: Of the command line, see `parse`.
    """

    def __init__(self, options: argparse.Namespace) -> None:
        self._node = Node("pilot_page")
        self._options = options
        self._users = Users(Path(options.users) if options.users else None)
        self.robot: str = options.robot
        self.picture = LatestImage()
        self._gate: tuple[SafetyState, float] | None = None
        self._loop = asyncio.new_event_loop()
        self._services = LeaseServices(self._loop)
        self._page = PilotPage(self, options.address)
        self._subscription: rospy.Subscriber | None = None
        rospy.Subscriber("drive/state", DriveState, self._on_lease, queue_size=1, tcp_nodelay=True)
        rospy.Subscriber("safety", SafetyState, self._on_gate, queue_size=1, tcp_nodelay=True)

    def run(self) -> int:
        """Serve until the node is shut down; return the exit code."""
        return self._node.run(self._serve)

    # --- what the page needs ---

    def admit(self, name: str, password: str) -> Account:
        """Return the account; where nobody signs in, everybody is a pilot."""
        if not self._options.sign_in:
            return Account(clean(name)[:_NAME] or "Pilot", PILOT)
        return self._users.check(name, password)

    def lease_link(self, name: str) -> LeaseLink:
        return self._services.link(name)

    def watch(self, wanted: bool) -> None:
        """Take pictures only while somebody looks."""
        if wanted and self._subscription is None:
            self._subscription = rospy.Subscriber(
                self._options.picture, Image, self._on_picture, queue_size=1, buff_size=2**24, tcp_nodelay=True
            )
        elif not wanted and self._subscription is not None:
            self._subscription.unregister()
            self._subscription = None

    def state(self) -> dict[str, Any]:
        gate = self._gate
        if gate is None or time.monotonic() - gate[1] > GATE_LIFE:
            return {"gate": None}
        message = gate[0]
        return {
            "gate": {
                "state": clean(message.state),
                "reason": clean(message.reason),
                "allowed": [round(speed, 2) for speed in message.allowed],
            }
        }

    # --- ROS ---

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
        self._loop.call_soon_threadsafe(self._page.receive, state)

    def _on_gate(self, message: SafetyState) -> None:
        self._gate = message, time.monotonic()

    # --- the page ---

    def _serve(self) -> None:
        asyncio.set_event_loop(self._loop)
        self._loop.run_until_complete(self._serve_until_stopped())

    async def _serve_until_stopped(self) -> None:
        options = self._options
        folder = Path(options.certificates)
        runner = web.AppRunner(self._page.application(), access_log=None, handle_signals=False)
        await runner.setup()
        site = web.TCPSite(runner, options.address, options.port, ssl_context=server_context(folder, {options.address}))
        try:
            await site.start()
        except OSError as error:
            rospy.logfatal("the page cannot listen on %s, port %d: %s", options.address, options.port, error.strerror)
            await runner.cleanup()
            return
        port = runner.addresses[0][1]
        rospy.loginfo("the pilot's page: https://%s:%d/  certificate SHA-256 %s", options.address, port,
                      fingerprint(folder))  # fmt: skip
        beats = threading.Thread(target=self._beat, daemon=True)
        beats.start()
        while not self._node.stop.is_set():
            await asyncio.sleep(0.05)
        await runner.cleanup()

    def _beat(self) -> None:
        """Count as frozen when the event loop does not turn: it carries everybody's commands."""
        for _ in self._node.cycles(0.1):
            asyncio.run_coroutine_threadsafe(asyncio.sleep(0), self._loop).result()


def parse(argv: list[str]) -> argparse.Namespace:
    """Return what a command line says."""
    parser = argparse.ArgumentParser(prog="pilot_page", description="The pilot's page.")
    parser.add_argument("--robot", default="Pepper", help="what the page calls it")
    parser.add_argument("--picture", default="pepper_robot/camera/front/image_raw", metavar="TOPIC")
    parser.add_argument("--address", default="127.0.0.1", help="of this machine, where the page is")
    parser.add_argument("--port", type=int, default=8443)
    parser.add_argument(
        "--sign-in", type=lambda word: word.lower() in ("true", "1"), default=True, metavar="true|false"
    )
    parser.add_argument("--users", default="", metavar="FILE")
    parser.add_argument("--certificates", default=str(Path.home() / ".config/telepresence/page"), metavar="FOLDER")
    return parser.parse_args([word for word in argv if ":=" not in word])


def main() -> int:
    """Run the node; the exit code."""
    return PageNode(parse(sys.argv[1:])).run()
