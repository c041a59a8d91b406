# Runs on Pepper's own Python 2.7 as well as on Python 3: keep to syntax that both accept.
# ruff: noqa: B904, UP004, UP024, UP031
"""A connection to NAOqi for programs on the robot: calls, posts, answers; no calls or events of the robot are taken.

Wire: messages of a header (magic, id, size, version, type, flags, service, object, action; little-endian, 28 bytes) and
a payload. Service 0, action 8: capabilities, over TLS user and password too. Source: aldebaran/libqi,
src/messaging/message.hpp, boundobject.cpp, authprovider.cpp.

A reader thread takes answers and never waits for anybody. Sending never waits either: requests are small, and a socket
that does not take one at once belongs to a robot that reads nothing; its connection ends.

TLS, which a robot with NAOqi 2.9 speaks to other machines, is given to a connection by those who run there
(`naoqi_driver.robot_tls`); nothing here knows it but by what it offers:

    tls.begin(socket, host, timeout)  the handshake, within some seconds, on a socket that may wait; returns a cipher
    tls.login, tls.login_from         what is said at the login, {} for nothing; where that is from, for people
    cipher.seal(data)                 what is sent for some bytes
    cipher.open(data)                 for what came, the bytes that it holds, and what has to be sent because of it

All three raise NaoqiError, `begin` EnvironmentError too.

The cipher is used under the lock of the connection, whose socket stays the plain one: what waits in it is known to the
kernel and thrown away as without TLS, and half a record, like half a message, is obeyed by nobody.
"""

import ctypes
import errno
import fcntl
import itertools
import select
import socket
import struct
import termios
import threading

from telepresence.drive.clock import monotonic
from telepresence.robot_side.naoqi_values import NaoqiError, decode, encode, parse

MYPY = False
if MYPY:
    from typing import Any, Dict, Optional, Tuple  # noqa: F401, UP035

    from telepresence.robot_side.naoqi_values import Kind  # noqa: F401

CLOSING_TIME = 1.0
"""Seconds for which the end of a reader is waited for."""
LARGEST = 4 * 1024 * 1024
"""Bytes of a message that is taken."""
MOST_OPEN = 256
"""Answers that may be outstanding on a connection."""
TCP_USER_TIMEOUT = 18
"""Linux's number; Python 2.7 does not name it."""
CALL, POST = 1, 4

_HEADER = struct.Struct("<IIIHBBIII")
_MAGIC = 0x42ADDE42
_REPLY, _ERROR, _CAPABILITY, _CANCELED = 2, 3, 6, 8
_DYNAMIC = 1  # flag: the payload is a dynamic
_AUTHENTICATE, _ASKS, _DONE = 8, 2, 3
_STATE, _REASON = "__qi_auth_state", "__qi_auth_err_reason"
_LOGIN_ROUNDS = 8
"""A robot that asks more often than this does not want us."""
_CAPABILITIES = {
    "ClientServerSocket": False,  # calls to a client over its own connection
    "MessageFlags": True,
    "MetaObjectCache": False,
    "RemoteCancelableCalls": False,
    "ObjectPtrUID": False,
    "RelativeEndpointURI": True,
}


class Answer(object):
    """What a call brings."""

    def __init__(self, changed, name, returns):
        # type: (Any, str, Kind) -> None
        self.name = name
        self._changed, self._returns = changed, returns
        self._payload = None  # type: Optional[Tuple[Kind, bytes]]
        self._error = ""

    def running(self):
        # type: () -> bool
        return self._payload is None and not self._error

    def wait(self, seconds):
        # type: (float) -> bool
        """Whether the answer comes within some seconds, a refusal too."""
        end = monotonic() + seconds
        with self._changed:
            while self.running():
                left = end - monotonic()
                if left <= 0.0:
                    return False
                self._changed.wait(left)
        return True

    def value(self, seconds=0.0):
        # type: (float) -> Any
        """Return what the method returns.

        Raises:
            NaoqiError: It refuses, no answer came within `seconds`, or the connection ended.
        """
        if not self.wait(seconds):
            raise NaoqiError("%s: no answer within %g s" % (self.name, seconds))
        if self._payload is None:
            raise NaoqiError(self._error)
        return decode(*self._payload)

    def _end(self, payload, dynamic, error=""):
        # type: (Optional[bytes], bool, str) -> None
        """Called once, with the lock held."""
        self._error = error
        if payload is not None:
            self._payload = (("m", ()) if dynamic else self._returns, payload)
        self._changed.notify_all()


