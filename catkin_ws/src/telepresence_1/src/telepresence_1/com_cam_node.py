"""ROS node com_cam: the pilot's camera, the page with its picture, and the robot's tablet, on which it is kept.

Subscribes: looking (std_msgs/String): who looks through the robot by the pilot's page, a name each line; the tablet
           names them. ~face (sensor_msgs/CompressedImage, jpeg): somebody elsewhere is the pilot; shown in place of
           the camera while it comes, and the page with it. Empty data: that camera is covered.
Publishes: ~status (diagnostic_msgs/DiagnosticStatus, latched, every second), /diagnostics.
Services:  ~show_on_tablet (std_srvs/SetBool): film, and show the page with this camera, from now on, or close the
           camera and take the page away; answers at once with how things stand.
Command line: --qi-url URL, in place of ~nao_ip and ~nao_port.
Parameters:
    ~source ("0")           camera number or device, video or picture file, URL, or "test"
    ~name ("Pilot")         whom the page announces
    ~width, ~height, ~rate (640, 480, 30), ~quality (80)
                            what the camera is asked for [pixel, pixel, 1/s], and the quality of the JPEG
    ~address ("")           where the page is served; "": ~roscore_ip if it is this machine's, else this machine's
                            address on the way to the robot, which is loopback for a simulated one
    ~port (10002)
    ~roscore_ip ("")        this machine as the robot sees it; in a container its host, which publishes ~port
    ~token ("auto")         the key to the page; "auto": the environment's TELEPRESENCE_PAGE_KEY, which `./stack up`
                            sets, else a new one in every run; "none"
    ~max_viewers (64)
    ~show_on_tablet (true)  from the start; see the service of this name. While it is off, the camera is closed
    ~activity ("robotvideo/behaviour")
                            what to keep in the robot's focus while the page is shown; "none" leaves the focus alone
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
from sensor_msgs.msg import CompressedImage
from std_msgs.msg import String
from std_srvs.srv import SetBool, SetBoolRequest, SetBoolResponse
from telepresence_ros.kept_state import KeptState
from telepresence_ros.node import ROBOT_PATIENCE, Node

from telepresence import ports
from telepresence.security.outside_text import clean
from telepresence.video.mjpeg import MjpegStream
from telepresence.web.page_auth import page_key, was_announced
from telepresence.web.server import WebServer
from telepresence_1.camera import Camera, State
from telepresence_1.network import NoRoute, address_for_tablet, choose_address
from telepresence_1.page import KEY_VARIABLE, create_app
from telepresence_1.page_record import PageRecord, remove_record
from telepresence_1.robot_focus import ACTIVITY, RobotFocus
from telepresence_1.tablet_link import TabletLink, public

VISIT_PATIENCE = 10.0
"""Seconds after which a tablet that should show the page and has not asked for the picture is a problem."""
STATUS_PERIOD = 1.0
"""Seconds between two reports."""
LONGEST_NAME, MOST_NAMES = 64, 16
"""Characters of a name on the tablet, and names there, at most."""
SHUTDOWN_TIMEOUT = 6.0
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
        self._kept = KeptState()  # a pilot who has taken the own face off the tablet does not come back unasked
        self._own = self._kept.switch("on_tablet", bool(rospy.get_param("~show_on_tablet", True)), quiet=False)
        self.camera = Camera(
            str(rospy.get_param("~source", "0")),
            wanted=self._own,
            width=int(rospy.get_param("~width", 640)),
            height=int(rospy.get_param("~height", 480)),
            rate=float(rospy.get_param("~rate", 30.0)),
            quality=int(rospy.get_param("~quality", 80)),
        )
        token = str(rospy.get_param("~token", "auto"))
        if token == "auto":
            token = page_key(KEY_VARIABLE)
        key = None if token in ("none", "") else token
        self.stream = MjpegStream(self.camera.image, max_viewers=int(rospy.get_param("~max_viewers", 64)))
        self._looking: tuple[str, ...] = ()
        app = create_app(
            self.stream,
            name=name,
            describe=self._describe,
            looking=self._who_looks,
            token=key,
            hosts=(own,) if own else (),
        )
        self.server = WebServer(app, address, int(rospy.get_param("~port", ports.TABLET_PAGE)))
        page_url = str(rospy.get_param("~page_url", ""))
        asked = self.server.address if page_url else address_for_tablet(self.server.address, own, robot)
        if asked != self.server.address:
            page_url = f"http://{asked}:{self.server.port}/"
        page_url = page_url or self.server.url
        if key and "k=" not in urllib.parse.urlsplit(page_url).query:
            page_url += ("&" if "?" in page_url else "?") + urllib.parse.urlencode({"k": key})
        self.page_url = page_url
        login = os.environ.get("NAO_USER"), os.environ.get("NAO_PASSWORD")
        self.connection = Connection(Address.parse(robot, int(rospy.get_param("~nao_port", 9559)), *login))
        self.link = TabletLink(
            self.connection, page_url, wanted=self._own, activity=str(rospy.get_param("~activity", ACTIVITY) or "")
        )
        # A run that has died may have left somebody else's page on the tablet.
        self.link.may_be_there = self._kept.switch("may_be_there", False, quiet=True)
        self._linked = self._closed = False
        self._arranging = threading.Lock()
        self._pilot_page = rospy.Subscriber("looking", String, self._on_looking, queue_size=1)
        self._status = rospy.Publisher("~status", DiagnosticStatus, queue_size=1, latch=True)
        self._diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=10)
        self._visited = time.monotonic()  # when the tablet had last no reason to ask for the picture, or asked
        self._unvisited = False

    def run(self) -> int:
        """Run until the node is shut down; return the exit code."""
        return self._kept.forget_after(self._node.run(self._loop))

    def _loop(self) -> None:
        try:
            self.start()
            for _ in self._node.cycles(STATUS_PERIOD, ROBOT_PATIENCE):
                self.report()
        finally:
            self.close()

    def start(self) -> None:
        """Begin to serve the page, and to film and to show it on the tablet if that is wanted."""
        self.camera.start()
        self.server.start()
        rospy.loginfo("the page is at %s", public(self.page_url))
        if public(self.page_url) != self.page_url and not was_announced(self.page_url):
            # To the terminal only: everybody on the ROS network can read /rosout, and standard output may be a file.
            print(f"with its key, for another browser: {self.page_url}", file=sys.stderr, flush=True)
        self._arrange()
        self._record()
        rospy.Service("~show_on_tablet", SetBool, self._switch)
        rospy.Subscriber("~face", CompressedImage, self._on_face, queue_size=1, buff_size=2**20, tcp_nodelay=True)

    def close(self) -> None:
        """End everything within three seconds, whatever the robot and the camera do."""
        with self._arranging:
            self._closed = True
        remove_record(self.connection.address)
        self.link.close()
        self.connection.close()
        self.server.close()
        self.camera.close()

    def report(self) -> None:
        """Publish how things stand, once the tablet was told to load the page anew if it needs that."""
        self._keep()
        self._arrange()
        self._reload_unvisited_page()
        camera, link = self.camera.status, self.link
        messages = [camera.text]
        as_wanted = camera.state is State.LIVE or not self.camera.wanted
        level = DiagnosticStatus.OK if as_wanted else DiagnosticStatus.WARN
        messages.append(self._describe_tablet())
        if link.wanted and (link.shown_since is None or self._unvisited):
            level = DiagnosticStatus.WARN
        values = {
            "page": public(self.page_url),
            "camera": camera.source,
            "state": camera.state.value,
            "size": f"{camera.width}x{camera.height}",
            "rate": f"{camera.rate:.1f}",
            "losses": camera.losses,
            "viewers": self.stream.viewers,
            "on tablet": link.shown_since is not None,
            "wanted on tablet": link.wanted,
            "focus": _describe_focus(link.focus),
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

    def _who_looks(self) -> tuple[str, ...]:
        # A page that has died says nothing more.
        return self._looking if self._pilot_page.get_num_connections() else ()

    def _on_looking(self, message: String) -> None:
        names = (clean(line)[:LONGEST_NAME] for line in message.data.split("\n"))
        self._looking = tuple(filter(None, names))[:MOST_NAMES]

    def _reload_unvisited_page(self) -> None:
        """Have the tablet load the page anew when it should show it and has not asked for the picture for long."""
        now, known = time.monotonic(), self._unvisited
        if self.link.shown_since is None or self.stream.viewers > 0:
            self._visited = now
        self._unvisited = now - self._visited > VISIT_PATIENCE
        if not self._unvisited:
            return
        self.link.reload()
        if not known:
            rospy.logwarn(
                "the tablet was told to show %s and does not ask for the picture. It uses its own Wi-Fi: can it "
                "reach this address? If not, give page_address or ~page_url.",
                public(self.page_url),
            )

    def _describe_tablet(self) -> str:
        link = self.link
        if link.shown_since is None:
            return f"not on the tablet: {link.problem if link.wanted else 'switched off'}"
        text = "the tablet does not ask for the picture" if self._unvisited else "on the tablet"
        return f"{text}; without the robot's focus: {link.focus.problem}" if link.focus.problem else text

    def _arrange(self) -> None:
        """Show the page for whoever wants it: this machine's pilot, or one elsewhere whose face comes. Only for the
        former this machine's camera is opened."""
        with self._arranging:
            if self._closed:
                return
            face, link = self.camera.shows_elsewhere, self.link
            self.camera.film(self._own)
            wanted = self._own or face
            if (wanted or link.may_be_there) and not self._linked:
                self._start_link()
            if wanted != link.wanted:
                link.show(wanted)
                self._record()

    def _start_link(self) -> None:
        self._linked = True
        self.connection.start()
        self.link.start()

    def _record(self) -> None:
        try:
            PageRecord(self.page_url, self.link.wanted, os.getpid()).write(self.connection.address)
        except OSError as error:
            rospy.logwarn("main.py will not find this page: %s", error)

    def _keep(self) -> None:
        self._kept.keep(lambda: {"on_tablet": self._own, "may_be_there": self.link.may_be_there})

    def _on_face(self, message: CompressedImage) -> None:
        try:
            self.camera.show(message.data, message.header.stamp.to_sec())
        except ValueError as error:
            rospy.logwarn_throttle(10.0, "~face: %s", error)
        else:
            self._arrange()

    def _switch(self, request: SetBoolRequest) -> SetBoolResponse:
        self._own = request.data
        self._arrange()
        self._keep()
        return SetBoolResponse(True, self._describe_tablet())


def _describe_focus(focus: RobotFocus) -> str:
    if focus.needless:
        return "not needed: autonomous life is off"
    return focus.activity if focus.held else focus.problem


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
    status = com_cam.run()
    print("Exit", flush=True)
    return status
