"""Short messages on the publisher's own thread: over real sockets, to readers that read, and to some that do not."""

from __future__ import annotations

import gc
import socket
import struct
import time
import weakref
from collections.abc import Iterator

import pytest
from rospy.impl.tcpros_base import TCPROSTransport
from rospy.impl.tcpros_pubsub import TCPROSPub
from telepresence_ros.prompt_sending import SHORT, PromptConnection

QUEUE = 3


class Subscriber:
    """The other end of a publisher's connection; a message is its length, its number, and padding."""

    def __init__(self) -> None:
        ours, self.socket = socket.socketpair()
        for end in (ours, self.socket):
            for option in (socket.SO_SNDBUF, socket.SO_RCVBUF):
                end.setsockopt(socket.SOL_SOCKET, option, 4096)
        self.transport = TCPROSTransport(TCPROSPub("/topic", None), "/topic")
        self.transport.set_socket(ours, "the publisher")
        self.connection = PromptConnection(self.transport, QUEUE)

    def read(self, least: int) -> list[int]:
        """The numbers of what has come, at least up to number `least`."""
        numbers: list[int] = []
        with self.socket.makefile("rb") as stream:
            while not numbers or numbers[-1] < least:
                size, number = struct.unpack("<II", stream.read(8))
                assert set(stream.read(size - 4)) <= {number % 251}
                numbers.append(number)
        return numbers


def message(number: int, padding: int = 100) -> bytes:
    return struct.pack("<II", padding + 4, number) + bytes([number % 251]) * padding


@pytest.fixture
def without_collection() -> Iterator[None]:
    gc.collect()
    gc.disable()
    yield
    gc.enable()


@pytest.fixture
def subscriber() -> Iterator[Subscriber]:
    made = Subscriber()
    yield made
    made.transport.close()
    made.socket.close()


def test_who_reads_gets_it_from_the_thread_that_publishes(subscriber, monkeypatch):
    senders = []
    send = subscriber.transport.write_data
    monkeypatch.setattr(subscriber.transport, "write_data", lambda data: senders.append("thread") or send(data))
    for number in range(20):
        subscriber.connection.write_data(message(number))
        assert subscriber.read(number) == [number]
    assert not senders
    assert subscriber.transport.stat_num_msg == 20
    subscriber.connection.write_data(message(20, SHORT))
    assert subscriber.read(20) == [20]
    assert senders


def test_who_does_not_read_holds_nobody_up_and_gets_whole_messages_then(subscriber):
    for number in range(2000):
        subscriber.connection.write_data(message(number, padding=number % 300))
    taken = subscriber.transport.stat_num_msg
    assert taken < 1990, "the socket should have been full"
    numbers = subscriber.read(1999)
    assert numbers == sorted(set(numbers))
    assert numbers[: taken - 1] == list(range(taken - 1))
    assert numbers[-QUEUE:] == [1997, 1998, 1999]


def test_who_has_gone_is_reported_to_whoever_publishes(subscriber):
    subscriber.socket.close()
    deadline = time.monotonic() + 10.0
    with pytest.raises(Exception, match=r"(?i)pipe|closed|reset"):
        while time.monotonic() < deadline:
            subscriber.connection.write_data(message(1))


def test_its_thread_ends_with_the_connection(subscriber):
    subscriber.transport.close()
    deadline = time.monotonic() + 10.0
    while subscriber.connection._thread.is_alive():
        assert time.monotonic() < deadline
        subscriber.connection._thread.join(0.05)


def as_a_topic_does(transport: TCPROSTransport) -> None:
    """Put a callback around the connection's own, as rospy.topics."""
    before = transport.cleanup_cb
    transport.set_cleanup_callback(lambda transport: before(transport))


def test_a_subscriber_that_has_gone_leaves_nothing_to_be_collected(without_collection):
    subscriber = Subscriber()
    as_a_topic_does(subscriber.transport)
    subscriber.socket.close()
    subscriber.connection.write_data(message(0, 10 * SHORT))
    subscriber.connection._thread.join(10)
    assert subscriber.transport.done
    gone = weakref.ref(subscriber.transport), weakref.ref(subscriber.connection)
    del subscriber
    assert [each() for each in gone] == [None, None]
