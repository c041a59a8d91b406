"""Commands that were given before this program listened, or before a connection broke.

A latched publisher, as every `rostopic pub` without `-r` is, sends its last message to whoever connects anew, for as
long as it lives. For a state that is right. A command would be carried out once more, an hour later, by a driver that
has just been started again.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import rospy

MOST_SENDERS = 1000
"""Names that are remembered: each `rostopic pub` has one of its own."""


class PastCommands:
    """Tells the past commands of a topic from the present ones. Make one before subscribing to the topic.

    Its first message is past when a sender's connection is latched, and the sender was there before us or had another
    connection before. Whoever begins later means what he sends.
    """

    def __init__(self, topic: str) -> None:
        self._lock = threading.Lock()  # every connection has a thread
        name = rospy.resolve_name(topic)
        publishers = rospy.get_master().getSystemState()[2][0]
        self._connections: dict[str, Any] = {
            sender: None for published, senders in publishers if published == name for sender in senders
        }
        """Sender -> the header of its newest connection: rospy puts the same object on every message."""

    def is_past(self, message: Any) -> bool:
        """Return whether this message was sent before its connection. Call it for every message of the topic."""
        header = message._connection_header
        if header.get("latching") != "1":
            return False
        sender = header.get("callerid", "")
        with self._lock:
            known = sender in self._connections
            newest = self._connections.pop(sender, None)
            self._connections[sender] = header  # the last one in the dictionary, which forgets its first one
            if len(self._connections) > MOST_SENDERS:
                del self._connections[next(iter(self._connections))]
        return known and newest is not header


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
