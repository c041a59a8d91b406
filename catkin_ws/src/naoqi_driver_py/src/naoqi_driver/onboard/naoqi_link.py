# Runs on Pepper's own Python 2.7 as well as on Python 3: keep to syntax that both accept.
# ruff: noqa: UP004, UP024, UP031
"""The drive server's link to NAOqi, which comes back for ever. Calls are only sent here; nothing waits for an answer.

Beside NAOqi (loopback) that is all. Over a network what TCP holds back arrives later, so each link is watched: what the
robot has not taken is known to the kernel, and a link on which it takes nothing for `STALL` is torn down, with all that
still waits in it, instead of being drained when the network is back.
"""

import ctypes
import fcntl
import os
import socket
import struct
import termios
import threading

from telepresence.drive.clock import monotonic
from telepresence.drive.datagram import INFINITY
from telepresence.security.shared_key import is_loopback

MYPY = False
if MYPY:
    from typing import Any, Callable, List, Optional  # noqa: F401, UP035

CONNECT_TIMEOUT = 1.5
"""Seconds for each step of a connection."""
PAUSE = 0.25
"""Seconds between two tries to connect."""
SAID_AFTER = 2.0
"""Seconds without a link after which it is said why: at the start of a station NAOqi comes later."""
WATCH_PERIOD = 0.05
"""Seconds between two looks at the link."""
STALL = 0.4
"""Seconds for which the robot may take nothing of what was sent to it over a network."""
TCP_USER_TIMEOUT = 18
"""Linux's number; Python 2.7 does not name it."""

# libqi's own messages repeat what is reported here.
os.environ.setdefault("QI_LOG_LEVEL", "1")


class NaoqiLink(object):
    """Connected from construction until `close`.

    Args:
        url: Of NAOqi, tcp://HOST:PORT.
        log: Takes a line for people.
        far: Behind the address, even if it is this machine's, is a network: a tunnel.
    Attributes:
        connections: How often a link was established.
        problem: Why there is none; empty while there is one.
        near: NAOqi is on this machine.
    Raises:
        ValueError: The address is none.
    """

    def __init__(self, url, log, far=False):
        # type: (str, Callable[[str], None], bool) -> None
        self.url, self._log = url, log
        self.near = is_near(url) and not far
        self.connections, self.problem = 0, "not connected yet"
        self._motion = None  # type: Any
        self._session = None  # type: Any
        self._wires = []  # type: List[Wire]
        self._drop = ""
        self._stop = threading.Event()
        self._wake = threading.Event()
        self._thread = threading.Thread(target=self._run, name="naoqi-link")
        self._thread.daemon = True
        self._thread.start()

    def motion(self):
        # type: () -> Any
        """ALMotion; None without a link."""
        return self._motion

    def waiting(self):
        # type: () -> bool
        """Whether something that was sent has not reached the robot yet; beside it, never."""
        return any(wire.waiting() for wire in self._wires)

    def drop(self, reason):
        # type: (str) -> None
        """Tear the link down, with what waits in it, and connect again."""
        self._drop = self._drop or reason
        self._motion = None
        for wire in self._wires:
            wire.abort()
        self._wake.set()

    def close(self):
        # type: () -> None
        self._stop.set()
        self._wake.set()
        self._thread.join(CONNECT_TIMEOUT)

    # --- the thread --------------------------------------------------------------------------------------------------

    def _run(self):
        # type: () -> None
        said, failing_since = "", monotonic()
        while not self._stop.is_set():
            try:
                self._connect()
                self._log("connected to NAOqi at %s" % self.url)
                said, failing_since = "", INFINITY
                self._watch()
            except (RuntimeError, EnvironmentError) as error:
                self.problem = first_line(error)
            self._close()
            failing_since = min(failing_since, monotonic())
            if self.problem != said and monotonic() - failing_since >= SAID_AFTER and not self._stop.is_set():
                said = self.problem
                self._log("no link to NAOqi at %s: %s; trying again until it answers" % (self.url, said))
            self._stop.wait(PAUSE)

    def _connect(self):
        # type: () -> None
        import qi

        self._drop = ""
        self._session = qi.Session()
        self._answer(self._session.connect(self.url, _async=True))
        motion = self._answer(self._session.service("ALMotion", _async=True))
        if not self.near:
            self._wires = wires()
        self.connections, self.problem, self._motion = self.connections + 1, "", motion

    def _answer(self, future):
        # type: (Any) -> Any
        """What a qi future brings. Raises RuntimeError with the robot's text, or after `CONNECT_TIMEOUT`."""
        end = monotonic() + CONNECT_TIMEOUT
        while future.isRunning() and not self._stop.is_set():
            if monotonic() >= end:
                raise RuntimeError("no answer within %g s" % CONNECT_TIMEOUT)
            self._stop.wait(0.01)
        return future.value(0)

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
            if not self._session.isConnected():
                raise RuntimeError("it closed the connection")

    def _close(self):
        # type: () -> None
        self._motion = None
        self.problem = self.problem or "closed"
        session, self._session = self._session, None
        left, self._wires = self._wires, []
        for wire in left:
            wire.abort()
        if session is not None:
            try:
                session.close()
            except RuntimeError:  # it is closed already
                pass
        for wire in left:
            wire.close()


class Wire(object):
    """A TCP connection that somebody else in this program, libqi, made.

    Args:
        descriptor: Its number there.
    Raises:
        socket.error: It is no TCP connection.
    """

    def __init__(self, descriptor):
        # type: (int) -> None
        self._socket = socket.fromfd(descriptor, socket.AF_INET, socket.SOCK_STREAM)
        try:
            self._socket.getpeername()
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._socket.setsockopt(socket.IPPROTO_TCP, TCP_USER_TIMEOUT, int(STALL * 1000))
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        except socket.error:
            self._socket.close()
            raise

    def waiting(self):
        # type: () -> int
        """Bytes that were sent and that the other side has not confirmed (tcp(7), SIOCOUTQ)."""
        try:
            return int(struct.unpack("i", fcntl.ioctl(self._socket.fileno(), termios.TIOCOUTQ, b"\0" * 4))[0])
        except EnvironmentError:  # closed: nothing will arrive
            return 0

    def abort(self):
        # type: () -> None
        """End the connection at once; what waits in it is thrown away (connect(2), AF_UNSPEC)."""
        ctypes.CDLL(None, use_errno=True).connect(self._socket.fileno(), b"\0" * 16, 16)

    def close(self):
        # type: () -> None
        self._socket.close()


def wires():
    # type: () -> List[Wire]
    """The TCP connections of this program, which has none but libqi's."""
    found = []
    for name in os.listdir("/proc/self/fd"):
        try:
            if os.readlink("/proc/self/fd/" + name).startswith("socket:"):
                found.append(Wire(int(name)))
        except EnvironmentError:  # another kind of socket, or closed meanwhile
            continue
    return found


def is_near(url):
    # type: (str) -> bool
    """Whether NAOqi at this address is on this machine.

    Raises:
        ValueError: The address is none.
    """
    scheme, _, rest = url.partition("://")
    host, _, port = rest.rpartition(":")
    if scheme not in ("tcp", "tcps") or not host or not port.isdigit():
        raise ValueError("not the address of NAOqi: %r; wanted is tcp://HOST:9559" % url)
    try:
        return is_loopback(host.strip("[]")) or is_own(host.strip("[]"))
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


def first_line(error):
    # type: (BaseException) -> str
    """What an error says, in at most 120 characters."""
    return (str(error).strip().splitlines() or [type(error).__name__])[0][:120]
