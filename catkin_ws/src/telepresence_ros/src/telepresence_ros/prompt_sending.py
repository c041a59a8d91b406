"""Short messages go out on the thread that publishes them.

rospy hands every message to a thread of each connection, so that a subscriber that does not read holds nobody up. What
a socket takes at once holds nobody up either, and to change threads takes as long as the rest of a message's way.
"""

from __future__ import annotations

import socket
from typing import Any

import rospy.topics
from rospy.impl.tcpros_pubsub import QueuedConnection

SHORT = 4096
"""Bytes of a message that is sent so: a picture takes longer to copy than threads to change."""


class PromptConnection(QueuedConnection):  # type: ignore[misc]
    """rospy's connection to a subscriber; its thread sends only what the socket does not take at once.

    Args:
        connection: The transport.
        queue_size: How many messages wait at most; 0 for no limit.
    """

    def __init__(self, connection: Any, queue_size: int) -> None:
        self._rest = b""  # of a message that the socket took in part: must not be left out
        self._sending = False  # the thread is at it
        super().__init__(connection, queue_size)

    def write_data(self, data: bytes) -> bool:
        """Send a message, now or soon."""
        with self._lock:
            idle = not (self._queue or self._rest or self._sending or self._error)
            sent = self._send_now(data) if idle and len(data) <= SHORT else 0
            if sent:
                self._rest = data[sent:]
                if self._rest:
                    self._cond_data_available.notify()
                return True
        return bool(super().write_data(data))

    def _send_now(self, data: bytes) -> int:
        """Return how many bytes the socket takes without waiting; what is wrong with it, the thread finds out."""
        connection = self._connection
        if connection.done or connection.socket is None:
            return 0
        try:
            sent: int = connection.socket.send(data, socket.MSG_DONTWAIT)
        except OSError:
            return 0
        connection.stat_bytes += sent
        connection.stat_num_msg += 1
        return sent

    def _run(self) -> None:
        while not self._connection.done:
            with self._lock:
                while not (self._queue or self._rest or self._connection.done):
                    self._cond_data_available.wait()
                waiting: list[bytes] = [self._rest, *self._queue]
                self._queue: list[bytes] = []
                self._rest = b""
                self._sending = True
            try:
                for data in filter(None, waiting):
                    self._connection.write_data(data)
            except Exception as error:  # whoever publishes next gets it, as from rospy's own
                # Tracebacks have frames, and with them the messages and us: for as long as nobody publishes.
                error.__cause__ = error.__context__ = None
                with self._lock:
                    self._error = error.with_traceback(None)
            waiting, data = [], b""  # a picture, perhaps; the next one may be long in coming
            with self._lock:
                self._sending = False

    def _closed_connection_callback(self, connection: Any) -> None:
        super()._closed_connection_callback(connection)
        connection.cleanup_cb = None  # has us in it, and we have the connection: a circle for each that has gone


def send_promptly() -> None:
    """Have rospy's publishers in this process send so. Call it before `rospy.init_node`; may be repeated."""
    rospy.topics.QueuedConnection = PromptConnection
