"""The link to one robot: turns topics into Qt signals and calls into messages.

Nothing in it blocks Qt's thread: the node's own thread (`gui.ros.node`) makes all calls to the master, and each service
call has a thread of its own.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import rosgraph
import roslib.message
import rospy
from PyQt5.QtCore import QCoreApplication, QEvent, QObject, Qt, QTimer, pyqtSignal
from telepresence_ros.transforms import Transforms

from gui.robots import Robot
from gui.ros.channels import Answer, Channel, Incoming, Offered, Outgoing
from gui.ros.link_state import LinkState
from gui.ros.node import NODE, Graph, RosNode
from telepresence.security.outside_text import clean
from telepresence.station.ros_master import ANONYMOUS

log = logging.getLogger(__name__)

FIND_TIMEOUT = 1.0
"""[s] that finding a service may take."""
BUFFER = 1 << 22
"""[B]; more than one picture, or old pictures would queue in the socket."""


class RosLink(QObject):
    """The link to one robot.

    Args:
        node: The window's node.
        robot: Which topics and services the robot has.
    """

    state_changed = pyqtSignal(object)
    """The `LinkState` has changed."""
    looked = pyqtSignal()
    """The master was asked anew; `state` is what it said."""
    trouble = pyqtSignal(str)
    """A message for the pilot."""

    _polled = pyqtSignal(object)
    _answered = pyqtSignal(object, object)

    def __init__(self, node: RosNode, robot: Robot) -> None:
        super().__init__()
        self.robot = robot
        self.state = LinkState(node.master_uri)
        self._node = node
        self._channels = {row.channel: Channel(row) for row in robot.incoming}
        self._outgoing: dict[str, Outgoing] = {row.channel: row for row in robot.outgoing}
        self._offered: dict[str, Offered] = {row.name: row for row in robot.services}
        self._publishers: dict[str, rospy.Publisher] = {}
        self._subscribers: dict[str, rospy.Subscriber] = {}
        self._unknown: set[str] = set()
        self._patient: list[threading.Thread] = []
        self._transforms = Transforms(robot.namespace, _subscribe_all)
        self._open = True
        self._found: frozenset[str] = frozenset()
        queued = Qt.ConnectionType.QueuedConnection
        self._polled.connect(self._on_polled, queued)  # type: ignore[call-arg]  # PyQt5's stub
        self._answered.connect(lambda then, answer: then(answer), queued)  # type: ignore[call-arg]  # PyQt5's stub
        for channel in self._channels.values():
            channel.trouble.connect(self.trouble)
        node.links.append(self)

    @property
    def node_name(self) -> str:
        """The name of the window's node."""
        return self._node.name

    def publishers(self, name: str) -> int:
        """Return with how many publishers of a channel this window is connected: one that is killed drops out at once,
        while the master lists it until somebody tells it."""
        subscriber = self._subscribers.get(name)
        return subscriber.get_num_connections() if subscriber is not None else 0

    def set_open(self, wanted: bool) -> None:
        """Receive and send, or do neither because nobody has signed in."""
        self._open = wanted
        self._node.poll_now()

    @property
    def feed(self) -> str:
        """The camera topic."""
        return self._resolve(self.channel("picture").row.topic)

    @property
    def essential(self) -> tuple[str, ...]:
        """The topics by which the window judges whether the robot's programs run."""
        return self._resolve(self.robot.cmd_vel), self.feed

    @property
    def found(self) -> frozenset[str]:
        """The channels that somebody publishes."""
        return self._found

    def look_now(self) -> None:
        """Ask the master at once who runs, sooner than usual."""
        self._node.poll_now()

    def tidy_master(self, seconds: float) -> None:
        """See `RosNode.tidy_master`."""
        self._node.tidy_master(seconds)

    def channel(self, name: str) -> Channel:
        """Return the incoming channel of this name in the robot's table.

        Raises:
            KeyError: It has none.
        """
        return self._channels[name]

    def has(self, name: str) -> bool:
        """Whether the robot has a channel or service of this name."""
        return name in self._channels or name in self._outgoing or name in self._offered

    def watch(self, name: str, wanted: bool) -> None:
        """Subscribe to a channel as soon as possible, or unsubscribe."""
        self._channels[name].wanted = wanted
        self._node.poll_now()

    def resolve(self, name: str) -> str:
        """Return the full name of a topic or service of this robot."""
        return self._resolve(name)

    def service_name(self, name: str) -> str:
        """Return the full name of the service of this name in the robot's table."""
        return self._resolve(self._offered[name].service)

    def place_of(self, frame: str, seen_from: str, stamp: float) -> tuple[np.ndarray, np.ndarray]:
        """See `Transforms.place_of`."""
        return self._transforms.place_of(frame, seen_from, stamp)

    def change_topic(self, name: str, topic: str) -> None:
        """Receive a channel from another topic from now on."""
        channel = self._channels[name]
        channel.row = replace(channel.row, topic=topic)
        self._node.poll_now()

    def send(self, name: str, *values: object) -> bool:
        """Publish a message; return whether that was possible."""
        publisher = self._publishers.get(name) if self._open else None
        if publisher is None:
            return False
        message = publisher.data_class()
        self._outgoing[name].fill(message, *values)
        try:
            publisher.publish(message)
        except rospy.ROSException as error:
            log.warning("%s was not sent: %s", name, error)
            return False
        self._node.note_sent()
        return True

    def is_heard(self, name: str) -> bool:
        """Return whether anybody subscribes to what is sent by this name, as far as this window is connected."""
        publisher = self._publishers.get(name)
        return publisher is not None and publisher.get_num_connections() > 0

    def call(
        self,
        name: str,
        *values: object,
        then: Callable[[Answer], None] = lambda answer: None,
        patient: bool = False,
        signed_out: bool = False,
    ) -> None:
        """Call a service; `then` gets the answer on Qt's thread, at the latest when the timeout is over.

        Args:
            patient: Whatever the timeout, wait until the call has ended: a frozen program carries it out late.
            signed_out: Call it even when nobody has signed in, to end what somebody had begun.
        """
        row = self._offered[name]
        settled: list[Answer] = []

        def settle(answer: Answer) -> None:
            if not settled:
                settled.append(answer)
                then(answer)

        if not (self._open or signed_out):
            QTimer.singleShot(0, lambda: settle(_failed("Sign in first.")))
            return
        if not self._node.joined:
            QTimer.singleShot(0, lambda: settle(_failed("There is no ROS master. Press Roscore start.")))
            return
        if not patient:
            late = _failed(f"{row.service} did not answer within {row.timeout:g} s.")
            QTimer.singleShot(round(1000 * row.timeout), lambda: settle(late))
        work = lambda: self._answered.emit(settle, self._call(row, values))  # noqa: E731
        thread = threading.Thread(target=work, name=f"call-{name}", daemon=True)
        thread.start()
        if patient:
            self._patient = [one for one in self._patient if one.is_alive()] + [thread]

    def finish(self, timeout: float) -> None:
        """Wait until patient calls have ended, and what is called because of their answers: at most `timeout` seconds,
        on Qt's thread, whose loop does not run any more."""
        deadline = time.monotonic() + timeout
        while self._patient and time.monotonic() < deadline:
            for thread in self._patient:
                thread.join(max(0.0, deadline - time.monotonic()))
            self._patient = [one for one in self._patient if one.is_alive()]
            QCoreApplication.sendPostedEvents(None, QEvent.Type.MetaCall)

    def _call(self, row: Offered, values: tuple) -> Answer:
        """Make the call; on a thread of its own."""
        service, kind = self._resolve(row.service), roslib.message.get_service_class(row.kind)
        if kind is None:
            return _failed(f"The service type {row.kind} is not built. Run  ./stack build")
        try:
            rospy.wait_for_service(service, timeout=FIND_TIMEOUT)
            request = kind._request_class()
            row.fill(request, *values)
            return row.read(rospy.ServiceProxy(service, kind)(request))
        except rospy.ServiceException as error:
            return _failed(f"{service} failed: {clean(error)}.")
        except rospy.ROSException:
            return _failed(f"No program offers {service}: it is not running, or not ready yet.")
        except Exception as error:  # whoever waits for the answer must get one
            log.exception("the call of %s failed", service)
            return _failed(f"{service} failed: {clean(error)}.")

    def _resolve(self, name: str) -> str:
        return rosgraph.names.resolve_name(name, rosgraph.names.ns_join(self.robot.namespace, NODE))

    # --- the node's thread ---

    def advertise(self) -> None:
        """Advertise all outgoing topics; to be called when the graph has been joined."""
        for row in self._outgoing.values():
            kind = self._message_class(row.kind)
            if kind is not None:
                self._publishers[row.channel] = rospy.Publisher(
                    self._resolve(row.topic), kind, headers=row.headers, queue_size=1
                )

    def update(self, graph: Graph | None) -> None:
        """Subscribe to what is wanted, and report the state of the graph. This calls the master and may block, so it
        must not run on Qt's thread."""
        if graph is not None:
            self._transforms.listen(self._open)
            for name, channel in self._channels.items():
                subscriber = self._subscribers.get(name)
                if subscriber is not None and subscriber.name != self._resolve(channel.row.topic):
                    self._subscribers.pop(name).unregister()
                wanted = channel.wanted and self._open
                if wanted and name not in self._subscribers:
                    self._subscribe(name, channel)
                elif not wanted and name in self._subscribers:
                    self._subscribers.pop(name).unregister()
        self._polled.emit(self._state_of(graph))

    def lose_master(self) -> None:
        """Report that the master has not answered lately."""
        self._polled.emit(self._state_of(None))

    def _subscribe(self, name: str, channel: Channel) -> None:
        row: Incoming = channel.row
        kind = self._message_class(row.kind)
        if kind is not None:
            self._subscribers[name] = rospy.Subscriber(
                self._resolve(row.topic), kind, channel.post, queue_size=row.queue, buff_size=BUFFER, tcp_nodelay=True
            )

    def _message_class(self, name: str) -> type | None:
        kind = roslib.message.get_message_class(name)
        if kind is None and name not in self._unknown:
            self._unknown.add(name)
            log.warning("the message type %s is not built; run  ./stack build", name)
        return kind

    def _state_of(self, graph: Graph | None) -> LinkState:
        if graph is None:
            self._found = frozenset()
            return LinkState(self._node.master_uri)
        publishers, subscribers, _ = graph
        self._found = frozenset(
            name for name, channel in self._channels.items() if publishers.get(self._resolve(channel.row.topic))
        )
        cmd_vel = self._resolve(self.robot.cmd_vel)
        # A keyboard node also subscribes, to know when another input drives; a driver does not publish.
        drivers = set(subscribers.get(cmd_vel, ())) - set(publishers.get(cmd_vel, ()))
        return LinkState(
            self._node.master_uri,
            master=True,
            joined=self._node.joined,
            unsupervised=self._node.unsupervised,
            driver=any(not ANONYMOUS.search(name) for name in drivers),
            keyboards=frozenset(name for names in publishers.values() for name in names if "keyboard" in name),
            feed=bool(publishers.get(self.feed)),
            robot_camera=bool(publishers.get(self._resolve(self.robot.robot_camera))),
        )

    # --- Qt's thread ---

    def _on_polled(self, state: LinkState) -> None:
        if state != self.state:
            self.state = state
            self.state_changed.emit(state)
        self.looked.emit()


def _failed(text: str) -> Answer:
    return Answer(False, text, arrived=False)


def _subscribe_all(topic: str, kind: type, callback: Callable, extra: str) -> rospy.Subscriber:
    """Subscribe without losing messages of a burst; `callback` gets each message and `extra`."""
    return rospy.Subscriber(topic, kind, callback, callback_args=extra, queue_size=100)