class Wire(object):
    """One connection.

    Args:
        place: Host and port.
        timeout: Seconds for each step.
        tls: What encrypts it and logs in, see above; None: plain TCP, over which no password goes.
    Attributes:
        problem: Why it has ended; empty while it is open.
    Raises:
        NaoqiError, EnvironmentError: There is none.
    """

    def __init__(self, place, timeout, tls=None):
        # type: (Tuple[str, int], float, Any) -> None
        self.problem = ""
        self._tls, self._cipher = tls, None  # type: Any, Any
        self._socket = socket.create_connection(place, timeout)
        if tls is not None:
            try:
                self._cipher = tls.begin(self._socket, place[0], timeout)
            except Exception:
                self._socket.close()
                raise
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket.setblocking(False)
        self._ids = itertools.count(1)
        self._answers = {}  # type: Dict[int, Answer]
        self._lock = threading.Lock()
        self._changed = threading.Condition(self._lock)
        self._reader = threading.Thread(target=self._read, name="naoqi-reader")
        self._reader.daemon = True
        self._reader.start()
        try:
            self._log_in(timeout)
        except NaoqiError:
            self.close()
            raise

    def call(self, service, action, arguments, returns, name, kind=CALL, object_=1):
        # type: (int, int, bytes, str, str, int, int) -> Answer
        """Send a call; the answer comes later. A post has none.

        Raises:
            NaoqiError: The connection has ended, or ends now.
        """
        answer = Answer(self._changed, name, parse(returns))
        with self._lock:
            if self.problem:
                raise NaoqiError("%s: %s" % (name, self.problem))
            if len(self._answers) >= MOST_OPEN:
                raise NaoqiError("%s: %d calls have no answer" % (name, MOST_OPEN))
            number = next(self._ids) & 0xFFFFFFFF
            if kind == CALL:
                self._answers[number] = answer
            self._send(number, kind, service, object_, action, arguments)
        return answer

    def limit(self, seconds):
        # type: (float) -> None
        """End the connection once the other side takes nothing for `seconds`; what waits is then lost."""
        self._socket.setsockopt(socket.IPPROTO_TCP, TCP_USER_TIMEOUT, int(seconds * 1000))
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))

    def waiting(self):
        # type: () -> int
        """Bytes that were sent and that the other side has not confirmed (tcp(7), SIOCOUTQ)."""
        with self._lock:
            if self.problem:
                return 0
            return int(struct.unpack("i", fcntl.ioctl(self._socket.fileno(), termios.TIOCOUTQ, b"\0" * 4))[0])

    def abort(self, reason="aborted"):
        # type: (str) -> None
        """End the connection at once; what waits in it is thrown away (connect(2), AF_UNSPEC)."""
        with self._lock:
            self._abort(reason)

    def close(self):
        # type: () -> None
        """End the connection; what was sent still goes."""
        with self._lock:
            self._shut("closed")
        if threading.current_thread() is not self._reader:
            self._reader.join(CLOSING_TIME)

    # --- inside ------------------------------------------------------------------------------------------------------

    def _log_in(self, timeout):
        # type: (float) -> None
        if self._tls is not None:
            return self._log_in_by_tls(timeout)
        capabilities = encode(parse("{sm}"), _CAPABILITIES)
        try:
            said = self._say_at_login(capabilities, timeout)
        except NaoqiError:
            if self.problem:
                raise
            # NAOqi up to 2.1 knows no such question.
            self.call(0, 0, capabilities, "v", "capabilities", _CAPABILITY, 0)
            return
        if said.get(_STATE) != _DONE:
            raise NaoqiError("it wants a login; on the robot itself tcp://127.0.0.1:9559 wants none")

    def _log_in_by_tls(self, timeout):
        # type: (float) -> None
        """Say user and password; a robot that asks again is told the same again."""
        login = self._tls.login
        message = dict(_CAPABILITIES, **login)
        try:
            for _ in range(_LOGIN_ROUNDS):
                said = self._say_at_login(encode(parse("{sm}"), message), timeout)
                state, message = said.get(_STATE), login
                if state == _DONE:
                    return
                if state != _ASKS or not login:
                    raise NaoqiError(str(said.get(_REASON, "refused")))
            raise NaoqiError("it does not stop asking")
        except NaoqiError as error:
            raise NaoqiError("the login failed (%s): %s" % (self._tls.login_from, error))

    def _say_at_login(self, message, timeout):
        # type: (bytes, float) -> Dict[str, Any]
        answer = self.call(0, _AUTHENTICATE, message, "{sm}", "the first message", object_=0)
        if not answer.wait(timeout):
            self.abort("no answer within %g s" % timeout)
        said = answer.value()
        if not isinstance(said, dict):
            self.abort("it answers as no NAOqi does")
            raise NaoqiError(self.problem)
        return said

    def _send(self, number, kind, service, object_, action, payload):
        # type: (int, int, int, int, int, bytes) -> None
        """Send one message; the caller holds the lock."""
        data = _HEADER.pack(_MAGIC, number, len(payload), 0, kind, 0, service, object_, action) + payload
        if self._cipher is not None:
            try:
                data = self._cipher.seal(data)
            except NaoqiError as error:
                self._abort(str(error))
                raise
        self._put(data)

    def _put(self, data):
        # type: (bytes) -> None
        """Hand bytes to the socket, at once or not at all; the caller holds the lock."""
        try:
            sent = _again(self._socket.send, data)
        except EnvironmentError as error:
            sent = 0
            problem = "it takes nothing more" if error.errno == errno.EAGAIN else str(error)
        else:
            problem = "it takes nothing more"
        if sent != len(data):
            self._abort(problem)
            raise NaoqiError(problem)

    def _abort(self, reason):
        # type: (str) -> None
        if not self.problem:
            ctypes.CDLL(None, use_errno=True).connect(self._socket.fileno(), b"\0" * 16, 16)
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            self._shut(reason)

    def _shut(self, reason):
        # type: (str) -> None
        """Answers end now; the reader, which this wakes, closes the socket."""
        if self.problem:
            return
        self.problem = reason
        answers, self._answers = self._answers, {}
        for answer in answers.values():
            answer._end(None, False, "%s: %s" % (answer.name, reason))
        try:
            self._socket.shutdown(socket.SHUT_RDWR)
        except EnvironmentError:  # it has ended already
            pass

    def _read(self):
        # type: () -> None
        reason = "its reader failed"
        try:
            arriving = self._pieces()
            next(arriving)
            while True:
                head = arriving.send(_HEADER.size)
                magic, number, size, version, kind, flags, service, object_, action = _HEADER.unpack(head)
                if magic != _MAGIC or version or size > LARGEST:
                    raise NaoqiError("it sends what is no message of NAOqi's")
                self._take(number, kind, flags, service, object_, action, arriving.send(size))
        except (NaoqiError, EnvironmentError, select.error) as error:
            reason = str(error)
        finally:
            with self._lock:
                self._shut(reason)
                self._socket.close()

    def _opened(self, data):
        # type: (bytes) -> bytes
        """The bytes that something that came holds."""
        if self._cipher is None:
            return data
        with self._lock:
            plain, answer = self._cipher.open(data)
            if answer:
                self._put(answer)
        return plain

    def _pieces(self):
        # type: () -> Any
        """What arrives, in the sizes that are asked for by `send`."""
        # Not by a recv that waits: in some versions of Linux 6 nobody can abort a connection in which somebody does.
        poll = select.poll()
        poll.register(self._socket, select.POLLIN)
        buffered = bytearray(self._opened(b""))  # what came together with the handshake's end
        size = yield b""
        while True:
            while len(buffered) < size:
                _again(poll.poll)
                try:
                    data = _again(self._socket.recv, 65536)
                except EnvironmentError as error:
                    if error.errno == errno.EAGAIN:
                        continue
                    raise
                if not data:
                    raise NaoqiError("it closed the connection")
                buffered += self._opened(data)
            piece = bytes(buffered[:size])
            del buffered[:size]
            size = yield piece

    def _take(self, number, kind, flags, service, object_, action, payload):
        # type: (int, int, int, int, int, int, bytes) -> None
        with self._lock:
            if kind == CALL:
                no = encode(("m", ()), "this program takes no calls")
                self._send(number, _ERROR, service, object_, action, no)
            elif kind in (_REPLY, _ERROR, _CANCELED):
                answer = self._answers.pop(number, None)
                if answer is None:
                    return
                if kind == _REPLY:
                    answer._end(payload, bool(flags & _DYNAMIC))
                else:
                    answer._end(None, False, _text(payload) if kind == _ERROR else "cancelled")


def _text(payload):
    # type: (bytes) -> str
    """What an error says."""
    try:
        return str(decode(("m", ()), payload)).strip() or "refused"
    except NaoqiError:
        return "refused"


def _again(function, *arguments):
    # type: (Any, *Any) -> Any
    """Call it until no signal comes in between, which Python 2.7 leaves to its users."""
    while True:
        try:
            return function(*arguments)
        except (EnvironmentError, select.error) as error:
            if error.args[0] != errno.EINTR:
                raise
