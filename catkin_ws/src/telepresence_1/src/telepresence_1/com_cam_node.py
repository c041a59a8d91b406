"""ROS node com_cam: the pilot's camera, the page with its picture, and the command to the tablet to show it.

Publishes: ~status (diagnostic_msgs/DiagnosticStatus, latched, every second), /diagnostics.
Service:   ~show_on_tablet (std_srvs/SetBool): show the page on the tablet, or take it away.
Command line: --qi-url URL, in place of ~nao_ip and ~nao_port.
Parameters:
    ~source ("0")           camera number or device, video or picture file, URL, or "test"
    ~name ("Pilot")         whom the page announces
    ~width, ~height, ~rate (640, 480, 30), ~quality (80)
                            what the camera is asked for [pixel, pixel, 1/s], and the quality of the JPEG
    ~address ("")           where the page is served; "": ~roscore_ip if it is this machine's, else this machine's
                            address on the way to the robot, which is loopback for a simulated one
    ~port (10002)
    ~roscore_ip ("")        this machine as the robot sees it
    ~token ("auto")         the key to the page; "auto": a new one in every run, but none on loopback; "none"
    ~max_viewers (64)
    ~show_on_tablet (true)
    ~nao_ip, ~nao_port (127.0.0.1, 9559)
                            with the environment's NAO_USER and NAO_PASSWORD, if they are set
    ~page_url ("")          the page as the tablet must ask for it, when that is not what ~address says
"""

from __future__ import annotations

import argparse
import os
import sys
import threading
import time
import urllib.parse

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from naoqi_driver.connection import Address, Connection
from std_srvs.srv import SetBool, SetBoolRequest, SetBoolResponse
from telepresence_ros.node import Node

from telepresence.video.mjpeg import MjpegStream
from telepresence.web.server import WebServer
from telepresence_1.camera import Camera, State
from telepresence_1.network import NoRoute, choose_address, is_loopback
from telepresence_1.page import create_app
from telepresence_1.page_auth import make_token
from telepresence_1.tablet_link import TabletLink, public

VISIT_PATIENCE = 10.0
"""Seconds after which a tablet that should show the page and has not asked for the picture is a problem."""
STATUS_PERIOD = 1.0
"""Seconds between two reports."""
SHUTDOWN_TIMEOUT = 4.0
"""Seconds allowed for `ComCam.close`, twice what it takes."""


