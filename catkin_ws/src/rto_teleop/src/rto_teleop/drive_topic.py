"""Where a program's velocities go: through the safety gate, wherever it runs, else to the driver itself.

A gate is a node that subscribes to safe_cmd_vel and publishes safety: safe_omni_drive on the pilot's machine, or
rto_drive_link, whose gate runs on the robot. `find_route` and `next_route` have no ROS in them.
"""

from __future__ import annotations

import re
import threading
from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple

import rosgraph
import rospy
from geometry_msgs.msg import Twist
from std_msgs.msg import String

from telepresence.geometry import Velocity
from telepresence.security.outside_text import LONGEST_LOG, clean
from telepresence.station.ros_master import topics_of

GATED, UNGATED = "safe_cmd_vel", "cmd_vel"
LOOK_PERIOD = 1.0
"""Seconds between two looks at who listens."""
MASTER_TIMEOUT = 1.0
"""Seconds within which the master must answer."""
_TOOL = re.compile(r"/(rostopic_|record_|rqt_|rviz)")
"""Nodes that listen to velocities and move nothing."""

Graph = tuple[Mapping[str, Iterable[str]], Mapping[str, Iterable[str]]]
"""Publishers and subscribers: topic -> nodes."""


class Route(NamedTuple):
    """Where to publish.

    Args:
        listeners: The nodes that move a robot by this topic; none if nothing would move.
        gated: They are a safety gate; without listeners: none but a gate will do.
        others: The namespaces that one must choose from, when there are several.
    """

    topic: str
    listeners: tuple[str, ...] = ()
    gated: bool = False
    others: tuple[str, ...] = ()

    def describe(self, program: str) -> str:
        """Return a sentence for the pilot about a program, such as "rto_teleop rto_teleop_keyboard"."""
        if self.listeners:
            through = "through the safety gate of" if self.gated else "WITHOUT a safety gate, to"
            return f"Drives on {self.topic}, {through} {', '.join(self.listeners)}."
        if self.others:
            choices = "  or  ".join(f"rosrun {program} __ns:={namespace}" for namespace in self.others)
            return f"Several robots are here, so nothing moves. Say which one:  {choices}"
        return (
            f"Nobody listens to {self.topic}, so nothing moves. Start the robot's programs:  ./stack up robotino  or  "
            "roslaunch rto_bringup rto.launch hostname:=ADDRESS"
        )


def find_route(own: str, graph: Graph, gate: bool = True) -> Route:
    """Return where velocities that are meant for the topic `own` go.

    In the root namespace, where a program lands that was started by rosrun alone, the only robot there is counts.

    Args:
        own: safe_cmd_vel or cmd_vel with its namespace.
        gate: Look for a gate first, when it is cmd_vel.
    """
    publishers, subscribers = graph
    namespace, name = _split(own)

    def listeners(topic: str) -> tuple[str, ...]:
        # Keyboards and the lease listen to what they publish themselves; a driver does not.
        found = set(subscribers.get(topic, ())) - set(publishers.get(topic, ()))
        return tuple(sorted(node for node in found if not _TOOL.match(node)))

    def gates(topic: str) -> tuple[str, ...]:
        return tuple(node for node in listeners(topic) if node in _gates_beside(topic, publishers))

    found = {topic: gates(topic) for topic in subscribers if _split(topic)[1] == GATED} if gate else {}
    found = {topic: nodes for topic, nodes in found.items() if nodes}
    if namespace + GATED in found:
        return Route(namespace + GATED, found[namespace + GATED], gated=True)
    if namespace == "/" and len(found) == 1:
        return Route(*found.popitem(), gated=True)
    if listeners(own):
        return _route_on(own, listeners(own), graph)
    if namespace == "/" and found:
        return Route(own, gated=True, others=tuple(sorted(_split(topic)[0].rstrip("/") for topic in found)))
    drivers = {topic: listeners(topic) for topic in subscribers if _split(topic)[1] == name == UNGATED}
    drivers = {topic: nodes for topic, nodes in drivers.items() if nodes}
    if namespace == "/" and len(drivers) == 1:
        return _route_on(*drivers.popitem(), graph)
    return Route(own)


def next_route(before: Route, found: Route) -> Route:
    """Return where velocities go that went to `before`, now that `find_route` has found another route.

    A gate that has gone may be starting again: a key that is held meanwhile must drive neither past it nor another
    robot. So nobody listens until it is back; only a restart of the program leaves it.
    """
    leaves = not found.gated or (found.topic != before.topic and not found.others)
    return before._replace(listeners=()) if before.gated and leaves else found


