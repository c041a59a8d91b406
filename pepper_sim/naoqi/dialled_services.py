"""Services of clients as the programs beside an ordinary Pepper's service directory find them: over a connection to an
address that the client announces (ros-naoqi/naoqi_driver, issues 96, 107, 158)."""

from __future__ import annotations

import concurrent.futures
import logging
import threading

from pepper_sim.naoqi.service import ServiceError
from telepresence.naoqi.future import Future
from telepresence.naoqi.proxy import remote_of
from telepresence.naoqi.server import Server
from telepresence.naoqi.session import Session

log = logging.getLogger(__name__)

WORKERS = 4


class DialledServices:
    """Connects from the first `reach` until `close`.

    Args:
        server: With the service directory.
        url: Where a program on the robot's own machine connects to it.
    """

    def __init__(self, server: Server, url: str) -> None:
        self._server, self._url = server, url
        self._session: Session | None = None
        self._reached: dict[str, Future] = {}
        self._lock = threading.Lock()
        self._pool = concurrent.futures.ThreadPoolExecutor(WORKERS, thread_name_prefix="dialled-services")
        server.serviceUnregistered.connect(lambda _identity, name: self._forget(name))

    def reach(self, name: str) -> Future:
        """Return the future of the RemoteObject by which a client's service is called.

        It fails with a ServiceError when there is none, or no way to it.
        """
        with self._lock:
            known = self._reached.get(name)
            if known is not None and (known.isRunning() or (known.hasValue() and known.value().alive)):
                return known
            reached = self._reached[name] = Future()
        self._pool.submit(self._connect, name, reached)
        return reached

    def close(self) -> None:
        self._pool.shutdown(wait=False, cancel_futures=True)
        if self._session is not None:
            self._session.close()

    def _connect(self, name: str, reached: Future) -> None:
        own = set(self._server.endpoints)
        records = [info["endpoints"] for info in self._server.services() if info["name"] == name]
        problem = ServiceError(f"Can't find service: {name}")
        if not records or set(records[0]) <= own:  # the directory names itself for a client that does not listen
            reached.finish_with_error(problem)
            return
        try:
            remote = remote_of(self._beside().service(name))
        except RuntimeError as error:
            log.info("'%s' cannot be reached at %s: %s", name, ", ".join(records[0]), error)
            reached.finish_with_error(problem)
        else:
            reached.finish_with_value(remote)

    def _beside(self) -> Session:
        with self._lock:
            if self._session is None or not self._session.isConnected():
                self._session = Session()
                self._session.connect(self._url)
            return self._session

    def _forget(self, name: str) -> None:
        with self._lock:
            self._reached.pop(name, None)
