"""The service directory: which services there are, who holds them, and under which addresses.

A service is pending between registerService and serviceReady: its name is taken, but nobody sees it. Services of a
client go with its connection.
"""

from __future__ import annotations

import itertools
import logging
import os
import socket
import threading
import uuid
from pathlib import Path
from typing import Any, Callable

from .codec import decode, encode
from .connection import LOST, Connection
from .future import Future
from .message import REPLY
from .metaobject import METAOBJECT, MetaObject
from .remote_object import RemoteObject
from .served_object import META_OBJECT, ServedObject
from .signals import Signal
from .signature import WireError
from .workers import submit

log = logging.getLogger(__name__)

NAME, SERVICE_ID, MAIN_OBJECT = "ServiceDirectory", 1, 1
_FIRST_SERVICE = 2
RELATIVE = "qi:ServiceDirectory"


def this_machine() -> str:
    """Return what tells this machine from others: by it clients judge whether loopback addresses are theirs."""
    try:
        identity = Path("/etc/machine-id").read_text().strip()
    except OSError:
        identity = socket.gethostname()
    return str(uuid.uuid5(uuid.NAMESPACE_URL, f"naoqi:{identity}"))  # the identity itself is not for others


class Entry:
    """One service.

    Attributes:
        owner: The connection through which a client has registered it; None: it is the server's own.
        served: The server's own object.
        relay: Passes calls on to a client that does not listen.
    """

    def __init__(
        self, name: str, number: int, info: dict[str, Any], owner: Connection | None, served: ServedObject | None
    ) -> None:
        self.name, self.number, self.info = name, number, info
        self.owner, self.served = owner, served
        self.ready = False
        self.relay: ServedObject | None = None
        self._reached: Future | None = None
        self._lock = threading.Lock()

    def reach(self) -> Future:
        """Return the future of the RemoteObject by which a client's service is called: all callers share one.

        The client is asked what the service offers, once, however many want to know; that has no time limit, so each of
        them sets its own. Fails with a RuntimeError if the answer is of no use, and the next caller asks again.
        """
        assert self.owner is not None
        with self._lock:
            if self._reached is not None:
                return self._reached
            self._reached = reached = Future()

        def described(kind: int, _flags: int, payload: Any) -> None:
            submit(self._described, reached, kind, payload)

        self.owner.start_call(self.number, MAIN_OBJECT, META_OBJECT, encode("I", 0), 0, described)
        return reached

    def gone(self) -> None:
        """The service was unregistered: nobody waits for its description any more."""
        with self._lock:
            reached = self._reached
        if reached is not None:
            reached.finish_with_error(f"service '{self.name}' is gone")

    def _described(self, reached: Future, kind: int, payload: Any) -> None:
        try:
            if kind != REPLY or self.owner is None:
                raise WireError(payload if kind == LOST else f"service #{self.number} does not describe itself")
            meta = MetaObject.from_value(decode(METAOBJECT, payload))
        except RuntimeError as error:
            with self._lock:
                self._reached = None
            reached.finish_with_error(str(error))
        else:
            reached.finish_with_value(RemoteObject(self.owner, self.number, MAIN_OBJECT, meta))


