"""A link to NAOqi that reconnects automatically.

Wire: NAOqi's messaging (`telepresence.naoqi`) over TCP. `tcp://ip:9559` up to NAOqi 2.8, without a login;
`tcps://ip:9503` from 2.9, with user and password (ros-naoqi/libqi-python, issues 7 and 22), which go to the robot whose
certificate is pinned (`certificate_pin`), and nowhere else. A request names a service, a method and its arguments; the
reply is a value or an error text. The robot calls our services over our connection, and nothing here listens, unless
that is asked for (`call_back`).

Whatever the other side sends, a caller gets a value of bounded size, whose types the functions of `replies` check, or a
`RobotError` whose text is one short line.

One thread owns the session: it connects, asks every two seconds whether the robot still answers, and connects again
with growing pauses. Any thread may call; a call without a link fails at once with `RobotUnreachable`.
"""

from __future__ import annotations

import logging
import re
import threading
import time
from collections.abc import Callable
from typing import Any

from naoqi_driver.address import Address, Login
from naoqi_driver.call_back import LIMITS, listen_url
from naoqi_driver.certificate_pin import CertificatePin, tls_context
from naoqi_driver.replies import CallRefused, RobotError, UnexpectedReply, bounded
from telepresence import naoqi, ports, start_patience
from telepresence.robot_side.naoqi_values import error_text
from telepresence.security.outside_text import LONGEST, clean

log = logging.getLogger(__name__)

CONNECT_TIMEOUT = 2.0
"""Seconds allowed for the connection, and for its first answer. TCP asks again after 1 s and then only after 3 s, so a
new attempt is sooner there when the network is back."""
PROBE_PERIOD = 2.0
PROBE_TIMEOUT = 1.0
FIRST_PAUSE, LONGEST_PAUSE = 0.2, 1.0
"""Seconds between two attempts to connect; doubled after every failure once `EAGER_TIME` is over."""
EAGER_TIME = 10.0
"""Seconds of quick retries, so that a robot that starts together with us is reached as soon as it listens."""
LOSS_REPORT_AFTER = 2.0
"""Seconds without a link before it is reported, once there was one; before, see `telepresence.start_patience`."""
CALL_TIMEOUT = 1.0


class RobotUnreachable(RobotError):
    """There is no link to the robot, or it did not answer in time. The link is being repaired meanwhile."""


class PendingCall:
    """A request that is on its way."""

    def __init__(self, connection: Connection, future: naoqi.Future, name: str) -> None:
        self._connection = connection
        self._future = future
        self._name = name

    @property
    def done(self) -> bool:
        return not self._future.isRunning()

    def result(self, timeout: float = CALL_TIMEOUT) -> Any:
        """The reply, waited for at most `timeout` seconds.

        Raises:
            RobotUnreachable: No reply in time, or the link broke.
            CallRefused: The robot answered with an error.
            UnexpectedReply: It answered with what no NAOqi sends.
        """
        try:
            value = self._future.value(round(timeout * 1000))
        except naoqi.WireError as error:
            raise UnexpectedReply(f"{self._name}: {_reason(error)}") from None
        except RuntimeError as error:
            raise self._connection.translate(error, self._name, self._future.isRunning(), timeout) from None
        return bounded(value, self._name)

    def on_failure(self, report: Callable[[RobotError], None]) -> None:
        """Have `report` called, on another thread, if the request is refused or is lost with the link."""

        def ended(_future: naoqi.Future) -> None:
            try:
                self.result(0.0)
            except RobotError as error:
                report(error)

        self._future.addCallback(ended)

    def cancel(self) -> None:
        """Ask the robot to give up the request."""
        if self._future.isRunning():
            self._future.cancel()


