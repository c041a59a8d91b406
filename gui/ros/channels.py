"""The topics and services between the window and a robot as tables. No ROS here: types go by their names.

An entry of `gui.robots` lists its rows (`Incoming`, `Outgoing`, `Offered`); `gui.ros.link` subscribes, advertises and
calls as they say. Names are resolved in the robot's namespace. Messages are read and written by field name, so that the
functions in the rows can be tested without ROS.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from PyQt5.QtCore import QObject, Qt, pyqtSignal

from telepresence.security.outside_text import clean

COMPLAINT_PERIOD = 1.0
"""[s] between two complaints about one topic, at least."""


@dataclass(frozen=True)
class Incoming:
    """A topic that the window subscribes to.

    Args:
        channel: What the window calls it.
        topic, kind: Name, and type such as "sensor_msgs/Image".
        convert: Converts a message and its arrival [monotonic s] to what the window works with; raises a ValueError
            that says why it cannot.
        on_request: Subscribe only after `RosLink.watch(channel, True)`; for large messages.
        queue: So many messages are delivered when they come faster than Qt is free; usually the newest alone.
    """

    channel: str
    topic: str
    kind: str
    convert: Callable[[Any, float], object]
    on_request: bool = False
    queue: int = 1


@dataclass(frozen=True)
class Outgoing:
    """A topic that the window publishes; `fill(message, *values)` sets the fields.

    Args:
        headers: More fields for the header of every connection to a subscriber.
    """

    channel: str
    topic: str
    kind: str
    fill: Callable[..., None]
    headers: Mapping[str, str] | None = None


@dataclass(frozen=True)
class Answer:
    """The result of a service call. `text` is a sentence for the pilot when `ok` is false, and may be one otherwise.

    Args:
        arrived: The program itself has answered; otherwise nobody knows whether it has heard of the call.
    """

    ok: bool
    text: str = ""
    value: Any = None
    arrived: bool = True


def read_trigger(response: Any) -> Answer:
    """Convert the response of std_srvs/Trigger and SetBool."""
    return Answer(bool(response.success), clean(response.message))


def fill_data(message: Any, value: object) -> None:
    """Set the only field of a std_msgs wrapper, or of std_srvs/SetBool."""
    message.data = value


@dataclass(frozen=True)
class Offered:
    """A service that the window calls: `fill(request, *values)`, then `read(response)`.

    Args:
        timeout: Seconds after which a call counts as failed.
    """

    name: str
    service: str
    kind: str = "std_srvs/Trigger"
    fill: Callable[..., None] = lambda request: None
    read: Callable[[Any], Answer] = read_trigger
    timeout: float = 5.0


class Channel(QObject):
    """One incoming topic on Qt's side: delivers the newest message (`Incoming.queue`), converted on Qt's thread."""

    arrived = pyqtSignal(object)
    """What `Incoming.convert` made of the newest message."""
    trouble = pyqtSignal(str)
    """The messages cannot be used; a sentence, once for each reason, at most once a second."""

    _posted = pyqtSignal()

    def __init__(self, row: Incoming) -> None:
        super().__init__()
        self.row = row
        self.wanted = not row.on_request
        self._lock = threading.Lock()
        self._waiting: deque[tuple[object, float]] = deque(maxlen=row.queue)
        self._complaint, self._complained = "", -COMPLAINT_PERIOD
        self._posted.connect(self._deliver, Qt.ConnectionType.QueuedConnection)  # type: ignore[call-arg]  # PyQt5's stub

    def post(self, message: object) -> None:
        """Deliver a message that has arrived; may be called from any thread."""
        with self._lock:
            announced = bool(self._waiting)
            self._waiting.append((message, time.monotonic()))
        if not announced:
            self._posted.emit()

    def _deliver(self) -> None:
        with self._lock:
            messages = list(self._waiting)
            self._waiting.clear()
        for message, arrived in messages:
            if self.wanted:
                self._convert(message, arrived)

    def _convert(self, message: object, arrived: float) -> None:
        try:
            value = self.row.convert(message, arrived)
        except (ValueError, ArithmeticError, LookupError) as error:
            self._complain(clean(error))
            return
        self.arrived.emit(value)

    def _complain(self, reason: str) -> None:
        now = time.monotonic()
        if reason != self._complaint and now - self._complained >= COMPLAINT_PERIOD:
            self._complaint, self._complained = reason, now
            self.trouble.emit(f"{self.row.topic} sends what can't be used: {reason}.")
