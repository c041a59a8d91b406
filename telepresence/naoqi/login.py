"""How a connection begins, at both ends: capabilities and, from NAOqi 2.9 on, user and password.

    client: CALL 0.0.8 {sm}   capabilities, and auth_user, auth_token
    server: REPLY {sm}        capabilities and __qi_auth_state: 3 in, 2 tell me more, 1 refused; or ERROR and the end

A robot that is older than this (2.1) answers ERROR and wants a CAPABILITY message instead.
"""

from __future__ import annotations

import hmac
import logging
import threading
import time
from collections.abc import Mapping
from typing import Any, Callable, Protocol

from .codec import decode, encode
from .connection import LOST, Connection
from .dial import CONNECT_S
from .dynamics import Typed
from .message import CALL, CAPABILITY, ERROR, POST, REPLY, Header
from .releases import Release
from .signature import WireError
from .workers import blocking

log = logging.getLogger(__name__)

AUTHENTICATE = 8
STATE, REASON, PREFIX = "__qi_auth_state", "__qi_auth_err_reason", "auth_"
REFUSED, CONTINUE, DONE = 1, 2, 3
_ROUNDS = 8
"""A server that asks for more than this does not want us."""
_VERSION = "[1.0]"


class Authenticator(Protocol):
    """Gives login data, with the vendor's interface. Keys are "user", "token" ..., without the wire's prefix."""

    def initialAuthData(self) -> Mapping[str, Any]: ...

    def _processAuth(self, data: Mapping[str, Any]) -> Mapping[str, Any]: ...


def log_in(connection: Connection, authenticator: Authenticator | None = None, timeout: float = CONNECT_S) -> None:
    """Start a dialled connection and log in; the caller's thread waits.

    Args:
        authenticator: Without it as on NAOqi up to 2.8.
        timeout: For all of it [s].
    Raises:
        RuntimeError: Refused, not understood, or too late. The connection is closed then.
    """
    deadline = time.monotonic() + timeout
    connection.before_login = _early_message(connection)
    connection.start()
    data = _prefixed(authenticator.initialAuthData()) if authenticator is not None else {}
    message = {**{name: bool(value) for name, value in connection.local.items()}, **data}
    try:
        for _ in range(_ROUNDS):
            answer = _ask(connection, message, deadline, older_ends=authenticator is None)
            if answer is None:
                return
            if authenticator is None:
                raise RuntimeError("Authentication failed: the robot asks for a user and a password")
            wanted = {name[len(PREFIX) :]: value for name, value in answer.items() if name.startswith(PREFIX)}
            message = _prefixed(authenticator._processAuth(wanted))
        raise RuntimeError("Authentication failed: the robot does not stop asking")
    except Exception as error:  # the authenticator is the user's code; whatever ends the login ends the connection
        connection.close(str(error))
        raise


def _ask(connection: Connection, message: dict[str, Any], deadline: float, older_ends: bool) -> dict[str, Any] | None:
    """Send one round; return what the robot asks for, or None if we are in."""
    over = threading.Event()
    outcome: list[Any] = [None, None]  # what is asked for, and the error

    def done(kind: int, flags: int, payload: Any) -> None:
        try:
            outcome[0] = _answered(connection, kind, payload, older_ends)
        except RuntimeError as error:
            outcome[1] = error
        over.set()

    connection.start_call(0, 0, AUTHENTICATE, encode("{sm}", message), 0, done)
    with blocking():
        if not over.wait(max(0.0, deadline - time.monotonic())):
            raise RuntimeError("Authentication failed: the robot does not answer")
    if outcome[1] is not None:
        raise outcome[1]
    return outcome[0]


def _answered(connection: Connection, kind: int, payload: Any, older_ends: bool) -> dict[str, Any] | None:
    """Take the answer to a round. On the reactor's thread, so that nothing that follows it is met before the login."""
    if kind == LOST:
        raise RuntimeError(f"Authentication failed: {payload}")
    if kind == ERROR:
        text = str(decode("m", payload))
        if not older_ends or text.startswith("Authentication failed"):
            raise RuntimeError(text)
        connection.trust()  # it is older than authentication
        connection.send(CAPABILITY, 0, 0, 0, encode("{sm}", dict(connection.local)))
        return None
    if kind != REPLY:
        raise RuntimeError("Authentication failed: the robot has canceled it")
    answer = dict(decode("{sm}", payload))
    state = answer.pop(STATE, None)
    connection.learn({name: value for name, value in answer.items() if not name.startswith(("__qi", PREFIX))})
    if state == DONE:
        connection.trust()
        return None
    if state == CONTINUE:
        return answer
    if state == REFUSED:
        raise RuntimeError(f"Authentication failed: {answer.get(REASON, 'refused')}")
    raise RuntimeError("Invalid authentication state token.")


