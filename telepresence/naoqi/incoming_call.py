"""A call that has arrived: decoded, run and answered on a worker, or cancelled before."""

from __future__ import annotations

import concurrent.futures
import logging
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

from . import workers
from .codec import decode_arguments, decode_from, encode, encode_dynamic
from .conversion import convert
from .future import Future
from .message import CALL, CANCELED, DYNAMIC_PAYLOAD, ERROR, REPLY, RETURN_TYPE, Header
from .reactor import reactor
from .signature import WireError

if TYPE_CHECKING:
    from .connection import Connection

log = logging.getLogger(__name__)

QUICK_BYTES = 16 * 1024
"""Calls with longer arguments are not answered on the reactor's thread, which serves everybody."""
_calling = threading.local()
_CANCELED_TEXT = "Call has been canceled."


class NotNow(Exception):
    """Raised by a method's quick answer: it would have to wait, so a worker is to run the method."""


def caller() -> Connection | None:
    """Return the connection whose call this thread carries out; None for a call from within this program."""
    return getattr(_calling, "connection", None)


class Method(NamedTuple):
    """One method: types, and the function that answers.

    inline: It returns at once and may run on the reactor's thread.
    quick: Answers as `function` does, on the reactor's thread and at once, or raises NotNow.
    connection_first: It gets the caller's Connection before the arguments.
    strict: See `ServedObject`.
    """

    uid: int
    returns: str
    name: str
    parameters: str
    function: Callable[..., Any]
    inline: bool = False
    connection_first: bool = False
    strict: bool = True
    quick: Callable[..., Any] | None = None


class Call:
    """One CALL or POST that has arrived: decoded, run and answered on a worker."""

    __slots__ = (
        *("_answered", "_begun", "_canceled", "_counted", "_future", "_lock", "_method"),
        *("connection", "header", "payload"),
    )

    def __init__(self, connection: Connection, header: Header, payload: Any, method: Method) -> None:
        self.connection, self.header, self.payload = connection, header, payload
        self._method = method
        self._future: Any = None
        self._begun = self._canceled = self._answered = self._counted = False
        self._lock = threading.Lock()

    def begin(self) -> bool:
        """Take a place among the connection's calls; refuse if there is none."""
        if self.connection.begin(self.header.identity, self, self.header.size):
            self._counted = True
            return True
        self.connection.error(self.header, f"more than {8 * self.connection.limits.pending_calls} calls are waiting")
        return False

    def run_quick(self) -> bool:
        """Answer at once if the method can; return whether it has. On the reactor's thread."""
        quick = self._method.quick
        if quick is None or self.header.size > QUICK_BYTES:
            return False
        wanted = ""
        try:
            arguments, wanted = self._arguments()
            result = quick(*arguments)
        except NotNow:
            return False
        except Exception as error:  # top of a remote call, as in `run`
            self._fail(error)
        else:
            self._succeed(result, wanted)
        return True

    def run(self) -> None:
        """Decode the arguments, call, and answer or wait for the future."""
        with self._lock:
            if self._canceled:
                return
            self._begun = True
        # It is carried out even if the caller has gone meanwhile: a script's last word may have been "stop".
        connection, method = self.connection, self._method
        wanted = ""
        try:
            arguments, wanted = self._arguments()
            before, _calling.connection = caller(), connection
            try:
                if method.connection_first:
                    result = method.function(connection, *arguments)
                else:
                    result = method.function(*arguments)
            finally:
                _calling.connection = before
        except Exception as error:  # top of a remote call: the caller gets every error as text
            return self._fail(error)
        if isinstance(result, (Future, concurrent.futures.Future)):
            self._await(result, wanted)
        else:
            self._succeed(result, wanted)

    def cancel(self) -> None:
        """The caller wants no answer any more: end it if it has not begun, or ask the future that it returned."""
        with self._lock:
            if self._canceled:
                return
            self._canceled = True
            begun, future = self._begun, self._future
        if not begun:
            self._cancelled()
        elif future is not None:
            future.cancel()

    def _arguments(self) -> tuple[tuple, str]:
        """Return the arguments, and the signature that the caller wants the answer in, or ""."""
        flags, parameters = self.header.flags, self._method.parameters
        objects = self.connection.objects(self.header.service)
        arguments, end = decode_arguments(parameters, self.payload, flags, objects=objects)
        if flags & DYNAMIC_PAYLOAD and parameters != "m":
            try:
                arguments = convert(arguments, parameters)
            except WireError:
                if self._method.strict:
                    raise
        wanted = decode_from("s", self.payload, end, objects=objects)[0] if flags & RETURN_TYPE else ""
        return arguments, wanted

    def _await(self, future: Any, wanted: str) -> None:
        with self._lock:
            self._future = future
            canceled = self._canceled
        if canceled:
            future.cancel()
        if isinstance(future, Future):
            future.when_done(lambda done: self._completed(done, wanted))
        else:
            future.add_done_callback(lambda done: self._completed(done, wanted))

    def _completed(self, future: Any, wanted: str) -> None:
        if reactor().inside():  # the answer of somebody else, which is to be decoded
            workers.submit(self._ended, future, wanted)
        else:
            self._ended(future, wanted)

    def _ended(self, future: Any, wanted: str) -> None:
        try:
            if isinstance(future, Future):
                if future.isCanceled():
                    return self._cancelled()
                result = future.value()
            elif future.cancelled():
                return self._cancelled()
            else:
                result = future.result()
        except Exception as error:  # the method's own, as in `run`
            return self._fail(error)
        self._succeed(result, wanted)

    def _succeed(self, result: Any, wanted: str) -> None:
        header, connection = self.header, self.connection
        if header.kind == CALL:
            returns, objects = self._method.returns, connection.objects(header.service)
            try:
                payload, flags = self._encoded(result, returns, wanted, objects)
            except Exception as error:  # the answer does not fit its declared type: the caller should know
                return self._fail(error)
            if not self._answered:
                self._answered = True
                connection.reply(header, payload, REPLY, flags)
        self._done()

    def _encoded(self, result: Any, returns: str, wanted: str, objects: Any) -> tuple[list[Any], int]:
        dialect = self.connection.dialect
        if wanted and wanted != returns:
            try:
                return encode_dynamic(result, wanted, objects=objects, dialect=dialect), DYNAMIC_PAYLOAD
            except WireError:
                log.debug("%s: no conversion to %s", self._method.name, wanted)
        return encode(returns, result, objects=objects, dialect=dialect), 0

    def _fail(self, error: BaseException) -> None:
        if not self._answered:
            self._answered = True
            self.connection.error(self.header, str(error) or type(error).__name__)
        self._done()

    def _cancelled(self) -> None:
        if not self._answered and self.header.kind == CALL:
            self._answered = True
            if self.connection.shared("RemoteCancelableCalls"):
                self.connection.reply(self.header, [], CANCELED)
            else:
                self.connection.reply(self.header, encode("m", _CANCELED_TEXT), ERROR)
        self._done()

    def _done(self) -> None:
        if self._counted:
            self.connection.finished(self.header.identity, self, self.header.size)
