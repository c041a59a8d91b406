"""Commands that were given before this program listened, or before a connection broke.

A latched publisher, as every `rostopic pub` without `-r` is, sends its last message to whoever connects anew, for as
long as it lives. For a state that is right. A command would be carried out once more, an hour later, by a driver that
has just been started again.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from typing import Any

import rospy
from rospy.impl import tcpros_pubsub
from rospy.impl.registration import Registration

MOST_SENDERS = 1000
"""Programs that are remembered: each `rostopic pub` is a new one."""
LATCHED_WITHIN = 2.0
"""Seconds after a connection's header within which a latched message has come: the publisher sends both at once."""


class DatedTransport(tcpros_pubsub.TCPROSTransport):  # type: ignore[misc]
    """rospy's connection; it remembers when the publisher's header came, which a frozen or distant one sends late."""

    header_at = -math.inf

    def read_header(self) -> None:
        super().read_header()
        self.header_at = time.monotonic()


tcpros_pubsub.TCPROSTransport = DatedTransport


class PastCommands:
    """Tells the past commands of a topic from the present ones. Make one before subscribing to the topic.

    A message is past when it is the first one of a latched connection and comes right after the connection's header,
    and its sender was there before us or had another connection before. Whoever begins later means what he sends, and
    so does who was there before us with nothing to repeat. Only who gives his first command within `LATCHED_WITHIN`
    cannot be told from one who repeats an old one.
    """

    def __init__(self, topic: str) -> None:
        self._lock = threading.Lock()  # every connection has a thread
        self._topic = rospy.resolve_name(topic)
        self._connections: dict[str, Any] = dict.fromkeys(self._publishers())
        """URI of a sender's node -> the header of its newest connection: rospy puts the same object on each message."""
        self._since = time.monotonic()

    def is_past(self, message: Any) -> bool:
        """Return whether this message was sent before its connection. Call it for every message of the topic."""
        header = message._connection_header
        if header.get("latching") != "1":
            return False
        link = self._link_of(header)
        sender = link.endpoint_id if link is not None else ""
        with self._lock:
            known = sender in self._connections
            newest = self._connections.pop(sender, None)
            self._connections[sender] = header  # the last one in the dictionary, which forgets its first one
            if len(self._connections) > MOST_SENDERS:
                del self._connections[next(iter(self._connections))]
        return known and newest is not header and self._comes_at_once(link)

    def _publishers(self) -> list[str]:
        """URIs of the nodes that publish the topic now: names say nothing, as a program's next run has the same."""
        master = rospy.get_master()
        names = [name for topic, names in master.getSystemState()[2][0] if topic == self._topic for name in names]
        return [uri for name in names if (uri := master.lookupNode(name)[2])]

    def _link_of(self, header: Any) -> Any:
        """The connection with this header; None if it is closed already."""
        # rospy's public interface does not say over which connection a message came.
        topic = rospy.topics.get_topic_manager().get_impl(Registration.SUB, self._topic)
        connections = (topic.connections if topic is not None else None) or ()
        return next((link for link in connections if link.header is header), None)

    def _comes_at_once(self, link: Any) -> bool:
        """Whether the connection is so new that what comes now may have been latched."""
        if link is None:
            return True
        # On a connection that another subscriber has opened, rospy repeats what was latched once we subscribe.
        return time.monotonic() - max(link.header_at, self._since) <= LATCHED_WITHIN


def subscribe_commands(
    topic: str, kind: type, callback: Callable[[Any], None], queue_size: int = 1
) -> rospy.Subscriber:
    """Subscribe to commands other than velocities; the callback gets no past one."""
    past = PastCommands(topic)

    def take(message: Any) -> None:
        if past.is_past(message):
            rospy.logwarn("%s: a command from before this program listened is not obeyed", rospy.resolve_name(topic))
        else:
            callback(message)

    return rospy.Subscriber(topic, kind, take, queue_size=queue_size, tcp_nodelay=True)
