"""NAOqi's messaging in plain Python: talk to a Pepper or NAO without the vendor's binary package.

    import telepresence.naoqi as qi

    session = qi.Session()
    session.connect("tcp://192.168.1.10:9559")
    session.service("ALTextToSpeech").say("Hello")

The interface is that of the vendor's Python package `qi` 3.1.5, for what scripts use: Session, Application (--qi-url,
--qi-listen-url), proxies with `_async=True`, Future, Promise, futureBarrier, runAsync, PeriodicTask, Signal, Property,
bind, nobind, singleThreaded, multiThreaded, the names of types, logging and the clocks. `Server` and `ServedObject`
make a robot of one's own.

Left out, with an error that says so: modules (`module`, `listModules`, Session.callModule and loadServiceRename), the
translator (`tr`, `defaultTranslator`), `path`, and a login at a server of one's own session (`Server` has that).

What differs on purpose: every wait for a service directory ends; `bytes` inside a dynamic travel as raw data (the
vendor's sends them as text); a set is a list; `Struct([...])` works; errors of a method are one line, without the
server's file names; keyword arguments raise an error, where the vendor's drops them; arguments of a wrong type are
refused before a bound method of ours runs.
"""

from __future__ import annotations

from typing import Any

from . import logging
from .application import Application, ApplicationSession
from .binding import bind, multiThreaded, nobind, singleThreaded
from .clocks import clockNow, steadyClockNow, systemClockNow
from .dynamics import PYTHON, ROBOT, Record, Typed
from .future import Future, FutureState, FutureTimeout, Promise, futureBarrier
from .limits import Limits
from .logging import Logger, error, fatal, info, verbose, warning
from .proxy import Proxy
from .releases import RELEASES
from .served_object import ServedObject
from .server import Server
from .session import Session
from .signals import Property, Signal
from .signature import WireError
from .tasks import PeriodicTask, runAsync
from .type_names import (
    AnyArguments,
    Bool,
    Buffer,
    Double,
    Dynamic,
    Float,
    Int8,
    Int16,
    Int32,
    Int64,
    List,
    Map,
    Object,
    Optional,
    Raw,
    String,
    Struct,
    UInt8,
    UInt16,
    UInt32,
    UInt64,
    Void,
    is_instance,
    typeof,
)

__version__ = "3.1.5"
"""Version of the vendor's package whose interface this is."""

isinstance = is_instance


def _left_out(name: str) -> Any:
    def refuse(*_: Any, **__: Any) -> Any:
        raise RuntimeError(f"{name} is not offered by telepresence.naoqi, see its documentation")

    refuse.__name__ = refuse.__qualname__ = name
    refuse.__doc__ = f"Raise a RuntimeError: {name} is left out, see the package's documentation."
    return refuse


module = _left_out("module")
listModules = _left_out("listModules")
tr = _left_out("tr")
defaultTranslator = _left_out("defaultTranslator")
Translator = _left_out("Translator")


def PromiseNoop(*args: Any, **kwargs: Any) -> None:
    """Do nothing, as an `on_cancel`."""


def __getattr__(name: str) -> Any:
    if name == "path":
        raise RuntimeError("path is not offered by telepresence.naoqi, see its documentation")
    if name == "async":  # a keyword since Python 3.7; only getattr finds it
        return runAsync
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


__all__ = [
    "PYTHON",
    "RELEASES",
    "ROBOT",
    "AnyArguments",
    "Application",
    "ApplicationSession",
    "Bool",
    "Buffer",
    "Double",
    "Dynamic",
    "Float",
    "Future",
    "FutureState",
    "FutureTimeout",
    "Int8",
    "Int16",
    "Int32",
    "Int64",
    "Limits",
    "List",
    "Logger",
    "Map",
    "Object",
    "Optional",
    "PeriodicTask",
    "Promise",
    "Property",
    "Proxy",
    "Raw",
    "Record",
    "ServedObject",
    "Server",
    "Session",
    "Signal",
    "String",
    "Struct",
    "Typed",
    "UInt8",
    "UInt16",
    "UInt32",
    "UInt64",
    "Void",
    "WireError",
    "bind",
    "clockNow",
    "error",
    "fatal",
    "futureBarrier",
    "info",
    "isinstance",
    "listModules",
    "logging",
    "module",
    "multiThreaded",
    "nobind",
    "runAsync",
    "singleThreaded",
    "steadyClockNow",
    "systemClockNow",
    "tr",
    "typeof",
    "verbose",
    "warning",
]
