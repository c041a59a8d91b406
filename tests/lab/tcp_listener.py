"""A listening socket whose connections each get a thread."""

from __future__ import annotations

import contextlib
import socket
import threading
from collections.abc import Callable


class TcpListener:
    """Listens from construction until `close`.

    Args:
        talk: Called with each connection, on a thread of its own; closes it. An OSError ends it quietly.
        place: Address and port; 0 takes a free one.
    """

    def __init__(self, talk: Callable[[socket.socket], None], place: tuple[str, int] = ("127.0.0.1", 0)) -> None:
        self._talk = talk
        self._socket = socket.create_server(place, backlog=50)
        self.port = self._socket.getsockname()[1]
        threading.Thread(target=self._accept, name="tcp-listener", daemon=True).start()

    def close(self) -> None:
        self._socket.close()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                near, _ = self._socket.accept()
                threading.Thread(target=self._serve, args=(near,), daemon=True).start()

    def _serve(self, near: socket.socket) -> None:
        with near, contextlib.suppress(OSError):
            self._talk(near)
