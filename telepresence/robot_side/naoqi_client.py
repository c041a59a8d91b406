# Runs on Pepper's own Python 2.7 as well as on Python 3: keep to syntax that both accept.
# ruff: noqa: UP004, UP024, UP031
"""A small client of NAOqi for programs on the robot: services by name, calls, posts. It listens nowhere, and speaks
`tcp`, as NAOqi does on the robot itself; `tcps` if it is given TLS, see `naoqi_connection`.

Wire: see `naoqi_connection`. Service 1, the directory: action 100, `service(name)`, says where one is. Action 2 of a
service: its metaobject, with the methods' names, types and numbers. Source: aldebaran/libqi, src/messaging/message.hpp,
servicedirectory.cpp.
"""

import collections

from telepresence.robot_side.naoqi_connection import CALL, POST, Wire
from telepresence.robot_side.naoqi_values import NaoqiError, encode, parse

MYPY = False
if MYPY:
    from typing import Any, Dict, List, Tuple  # noqa: F401, UP035

    from telepresence.robot_side.naoqi_connection import Answer  # noqa: F401

PORT = 9559
TIMEOUT = 1.5
"""Seconds for each step of a connection, and for a question, if nothing else is asked for."""

_METAOBJECT, _SERVICE = 2, 100
_DIRECTORY = 1
_SERVICE_INFO = "(sIsI[s])"  # and what newer directories put behind it
_METAOBJECT_SIGNATURE = "({I(Issss[(ss)]s)}{I(Iss)}{I(Iss)}s)"

_Method = collections.namedtuple("_Method", "action returns parameters")


class Service(object):
    """A service of the robot."""

    def __init__(self, wire, number, name, methods):
        # type: (Wire, int, str, Dict[str, List[Any]]) -> None
        self.wire, self.name = wire, name
        self._number, self._methods = number, methods

    def send(self, method, *arguments):
        # type: (str, *Any) -> Answer
        """Call a method; the answer comes later. Of several methods with this name it is the first that can take the
        arguments.

        Raises:
            NaoqiError: The connection has ended, or no such method takes these arguments.
        """
        return self._send(CALL, method, arguments)

    def post(self, method, *arguments):
        # type: (str, *Any) -> None
        """Call a method as `send` does, without an answer."""
        self._send(POST, method, arguments)

    def ask(self, method, *arguments):
        # type: (str, *Any) -> Any
        """Call a method and return what it returns.

        Raises:
            NaoqiError: As `send`; it refuses; no answer came within `TIMEOUT`.
        """
        return self.send(method, *arguments).value(TIMEOUT)

    def _send(self, kind, method, arguments):
        # type: (int, str, Tuple[Any, ...]) -> Answer
        name = "%s.%s" % (self.name, method)
        problem = "there is no such method"
        for known in self._methods.get(method, ()):
            try:
                data = _arguments(known.parameters, arguments)
            except NaoqiError as error:
                problem = str(error)
                continue
            return self.wire.call(self._number, known.action, data, known.returns, name, kind)
        raise NaoqiError("%s: %s" % (name, problem))


