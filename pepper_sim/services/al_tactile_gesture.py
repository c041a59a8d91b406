"""ALTactileGesture: strokes and taps on the head's three touch sensors.

A gesture is a sequence of patterns of the front, middle and rear sensor, ["000", "100", "000"]: the first is always
"000", and one that does not end with it is held. A pattern counts once it has stayed for the settle time. The gesture
is over when nothing is touched for the sequence time, or when a pattern is held for the hold time, and again after it.
Source: NAOqi 2.8 documentation, ALTactileGesture, which does not give the three times.
"""

from __future__ import annotations

import itertools
import re
import threading
import time

from pepper_sim.naoqi.service import Service, ServiceError, remote, shown
from pepper_sim.services.al_memory import ALMemory
from telepresence.naoqi.signals import Signal

GESTURES: dict[str, str] = {
    **{"SingleFront": "100", "SingleMiddle": "010", "SingleRear": "001", "SingleTap": "111", "TheClaw": "101"},
    **{"DoubleFront": "100 000 100", "DoubleMiddle": "010 000 010", "DoubleRear": "001 000 001"},
    **{"DoubleTap": "111 000 111", "ZoomIn": "101 010", "ZoomOut": "010 101"},
    **{"CaressFtoR": "100 010 001", "CaressRtoF": "001 010 100"},
}
"""Name -> what is between the first and the last "000"."""
HELD = ("SingleFront", "SingleMiddle", "SingleRear", "SingleTap", "TheClaw")
"""Those that exist held, too, under the name with "Hold" behind it."""
SETTLE, HOLD, SEQUENCE = 0.08, 0.8, 0.35
"""Seconds; the documentation gives no values."""
_SENSORS = ("FrontTactilTouched", "MiddleTactilTouched", "RearTactilTouched")
_PATTERN = re.compile("[01]{3}")
_NOTHING = "000"
_PERIOD = 0.02
_MOST, _LONGEST = 1000, 50


class ALTactileGesture(Service):
    """Recognises gestures, on a thread that runs from the first touch to the gesture's end."""

    name = "ALTactileGesture"

    def __init__(self, memory: ALMemory) -> None:
        self._memory = memory
        self._lock = threading.Lock()
        self._gestures = {name: (_NOTHING, *text.split(), _NOTHING) for name, text in GESTURES.items()}
        self._gestures.update({f"{name}Hold": (_NOTHING, GESTURES[name]) for name in HELD})
        self._times = {"settle": SETTLE, "hold": HOLD, "sequence": SEQUENCE}
        self._closing = threading.Event()
        self._watching = False
        self.onGesture = Signal("(s)")
        self.onRelease = Signal("()")
        memory.declare(("ALTactileGesture/Gesture", "ALTactileGesture/Release"), self.name)
        for event in _SENSORS:
            memory.follow(event, self._touched)

    def close(self) -> None:
        """End the thread."""
        self._closing.set()

    @remote("s([s])")
    def createGesture(self, sequence: list[str]) -> str:
        """Makes a gesture and returns its name, which is made of the sequence; an error if that is malformed."""
        wanted = _checked(sequence)
        with self._lock:
            known = self._name(wanted)
            if known:
                return known
            if len(self._gestures) >= _MOST:
                raise ServiceError(f"there are {_MOST} gestures already")
            name = "_".join(wanted)
            self._gestures[name] = wanted
            return name

    @remote("m(s)")
    def getSequence(self, gestureName: str) -> list[str] | None:
        """Returns a gesture's sequence; nothing if there is none of this name."""
        found = self._gestures.get(gestureName)
        return list(found) if found is not None else None

    @remote("m([s])")
    def getGesture(self, sequence: list[str]) -> str | None:
        """Returns the name of a sequence's gesture; nothing if there is none."""
        with self._lock:
            return self._name(tuple(sequence)) or None

    @remote("{s[s]}()")
    def getGestures(self) -> dict[str, list[str]]:
        """Returns the sequences of all gestures by name."""
        with self._lock:
            return {name: list(sequence) for name, sequence in self._gestures.items()}

    @remote("b(f)")
    def setSettleTime(self, settleTime: float) -> bool:
        """Sets how long a pattern must stay to count [s]; false if that is no positive time."""
        return self._set("settle", settleTime)

    @remote("b(f)")
    def setHoldTime(self, holdTime: float) -> bool:
        """Sets after what time a pattern is held [s]; false if that is no positive time."""
        return self._set("hold", holdTime)

    @remote("b(f)")
    def setSequenceTime(self, sequenceTime: float) -> bool:
        """Sets how long a pause inside a gesture may be [s]; false if that is no positive time."""
        return self._set("sequence", sequenceTime)

    # --- inside ------------------------------------------------------------------------------------------------------

    def _set(self, name: str, seconds: float) -> bool:
        if not 0.0 < seconds <= 60.0:
            return False
        self._times[name] = seconds
        return True

    def _name(self, sequence: tuple[str, ...]) -> str:
        return next((name for name, known in self._gestures.items() if known == sequence), "")

    def _touched(self, value: float) -> None:
        if not value:
            return
        with self._lock:
            begin, self._watching = not self._watching, True
        if begin:
            threading.Thread(target=self._watch, name="tactile-gesture", daemon=True).start()

    def _pattern(self) -> str:
        return "".join("1" if self._memory.read(event) else "0" for event in _SENSORS)

    def _watch(self) -> None:
        """Follow one gesture from its first touch until nothing has been touched for the sequence time."""
        sequence, since, held = [_NOTHING], time.monotonic(), False
        pattern = self._pattern()
        while not self._closing.wait(_PERIOD):
            now, before, pattern = time.monotonic(), pattern, self._pattern()
            if pattern != before:
                since = now
            stayed = now - since
            if stayed >= self._times["settle"] and pattern != sequence[-1]:
                sequence = [*sequence[-_LONGEST:], pattern]
            if pattern != _NOTHING and stayed >= self._times["settle"] + self._times["hold"]:
                self._report(sequence)
                since, held = now - self._times["settle"], True
            elif pattern == _NOTHING and (held or stayed >= self._times["sequence"]):
                break
        with self._lock:
            self._watching = False
        if not held and not self._report(sequence):
            return
        self.onRelease()
        self._memory.announce("ALTactileGesture/Release", 1)

    def _report(self, sequence: list[str]) -> bool:
        with self._lock:
            name = self._name(tuple(sequence))
        if name:
            self.onGesture(name)
            self._memory.announce("ALTactileGesture/Gesture", name)
        return bool(name)


def _checked(sequence: list[str]) -> tuple[str, ...]:
    """Return a sequence that a gesture can have."""
    wellformed = 2 <= len(sequence) <= _LONGEST and all(_PATTERN.fullmatch(pattern) for pattern in sequence)
    twice = any(first == second for first, second in itertools.pairwise(sequence))
    if not wellformed or twice or sequence[0] != _NOTHING:
        raise ServiceError(f"sequence must be patterns such as '000', '100', '000', got {shown(sequence)}")
    return tuple(sequence)