class DriveTopic:
    """Publishes velocities where `find_route` says, and looks every second whether that has changed (`next_route`).

    Args:
        topic: safe_cmd_vel or cmd_vel. A remapping of it is obeyed to the letter, and so is ~gate (true), false for no
            gate.
        program: What a person types after rosrun.
        say: Called with each sentence for the pilot, from a thread too.
    Attributes:
        route: The present one.
    """

    def __init__(self, topic: str, program: str, say: Callable[[str], None]) -> None:
        self._own = rospy.resolve_name(topic)
        self._fixed = self._own != rosgraph.names.ns_join(rospy.get_namespace(), topic)
        self._gate = bool(rospy.get_param("~gate", True)) or topic == GATED
        self._program, self._say = program, say
        self._lock = threading.Lock()  # protects the publisher while it is exchanged
        self._hold = ""
        self._publisher: rospy.Publisher | None = None
        self._holds: rospy.Subscriber | None = None
        self.route = Route(self._own)
        self._take(self._find() or self.route)

    def watch(self, stop: threading.Event) -> None:
        """Follow changes until `stop` is set; for a thread of its own."""
        while not stop.wait(LOOK_PERIOD):
            found = self._find()
            route = self.route if found is None else next_route(self.route, found)
            if route != self.route:
                self._take(route)

    @property
    def problem(self) -> str:
        """Why nothing would move; empty while somebody listens."""
        return "" if self.route.listeners else clean(self.route.describe(self._program), LONGEST_LOG)

    @property
    def hold(self) -> str:
        """Why nobody may drive now, as drive_lease says; empty if somebody may."""
        # What a node said that is gone since does not count.
        return self._hold if self._holds is not None and self._holds.get_num_connections() else ""

    def publish(self, velocity: Velocity) -> None:
        """Publish a velocity of base_link.

        Raises:
            rospy.ROSException: The node is being shut down.
        """
        message = Twist()
        message.linear.x, message.linear.y, message.angular.z = velocity
        with self._lock:
            assert self._publisher is not None  # made by __init__
            self._publisher.publish(message)

    def _find(self) -> Route | None:
        """Return the route as the master knows it now; None if the master does not answer."""
        graph = topics_of(rosgraph.get_master_uri(), rospy.get_name(), MASTER_TIMEOUT)
        if graph is None:
            return None
        if self._fixed:
            nodes = set(graph[1].get(self._own, ())) - {rospy.get_name()}
            route = _route_on(self._own, tuple(sorted(nodes)), graph)
            return route._replace(gated=route.gated or _split(self._own)[1] == GATED)
        return find_route(self._own, graph, self._gate)

    def _take(self, route: Route) -> None:
        if self._publisher is None or route.topic != self.route.topic:
            made = rospy.Publisher(route.topic, Twist, queue_size=1)
            with self._lock:
                old, self._publisher = self._publisher, made
            if old is not None:
                old.unregister()
            if self._holds is not None:
                self._holds.unregister()
            self._hold = ""
            hold = f"{_split(route.topic)[0]}drive/hold"
            self._holds = rospy.Subscriber(hold, String, self._on_hold, queue_size=1, tcp_nodelay=True)
        self.route = route
        self._say(clean(route.describe(self._program), LONGEST_LOG))

    def _on_hold(self, message: String) -> None:
        self._hold = clean(message.data)


def _gates_beside(topic: str, publishers: Mapping[str, Iterable[str]]) -> set[str]:
    """Return the nodes that are safety gates of the robot that this topic drives."""
    return set(publishers.get(f"{_split(topic)[0]}safety", ()))


def _route_on(topic: str, listeners: tuple[str, ...], graph: Graph) -> Route:
    """Return the route on a topic that these nodes listen to. A gate that hears it, be it cmd_vel, is the only one that
    the driver obeys."""
    publishers, subscribers = graph
    hearing = tuple(sorted(_gates_beside(topic, publishers) & set(subscribers.get(topic, ()))))
    return Route(topic, hearing or listeners, gated=bool(hearing))


def _split(topic: str) -> tuple[str, str]:
    """Return namespace, with its last slash, and name."""
    head, slash, name = topic.rpartition("/")
    return head + slash, name