def _prefixed(data: Mapping[str, Any]) -> dict[str, Any]:
    return {name if name.startswith(PREFIX) else PREFIX + name: value for name, value in data.items()}


def _early_message(connection: Connection) -> Callable[[Header, Any], None]:
    """Return what a client does with messages that come before its login is over."""

    def handle(header: Header, payload: Any) -> None:
        if header.kind == CAPABILITY:
            connection.learn(decode("{sm}", payload))
        elif header.kind == CALL:
            connection.error(header, "The call request could not be handled.")

    return handle


def _is_capability(name: Any) -> bool:
    """Whether an entry of a login is one; names that are not UTF-8 come as bytes and are none."""
    return isinstance(name, str) and not name.startswith(("__qi", PREFIX))


class ServerLogin:
    """The server's part for one connection, until it is over.

    Args:
        users: Password by user; None: whoever connects is in.
        on_done: Called when the peer is in.
    """

    def __init__(
        self, connection: Connection, release: Release, users: Mapping[str, str] | None, on_done: Callable[[], None]
    ) -> None:
        self._connection = connection
        self._release = release
        self._users = users
        self._on_done = on_done
        self._announced = False

    def handle(self, header: Header, payload: Any) -> None:
        """Take a message of a peer that is not in; on the reactor's thread.

        Raises: WireError: It is malformed; the connection ends.
        """
        connection = self._connection
        if header.kind == CAPABILITY:
            connection.learn(decode("{sm}", payload))
            if not self._release.authentication:
                self._admit_silently()
            return
        at_server = header.service == 0 and header.object == 0
        if header.kind == CALL and at_server and header.action == AUTHENTICATE and self._release.authentication:
            self._authenticate(header, payload)
        elif self._users is None and at_server and header.action != AUTHENTICATE:
            self._admit_silently()  # older than authentication; what it asked is not answered
        elif self._users is None and self._release.version in ("2.1", "2.5"):
            self._admit_silently()
            if at_server:
                return connection.error(header, "can't find service, address: 0.0.8")
            connection.message(header, payload)
        elif at_server:
            text = f"service #{header.service}, type #{header.kind}, action #{header.action}"
            connection.error(
                header, f"Expected authentication (service #0, type #{CALL}, action #{AUTHENTICATE}), received {text}"
            )
            connection.finish("the peer did not log in")
        elif header.kind in (CALL, POST):
            connection.error(header, "The call request could not be handled.")

    def _authenticate(self, header: Header, payload: Any) -> None:
        connection = self._connection
        data = decode("{sm}", payload)
        if len(data) > connection.limits.capabilities:
            raise WireError(f"a login with {len(data)} entries")
        connection.learn({name: value for name, value in data.items() if _is_capability(name)})
        if self._users is not None and not self._known(data.get(PREFIX + "user"), data.get(PREFIX + "token")):
            log.info("%s: wrong user or password", connection.peer)
            connection.error(header, f"Authentication failed: wrong user or password {_VERSION}")
            return connection.finish("wrong user or password")
        answer: dict[str, Any] = {STATE: Typed("I", DONE)}
        if not self._announced:
            self._announced = True
            answer.update(connection.local)
        connection.reply(header, encode("{sm}", answer))
        self._admit()

    def _known(self, user: Any, token: Any) -> bool:
        password = self._users.get(user) if self._users is not None and isinstance(user, str) else None
        given = token if isinstance(token, str) else ""
        right = hmac.compare_digest((password or "").encode(), given.encode("utf-8", "replace"))
        return right and password is not None

    def _admit_silently(self) -> None:
        self._connection.send(CAPABILITY, 0, 0, 0, encode("{sm}", dict(self._connection.local)))
        self._admit()

    def _admit(self) -> None:
        self._connection.trust()
        self._on_done()
