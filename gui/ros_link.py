"""The window's node in the ROS graph: topics become Qt signals and the other way round.

The only file here that imports ROS. Nothing in it makes Qt wait: a thread looks for the master and joins the graph when
there is one; pictures wait in a slot that holds one.
"""

from __future__ import annotations

import http.client
import logging
import math
import re
import threading
import time
import xmlrpc.client
from dataclasses import replace

import rosgraph
import rospy
from geometry_msgs.msg import Twist
from PyQt5.QtCore import QObject, Qt, pyqtSignal
from sensor_msgs.msg import Image

from gui.link_state import LinkState
from gui.picture import Picture
from telepresence.images import read_image_message
from telepresence.ros_master import MasterWatch, master_proxy

log = logging.getLogger(__name__)

NODE = "gui_ros_node"
KEYBOARD_NODE = "/teleop_twist_keyboard"
LOOK_PERIOD = 0.5
LOOK_TIMEOUT = 1.0
_TOOL = re.compile(r"_\d+(_\d+)?$")  # anonymous names: rostopic, keyboards, a person's scripts


def without_remappings(argv: list[str]) -> list[str]:
    """The arguments, less those that roslaunch adds for ROS (`__name:=...`)."""
    return rospy.myargv(argv)


class RosLink(QObject):
    """Joins the graph when there is one.

    Args:
        feed: The camera topic, sensor_msgs/Image.
        cmd_vel: The topic to drive on, geometry_msgs/Twist.
    """

    state_changed = pyqtSignal(object)
    """LinkState, on every change."""
    picture = pyqtSignal(object)
    """Picture: the newest, never one that was overtaken."""
    trouble = pyqtSignal(str)
    """A sentence for the pilot."""
    ended = pyqtSignal(str)
    """ROS wants this node to end (rosnode kill, a second window); why."""

    _looked = pyqtSignal(object)
    _arrived = pyqtSignal()

    def __init__(self, feed: str, cmd_vel: str = "cmd_vel") -> None:
        super().__init__()
        self.feed = feed
        self._cmd_vel = cmd_vel
        self.state = LinkState(rosgraph.get_master_uri())
        self._closing = threading.Event()
        self._wake = threading.Event()
        self._thread = threading.Thread(target=self._run, name="ros-link", daemon=True)
        self._joined = False
        self._watching = False
        self._driven_at = -math.inf
        self._publisher: rospy.Publisher | None = None
        self._subscriber: rospy.Subscriber | None = None
        self._lock = threading.Lock()
        self._newest: tuple[Image, float] | None = None
        self._complaint = ""
        self._looked.connect(self._on_looked, Qt.QueuedConnection)
        self._arrived.connect(self._on_arrived, Qt.QueuedConnection)

    def start(self) -> None:
        self._thread.start()

    def watch(self, wanted: bool) -> None:
        """Subscribe to the camera topic as soon as possible, or stop doing so."""
        self._watching = wanted
        self._wake.set()

    def drive(self, vx: float, vy: float, wz: float) -> None:
        """Publish one command on cmd_vel, if the graph has been joined.

        Args:
            vx, vy: Forward and left [m/s].
            wz: Counter-clockwise [rad/s].
        """
        if self._publisher is None:
            return
        message = Twist()
        message.linear.x, message.linear.y, message.angular.z = vx, vy, wz
        try:
            self._publisher.publish(message)
            self._driven_at = time.monotonic()
        except rospy.ROSException as error:
            log.warning("the command was not sent: %s", error)

    def close(self) -> None:
        """Leave the graph; at most a few seconds, also when the master hangs."""
        self._closing.set()
        self._wake.set()
        self._thread.join(timeout=2.0 * LOOK_TIMEOUT)
        if not self._joined:
            return
        if time.monotonic() - self._driven_at < 0.5:
            time.sleep(0.05)  # rospy sends from a thread of its own; the last command is a zero
        farewell = threading.Thread(target=rospy.signal_shutdown, args=["the window was closed"], daemon=True)
        farewell.start()
        farewell.join(timeout=2.0)

    # --- the link's own thread ---

    def _run(self) -> None:
        while not self._closing.is_set():
            state = self._look()
            if state.master and not self._joined:
                try:
                    self._join()
                except rospy.ROSException as error:
                    self.trouble.emit(f"The window cannot join the ROS graph: {error}. Start it again.")
                    return
                state = replace(state, joined=True)
            if state.master:
                self._follow_wish()
            self._looked.emit(state)
            self._wake.wait(LOOK_PERIOD)
            self._wake.clear()

    def _look(self) -> LinkState:
        uri = self.state.master_uri
        try:
            code, _, graph = master_proxy(uri, LOOK_TIMEOUT).getSystemState(f"/{NODE}")
        except (OSError, http.client.HTTPException, xmlrpc.client.Error):
            return LinkState(uri)
        if code != 1:
            return LinkState(uri)
        publishers, subscribers, _ = (dict(group) for group in graph)
        cmd_vel = rosgraph.names.resolve_name(self._cmd_vel, f"/{NODE}")
        # Keyboards listen as well, to know when another input drives; a driver only listens.
        drivers = set(subscribers.get(cmd_vel, ())) - set(publishers.get(cmd_vel, ()))
        return LinkState(
            uri,
            master=True,
            joined=self._joined,
            driver=any(not _TOOL.search(name) for name in drivers),
            keyboard=KEYBOARD_NODE in publishers.get(cmd_vel, ()),
            feed=bool(publishers.get(rosgraph.names.resolve_name(self.feed, f"/{NODE}"))),
        )

    def _join(self) -> None:
        rospy.init_node(NODE, disable_signals=True)
        rospy.core.add_preshutdown_hook(self._on_ros_shutdown)
        self._publisher = rospy.Publisher(self._cmd_vel, Twist, queue_size=1)
        MasterWatch(rospy).start()
        self._joined = True

    def _follow_wish(self) -> None:
        """Registering asks the master and so may wait for it: not for Qt's thread."""
        if self._watching and self._subscriber is None:
            self._subscriber = rospy.Subscriber(self.feed, Image, self._on_image, queue_size=1)
        elif not self._watching and self._subscriber is not None:
            self._subscriber.unregister()
            self._subscriber = None

    # --- rospy's threads ---

    def _on_image(self, message: Image) -> None:
        with self._lock:
            announced = self._newest is not None
            self._newest = (message, time.monotonic())
        if not announced:
            self._arrived.emit()

    def _on_ros_shutdown(self, reason: str) -> None:
        if not self._closing.is_set():
            self.ended.emit(reason)

    # --- Qt's thread ---

    def _on_looked(self, state: LinkState) -> None:
        if state != self.state:
            self.state = state
            self.state_changed.emit(state)

    def _on_arrived(self) -> None:
        with self._lock:
            newest, self._newest = self._newest, None
        if newest is None or not self._watching:
            return
        message, arrived = newest
        try:
            pixels = read_image_message(message)
        except ValueError as error:
            self._complain(f"{self.feed} sends pictures that cannot be read: {error}.")
            return
        self.picture.emit(Picture(pixels, message.encoding, message.header.stamp.to_sec(), arrived))

    def _complain(self, text: str) -> None:
        if text != self._complaint:
            self._complaint = text
            self.trouble.emit(text)
