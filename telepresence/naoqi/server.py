"""A NAOqi server: the service directory and the services of one process behind one port."""

from __future__ import annotations

import contextlib
import errno
import logging
import socket
import ssl
import threading
import time
import uuid
from collections.abc import Mapping
from typing import Any

from .connection import Connection, split_url
from .directory import MAIN_OBJECT, SERVICE_ID, Directory
from .dynamics import ROBOT, Dialect, Record
from .limits import Limits
from .login import ServerLogin
from .metaobject import METAOBJECT, MetaObject
from .reactor import READ, Timer, reactor
from .releases import RELEASES, Release
from .served_object import META_OBJECT, ServedObject
from .signals import Signal
from .stream import prepare

log = logging.getLogger(__name__)

_BACKLOG = 4096
_ACCEPTED_AT_ONCE = 256
_PAUSE_S = 0.1
"""Without descriptors or memory no connection is accepted for this time [s]."""
_CHECK_S = 1.0
_EXHAUSTED = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM)
_ASK_S = 10.0


class Server:
    """Serves objects on a TCP port as a robot does.

    Args:
        url: Where to listen, "tcp://host:port" or "tcps://host:port"; port 0 takes a free one.
        release: Which robot to play.
        login: Password by user; None: whoever reaches the port is in, as on NAOqi up to 2.8.
        tls: Certificate and key, needed for tcps.
        dialect: How numbers are sent inside dynamics.
        machine_id: What machineId() answers; clients on the same machine compare it.
    """

    def __init__(
        self,
        url: str = "tcp://127.0.0.1:0",
        *,
        release: Release = RELEASES["2.8"],
        login: Mapping[str, str] | None = None,
        tls: ssl.SSLContext | None = None,
        limits: Limits = Limits(),  # noqa: B008 -- frozen
        dialect: Dialect = ROBOT,
        machine_id: str = "",
    ) -> None:
        self._url, self._release, self._login, self._tls = url, release, login, tls
        self._limits, self._dialect = limits, dialect
        self._reactor = reactor()
        self._listener: socket.socket | None = None
        self._connections: set[Connection] = set()
        self._arriving: dict[Connection, None] = {}
        self._lock = threading.Lock()
        self._timers: list[Timer] = []
        self._closed = False
        self._directory = Directory(
            release.service_info_signature, machine_id or str(uuid.UUID(int=uuid.getnode())), self._listed
        )
        self.serviceRegistered: Signal = self._directory.added
        self.serviceUnregistered: Signal = self._directory.removed

    # --- services

    def register(self, name: str, served: ServedObject) -> int:
        """Add a service, also before `start`, and return its id.

        Raises: RuntimeError: The name is taken.
        """
        return self._directory.register(name, served)

    def unregister(self, number: int) -> None:
        """Remove a service.

        Raises: RuntimeError: There is none with that id.
        """
        self._directory.unregister(number)

    def services(self) -> list[Record]:
        """Return what the directory lists, itself first."""
        return [Record(info) for info in self._directory.infos()]

    # --- life

    @property
    def endpoints(self) -> list[str]:
        """The URLs that clients can connect to."""
        return self._listed(None)

    def start(self) -> None:
        """Listen. All services registered before are there when the port answers.

        Raises: OSError: The address cannot be used; the text says which and why.
        """

    def close(self) -> None:
        """End every connection. Calling it again does nothing."""

    def remote(self, name: str) -> Any:
        """Return a Proxy of a service that a client has registered; its calls go over the client's connection.

        Raises: RuntimeError: There is none, or the client does not answer.
        """
        raise NotImplementedError

    def _listed(self, connection: Connection | None) -> list[str]:
        return [self._url]
