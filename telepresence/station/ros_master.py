"""Asks a ROS master over the documented Master API (http://wiki.ros.org/ROS/Master_API); needs no ROS itself."""

from __future__ import annotations

import http.client
import xmlrpc.client
from typing import Any

TIMEOUT = 0.3
"""Seconds within which the master must answer."""


class _TimeoutTransport(xmlrpc.client.Transport):
    def __init__(self, timeout: float) -> None:
        super().__init__()
        self._timeout = timeout

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = self._timeout
        return connection


def master_proxy(uri: str, timeout: float = TIMEOUT) -> Any:  # XML-RPC has no types that a checker could know
    """The master at `uri` (http://host:port); every call ends after `timeout` seconds."""
    return xmlrpc.client.ServerProxy(uri, transport=_TimeoutTransport(timeout), allow_none=True)


def master_answers(uri: str, timeout: float = TIMEOUT) -> bool:
    """Whether a ROS master answers at `uri` within `timeout` seconds."""
    master: Any = master_proxy(uri, timeout)  # XML-RPC answers have no types
    try:
        return master.getPid("/master_watch")[0] == 1
    except (OSError, http.client.HTTPException, xmlrpc.client.Error):
        return False
