"""Reads ROS topics without being a node: it outlives a master that dies and publishers that come back.

TCPROS and the Slave API as http://wiki.ros.org/ROS/TCPROS and http://wiki.ros.org/ROS/Slave_API describe them. The
connection goes straight to the publisher: once it stands, neither master nor any other program is on the way.
"""

from __future__ import annotations

import http.client
import socket
import struct
import threading
import xmlrpc.client
from collections.abc import Callable
from typing import Any
from urllib.parse import urlsplit

import roslib.message

from telepresence.station.ros_master import master_proxy

CALLER = "/bench_faults"
PERIOD = 0.1
"""Between two questions where a topic is published [s]."""
TIMEOUT = 1.0
"""Seconds allowed for an answer of the master or of a node."""
_ERRORS = (OSError, http.client.HTTPException, xmlrpc.client.Error, struct.error, ValueError)


class TopicReader:
    """Receives a topic until closed, from whoever publishes it now.

    Args:
        master: The master's URI.
        topic: Its full name.
        receive: Called with every message, on a thread of this reader.
        enter: Called first on that thread; a thread may live in a network namespace of its own.
    """

    def __init__(
        self, master: str, topic: str, receive: Callable[[Any], None], enter: Callable[[], None] | None = None
    ) -> None:
        self._master, self._topic, self._receive = master, topic, receive
        self._enter = enter or (lambda: None)
        self.connected = False
        self._closing = threading.Event()
        self._connection: socket.socket | None = None
        self._thread = threading.Thread(target=self._run, name=f"reads {topic}", daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._closing.set()
        connection = self._connection
        if connection is not None:
            try:
                connection.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass  # it has ended by itself
        self._thread.join(timeout=5.0)

    def _run(self) -> None:
        self._enter()
        while not self._closing.is_set():
            try:
                address = self._publisher()
                if address is not None:
                    self._read(address)
            except _ERRORS:
                pass  # a program on the way has died: that is what this benchmark is for; ask again
            finally:
                self.connected = False
            self._closing.wait(PERIOD)

    def _publisher(self) -> tuple[str, int] | None:
        """Where the topic can be had, or None when nobody publishes it."""
        master: Any = master_proxy(self._master, timeout=TIMEOUT)
        publishers, _, _ = master.getSystemState(CALLER)[2]
        for node in next((nodes for topic, nodes in publishers if topic == self._topic), []):
            code, _, uri = master.lookupNode(CALLER, node)
            if code != 1:
                continue
            server: Any = master_proxy(uri, timeout=TIMEOUT)
            code, _, protocol = server.requestTopic(CALLER, self._topic, [["TCPROS"]])
            if code == 1 and protocol:
                # The publisher may announce a name; its address is the one that has just answered.
                return urlsplit(uri).hostname or protocol[1], int(protocol[2])
        return None

    def _read(self, address: tuple[str, int]) -> None:
        with socket.create_connection(address, timeout=TIMEOUT) as connection:
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._connection = connection
            fields = {"callerid": CALLER, "topic": self._topic, "type": "*", "md5sum": "*", "tcp_nodelay": "1"}
            words = [f"{name}={value}".encode() for name, value in fields.items()]
            header = b"".join(struct.pack("<I", len(word)) + word for word in words)
            connection.sendall(struct.pack("<I", len(header)) + header)
            kind = _fields(_block(connection))["type"]
            message = roslib.message.get_message_class(kind)
            if message is None:
                raise ValueError(f"{self._topic}: there is no message {kind} in this workspace")
            connection.settimeout(None)
            self.connected = True
            while not self._closing.is_set():
                self._receive(message().deserialize(_block(connection)))


def _block(connection: socket.socket) -> bytes:
    """A length and that many bytes."""
    return _exactly(connection, struct.unpack("<I", _exactly(connection, 4))[0])


def _exactly(connection: socket.socket, count: int) -> bytes:
    parts = bytearray()
    while len(parts) < count:
        part = connection.recv(count - len(parts))
        if not part:
            raise ConnectionError("the publisher has ended")
        parts += part
    return bytes(parts)


def _fields(block: bytes) -> dict[str, str]:
    fields = {}
    while block:
        (length,) = struct.unpack_from("<I", block)
        name, _, value = block[4 : 4 + length].partition(b"=")
        fields[name.decode()] = value.decode(errors="replace")
        block = block[4 + length :]
    return fields
