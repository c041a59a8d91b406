"""RobotinoClient: Robotino's REST interface over one connection that is kept open, with timeouts and back-off. No ROS.

    GET /data/NAME        JSON; empty for hardware that the robot does not have
    PUT /data/NAME        JSON body; 200
    GET /cam0             image/jpeg; 500 while the camera wakes up

Port 80, no authentication. The robot stops 200 ms after the last velocity, so send one every 50 to 100 ms.

Whatever answers at the robot's address, a question ends within its time with a value that is checked, or with a
`RobotinoError` whose text is one short line: nobody can tell the robot's web server from another one.
Source: wiki.openrobotino.org, page Rest api (27 July 2020).
"""

from __future__ import annotations

import json
import math
import socket
import time
from collections.abc import Callable, Sequence
from http.client import RemoteDisconnected
from typing import Any, NamedTuple

from rto_node.robot_facts import SENSORS
from telepresence.geometry import require_finite
from telepresence.host_port import parse_host_port
from telepresence.security.bounded_http import BadAnswer, BoundedConnection
from telepresence.security.name_lookup import NameLookup
from telepresence.security.outside_text import clean

TIMEOUT = 0.5
"""Seconds allowed for connecting to the robot, and for its whole answer."""
PICTURE_TIMEOUT = 2.0
"""Seconds allowed for a whole picture, of which a piece must come within `TIMEOUT`."""
SHORTEST_BACK_OFF, LONGEST_BACK_OFF = 0.1, 0.3
"""Seconds without a new attempt after a failure; doubled from one failure to the next. None after an answer that did
not come in time: that was a pause already."""
DEFAULT_PORT = 80
MAX_DATA, MAX_PICTURE = 256 * 1024, 8 * 1024 * 1024
"""Largest answer that is read, of /data and of /cam0 [bytes]. A scan has about 10 000."""
MAX_RANGES = 10_000
"""Most ranges of a scan."""
LARGEST = 1e6
"""Largest size of a number that a robot may measure, in whatever unit: beyond it nothing is believed."""
LARGEST_COUNT = 2.0**53
ERROR_LENGTH = 160
"""Characters of an error's text that the robot has a say in."""


class RobotinoError(RuntimeError):
    """Something about the robot went wrong; the text says what, and with which robot, in one short line."""


class RobotinoUnreachable(RobotinoError):
    """There is no connection, or no answer in time."""


class RequestRefused(RobotinoError):
    """The robot answered, but not with what was asked for; none of it is used."""


class Odometry(NamedTuple):
    """Pose since the robot's start [m, m, rad], velocity in base_link [m/s, m/s, rad/s], count of readings."""

    x: float
    y: float
    phi: float
    vx: float
    vy: float
    omega: float
    seq: int


class Power(NamedTuple):
    """`voltage` [V]; `kind` "Pb", "NiMH" or "Li-Ion"; `low` and about to switch off; `external`: on the mains."""

    voltage: float
    kind: str
    low: bool
    external: bool


class Scan(NamedTuple):
    """A scan of the laser: angles [rad], ranges [m] with 0 where nothing was hit."""

    seq: int
    angle_min: float
    angle_increment: float
    time_increment: float
    scan_time: float
    range_min: float
    range_max: float
    ranges: tuple[float, ...]


