"""ALNotificationManager: what the robot has to say to people; it says it when its chest button is pressed once.

A notification is [[key, value], ...] with the keys id, message, severity (info, warning or error) and removeOnRead.
Source: NAOqi 2.8 documentation, ALNotificationManager and NotificationInfo.
"""

from __future__ import annotations

import itertools
import threading
from typing import Any

from pepper_sim.naoqi.service import Module, ServiceError, one_of, remote, shown
from pepper_sim.services.al_memory import ALMemory
from pepper_sim.services.al_text_to_speech import ALTextToSpeech

SEVERITIES = ("info", "warning", "error")
_DEFAULTS: dict[str, Any] = {"id": -1, "message": "", "severity": SEVERITIES[0], "removeOnRead": True}
_MAX_PENDING = 1000
_CLICK = "ALChestButton/SimpleClickOccurred"


class ALNotificationManager(Module):
    """Keeps notifications until they are read."""

    name = "ALNotificationManager"

    def __init__(self, memory: ALMemory, speech: ALTextToSpeech) -> None:
        self._memory = memory
        self._speech = speech
        self._lock = threading.Lock()
        self._numbers = itertools.count(1)
        self._pending: dict[int, dict[str, Any]] = {}
        memory.declare(("notificationAdded", "notificationRemoved"), self.name)
        memory.follow(_CLICK, lambda _: self._read_out())

    @remote("i(m)")
    def add(self, notification: Any) -> int:
        """Adds a notification and returns its number; what it lacks has the documented default."""
        entry = _checked(notification)
        with self._lock:
            if len(self._pending) >= _MAX_PENDING:
                raise ServiceError(f"there are {_MAX_PENDING} notifications already")
            entry["id"] = next(self._numbers)
            self._pending[entry["id"]] = entry
        self._memory.announce("notificationAdded", entry["id"])
        return entry["id"]

    @remote("v(i)")
    def remove(self, notificationId: int) -> None:
        """Removes a notification; an error if there is none of this number."""
        with self._lock:
            found = self._pending.pop(notificationId, None)
        if found is None:
            raise _unknown(notificationId)
        self._memory.announce("notificationRemoved", notificationId)

    @remote("m(i)")
    def notification(self, notificationId: int) -> list[list]:
        """Returns a notification; an error if there is none of this number."""
        with self._lock:
            found = self._pending.get(notificationId)
        if found is None:
            raise _unknown(notificationId)
        return _pairs(found)

    @remote("m()")
    def notifications(self) -> list[list[list]]:
        """Lists the pending notifications."""
        with self._lock:
            return [_pairs(entry) for entry in self._pending.values()]

    def _read_out(self) -> None:
        """Say what is pending, and forget what is to be removed once it was read."""
        with self._lock:
            entries = list(self._pending.values())
        for entry in entries:
            if entry["message"]:
                self._speech.say(entry["message"])
            if entry["removeOnRead"]:
                with self._lock:
                    found = self._pending.pop(entry["id"], None)
                if found is not None:
                    self._memory.announce("notificationRemoved", entry["id"])


def _checked(notification: Any) -> dict[str, Any]:
    """Return a notification with its defaults; a client's is a map or a list of pairs."""
    pairs = list(notification.items()) if isinstance(notification, dict) else notification
    if not isinstance(pairs, list | tuple) or not all(
        isinstance(pair, list | tuple) and len(pair) == 2 for pair in pairs
    ):
        raise ServiceError(f"notification must be [[key, value], ...], got {shown(notification)}")
    entry = dict(_DEFAULTS)
    for key, value in pairs:
        one_of(key, _DEFAULTS, "key")
        if value is None:
            continue
        if not isinstance(value, type(_DEFAULTS[key])) and not (key == "removeOnRead" and isinstance(value, int)):
            raise ServiceError(f"{key} cannot be {shown(value)}")
        entry[key] = value
    one_of(entry["severity"], SEVERITIES, "severity")
    entry["removeOnRead"] = bool(entry["removeOnRead"])
    return entry


def _pairs(entry: dict[str, Any]) -> list[list]:
    return [[key, value] for key, value in entry.items()]


def _unknown(number: int) -> ServiceError:
    return ServiceError(f"there is no notification {number}")
