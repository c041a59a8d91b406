"""Calls from the robot to services that clients registered: event callbacks, microphone buffers.

Looking up a client's service opens a connection and may take long when the client is gone, so it happens on threads of
this module and never on libqi's event loop.
"""

from __future__ import annotations

import concurrent.futures
import threading
from typing import Any

import qi

MAX_FAILURES = 3
"""A subscriber whose calls fail this many times in a row is dropped."""
LOOKUP_WORKERS = 4
CALL_TIMEOUT = 5.0
"""A client that does not answer within this time [s] has failed."""


class ClientServices:
    """Services of clients, by name.

    Args:
        session: The session of the robot's service directory.
    """

    def __init__(self, session: qi.Session) -> None:
        self._session = session
        self._own: frozenset[str] = frozenset()
        self._proxies: dict[str, Any] = {}
        self._lock = threading.Lock()
        self._pool = concurrent.futures.ThreadPoolExecutor(LOOKUP_WORKERS, thread_name_prefix="client-call")
        session.serviceUnregistered.connect(lambda _identity, name: self._forget(name))

    @property
    def url(self) -> str:
        """Where a program on the robot's own machine connects."""
        return str(self._session.endpoints()[0]).replace("//0.0.0.0:", "//127.0.0.1:")

    def names(self) -> list[str]:
        """List all services that are registered now, the robot's own included."""
        return [info["name"] for info in self._session.services()]

    def exists(self, name: str) -> bool:
        """Whether a service of this name is registered now."""
        return name in self.names()

    def is_own(self, name: str) -> bool:
        """Whether a service belongs to the robot itself."""
        return name in self._own

    def remember_own(self) -> None:
        """Regard the services that are registered now as the robot's own."""
        self._own = frozenset(self.names())

    def endpoints(self, name: str) -> list[tuple[int, str]]:
        """List (number of the service, tcp address) in its owner's order; no loopback addresses of other machines."""
        infos = self._session.services()
        here = next((info["machineId"] for info in infos if info["name"] == "ServiceDirectory"), "")
        return [
            (info["serviceId"], endpoint)
            for info in infos
            if info["name"] == name
            for endpoint in info["endpoints"]
            if endpoint.startswith("tcp://") and (info["machineId"] == here or "//127." not in endpoint)
        ]

    def call(self, name: str, method: str, *arguments: Any) -> concurrent.futures.Future:
        """Call `name`.`method`; the future holds the answer, or what went wrong (RuntimeError, TimeoutError)."""
        return self._pool.submit(self._call, name, method, arguments)

    def close(self) -> None:
        self._pool.shutdown(wait=False, cancel_futures=True)

    def _call(self, name: str, method: str, arguments: tuple) -> Any:
        with self._lock:
            proxy = self._proxies.get(name)
        try:
            if proxy is None:
                proxy = self._session.service(name)
                with self._lock:
                    self._proxies[name] = proxy
            return getattr(proxy, method)(*arguments, _async=True).value(int(CALL_TIMEOUT * 1000))
        except AttributeError:
            raise RuntimeError(f"service '{name}' has no method '{method}'") from None
        except RuntimeError:
            self._forget(name)
            raise

    def _forget(self, name: str) -> None:
        with self._lock:
            self._proxies.pop(name, None)
