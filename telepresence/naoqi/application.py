"""The application object of the vendor's package: a session made from the command line, and a main loop."""

from __future__ import annotations

import atexit
import sys
import threading
from collections.abc import Callable, MutableSequence
from typing import Any

from .future import describe
from .log import logger
from .logging import setLevel
from .routing import normal
from .session import DEFAULT_URL, Session
from .workers import blocking

_URL, _LISTEN = "--qi-url", "--qi-listen-url"
_STANDALONE, _LOG_LEVEL = "--qi-standalone", "--qi-log-level"

_log = logger("application")
_application: ApplicationSession | None = None
_lock = threading.Lock()


class ApplicationSession:
    """A session whose addresses come from the command line: --qi-url=URL, --qi-listen-url=URL, --qi-standalone.
    --qi-log-level=0..6 sets the level of the messages.

    The options are taken out of the list that was given, so that the program's own parser does not see them.
    """

    def __init__(self, args: MutableSequence[str], autoExit: bool = True, url: str = "") -> None:
        self._url = normal(_take(args, _URL) or url or DEFAULT_URL)
        if level := _take(args, _LOG_LEVEL):
            _set_level(level)
        self._listen = _take(args, _LISTEN)
        self._standalone = _take_flag(args, _STANDALONE)
        self._session = Session()
        self._auto_exit = autoExit
        self._stopped = threading.Event()
        self._at_run: list[Callable[[], Any]] = []
        self._started = False

    @property
    def session(self) -> Session:
        """The session; it is connected after `start`."""
        return self._session

    @property
    def url(self) -> str:
        """The address that `start` connects to."""
        return self._url

    def start(self) -> None:
        """Connect the session, once. RuntimeError: it cannot be connected."""
        if self._started:
            return
        if self._standalone:
            self._session.listenStandalone(self._listen or DEFAULT_URL)
        else:
            self._session.connect(self._url)
            if self._listen:
                self._session.listen(self._listen)
        self._started = True
        if self._auto_exit:
            self._session.disconnected.connect(lambda _reason: self.stop())

    def run(self) -> None:
        """Start, and block until `stop`, the end of the connection (with autoExit) or Ctrl-C."""
        self.start()
        for callback in self._at_run:
            try:
                callback()
            except Exception as error:
                _log.warning("Exception in a callback of atRun: %s", describe(error))
        with blocking():
            self._stopped.wait()

    def atRun(self, func: Callable[[], Any]) -> bool:
        """Have `func()` called when `run` begins."""
        self._at_run.append(func)
        return True

    def stop(self) -> None:
        """Make `run` return."""
        self._stopped.set()


def Application(
    args: MutableSequence[str] | None = None, raw: bool = False, autoExit: bool = True, url: str | None = None
) -> ApplicationSession:
    """Make the application of this process; there is only one.

    Args:
        args: The command line, sys.argv if not given.
        raw: Accepted for the vendor's interface; the session is simply not used then.
        autoExit: `run` returns when the connection ends.
        url: Address to connect to unless --qi-url gives one.
    Raises:
        Exception: There is one already.
    """
    global _application
    with _lock:
        if _application is not None:
            raise Exception("Application was already initialized")
        _application = ApplicationSession(sys.argv if args is None else args, autoExit, url or "")
        return _application


def _take(args: MutableSequence[str], option: str) -> str:
    """Take "--option=value" or "--option value" out of a command line; return the value, "" without it."""
    for at, argument in enumerate(args):
        if argument == option and at + 1 < len(args):
            del args[at]
            return args.pop(at)
        if argument.startswith(option + "="):
            return args.pop(at)[len(option) + 1 :]
    return ""


def _set_level(text: str) -> None:
    try:
        setLevel(int(text))
    except ValueError:
        raise RuntimeError(f"{_LOG_LEVEL}: {text!r} is not a level of 0 to 6") from None


def _take_flag(args: MutableSequence[str], option: str) -> bool:
    if option not in args:
        return False
    args.remove(option)
    return True


def _at_exit() -> None:
    if _application is not None:
        _application.stop()
        _application.session.close()


atexit.register(_at_exit)
