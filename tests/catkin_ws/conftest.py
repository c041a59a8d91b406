"""A small NAOqi in this process, and a wire to it that a test can freeze and cut."""

from __future__ import annotations

import contextlib
import socket
import threading
from collections.abc import Callable, Iterator

import pytest
import qi


class Naoqi:
    """A qi service directory on a free port with the services a test registers."""

    def __init__(self) -> None:
        self.session = qi.Session()
        self.session.listenStandalone("tcp://127.0.0.1:0")
        self.port = int(self.session.endpoints()[0].rpartition(":")[2])

    def register(self, name: str, service: object) -> None:
        self.session.registerService(name, service)

    def close(self) -> None:
        self.session.close()


class Wire:
    """A TCP relay to `target`: `freeze()` stops the bytes but not the connections, `cut()` ends these, `thaw()` goes
    on."""

    def __init__(self, target: int) -> None:
        self._target = target
        self._flowing = threading.Event()
        self._flowing.set()
        self._sockets: list[socket.socket] = []
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        threading.Thread(target=self._accept, name="wire", daemon=True).start()

    def freeze(self) -> None:
        self._flowing.clear()

    def thaw(self) -> None:
        self._flowing.set()

    def cut(self) -> None:
        for end in self._sockets:
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
        self._sockets.clear()

    def close(self) -> None:
        self._listener.close()
        self.cut()
        self._flowing.set()

    def _accept(self) -> None:
        while True:
            try:
                near, _ = self._listener.accept()
                far = socket.create_connection(("127.0.0.1", self._target))
            except OSError:
                return
            self._sockets += [near, far]
            for source, sink in ((near, far), (far, near)):
                threading.Thread(target=self._pump, args=(source, sink), daemon=True).start()

    def _pump(self, source: socket.socket, sink: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while data := source.recv(65536):
                self._flowing.wait()
                sink.sendall(data)
        with contextlib.suppress(OSError):
            sink.shutdown(socket.SHUT_RDWR)


@pytest.fixture
def naoqi() -> Iterator[Naoqi]:
    server = Naoqi()
    yield server
    server.close()


@pytest.fixture
def make_wire() -> Iterator[Callable[[int], Wire]]:
    wires: list[Wire] = []

    def make(target: int) -> Wire:
        wires.append(Wire(target))
        return wires[-1]

    yield make
    for wire in wires:
        wire.close()
