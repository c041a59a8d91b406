"""Asks a ROS master over the documented Master API (http://wiki.ros.org/ROS/Master_API); needs no ROS itself."""

from __future__ import annotations

import http.client
import os
import re
import select
import socket
import time
import xmlrpc.client
from collections.abc import Iterable
from typing import Any
from urllib.parse import urlsplit

TIMEOUT = 0.3
"""Seconds within which the master must answer."""

ANONYMOUS = re.compile(r"_\d+(_\d+)?$")
"""Ends the names of nodes that did not choose one: rostopic, rosnode, keyboards, a person's scripts."""
RESTARTED = "the ROS master was restarted"
"""Why a node is asked to shut down which the new master does not know: it is meant to start again."""


def end_code(reason: str) -> int:
    """Return the exit code of a program that ROS has ended for this reason. 0 says that its work is done; one that the
    new master did not know is to start again, and goes on where it was."""
    return os.EX_TEMPFAIL if RESTARTED in reason else 0


class _TimeoutTransport(xmlrpc.client.Transport):
    def __init__(self, timeout: float) -> None:
        super().__init__()
        self._timeout = timeout
        self.connection: http.client.HTTPConnection | None = None

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        self.connection = super().make_connection(host)
        self.connection.timeout = self._timeout
        return self.connection


def master_proxy(uri: str, timeout: float = TIMEOUT) -> Any:  # XML-RPC has no types that a checker could know
    """The master at `uri` (http://host:port); every call ends after `timeout` seconds."""
    return xmlrpc.client.ServerProxy(uri, transport=_TimeoutTransport(timeout), allow_none=True)


class MasterConnection:
    """A connection to the master that stays open (HTTP/1.1): a question over it costs the master a third, and when the
    master ends, the kernel closes it and nobody has to ask.

    Args:
        uri: http://host:port.
        timeout: Seconds after which every call ends.
    """

    def __init__(self, uri: str, timeout: float = TIMEOUT) -> None:
        self._transport = _TimeoutTransport(timeout)
        self.master: Any = xmlrpc.client.ServerProxy(uri, transport=self._transport, allow_none=True)
        """The Master API."""

    def wait_for_end(self, seconds: float) -> bool:
        """Wait; True as soon as the other end closes the connection."""
        connection = self._transport.connection
        if connection is None or connection.sock is None:
            time.sleep(seconds)
            return False
        poll = select.poll()
        poll.register(connection.sock, select.POLLIN)  # nothing is asked now, so only an end can arrive
        return bool(poll.poll(1000.0 * seconds))


def master_answers(uri: str, timeout: float = TIMEOUT) -> bool:
    """Whether a ROS master answers at `uri` within `timeout` seconds."""
    master: Any = master_proxy(uri, timeout)  # XML-RPC answers have no types
    try:
        return master.getPid("/master_watch")[0] == 1
    except (OSError, http.client.HTTPException, xmlrpc.client.Error):
        return False


def topics_of(
    uri: str, caller: str, timeout: float = TIMEOUT
) -> tuple[dict[str, list[str]], dict[str, list[str]]] | None:
    """Return who publishes and who subscribes, topic -> nodes; None if the master at `uri` does not answer within
    `timeout` seconds."""
    try:
        publishers, subscribers, _services = master_proxy(uri, timeout).getSystemState(caller)[2]
    except (OSError, http.client.HTTPException, xmlrpc.client.Error):
        return None
    return dict(publishers), dict(subscribers)


def has_ended(node_uri: str, timeout: float = TIMEOUT) -> bool:
    """Whether the process of a node has ended: nothing listens at its XML-RPC address (http://host:port) any more, and
    its host says so within `timeout` seconds. A host that is silent proves nothing."""
    parts = urlsplit(node_uri)
    try:
        socket.create_connection((parts.hostname or "", parts.port or 0), timeout).close()
    except ConnectionRefusedError:
        return True
    except OSError:
        return False
    return False


def ended_nodes(uri: str, names: Iterable[str], caller: str, timeout: float = TIMEOUT) -> dict[str, str]:
    """Return which of these nodes are still listed by the master at `uri` although their process has ended, with the
    address of each: whoever is killed cannot sign off.

    Raises:
        OSError, http.client.HTTPException, xmlrpc.client.Error: The master does not answer within `timeout` seconds.
    """
    master = master_proxy(uri, timeout)
    found = {}
    for name in names:
        code, _, address = master.lookupNode(caller, name)
        if code == 1 and has_ended(address, timeout):
            found[name] = address
    return found


def forget_nodes(uri: str, nodes: dict[str, str], caller: str, timeout: float = TIMEOUT) -> None:
    """Take nodes (name -> address) off the master's lists, as `rosnode cleanup` does. One that has come back at another
    address meanwhile stays: the master compares the address.

    Raises:
        OSError, http.client.HTTPException, xmlrpc.client.Error: The master does not answer within `timeout` seconds.
    """
    master = master_proxy(uri, timeout)
    publishers, subscribers, services = master.getSystemState(caller)[2]
    for name, address in nodes.items():
        for topic, names in publishers:
            if name in names:
                master.unregisterPublisher(name, topic, address)
        for topic, names in subscribers:
            if name in names:
                master.unregisterSubscriber(name, topic, address)
        for service, names in services:
            code, _, service_address = master.lookupService(caller, service) if name in names else (0, "", "")
            if code == 1:
                master.unregisterService(name, service, service_address)
