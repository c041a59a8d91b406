"""Subscriptions that notice at once when the program that sent last has ended.

The kernel closes a program's connections when it dies, however it dies. rospy drops such a connection and says nothing,
so a driver would obey the last velocity until its command timeout is over: 0.25 to 0.5 s too long. Silence without a
closed connection (a frozen program, a cut network) stays with those timeouts.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from functools import partial
from typing import Any

import rospy
from geometry_msgs.msg import Twist

from telepresence_ros.other_senders import subscribe_to_others
from telepresence_ros.past_commands import PastCommands

log = logging.getLogger(__name__)

PERIOD = 0.05
"""Seconds between two looks whether the sender is still connected."""


class SenderWatch:
    """A subscription with a callback for the end of its sender. Make one after `rospy.init_node`.

    Args:
        topic, kind, callback, queue_size: As of `rospy.Subscriber`.
        on_end: Called, on a thread of its own, once the connection is closed over which the newest message came.
        matters: Whether the end of the sender of this message matters; by default always.
        accepts: Whether this message counts at all; by default always.
        others_only: This node publishes the topic, too, and does not listen to itself, see `subscribe_to_others`.
    """

    def __init__(
        self,
        topic: str,
        kind: type,
        callback: Callable[[Any], None],
        on_end: Callable[[], None],
        queue_size: int = 1,
        matters: Callable[[Any], bool] = lambda _message: True,
        accepts: Callable[[Any], bool] = lambda _message: True,
        others_only: bool = False,
    ) -> None:
        self._callback, self._on_end, self._matters, self._accepts = callback, on_end, matters, accepts
        self._lock = threading.Lock()  # protects _sender
        self._sender: object = None
        subscribe = subscribe_to_others if others_only else partial(rospy.Subscriber, tcp_nodelay=True)
        self._subscriber = subscribe(topic, kind, self._on_message, queue_size=queue_size)
        threading.Thread(target=self._watch, name=f"senders of {topic}", daemon=True).start()

    def _on_message(self, message: Any) -> None:
        if not self._accepts(message):
            return
        with self._lock:
            # rospy puts the header of its connection, the same object, on every message that it delivers.
            self._sender = message._connection_header if self._matters(message) else None
        self._callback(message)

    def _watch(self) -> None:
        while not rospy.core.is_shutdown_requested():
            rospy.rostime.wallsleep(PERIOD)
            if self._has_ended():
                try:
                    self._on_end()
                except Exception:  # a callback of the node; its failure must not end the watch
                    log.exception("a callback of the sender watch failed")

    def _has_ended(self) -> bool:
        with self._lock:
            if self._sender is None:
                return False
            # rospy's public interface gives only the number of connections.
            connections = self._subscriber.impl.connections or ()
            if any(connection.header is self._sender for connection in connections):
                return False
            self._sender = None
            return True


def subscribe_velocities(
    topic: str,
    callback: Callable[[Twist], None],
    queue_size: int = 1,
    on_end: Callable[[], None] | None = None,
    accepts: Callable[[Twist], bool] = lambda _twist: True,
    others_only: bool = False,
) -> SenderWatch:
    """Subscribe to velocities. When the program that drives ends without a zero, `on_end` is called; without it the
    callback gets one.

    A latched velocity that was sent before this program listened is not obeyed, see `PastCommands`. The other arguments
    are those of `SenderWatch`.
    """
    past = PastCommands(topic)

    def is_present(twist: Twist) -> bool:
        if not (past.is_past(twist) and moves(twist)):
            return accepts(twist)
        rospy.logwarn("%s: a velocity from before this program listened is not obeyed", rospy.resolve_name(topic))
        return False

    def end() -> None:
        rospy.logwarn("the program that drove by %s has ended", rospy.resolve_name(topic))
        if on_end is None:
            callback(Twist())
        else:
            on_end()

    return SenderWatch(topic, Twist, callback, end, queue_size, moves, is_present, others_only)


def moves(twist: Twist) -> bool:
    """Whether it is anything but a stop."""
    return any((twist.linear.x, twist.linear.y, twist.angular.z))
