"""The window's node in the ROS graph.

A thread of its own polls for the master, joins the graph when there is one and makes all calls to the master, so that
nothing blocks Qt's thread.
"""

from __future__ import annotations

import http.client
import logging
import math
import threading
import time
import xmlrpc.client
from typing import Any, Protocol, cast

import rosgraph
import rospy
from PyQt5.QtCore import QObject, pyqtSignal
from telepresence_ros.logs import close_log_folder, log_without_master
from telepresence_ros.master_watch import MasterWatch
from telepresence_ros.single_connections import connect_once
from telepresence_ros.sockets import narrow_sockets

from gui.ros.supervisors import Supervisors
from telepresence.security.outside_text import clean
from telepresence.station.ros_master import ended_nodes, forget_nodes, master_proxy

log = logging.getLogger(__name__)

NODE = "gui_ros_node"
POLL_PERIOD = 0.5
POLL_TIMEOUT = 1.0
Graph = list[dict[str, list[str]]]
"""Publishers, subscribers and services: name -> nodes."""


def without_remappings(argv: list[str]) -> list[str]:
    """Return the arguments without those that roslaunch adds for ROS (`__name:=...`)."""
    return rospy.myargv(argv)


class Link(Protocol):
    """What the node tells about the graph (`gui.ros.link.RosLink`)."""

    @property
    def essential(self) -> tuple[str, ...]:
        """The topics by which the window judges whether the robot's programs run."""

    def advertise(self) -> None:
        """Advertise what is sent: the graph has been joined."""

    def update(self, graph: Graph | None) -> None:
        """Take the graph as the master knows it; None without a master."""

    def lose_master(self) -> None:
        """Take note that the master has not answered lately."""


class RosNode(QObject):
    """The window's node, shared by the links to its robots. They must be made before `start`."""

    trouble = pyqtSignal(str)
    """A message for the pilot."""
    ended = pyqtSignal(str)
    """ROS has shut this node down (rosnode kill); the reason."""

    def __init__(self) -> None:
        super().__init__()
        self.master_uri = rosgraph.get_master_uri()
        self.name = f"/{NODE}"
        self.joined = False
        self.unsupervised = False
        """The roslaunch that started the robot's programs was killed."""
        self.links: list[Link] = []
        self._sent_at = self._tidy_until = -math.inf
        self._watch: MasterWatch | None = None
        self._supervisors = Supervisors()
        self._closing = threading.Event()
        self._wake = threading.Event()
        self._thread = threading.Thread(target=self._run, name="ros-link", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def poll_now(self) -> None:
        """Poll at once: what the window wants to receive has changed."""
        self._wake.set()

    def tidy_master(self, seconds: float) -> None:
        """Have the master forget, for `seconds`, every node whose process has ended without signing off."""
        self._tidy_until = time.monotonic() + seconds
        self._wake.set()

    def note_sent(self) -> None:
        self._sent_at = time.monotonic()

    def close(self) -> None:
        """Leave the graph; takes a few seconds at most, even when the master hangs."""
        self._closing.set()
        self._wake.set()
        self._thread.join(timeout=2.0 * POLL_TIMEOUT)
        if not self.joined:
            return
        if time.monotonic() - self._sent_at < 0.5:
            time.sleep(0.05)  # rospy sends from a thread of its own; the last command is a zero
        farewell = threading.Thread(target=rospy.signal_shutdown, args=["the window was closed"], daemon=True)
        farewell.start()
        farewell.join(timeout=2.0)

    # --- the node's own thread ---

    def _run(self) -> None:
        while not self._closing.is_set():
            graph = self._poll()
            if graph is not None and not self.joined:
                try:
                    self._join()
                except rospy.ROSException as error:
                    self.trouble.emit(f"The window cannot join the ROS graph: {clean(error)}. Start it again.")
                    return
            if self._watch is not None and not self._watch.alive:
                graph = None  # the answer is older than that, or the node is not registered yet
            for link in self.links:
                link.update(graph)
            self._wake.wait(POLL_PERIOD)
            self._wake.clear()

    def _poll(self) -> Graph | None:
        """Return the graph as the master knows it; None without a master."""
        try:
            reply: Any = master_proxy(self.master_uri, POLL_TIMEOUT).getSystemState(self.name)
            self.unsupervised = self._supervisors.lost(self.master_uri, self.name, POLL_TIMEOUT)
        except (OSError, http.client.HTTPException, xmlrpc.client.Error):
            return None
        code, _, graph = reply
        return self._running([dict(group) for group in graph]) if code == 1 else None

    def _running(self, graph: Graph) -> Graph:
        """Return the graph without nodes that the master lists although their process has ended."""
        tidy = time.monotonic() < self._tidy_until
        topics = {name for link in self.links for name in link.essential}
        looked_at = {
            node for group in graph for name, nodes in group.items() if tidy or name in topics for node in nodes
        } - {self.name, "/rosout"}
        try:
            ended = ended_nodes(self.master_uri, looked_at, self.name, POLL_TIMEOUT)
            if tidy and ended:
                log.warning("the master still listed nodes that have ended: %s", ", ".join(sorted(ended)))
                forget_nodes(self.master_uri, ended, self.name, POLL_TIMEOUT)
        except (OSError, http.client.HTTPException, xmlrpc.client.Error) as error:
            log.info("the master does not say which nodes run: %s", error)
            return graph
        return [
            {name: [node for node in nodes if node not in ended] for name, nodes in group.items()} for group in graph
        ]

    def _join(self) -> None:
        close_log_folder()
        narrow_sockets()
        connect_once()
        # ROS ends the older of two nodes with one name, so a second window takes an anonymous name.
        rospy.init_node(NODE, anonymous=self._is_taken(), disable_signals=True)
        log_without_master()
        self.name = rospy.get_name()
        rospy.core.add_preshutdown_hook(self._on_ros_shutdown)
        self._watch = MasterWatch(self._on_master_lost, self.poll_now).start()
        for link in self.links:
            link.advertise()
        self.joined = True

    def _is_taken(self) -> bool:
        """Whether a node of our name is running; the master also lists ones that were killed."""
        try:
            code, _, uri = cast(Any, master_proxy(self.master_uri, POLL_TIMEOUT).lookupNode(self.name, self.name))
            if code != 1:
                return False
            return bool(cast(Any, master_proxy(uri, POLL_TIMEOUT).getPid(self.name))[0] == 1)
        except (OSError, http.client.HTTPException, xmlrpc.client.Error):
            return False

    def _on_master_lost(self) -> None:
        """The watch notices a master that is frozen sooner than a poll, which waits for its answer."""
        if not self._closing.is_set():
            for link in self.links:
                link.lose_master()

    def _on_ros_shutdown(self, reason: str) -> None:
        if not self._closing.is_set():
            self.ended.emit(clean(reason))
