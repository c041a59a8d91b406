"""Keeps the robot from moving by itself while a pilot has it, and lets it do so again afterwards.

NAOqi 2.8 documentation: ALBasicAwareness turns the head to people and noises, and after it the base, which is how
autonomous life sets it; ALMotion's idle control breathes and comes back to the posture Stand, ALListeningMovement and
ALSpeakingMovement nod. Each is asked for its state first, so that what its owner had switched off stays off.
"""

from __future__ import annotations

import logging
from typing import Any, NamedTuple

from naoqi_driver.connection import CallRefused, Connection

log = logging.getLogger(__name__)

Call = tuple[Any, ...]


class Movement(NamedTuple):
    """Something that moves the robot by itself.

    Args:
        works: Calls of the service with what they answer while it does.
        off, on: Calls that end and resume it.
    """

    service: str
    works: tuple[tuple[Call, bool | str], ...]
    off: Call
    on: Call


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
    )
    for mode in ("BodyRotation", "MoveContextually")
)
"""What turns and drives the base: then the head alone follows people, until somebody wants to look around."""


class IdleMovement:
    """What moves the robot by itself. For a thread that may wait for the robot."""

    def __init__(self, connection: Connection, movements: tuple[Movement, ...]) -> None:
        self._connection = connection
        self._movements = movements
        self._ended: list[Movement] = []

    @property
    def held(self) -> bool:
        """Whether something was ended that is to be resumed."""
        return bool(self._ended)

    def hold(self) -> None:
        """End what moves by itself; now and then again, as ALAutonomousLife switches it on.

        Raises:
            RobotUnreachable: See `Connection.call`.
        """
        for movement in self._movements:
            try:
                if all(self._ask(movement, call) == wanted for call, wanted in movement.works):
                    self._ask(movement, movement.off)
                    if movement not in self._ended:
                        self._ended.append(movement)
            except CallRefused as error:
                log.debug("%s", error)  # this robot has no such movement

    def resume(self) -> None:
        """Let the robot move by itself again as it did before.

        Raises:
            RobotUnreachable: See `Connection.call`.
        """
        while self._ended:
            movement = self._ended[-1]
            try:
                self._ask(movement, movement.on)
            except CallRefused as error:
                log.warning("%s", error)
            self._ended.pop()

    def _ask(self, movement: Movement, call: Call) -> Any:
        return self._connection.call(movement.service, *call)
