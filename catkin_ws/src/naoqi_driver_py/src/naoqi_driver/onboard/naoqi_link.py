# Runs on Pepper's own Python 2.7 as well as on Python 3: keep to syntax that both accept.
# ruff: noqa: UP004, UP024, UP031
"""The drive server's link to NAOqi, which comes back for ever. Calls are only sent here; nothing waits for an answer.

Beside NAOqi (loopback) that is all. Over a network what TCP holds back arrives later, so each link is watched: what the
robot has not taken is known to the kernel, and a link on which it takes nothing for `STALL` is torn down, with all that
still waits in it, instead of being drained when the network is back.
"""

import socket
import threading

from telepresence.drive.clock import monotonic
from telepresence.drive.datagram import INFINITY, MAX_TEXT
from telepresence.robot_side.naoqi_client import Client, place_of, tls_for
from telepresence.robot_side.naoqi_values import error_text
from telepresence.security.shared_key import is_loopback

MYPY = False
if MYPY:
    from typing import Any, Callable, Optional  # noqa: F401, UP035

    from telepresence.robot_side.naoqi_client import Service  # noqa: F401

CONNECT_TIMEOUT = 1.5
"""Seconds for each step of a connection."""
PAUSE = 0.25
"""Seconds between two tries to connect."""
SAID_AFTER, LOSS_SAID_AFTER = 10.0, 2.0
"""Seconds without a link after which it is said why: at the start of a station, where NAOqi comes later, and after a
link was lost."""
WATCH_PERIOD = 0.05
"""Seconds between two looks at the link."""
STALL = 0.4
"""Seconds for which the robot may take nothing of what was sent to it over a network."""
LONGEST_LINE = MAX_TEXT - 30
"""Characters of what an error says: as many as a report to the pilot has room for, with a few words around, because at
the end may stand the line that removes a robot's old certificate."""


class NaoqiLink(object):
    """Connected from construction until `close`.

    Args:
        url: Of NAOqi, tcp://HOST:PORT or tcps://HOST:PORT.
        log: Takes a line for people.
        far: Behind the address, even if it is this machine's, is a network: a tunnel.
        tls: For tcps, see `telepresence.robot_side.naoqi_connection`.
    Attributes:
        connections: How often a link was established.
        problem: Why there is none; empty while there is one.
        near: NAOqi is on this machine.
    Raises:
        ValueError: The address is invalid, or it is tcps and there is no TLS.
    """

    def __init__(self, url, log, far=False, tls=None):
        # type: (str, Callable[[str], None], bool, Any) -> None
        self.url, self._log = url, log
        self.near = is_near(url) and not far
        self._tls = tls_for(url, tls)
        self.connections, self.problem = 0, "not connected yet"
        self._motion = None  # type: Optional[Service]
        self._client = None  # type: Optional[Client]
        self._drop = ""
        self._stop = threading.Event()
        self._wake = threading.Event()
        self._thread = threading.Thread(target=self._run, name="naoqi-link")
        self._thread.daemon = True
        self._thread.start()

    def motion(self):
        # type: () -> Optional[Service]
        """ALMotion; None without a link."""
        return self._motion

    def waiting(self):
        # type: () -> bool
        """Whether something that was sent has not reached the robot yet; beside it, never."""
        client = self._client
        return not self.near and client is not None and any(wire.waiting() for wire in client.wires)

    def drop(self, reason):
        # type: (str) -> None
        """Tear the link down, with what waits in it, and connect again."""
        self._drop = self._drop or reason
        self._motion = None
        client = self._client
        for wire in client.wires if client is not None else ():
            wire.abort(self._drop)
        self._wake.set()

    def close(self):
        # type: () -> None
        self._stop.set()
        self._wake.set()
        self._thread.join(CONNECT_TIMEOUT)

    # --- the thread --------------------------------------------------------------------------------------------------

    def _run(self):
        # type: () -> None
        said, failing_since, patience = "", monotonic(), SAID_AFTER
        while not self._stop.is_set():
            try:
                self._connect()
                self._log("connected to NAOqi at %s" % self.url)
                said, failing_since, patience = "", INFINITY, LOSS_SAID_AFTER
                self._watch()
            except (RuntimeError, EnvironmentError) as error:
                self.problem = error_text(error, LONGEST_LINE)
            self._close()
            failing_since = min(failing_since, monotonic())
            if self.problem != said and monotonic() - failing_since >= patience and not self._stop.is_set():
                said = self.problem
                self._log("no link to NAOqi at %s: %s; trying again until it answers" % (self.url, said))
            self._stop.wait(PAUSE)

    def _connect(self):
        # type: () -> None
        self._drop = ""
        client = self._client = Client(self.url, CONNECT_TIMEOUT, self._tls)
        motion = client.service("ALMotion")
        if not self.near:
            for wire in client.wires:
                wire.limit(STALL)
        self.connections, self.problem, self._motion = self.connections + 1, "", motion

    def _watch(self):
        # type: () -> None
        """Until the link is lost. Raises RuntimeError with the reason."""
        taken = monotonic()
        while not self._stop.is_set():
            self._wake.wait(WATCH_PERIOD)
            self._wake.clear()
            now = monotonic()
            taken = taken if self.waiting() else now
            if not self._drop and now - taken >= STALL:
                self.drop("it took nothing for %g s" % STALL)
            if self._drop:
                raise RuntimeError(self._drop)
            for wire in self._client.wires if self._client is not None else ():
                if wire.problem:
                    raise RuntimeError(wire.problem)

    def _close(self):
        # type: () -> None
        self._motion = None
        self.problem = self.problem or "closed"
        client, self._client = self._client, None
        for wire in client.wires if client is not None else ():
            if not self.near:
                wire.abort()
            wire.close()


def is_near(url):
    # type: (str) -> bool
    """Whether NAOqi at this address is on this machine. By tcps never: that is how a robot speaks to other machines, so
    an address of this one is the end of a tunnel.

    Raises:
        ValueError: The address is invalid.
    """
    scheme, (host, _) = place_of(url)
    try:
        return (is_loopback(host) or is_own(host)) and scheme == "tcp"
    except EnvironmentError:  # a name without an address, now
        return False


def is_own(host):
    # type: (str) -> bool
    """Whether every address of a host is one of this machine's.

    Raises:
        EnvironmentError: The name has no address.
    """
    for family, kind, _, _, place in socket.getaddrinfo(host, 0, 0, socket.SOCK_DGRAM):
        probe = socket.socket(family, kind)
        try:
            probe.bind(place)  # Linux gives a socket no address of others
        except EnvironmentError:
            return False
        finally:
            probe.close()
    return True
