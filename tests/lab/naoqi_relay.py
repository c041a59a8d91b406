"""Somebody between client and server of NAOqi's messaging, or in the server's place."""

from __future__ import annotations

import contextlib
import socket
import threading
from collections.abc import Callable

from naoqi_bytes import Message, RawPeer


class Impostor:
    """Listens as a robot does and answers each connection as `talk` does, on a thread of its own."""

    def __init__(self, talk: Callable[[RawPeer], None]) -> None:
        self._talk = talk
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.url = f"tcp://127.0.0.1:{self._listener.getsockname()[1]}"
        self._peers: list[RawPeer] = []
        self._thread = threading.Thread(target=self._listen, name="impostor", daemon=True)
        self._thread.start()

    def _listen(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                peer = RawPeer(self._listener.accept()[0])
                self._peers.append(peer)
                threading.Thread(target=self._answer, args=(peer,), name="impostor", daemon=True).start()

    def _answer(self, peer: RawPeer) -> None:
        with contextlib.suppress(OSError):
            self._talk(peer)

    def __enter__(self) -> Impostor:
        return self

    def __exit__(self, *_: object) -> None:
        with contextlib.suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        self._thread.join(10.0)
        for peer in self._peers:
            with contextlib.suppress(OSError):
                peer.socket.shutdown(socket.SHUT_RDWR)
            peer.close()


def forward(source: RawPeer, target: RawPeer, change: Callable[[Message], bytes] = Message.pack) -> None:
    """Pass messages on until one end closes."""
    with contextlib.suppress(OSError):
        while True:
            target.send(change(source.receive()))
    with contextlib.suppress(OSError):
        target.socket.shutdown(socket.SHUT_RDWR)


class Between:
    """Passes a conversation on to an honest server, and what that says through `change` on its way back.

    Args:
        change: Is given each message of the server and its number; returns what is sent instead.
        ask: The same for messages of the client.
        last: The number of the message after which the connection is reset, if any.
    """

    def __init__(
        self,
        port: int,
        change: Callable[[Message, int], bytes] = lambda message, _: message.pack(),
        ask: Callable[[Message], bytes] = Message.pack,
        last: int | None = None,
    ) -> None:
        self._port = port
        self._change, self._ask = change, ask
        self._last = last
        self._servers: list[RawPeer] = []
        self._impostor = Impostor(self._talk)
        self.url = self._impostor.url
        self.passed = 0

    def _talk(self, client: RawPeer) -> None:
        with RawPeer(("127.0.0.1", self._port)) as server:
            self._servers.append(server)
            threading.Thread(target=forward, args=(client, server, self._ask), name="between", daemon=True).start()
            try:
                while True:
                    client.send(self._change(server.receive(), self.passed))
                    self.passed += 1
                    if self._last is not None and self.passed > self._last:
                        return client.reset()
            finally:
                with contextlib.suppress(OSError):
                    client.socket.shutdown(socket.SHUT_RDWR)

    def __enter__(self) -> Between:
        return self

    def __exit__(self, *_: object) -> None:
        self._impostor.__exit__()
        for server in self._servers:
            with contextlib.suppress(OSError):
                server.socket.shutdown(socket.SHUT_RDWR)
