"""The plain-Python qi server against the real library, and against sockets that misbehave."""

import socket
import struct

import numpy as np
import pytest

from pepper_sim.naoqi.raw_server import RawMethod, RawServer

import qi  # isort: skip

PIXELS = np.arange(256, dtype=np.uint8)


@pytest.fixture
def peer():
    directory = qi.Session()
    directory.listenStandalone("tcp://127.0.0.1:0")

    def fail() -> None:
        raise ValueError("no picture")

    methods = [
        RawMethod("m", "image", "(s)", lambda name: [640, 0.5, PIXELS, name]),
        RawMethod("i", "image", "(ii)", lambda a, b: a + b),
        RawMethod("v", "fail", "()", fail),
        RawMethod("m", "echo", "(m)", lambda value: value),
    ]
    server = RawServer(directory.service("ServiceDirectory").machineId(), {"Images": methods})
    client = qi.Session()
    client.connect(server.url)
    yield server, client.service("Images"), directory
    client.close()
    directory.close()
    server.close()


def test_a_list_holds_raw_and_exact_types(peer):
    image = peer[1].image("top")
    assert isinstance(image, list) and isinstance(image[2], bytearray)
    assert image[:2] == [640, 0.5] and bytes(image[2]) == PIXELS.tobytes() and image[3] == "top"


def test_overloads_errors_and_dynamics(peer):
    proxy = peer[1]
    assert proxy.image(2, 3) == 5
    with pytest.raises(RuntimeError, match=r"^no picture$"):
        proxy.fail()
    for value in (1, -1.5, "text", [1, "a", [None]], {"a": 1}, True, None):
        assert proxy.echo(value) == value


def test_the_robots_directory_passes_calls_on_unchanged(peer):
    _, proxy, directory = peer
    directory.registerService("Images", proxy)
    far = qi.Session()
    far.connect(directory.endpoints()[0])
    image = far.service("Images").image("top")
    assert isinstance(image, list) and isinstance(image[2], bytearray)
    calls = [far.service("Images").image("x", _async=True) for _ in range(50)]
    assert all(len(call.value(5000)) == 4 for call in calls)
    far.close()


def test_garbage_ends_its_own_connection_only(peer):
    server, proxy, _ = peer
    address = ("127.0.0.1", int(server.url.rsplit(":", 1)[1]))
    header = struct.Struct("<IIIHBBIII")
    for data in (
        b"GET / HTTP/1.0\r\n\r\n" * 3,
        header.pack(0x42ADDE42, 1, 0xFFFFFFFF, 0, 1, 0, 2, 1, 100),
        header.pack(0x42ADDE42, 1, 8, 0, 1, 0, 2, 1, 100)[:10],
        header.pack(0x42ADDE42, 1, 4, 0, 1, 0, 2, 1, 100) + b"\xff\xff\xff\xff",
        header.pack(0x42ADDE42, 1, 0, 0, 1, 0, 99, 1, 5),
    ):
        with socket.create_connection(address, timeout=2) as connection:
            connection.sendall(data)
    assert proxy.image(1, 1) == 2


def test_nobody_else_is_let_in_after_stop_listening(peer):
    server, proxy, _ = peer
    server.stop_listening()
    with pytest.raises(OSError):
        socket.create_connection(("127.0.0.1", int(server.url.rsplit(":", 1)[1])), timeout=1)
    assert proxy.image(1, 1) == 2