class Client(object):
    """Services of one robot, each over the connection on which it can be reached.

    Args:
        url: Of its directory: tcp://HOST:PORT, tcps://HOST:PORT.
        timeout: Seconds for each step of a connection.
        tls: For tcps; over tcp it is not used, and so no password sent.
    Attributes:
        wires: The connections; the first is that of the directory.
    Raises:
        ValueError: The address is invalid, or it is tcps and there is no TLS.
        NaoqiError, EnvironmentError: Nobody answers there as NAOqi does.
    """

    def __init__(self, url, timeout=TIMEOUT, tls=None):
        # type: (str, float, Any) -> None
        self._scheme, self._place = place_of(url)
        self._tls = tls_for(url, tls)
        self._timeout = timeout
        self._services = {}  # type: Dict[str, Service]
        self._places = {}  # type: Dict[Tuple[str, int], Wire]
        self.wires = [Wire(self._place, timeout, self._tls)]

    def connected(self):
        # type: () -> bool
        """Whether the directory can be asked."""
        return not self.wires[0].problem

    def service(self, name):
        # type: (str) -> Service
        """Return a service; an earlier one if its connection is open still.

        Raises:
            NaoqiError: The directory does not know it, or it cannot be reached.
        """
        service = self._services.get(name)
        if service is None or service.wire.problem:
            number, endpoints = self._info(name)
            wire = self._wire(endpoints)
            description = self._asked(wire, number, _METAOBJECT, encode(("I", ()), 0), _METAOBJECT_SIGNATURE, name)
            service = self._services[name] = Service(wire, number, name, _methods(description))
        return service

    def close(self):
        # type: () -> None
        for wire in self.wires:
            wire.close()

    # --- inside ------------------------------------------------------------------------------------------------------

    def _info(self, name):
        # type: (str) -> Tuple[int, List[str]]
        """Number and endpoints of a service."""
        info = self._asked(self.wires[0], _DIRECTORY, _SERVICE, encode(("s", ()), name), _SERVICE_INFO, name)
        return info[1], info[4]

    def _asked(self, wire, service, action, arguments, returns, name):
        # type: (Wire, int, int, bytes, str, str) -> Any
        return wire.call(service, action, arguments, returns, name).value(self._timeout)

    def _wire(self, endpoints):
        # type: (List[str]) -> Wire
        """The connection by which a service is reached: that of the directory if it is there too."""
        places = []
        for each in endpoints:
            try:
                scheme, place = place_of(each)
            except ValueError:
                continue
            if scheme == self._scheme:  # every connection logs in: what began encrypted goes on encrypted
                places.append(place)
        if "qi:ServiceDirectory" in endpoints or self._place in places:
            return self.wires[0]
        if sorted(endpoints) == sorted(self._info("ServiceDirectory")[1]):
            return self.wires[0]
        problem = "%s has no way in by %s" % (", ".join(endpoints), self._scheme)
        near = self._place[0].startswith("127.") or self._place[0] in ("localhost", "::1")
        for place in sorted(places, key=lambda each: each[0].startswith("127.") != near):
            wire = self._places.get(place)
            if wire is not None and not wire.problem:
                return wire
            try:
                wire = self._places[place] = Wire(place, self._timeout, self._tls)
            except (NaoqiError, EnvironmentError) as error:
                problem = "%s:%d: %s" % (place[0], place[1], error)
                continue
            self.wires = [each for each in self.wires if not each.problem or each is self.wires[0]] + [wire]
            return wire
        raise NaoqiError(problem)


def place_of(url):
    # type: (str) -> Tuple[str, Tuple[str, int]]
    """Return scheme, host and port of an address.

    Raises:
        ValueError: It is none.
    """
    scheme, _, rest = url.partition("://")
    host, _, port = rest.rpartition(":")
    if scheme not in ("tcp", "tcps") or not host or not port.isdigit():
        raise ValueError("not the address of NAOqi: %r; expected tcp://HOST:%d" % (url, PORT))
    return scheme, (host.strip("[]"), int(port))


def tls_for(url, tls):
    # type: (str, Any) -> Any
    """Return what encrypts the connections to an address; None for tcp.

    Raises:
        ValueError: The address is invalid, or it is tcps and there is no TLS.
    """
    if place_of(url)[0] == "tcp":
        return None
    if tls is None:
        raise ValueError(
            "%s is for other machines, and this program speaks no TLS: on the robot itself NAOqi answers at "
            "tcp://127.0.0.1:%d" % (url, PORT)
        )
    return tls


def _methods(description):
    # type: (Any) -> Dict[str, List[Any]]
    """Methods by name; of the same name those first whose types say most."""
    methods = {}  # type: Dict[str, List[Any]]
    for uid, (_, returns, name, parameters, _, _, _) in sorted(description[0].items()):
        methods.setdefault(name, []).append(_Method(uid, returns, parameters))
    for same in methods.values():
        same.sort(key=lambda method: method.parameters.count("m"))
    return methods


def _arguments(parameters, arguments):
    # type: (str, Tuple[Any, ...]) -> bytes
    """The payload of a call. A method that takes anything gets one dynamic with all arguments."""
    if parameters != "m":
        return encode(parse(parameters), arguments)
    signature = "(%s)" % ("m" * len(arguments))
    return encode(("s", ()), signature) + encode(parse(signature), arguments)