class RobotinoClient:
    """One connection to one robot, for one thread.

    Args:
        address: Host, host:port or http://host:port of the robot.
        timeout: Seconds to connect, and to wait for each answer.
        clock: Monotonic time [s].
    Raises:
        ValueError: The address is invalid.
    """

    def __init__(self, address: str, timeout: float = TIMEOUT, clock: Callable[[], float] = time.monotonic) -> None:
        self.host, self.port = parse_address(address)
        self._timeout = timeout
        self._clock = clock
        self._lookup = NameLookup(self.host, self.port)
        self._connection: BoundedConnection | None = None
        self._back_off = 0.0
        self._not_before = -math.inf
        self._failure = ""

    @property
    def address(self) -> str:
        """host:port"""
        return f"{self.host}:{self.port}"

    # --- readings ----------------------------------------------------------------------------------------------------

    def odometry(self) -> Odometry:
        """Raises RobotinoError, as all of these do."""
        answer = self._array("odometry", 7, more=True)  # one robot is known to have sent an eighth value
        x, y, phi, vx, vy, omega = (self._number(value, "odometry") for value in answer[:6])
        return Odometry(x, y, phi, vx, vy, omega, int(self._number(answer[6], "odometry", LARGEST_COUNT)))

    def distances(self) -> tuple[float, ...]:
        """Readings of the nine infrared sensors [m], the first ahead, counter-clockwise; 0.41 is nothing, 0.04 the
        least. A negative one is no reading; the safety gate says so."""
        return self._numbers("distancesensorarray", SENSORS)

    def bumper(self) -> bool:
        return self._flag(self._member("bumper", "value"), "bumper")

    def power(self) -> Power:
        answer = self._object("powermanagement")
        voltage = self._number(answer.get("voltage"), "powermanagement")
        # One robot is known to count in millivolts.
        voltage = voltage / 1000.0 if voltage > 100.0 else voltage
        kind = answer.get("batteryType")
        kind = clean(kind, 20) if isinstance(kind, str) else ""
        return Power(voltage, kind, bool(answer.get("batteryLow")), bool(answer.get("ext_power")))

    def analog_inputs(self) -> tuple[float, ...]:
        """Eight voltages [V]."""
        return self._numbers("analoginputarray", 8)

    def digital_inputs(self) -> tuple[bool, ...]:
        return self._flags("digitalinputarray", 8)

    def digital_outputs(self) -> tuple[bool, ...]:
        return self._flags("digitaloutputstatus", 8)

    def relays(self) -> tuple[bool, ...]:
        return self._flags("relaystatus", 2)

    def scan(self) -> Scan | None:
        """The last scan; None if there is no laser."""
        if (answer := self._get("scan0")) is None:
            return None
        ranges = answer.get("ranges") if isinstance(answer, dict) else None
        if not isinstance(ranges, list) or len(ranges) > MAX_RANGES:
            raise self._refused(f"scan0 is not a scan: {_start(answer)}")

        def number(name: str, largest: float = LARGEST) -> float:
            return self._number(answer.get(name), "scan0", largest)

        return Scan(
            seq=int(number("seq", LARGEST_COUNT)),
            angle_min=number("angle_min"),
            angle_increment=number("angle_increment"),
            time_increment=number("time_increment"),
            scan_time=number("scan_time"),
            range_min=number("range_min"),
            range_max=number("range_max"),
            ranges=tuple(self._number(value, "scan0") for value in ranges),
        )

    def picture(self) -> bytes | None:
        """A JPEG; None while the camera wakes up or has no new picture."""
        status, body = self._ask("GET", "/cam0", None, max(PICTURE_TIMEOUT, self._timeout), MAX_PICTURE)
        if status == 500:
            return None
        if status != 200:
            raise self._refused(f"/cam0 answered {status}")
        return body

    # --- commands ----------------------------------------------------------------------------------------------------

    def drive(self, vx: float, vy: float, wz: float) -> None:
        """Drive for the next 200 ms: forward and left [m/s], counter-clockwise [rad/s].

        Raises:
            ValueError: A value is not finite.
        """
        require_finite("velocity", (vx, vy, wz))
        self._put("omnidrive", [vx, vy, wz])

    def set_digital_outputs(self, values: Sequence[bool], timeout: float = 0.0) -> None:
        """Set the eight outputs within `timeout` seconds instead of the client's own, unless it is 0."""
        self._put("digitaloutputarray", [bool(value) for value in values], timeout)

    def set_relays(self, values: Sequence[bool]) -> None:
        self._put("relayarray", [bool(value) for value in values])

    def set_power_output(self, percent: float) -> None:
        """Drive the motor output, -100 to 100 %."""
        self._put("poweroutput", {"value": percent})

    def close(self) -> None:
        """Close the connection; the next request opens a new one."""
        if self._connection is not None:
            self._connection.close()
            self._connection = None

    # --- inside ------------------------------------------------------------------------------------------------------

    def _get(self, name: str) -> Any:
        """The JSON at /data/name; None for an empty body."""
        status, body = self._ask("GET", f"/data/{name}")
        if status != 200:
            raise self._refused(f"{name} answered {status}: {_start(body)}")
        if not body.strip():
            return None
        try:
            return json.loads(body.decode(), parse_constant=_refuse_constant, object_pairs_hook=_object_of)
        except (ValueError, RecursionError) as error:  # also a number of 5000 digits; brackets within brackets
            raise self._refused(f"{name} is not JSON: {error}") from None

    def _put(self, name: str, value: Any, time_allowed: float = 0.0) -> None:
        status, body = self._ask("PUT", f"/data/{name}", json.dumps(value).encode(), time_allowed)
        if status != 200:
            raise RequestRefused(f"Robotino at {self.address} refused {name}: {status}: {_start(body)}")

    def _refused(self, cause: str) -> RequestRefused:
        return RequestRefused(f"Robotino at {self.address}: {clean(cause, ERROR_LENGTH)}")

    def _object(self, name: str) -> dict[str, Any]:
        answer = self._get(name)
        if not isinstance(answer, dict):
            raise self._refused(f"{name} is not an object: {_start(answer)}")
        return answer

    def _member(self, name: str, member: str) -> Any:
        answer = self._object(name)
        if member not in answer:
            raise self._refused(f"{name} has no {member!r}: {_start(answer)}")
        return answer[member]

    def _array(self, name: str, count: int, more: bool = False) -> list[Any]:
        """The first `count` values; there may be `more`, or no others."""
        answer = self._get(name)
        if not isinstance(answer, list) or len(answer) < count or (len(answer) > count and not more):
            raise self._refused(f"{name} has not {count} values: {_start(answer)}")
        return answer[:count]

    def _numbers(self, name: str, count: int) -> tuple[float, ...]:
        return tuple(self._number(value, name) for value in self._array(name, count))

    def _number(self, value: Any, name: str, largest: float = LARGEST) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or not -largest <= value <= largest:
            raise self._refused(f"{name} holds {_start(value)} for a number")
        return float(value)

    def _flags(self, name: str, count: int) -> tuple[bool, ...]:
        return tuple(self._flag(value, name) for value in self._array(name, count))

    def _flag(self, value: Any, name: str) -> bool:
        # Whatever a web server writes its truth with: 0 and 1 are as clear. A float, a text or null are not.
        if not isinstance(value, bool | int) or value not in (0, 1):
            raise self._refused(f"{name} holds {_start(value)} for true or false")
        return bool(value)

    def _ask(
        self, method: str, path: str, body: bytes | None = None, time_allowed: float = 0.0, limit: int = MAX_DATA
    ) -> tuple[int, bytes]:
        """Status and body. A connection that the robot has closed since the last request is opened once more."""
        if self._clock() < self._not_before:
            raise RobotinoUnreachable(self._failure)
        deadline = time.monotonic() + (time_allowed or self._timeout)
        kept = self._connection is not None
        try:
            try:
                answer = self._exchange(method, path, body, deadline, limit)
            except (ConnectionError, RemoteDisconnected):
                if not kept:
                    raise
                self.close()
                answer = self._exchange(method, path, body, deadline, limit)
        except (OSError, BadAnswer) as error:
            # What comes late must not be taken for the answer to the next request, nor a late velocity be obeyed.
            if self._connection is not None:
                self._connection.abandon()
                self._connection = None
            late = isinstance(error, TimeoutError)
            self._back_off = 0.0 if late else min(LONGEST_BACK_OFF, max(SHORTEST_BACK_OFF, 2.0 * self._back_off))
            self._not_before = self._clock() + self._back_off
            cause = clean(_cause(error, time_allowed or self._timeout), ERROR_LENGTH)
            self._failure = f"Robotino at {self.address} does not answer: {cause}"
            raise RobotinoUnreachable(self._failure) from error
        self._back_off = 0.0
        return answer

    def _exchange(self, method: str, path: str, body: bytes | None, deadline: float, limit: int) -> tuple[int, bytes]:
        if self._connection is None:
            self._connection = BoundedConnection(self.host, self.port, self._timeout, self._lookup)
        headers = {"Content-Type": "application/json"} if body is not None else {}
        answer = self._connection.exchange(method, path, body, headers, deadline, limit)
        return answer.status, answer.body


