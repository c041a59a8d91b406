"""LogManager: sends the robot's log to listeners; the robot's log is this simulator's log.

A message is a structure of source, level (1 fatal to 6 debug), category, location, text, number and two dates [ns], by
the robot's steady clock and since 1970, as robots of NAOqi 2.5 declare it.
"""

from __future__ import annotations

import itertools
import logging
import os
import threading
import time
import weakref
from typing import Any

from pepper_sim.naoqi.service import Service, remote, within
from telepresence.naoqi.served_object import ServedObject
from telepresence.naoqi.signals import Signal

_MESSAGE = "(sisssIll)<LogMessage,source,level,category,location,message,id,date,systemDate>"
_QI_LEVELS = ((logging.CRITICAL, 1), (logging.ERROR, 2), (logging.WARNING, 3), (logging.INFO, 4), (logging.DEBUG, 6))
_PYTHON_LEVELS = {1: logging.CRITICAL, 2: logging.ERROR, 3: logging.WARNING, 4: logging.INFO, 5: logging.DEBUG}
_INFO = 4
_LOGGER = "pepper_sim"


class _Listener:
    """Its signals fire with every message up to a level. Filters are ignored: every category is sent."""

    def __init__(self) -> None:
        self._level = _INFO
        self._message = Signal(f"({_MESSAGE})")
        self._messages = Signal(f"([{_MESSAGE}])")

    def served(self) -> ServedObject:
        """Return what getListener returns. It holds the listener, and nothing holds it but those who use it."""
        served = ServedObject()
        served.add_method("setLevel", "v", "(i)", self._set_level)
        served.add_method("setVerbosity", "v", "(m)", self._set_level)
        served.add_method("addFilter", "v", "(si)", lambda category, level: None)
        served.add_method("clearFilters", "v", "()", lambda: None)
        served.add_signal("onLogMessage", self._message)
        served.add_signal("onLogMessages", self._messages)
        return served

    def report(self, message: tuple) -> None:
        if message[1] <= self._level:
            self._message(message)
            self._messages([message])

    def _set_level(self, level: Any) -> None:
        self._level = level if isinstance(level, int) else _INFO


class _Handler(logging.Handler):
    """Passes on Python's log records."""

    def __init__(self, report: Any) -> None:
        super().__init__(logging.INFO)
        self._report = report

    def emit(self, record: logging.LogRecord) -> None:
        try:
            level = next(number for least, number in _QI_LEVELS if record.levelno >= least)
            source = f"{record.filename}:{record.funcName}:{record.lineno}"
            self._report(level, source, record.name, record.getMessage(), record.created)
        except Exception:  # the contract of logging.Handler: an error while logging must not reach the caller
            self.handleError(record)


class LogManager(Service):
    """Collects log messages and sends them to listeners."""

    name = "LogManager"

    def __init__(self) -> None:
        self._listeners: weakref.WeakSet[_Listener] = weakref.WeakSet()
        self._providers = itertools.count(1)
        self._numbers = itertools.count(1)
        self._lock = threading.Lock()
        self._reporting = threading.local()
        self._location = f"simulated:{os.getpid()}"
        self._handler = _Handler(self._report)
        logging.getLogger(_LOGGER).addHandler(self._handler)

    def close(self) -> None:
        logging.getLogger(_LOGGER).removeHandler(self._handler)
        self._listeners.clear()

    @remote("v([m])")
    def log(self, message: list) -> None:
        """Accepts messages from a provider; each is a structure as listeners receive it."""
        for item in message:
            fields = list(item.values()) if isinstance(item, dict) else item
            if isinstance(fields, list | tuple) and len(fields) >= 5:
                level = int(within(fields[1], 0, 6, "level")) if isinstance(fields[1], int) else _INFO
                logging.getLogger(_LOGGER).log(_PYTHON_LEVELS.get(level, logging.DEBUG), "%s", fields[4])

    @remote("o()")
    def getListener(self) -> Any:
        """Returns an object with the signal onLogMessage."""
        listener = _Listener()
        with self._lock:
            self._listeners.add(listener)
        return listener.served()

    @remote("o()")
    def createListener(self) -> Any:
        """The same as getListener."""
        return self.getListener()

    @remote("i(o)")
    def addProvider(self, provider: Any) -> int:
        """Registers a source of messages and returns its number. Providers call log() by themselves."""
        return next(self._providers)

    @remote("v(i)")
    def removeProvider(self, providerId: int) -> None:
        """Removes a source of messages."""

    def _report(self, level: int, source: str, category: str, text: str, created: float) -> None:
        if getattr(self._reporting, "busy", False):
            return  # what goes wrong while sending to listeners is not sent to listeners
        self._reporting.busy = True
        try:
            number = next(self._numbers) & 0xFFFFFFFF
            date, since_1970 = time.monotonic_ns(), int(created * 1e9)
            message = (source, level, category, self._location, text, number, date, since_1970)
            with self._lock:
                listeners = list(self._listeners)
            for listener in listeners:
                listener.report(message)
        finally:
            self._reporting.busy = False
