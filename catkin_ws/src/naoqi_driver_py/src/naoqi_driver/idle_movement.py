"""Keeps the robot from moving by itself while a pilot has it, and lets it do so again afterwards.

NAOqi 2.8 documentation: ALBasicAwareness turns the head to people and noises, and after it the base, which is how
autonomous life sets it; ALMotion's idle control breathes and comes back to the posture Stand, ALListeningMovement and
ALSpeakingMovement nod. Each is asked for its state first, so that what its owner had switched off stays off, and what
was changed meanwhile stays changed.
"""

from __future__ import annotations

import logging
from typing import Any, NamedTuple

from naoqi_driver.connection import CallRefused, Connection

log = logging.getLogger(__name__)

Call = tuple[Any, ...]
SEPARATOR = "; "
"""Between the names of movements."""


class Movement(NamedTuple):
    """Something that moves the robot by itself.

    Args:
        works: Calls of the service with what they answer while it does.
        off, on: Calls that end and resume it. Of movements that the same call ends the newest one is resumed.
        ended: Calls with what they answer as long as nobody has changed it after `off`.
    """

    service: str
    works: tuple[tuple[Call, bool | str], ...]
    off: Call
    on: Call
    ended: tuple[tuple[Call, bool | str], ...] = ()

    @property
    def name(self) -> str:
        return " ".join(map(str, (self.service, *self.on)))


HEAD_MOVEMENTS = (
    Movement(
        "ALBasicAwareness",
        ((("isEnabled",), True), (("isAwarenessPaused",), False)),
        ("pauseAwareness",),
        ("resumeAwareness",),
    ),
    *(
        Movement("ALMotion", (((f"get{mode}Enabled", "Head"), True),), (f"set{mode}Enabled", "Head", False),
                 (f"set{mode}Enabled", "Head", True))
        for mode in ("Breath", "IdlePosture")
    ),
    *(
        Movement(service, ((("isEnabled",), True),), ("setEnabled", False), ("setEnabled", True))
        for service in ("ALListeningMovement", "ALSpeakingMovement")
    ),
)  # fmt: skip
BASE_MOVEMENTS = tuple(
    Movement(
        "ALBasicAwareness",
        ((("isEnabled",), True), (("getTrackingMode",), mode)),
        ("setTrackingMode", "Head"),
        ("setTrackingMode", mode),
        ((("getTrackingMode",), "Head"),),
    )
    for mode in ("BodyRotation", "MoveContextually")
)
"""What turns and drives the base: then the head alone follows people, until somebody wants to look around."""


class IdleMovement:
    """What moves the robot by itself. One thread at a time, which may wait for the robot.

    Args:
        ended: What `ended` said in a driver that has died since; of other movements it may speak, too.
    """

    def __init__(self, connection: Connection, movements: tuple[Movement, ...], ended: str = "") -> None:
        self._connection = connection
        self._movements = movements
        names = ended.split(SEPARATOR)
        self._ended = tuple(movement for movement in movements if movement.name in names)

    @property
    def ended(self) -> str:
        """The names of what is to be resumed. For any thread."""
        return SEPARATOR.join(movement.name for movement in self._ended)

    def hold(self) -> None:
        """End what moves by itself; now and then again, as ALAutonomousLife switches it on.

        Raises:
            RobotUnreachable: See `Connection.call`.
        """
        for movement in self._movements:
            try:
                if self._answers(movement, movement.works):
                    # Noted before: a robot whose answer does not come may have obeyed.
                    self._note(movement)
                    self._ask(movement, movement.off)
            except CallRefused as error:
                log.debug("%s", error)  # this robot has no such movement

    def resume(self) -> None:
        """Let the robot move by itself again as it did before.

        Raises:
            RobotUnreachable: See `Connection.call`.
        """
        while self._ended:
            *before, movement = self._ended
            try:
                if self._answers(movement, movement.ended):
                    self._ask(movement, movement.on)
            except CallRefused as error:
                log.warning("%s", error)
            self._ended = tuple(before)

    def _note(self, movement: Movement) -> None:
        alike = (movement.service, movement.off)
        others = (other for other in self._ended if (other.service, other.off) != alike)
        self._ended = (*others, movement)

    def _answers(self, movement: Movement, answers: tuple[tuple[Call, bool | str], ...]) -> bool:
        return all(self._ask(movement, call) == wanted for call, wanted in answers)

    def _ask(self, movement: Movement, call: Call) -> Any:
        return self._connection.call(movement.service, *call)