def parse_address(text: str) -> tuple[str, int]:
    """Host and port from "host", "host:port" or "http://host[:port][/]".

    Raises:
        ValueError: It is none of these.
    """
    scheme, mark, rest = text.strip().rpartition("://")
    if mark and scheme != "http":
        raise ValueError(f"a Robotino is reached by http, not {scheme}: {text!r}")
    return parse_host_port(rest.rstrip("/"), DEFAULT_PORT, "a robot")


def _object_of(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """An object of JSON. Of two members of one name nobody can say which one another reader would take."""
    made = dict(pairs)
    if len(made) != len(pairs):
        raise ValueError("a member twice")
    return made


def _refuse_constant(name: str) -> float:
    raise ValueError(f"{name} is not a number")


def _start(value: Any) -> str:
    """The beginning of what the robot sent, for an error's text."""
    if isinstance(value, bytes):
        return clean(value[:200].decode(errors="replace").strip(), 80)
    if isinstance(value, list | dict):
        return f"{type(value).__name__} of {len(value)}"
    return clean(repr(value) if isinstance(value, str) else _number_text(value), 80)


def _number_text(value: Any) -> str:
    """Return a number of any size as text: Python refuses to write one of 5000 digits."""
    return f"a number of {value.bit_length()} bits" if isinstance(value, int) and abs(value) >= 1 << 64 else str(value)


def _cause(error: Exception, timeout: float) -> str:
    if isinstance(error, socket.gaierror):
        return "its name is unknown"
    if isinstance(error, TimeoutError):
        return f"nothing within {timeout:g} s"
    if isinstance(error, OSError) and error.strerror:
        return error.strerror.lower()
    return str(error) or type(error).__name__