class Directory(ServedObject):
    """Service 1 of a server.

    Args:
        service_info: Signature of its records.
        machine_id: What it answers to machineId().
        endpoints: Called with the asking connection (None: the server's own process): where the server listens.
    Attributes:
        added, removed: Signals (id, name), as serviceAdded and serviceRemoved.
    """

    def __init__(self, service_info: str, machine_id: str, endpoints: Callable[[Connection | None], list[str]]) -> None:
        super().__init__()
        self.added, self.removed = Signal("(Is)"), Signal("(Is)")
        self.machine_id = machine_id
        self._endpoints = endpoints
        self._entries: dict[int, Entry] = {}
        self._numbers = itertools.count(_FIRST_SERVICE)
        self._directory_lock = threading.Lock()
        for uid, name, returns, parameters, function in (
            (100, "service", service_info, "(s)", self._service),
            (101, "services", f"[{service_info}]", "()", self._services),
            (102, "registerService", "I", f"({service_info})", self._register_remote),
            (103, "unregisterService", "v", "(I)", self._unregister_remote),
            (104, "serviceReady", "v", "(I)", self._ready_remote),
            (105, "updateServiceInfo", "v", f"({service_info})", self._update),
        ):
            self.add_method(name, returns, parameters, function, uid=uid, inline=True, connection_first=True)
        self.add_signal("serviceAdded", self.added, uid=106)
        self.add_signal("serviceRemoved", self.removed, uid=107)
        self.add_method("machineId", "s", "()", lambda: self.machine_id, uid=108, inline=True)

    # --- for the server's own process

    def register(self, name: str, served: ServedObject) -> int:
        """Add a service of this process; it is ready at once. Return its id.

        Raises: RuntimeError: The name is taken.
        """
        entry = self._add(name, {}, None, served)
        self.ready(entry.number)
        return entry.number

    def unregister(self, number: int) -> None:
        """Remove a service.

        Raises: RuntimeError: There is none.
        """
        with self._directory_lock:
            entry = self._entries.pop(number, None)
        if entry is None:
            raise WireError(f"Unregister Service: Can't find service #{number}")
        entry.gone()
        if entry.ready:
            self.removed(number, entry.name)

    def ready(self, number: int) -> None:
        """Make a pending service visible.

        Raises: RuntimeError: There is none.
        """
        with self._directory_lock:
            entry = self._entries.get(number)
            if entry is None or entry.ready:
                raise WireError(f"Can't find pending service #{number}")
            entry.ready = True
        self.added(number, entry.name)

    def find(self, name: str) -> Entry | None:
        """Return the service of that name if it is ready."""
        with self._directory_lock:
            return next((entry for entry in self._entries.values() if entry.name == name and entry.ready), None)

    def at(self, number: int) -> Entry | None:
        """Return the service with that id, ready or not."""
        return self._entries.get(number)

    def connection_ended(self, connection: Connection) -> None:
        """Remove the services of a client that has gone."""
        with self._directory_lock:
            gone = [number for number, entry in self._entries.items() if entry.owner is connection]
        for number in gone:
            try:
                self.unregister(number)
            except WireError:
                log.debug("service #%d had been unregistered meanwhile", number)

    def infos(self, connection: Connection | None = None) -> list[dict[str, Any]]:
        """Return the records of all ready services, the directory first."""
        with self._directory_lock:
            entries = [entry for entry in self._entries.values() if entry.ready]
        own = self._own_info(NAME, SERVICE_ID, b"", connection)
        return [own, *[self._info(entry, connection) for entry in entries]]

    # --- for clients; on the reactor's thread

    def _service(self, connection: Connection, name: str) -> dict[str, Any]:
        if name == NAME:
            return self._own_info(NAME, SERVICE_ID, b"", connection)
        entry = self.find(name)
        if entry is None:
            raise WireError(f"Cannot find service '{name}' in index")
        return self._info(entry, connection)

    def _services(self, connection: Connection) -> list[dict[str, Any]]:
        return self.infos(connection)

    def _register_remote(self, connection: Connection, info: dict[str, Any]) -> int:
        owned = sum(entry.owner is connection for entry in list(self._entries.values()))
        if owned >= connection.limits.services:
            raise WireError(f"more than {connection.limits.services} services of one client")
        return self._add(str(info["name"]), dict(info), connection, None).number

    def _unregister_remote(self, connection: Connection, number: int) -> None:
        entry = self._entries.get(number)
        if entry is not None and entry.owner is not connection:
            raise WireError(f"Unregister Service: service #{number} belongs to somebody else")
        self.unregister(number)

    def _ready_remote(self, connection: Connection, number: int) -> Any:
        entry = self._entries.get(number)
        if entry is None or entry.owner is not connection or entry.ready:
            raise WireError(f"Can't find pending service #{number}")
        if entry.info.get("endpoints"):
            return self.ready(number)
        return self._relayed(entry)

    def _relayed(self, entry: Entry) -> Future:
        """Make a service of a client that does not listen reachable through this server, and then ready."""
        done = Future()

        def finish(reached: Future) -> None:
            from .relay import Relay  # which imports the client's side

            try:
                entry.relay = Relay(reached.value())
                self.ready(entry.number)
            except RuntimeError as error:
                done.finish_with_error(str(error))
            else:
                done.finish_with_value(None)

        entry.reach().addCallback(finish)
        return done

    def _update(self, connection: Connection, info: dict[str, Any]) -> None:
        entry = self._entries.get(info["serviceId"])
        if entry is None or entry.owner is not connection or entry.name != info["name"]:
            raise WireError(f"updateServiceInfo: Can't find service #{info['serviceId']}")
        entry.info = dict(info)

    # --- both

    def _add(self, name: str, info: dict[str, Any], owner: Connection | None, served: ServedObject | None) -> Entry:
        with self._directory_lock:
            for entry in self._entries.values():
                if entry.name == name:
                    raise WireError(
                        f'Service "{name}" (#{entry.number}) is already registered. '
                        "Rejecting conflicting registration attempt."
                    )
            if not name or name == NAME:
                raise WireError(f'Service "{name}" cannot be registered: the name is not free')
            entry = Entry(name, next(self._numbers), info, owner, served)
            self._entries[entry.number] = entry
            return entry

    def _info(self, entry: Entry, connection: Connection | None) -> dict[str, Any]:
        if entry.served is not None:
            return self._own_info(entry.name, entry.number, entry.served.uid, connection)
        info = {**entry.info, "serviceId": entry.number}
        if entry.relay is not None:  # the server is where it can be reached
            info.update(machineId=self.machine_id, endpoints=self._listed(connection))
        return info

    def _own_info(self, name: str, number: int, uid: bytes, connection: Connection | None) -> dict[str, Any]:
        return {
            "name": name,
            "serviceId": number,
            "machineId": self.machine_id,
            "processId": os.getpid(),
            "endpoints": self._listed(connection),
            "sessionId": "0",
            "objectUid": uid,
        }

    def _listed(self, connection: Connection | None) -> list[str]:
        relative = [RELATIVE] if connection is not None and connection.shared("RelativeEndpointURI") else []
        return relative + self._endpoints(connection)