class Connection:
    """The link to one robot.

    Args:
        address: Where it answers.
        on_connected: Called after every new connection, on the link's thread; may call the robot.
        on_lost: Called once when a link that was up is lost, with the cause.
        listen: Where the robot may connect to services of ours, as `call_back.listen_url` takes it; None for nowhere.
    """

    def __init__(
        self,
        address: Address,
        on_connected: Callable[[], None] | None = None,
        on_lost: Callable[[str], None] | None = None,
        listen: str | None = None,
    ) -> None:
        self.address = address
        self.listens_at = ""
        """Where the robot may connect to services of ours now; empty while it may not."""
        self.connections = 0
        """How often a link was established."""
        self._on_connected = on_connected or (lambda: None)
        self._on_lost = on_lost or (lambda _cause: None)
        self._listen_url = listen
        self._problem = "not connected yet"
        self._session: naoqi.Session | None = None
        self._services: dict[str, Any] = {}
        self._lock = threading.Lock()
        self._up = threading.Event()
        self._wake = threading.Event()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="naoqi-link", daemon=True)

    def start(self) -> Connection:
        if self.address.password and not self.address.encrypted:
            log.info("the robot's password stays here: %s is not encrypted, tcps:// is", self.address)
        self._thread.start()
        return self

    def __enter__(self) -> Connection:
        return self.start()

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        self._stop.set()
        self._wake.set()
        if self._thread.ident is not None:
            self._thread.join(timeout=1.0)

    @property
    def connected(self) -> bool:
        return self._up.is_set()

    @property
    def problem(self) -> str | None:
        """Why there is no link; None while there is one."""
        return None if self.connected else self._problem

    def wait_connected(self, timeout: float) -> bool:
        return self._up.wait(timeout)

    def call(self, service: str, method: str, *arguments: Any, timeout: float = CALL_TIMEOUT) -> Any:
        """Call `service.method(*arguments)` and wait at most `timeout` seconds for the reply.

        Raises:
            RobotUnreachable: No link, or no reply in time.
            CallRefused: The robot knows no such service or method, or answered with an error.
        """
        return self.call_async(service, method, *arguments).result(timeout)

    def call_async(self, service: str, method: str, *arguments: Any) -> PendingCall:
        """Send the request and return at once; several may be on their way together.

        Raises:
            RobotUnreachable, CallRefused: As `call`, when the request cannot even be sent.
        """
        session = self._linked()
        name = f"{service}.{method}"
        try:
            future = self._service(session, service).call(method, *arguments, _async=True)
        except RuntimeError as error:
            raise self.translate(error, name, False, 0.0) from None
        return PendingCall(self, future, name)

    def subscribe(self, service: str, signal: str, callback: Callable[..., None]) -> None:
        """Have `callback` called on another thread with what the service's signal carries, until the link is lost.

        Raises:
            RobotUnreachable: No link, or no answer in time.
            CallRefused: The robot knows no such service or signal.
        """
        session = self._linked()
        name = f"{service}.{signal}"
        try:
            future = getattr(self._service(session, service), signal).connect(callback, _async=True)
        except AttributeError:
            raise CallRefused(f"{name}: no such signal") from None
        except RuntimeError as error:
            raise self.translate(error, name, False, 0.0) from None
        PendingCall(self, future, name).result()

    def register_service(self, name: str, service: object) -> int:
        """Offer `service` to the robot under `name` until `unregister_service` or the end of the link; return its id.

        The robot calls it over this connection, or at `listens_at`.

        Raises:
            RobotUnreachable: No link, or no answer in time; what is registered later nevertheless is unregistered.
            CallRefused: The name is taken.
        """
        session = self._linked()
        self._listen(session)
        future = session.registerService(name, service, _async=True)
        try:
            return int(PendingCall(self, future, f"registering {name}").result())
        except RobotUnreachable:
            future.andThen(lambda number: session.unregisterService(number, _async=True))
            raise

    def unregister_service(self, number: int) -> None:
        """Withdraw what `register_service` has offered.

        Raises:
            RobotUnreachable: No link, or no answer in time.
            CallRefused: There is no such service.
        """
        future = self._linked().unregisterService(number, _async=True)
        PendingCall(self, future, f"unregistering service {number}").result()

    def _listen(self, session: naoqi.Session) -> None:
        """Listen for the robot, once a link, before it hears of a service."""
        if self._listen_url is None or self.listens_at:
            return
        try:
            here, robot = session.ends()
            url = listen_url(self._listen_url, here, robot, self.address.encrypted)
            if url:
                session.listen(url, only_from=[robot], limits=LIMITS)
                self.listens_at = session.endpoints()[0]
                log.info("for services of ours the robot may connect to %s", self.listens_at)
        except (RuntimeError, OSError) as error:
            log.warning("the robot can call no service of ours but over our own connection: %s", _reason(error))

    def translate(self, error: RuntimeError, name: str, unanswered: bool, timeout: float) -> RobotError:
        """What an error of the library means to the caller of `name`."""
        if unanswered:
            self._wake.set()
            return RobotUnreachable(f"{name}: no reply from {self.address} within {timeout:g} s")
        cause = _reason(error)
        session = self._session
        if session is None or not session.isConnected() or cause in _BROKEN_LINK:
            with self._lock:
                self._services.clear()  # one of a program that has ended may be there again
            self._wake.set()
            return RobotUnreachable(f"{name}: the link to {self.address} broke: {cause}")
        return CallRefused(f"{name}: {cause}")

    def _linked(self) -> naoqi.Session:
        session = self._session
        if session is None:
            raise RobotUnreachable(f"robot at {self.address} is not reachable: {self._problem}")
        return session

    def _service(self, session: naoqi.Session, name: str) -> Any:
        with self._lock:
            proxy = self._services.get(name)
        if proxy is None:
            future = session.service(name, _async=True)
            try:
                proxy = future.value(round(CALL_TIMEOUT * 1000))
            except RuntimeError as error:
                raise self.translate(error, name, future.isRunning(), CALL_TIMEOUT) from None
            with self._lock:
                if self._session is session:
                    self._services[name] = proxy
        return proxy

    def _run(self) -> None:
        pause, dropped, reported = FIRST_PAUSE, 0.0, None
        failing_since, patience = time.monotonic(), start_patience.patience()
        while not self._stop.is_set():
            try:
                session = self._connect()
            except (RuntimeError, OSError) as error:
                cause = _reason(error)
                self._problem = cause
                if cause != reported and time.monotonic() - failing_since >= patience:
                    hint = _hint(self.address, cause)
                    log.warning(
                        "cannot reach the robot at %s: %s; trying again until it answers%s", self.address, cause, hint
                    )
                    reported = cause
                self._stop.wait(pause)
                if time.monotonic() - failing_since >= EAGER_TIME:
                    pause = min(2 * pause, LONGEST_PAUSE)
                continue
            began = time.monotonic()
            self._serve(session)
            # A robot that takes links and drops them at once is not asked more often than one that takes none.
            lasted = time.monotonic() - began >= EAGER_TIME
            dropped = 0.0 if lasted else min(max(1.0, 2.0 * dropped), LONGEST_PAUSE)
            self._stop.wait(dropped)
            pause, reported = FIRST_PAUSE, None
            failing_since, patience = time.monotonic(), LOSS_REPORT_AFTER

    def _connect(self) -> naoqi.Session:
        """A new session. Raises RuntimeError with the cause."""
        session, tls = naoqi.Session(), None
        if self.address.encrypted:
            tls = tls_context(CertificatePin(*self.address.place))
            if self.address.user or self.address.password:
                session.setClientAuthenticatorFactory(Login(self.address.user or "nao", self.address.password or ""))
        future = session.connect(self.address.url, tls=tls, timeout=CONNECT_TIMEOUT, _async=True)
        if not self._answered(future, CONNECT_TIMEOUT):
            future.addCallback(lambda _: session.close())  # if it is connected after all
            raise RuntimeError(f"no answer within {CONNECT_TIMEOUT:g} s")
        future.value(0)
        return session

    def _answered(self, future: naoqi.Future, timeout: float) -> bool:
        """Wait for the future, at most `timeout` seconds, and no longer than the connection is wanted."""
        deadline = time.monotonic() + timeout
        future.when_done(lambda _: self._wake.set())
        while future.isRunning() and not self._stop.is_set() and time.monotonic() < deadline:
            self._wake.wait(deadline - time.monotonic())
            self._wake.clear()
        return not future.isRunning()

    def _serve(self, session: naoqi.Session) -> None:
        """Keep the session until the robot stops answering or the connection is closed."""
        session.disconnected.connect(lambda *_: self._wake.set())
        with self._lock:
            self._services.clear()
            self._session = session
        self.connections += 1
        self._up.set()
        log.info("connected to the robot at %s", self.address)
        self._report(self._on_connected)
        cause = None
        while cause is None and not self._stop.is_set():
            self._wake.wait(PROBE_PERIOD)
            self._wake.clear()
            cause = None if self._stop.is_set() else self._probe(session)
        if self._stop.is_set():
            cause = None  # it was closed while it waited for an answer, and need not be lost
        with self._lock:
            self._session = None
            self._services.clear()
        self._problem, self.listens_at = cause or "closed", ""
        self._up.clear()
        session.close(abort=cause is not None)  # else a robot that is back says and does what was asked for long ago
        if cause is not None:
            log.warning("lost the robot at %s: %s; connecting again", self.address, cause)
            self._report(self._on_lost, cause)

    def _probe(self, session: naoqi.Session) -> str | None:
        """Why the robot counts as lost, or None when it answers."""
        try:
            future = self._service(session, "ServiceDirectory").call("machineId", _async=True)
            if self._answered(future, PROBE_TIMEOUT):
                future.value(0)
                return None
        except (RuntimeError, RobotError) as error:
            log.debug("probe of %s failed: %s", self.address, error)
        return f"it did not answer within {PROBE_TIMEOUT:g} s" if session.isConnected() else "it closed the connection"

    def _report(self, callback: Callable[..., None], *arguments: object) -> None:
        try:
            callback(*arguments)
        except RobotError as error:
            log.warning("%s", error)
        except Exception:  # of the callback's own; the link must outlive it
            log.exception("a callback of the link to %s failed", self.address)


_BROKEN_LINK = ("Socket is not connected", "Session closed", "Session not connected.", "Socket Disconnected")
"""Texts for a request that a dying link swallowed."""
_NOBODY_THERE = re.compile(r"no answer|Connect error: -?\d+: ")
"""How a cause begins that the network gives; of a robot that is there and refuses us, the cause says what to do."""


def _hint(address: Address, cause: str) -> str:
    """What a person can look at when nobody answers; empty for another cause."""
    if not _NOBODY_THERE.match(cause):
        return ""
    host, port = address.place
    place = host if port == ports.NAOQI else f"{host}:{port}"
    return f". Is it on, in this network, and is nao_ip:= its address?  ./stack doctor {place}"


def _reason(error: Exception) -> str:
    return clean(error_text(error, LONGEST + 1), LONGEST)  # which marks that something is left out