class ComCam:
    """Joins camera, page and tablet; reads its parameters once.

    Args:
        node: The started node.
        qi_url: The robot, in place of its parameters; for example tcp://192.168.1.20:9559.

    Raises:
        NoRoute, OSError, ValueError: The page cannot be served, or a parameter makes no sense; the text says why.
    """

    def __init__(self, node: Node, qi_url: str | None) -> None:
        self._node = node
        robot = qi_url or str(rospy.get_param("~nao_ip", "127.0.0.1"))
        own = str(rospy.get_param("~roscore_ip", ""))
        address = choose_address(str(rospy.get_param("~address", "")), own, robot)
        name = str(rospy.get_param("~name", "Pilot"))
        self.camera = Camera(
            str(rospy.get_param("~source", "0")),
            width=int(rospy.get_param("~width", 640)),
            height=int(rospy.get_param("~height", 480)),
            rate=float(rospy.get_param("~rate", 30.0)),
            quality=int(rospy.get_param("~quality", 80)),
        )
        token = str(rospy.get_param("~token", "auto"))
        if token == "auto":
            token = "none" if is_loopback(address) else make_token()
        key = None if token in ("none", "") else token
        self.stream = MjpegStream(self.camera.image, max_viewers=int(rospy.get_param("~max_viewers", 64)))
        app = create_app(self.stream, name=name, describe=self._describe, token=key)
        self.server = WebServer(app, address, int(rospy.get_param("~port", 10002)))
        page_url = str(rospy.get_param("~page_url", ""))
        if not page_url and self.server.address in ("0.0.0.0", "::"):  # no address that anybody could ask for
            page_url = f"http://{choose_address('', own, robot)}:{self.server.port}/"
        page_url = page_url or self.server.url
        if key and "k=" not in urllib.parse.urlsplit(page_url).query:
            page_url += ("&" if "?" in page_url else "?") + urllib.parse.urlencode({"k": key})
        self.page_url = page_url
        port = int(rospy.get_param("~nao_port", 9559))
        login = os.environ.get("NAO_USER"), os.environ.get("NAO_PASSWORD")
        self.connection = Connection(Address.parse(robot, port, *login))
        self.link: TabletLink | None = None
        self._showing, self._connecting = threading.Lock(), False
        self._shown_at_start = bool(rospy.get_param("~show_on_tablet", True))
        self._status = rospy.Publisher("~status", DiagnosticStatus, queue_size=1, latch=True)
        self._diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=10)
        self._unvisited = False
        rospy.Service("~show_on_tablet", SetBool, self._on_show)

    def run(self) -> int:
        """Run until the node is shut down; return the exit code."""
        return self._node.run(self._loop)

    def _loop(self) -> None:
        try:
            self.start()
            for _ in self._node.cycles(STATUS_PERIOD):
                self.report()
        finally:
            self.close()

    def start(self) -> None:
        """Begin to film, to serve the page, and to show it on the tablet."""
        self.camera.start()
        self.server.start()
        rospy.loginfo("the page is at %s", public(self.page_url))
        if public(self.page_url) != self.page_url:
            # To the terminal only: everybody on the ROS network can read /rosout.
            print(f"with its key, for another browser: {self.page_url}", flush=True)
        if self._shown_at_start:
            self.show_on_tablet(True)

    def show_on_tablet(self, wanted: bool) -> None:
        """Show the page on the tablet from now on, or take it away; at most about a second."""
        with self._showing:
            if wanted and self.link is None:
                if not self._connecting:
                    self.connection.start()
                    self._connecting = True
                self.link = TabletLink(self.connection, self.page_url).start()
            elif not wanted and self.link is not None:
                self.link.close()
                self.link = None

    def _on_show(self, request: SetBoolRequest) -> SetBoolResponse:
        self.show_on_tablet(request.data)
        return SetBoolResponse(True, "the page is to be on the tablet" if request.data else "the page is taken away")

    def close(self) -> None:
        """End everything within two seconds, whatever the robot and the camera do."""
        self.show_on_tablet(False)
        self.connection.close()
        self.server.close()
        self.camera.close()

    def report(self) -> None:
        """Publish how things stand."""
        camera, link = self.camera.status, self.link
        messages = [camera.text]
        level = DiagnosticStatus.OK if camera.state is State.LIVE else DiagnosticStatus.WARN
        if link is not None:
            messages.append(self._describe_tablet(link))
            if link.shown_since is None or self._unvisited:
                level = DiagnosticStatus.WARN
        values = {
            "page": public(self.page_url),
            "camera": camera.source,
            "state": camera.state.value,
            "size": f"{camera.width}x{camera.height}",
            "rate": f"{camera.rate:.1f}",
            "losses": camera.losses,
            "viewers": self.stream.viewers,
            "on tablet": link is not None and link.shown_since is not None,
        }
        status = DiagnosticStatus(level, f"{rospy.get_name().strip('/')}: page", "; ".join(messages), "", [])
        status.values = [KeyValue(key, str(value)) for key, value in values.items()]
        self._status.publish(status)
        array = DiagnosticArray(status=[status])
        array.header.stamp = rospy.Time.now()
        self._diagnostics.publish(array)

    def _describe(self) -> tuple[str, str]:
        status = self.camera.status
        return status.state.value, status.text

    def _describe_tablet(self, link: TabletLink) -> str:
        if link.shown_since is None:
            self._unvisited = False
            return f"not on the tablet: {link.problem}"
        unvisited = self.stream.viewers == 0 and time.monotonic() - link.shown_since > VISIT_PATIENCE
        if unvisited and not self._unvisited:
            rospy.logwarn(
                "the tablet was told to show %s and does not ask for the picture. It uses its own Wi-Fi: can it reach "
                "this address? If not, give page_address or ~page_url.",
                public(self.page_url),
            )
        self._unvisited = unvisited
        return "the tablet does not ask for the picture" if unvisited else "on the tablet"


def main() -> int:
    """Run the node; the exit code for the process."""
    parser = argparse.ArgumentParser(prog="com_cam.py", description="Show the pilot's camera on the robot's tablet.")
    parser.add_argument("--qi-url", help="the robot, for example tcp://192.168.1.20:9559")
    arguments, _ = parser.parse_known_args(rospy.myargv(sys.argv)[1:])
    node = Node("com_cam")
    node.shutdown_timeout = SHUTDOWN_TIMEOUT
    try:
        com_cam = ComCam(node, arguments.qi_url)
    except (NoRoute, OSError, ValueError) as error:
        rospy.logfatal("%s", error)
        return 1
    return com_cam.run()
