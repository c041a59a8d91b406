"""Driving to the place on the floor that the pilot points at in the picture, for as long as the button is held.

The place is kept in the odometry frame at the picture's own time, so the delay of the picture does not move it. Letting
go, losing the picture, the odometry or the way stops.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from PyQt5.QtCore import QObject, Qt, QTimer, pyqtSignal

from gui.floor import floor_place
from gui.readings import BodyState, CameraView, Safety

SEND_PERIOD = 50  # ms
ARRIVED = 0.15
"""[m] from the place: near enough."""
HOLD = 0.2
"""Seconds that the button must be down before the robot moves: a click that only takes the keyboard moves nothing."""
SLOWEST = 0.06
"""[m/s]; slower commands would be lost in the wheels' friction."""
NEARING = 1.0
"""[1/s]: speed per metre that is left."""
TURNING = 1.5
"""[1/s]: rad/s per radian to turn."""
POSE_MAX_AGE = 0.5
BLOCKED_PATIENCE = 2.0
"""[s]"""
OLDEST_PICTURE = 1.0
"""[s]; a place in an older one is not driven to."""


class FloorDrive(QObject):
    """A source of velocities like the drive pad.

    Args:
        view_of: The view of the camera as the picture that is shown was taken, in odom; or a sentence why there is
            none.
        picture_age: How old that picture is [s].
        farthest: Places farther away than this are moved nearer [m].
    """

    velocity = pyqtSignal(float, float, float)
    """Forward, left [m/s], counter-clockwise [rad/s]: 20 times a second while driving, zero once at the end."""
    target_changed = pyqtSignal(object)
    """(x, y) in odom [m], or None."""
    refused = pyqtSignal(str)
    """Why the robot does not go there."""
    arrived = pyqtSignal()

    def __init__(
        self,
        view_of: Callable[[], CameraView | str],
        picture_age: Callable[[], float],
        farthest: float = 3.0,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self.farthest = farthest
        self.speed, self.turn = 0.2, 0.5
        self._view_of, self._picture_age = view_of, picture_age
        self._block = ""
        self._target: tuple[float, float] | None = None
        self._driving = self._arrived = False
        self._pressed_at = 0.0
        self._body: BodyState | None = None
        self._safety: Safety | None = None
        self._blocked_since: float | None = None
        self._timer = QTimer(self, interval=SEND_PERIOD)
        self._timer.setTimerType(Qt.PreciseTimer)
        self._timer.timeout.connect(self._step)

    @property
    def target(self) -> tuple[float, float] | None:
        """The place in odom [m] while the button is held."""
        return self._target

    @property
    def driving(self) -> bool:
        return self._driving

    def show_reading(self, reading: object) -> None:
        """Take in `BodyState` and `Safety`; other readings are ignored."""
        if isinstance(reading, BodyState):
            self._body = reading
        elif isinstance(reading, Safety):
            self._safety = reading

    def set_block(self, reason: str) -> None:
        """Do not drive until the reason is an empty string again."""
        self._block = reason
        if reason and self._target is not None:
            self._end(reason)

    def press(self, u: float, v: float) -> None:
        """The button went down on this pixel of the picture."""
        if self._block:
            self.refused.emit(self._block)
        elif self._point_at(u, v):
            self._blocked_since = None
            self._pressed_at, self._arrived = time.monotonic(), False
            self._timer.start()
            self._step()

    def drag(self, u: float, v: float) -> None:
        """The pointer moved with the button down."""
        if self._target is not None and self._point_at(u, v):
            self._arrived = False
            self._timer.start()

    def release_all(self) -> None:
        """The button went up, or whatever counts as that."""
        if self._target is not None:
            self._end("")

    def tone(self) -> str:
        """How the way is to be painted: free, slow or blocked."""
        distance, bearing = self.way() or (0.0, 0.0)
        safety = self._safety
        if safety is None or time.monotonic() - safety.arrived > 1.0:
            return "slow"
        allowed = safety.allowed_towards(bearing)
        wanted = self._speed_for(distance)
        return "blocked" if allowed < 0.02 else "slow" if allowed < 0.9 * wanted else "free"

    def way(self) -> tuple[float, float] | None:
        """Distance [m] and bearing [rad] of the place from where the robot is; None when one is unknown."""
        body = self._body
        if body is None or self._target is None:
            return None
        dx, dy = self._target[0] - body.x, self._target[1] - body.y
        return math.hypot(dx, dy), math.remainder(math.atan2(dy, dx) - body.yaw, math.tau)

    def _point_at(self, u: float, v: float) -> bool:
        if self._picture_age() > OLDEST_PICTURE:
            self._end("The picture is too old to drive by.")
            return False
        view = self._view_of()
        if isinstance(view, str):
            self._end(view)
            return False
        place = floor_place(view, u, v, self.farthest)
        if place is None:
            self._end("There is no floor there. Point at the floor, below the horizon.")
            return False
        self._target = (place.x, place.y)
        self.target_changed.emit(self._target)
        return True

    def _step(self) -> None:
        body, now = self._body, time.monotonic()
        if body is None or now - body.arrived > POSE_MAX_AGE:
            self._end("The robot's odometry is lost, so it cannot find the way there.")
            return
        distance, bearing = self.way()
        if distance < ARRIVED:
            self._timer.stop()
            if self._driving:
                self._driving = False
                self.velocity.emit(0.0, 0.0, 0.0)
            if not self._arrived:
                self._arrived = True
                self.arrived.emit()
            return
        if now - self._pressed_at < HOLD:
            return
        if self._is_blocked(now):
            self._end(f"The way is blocked: {self._safety.reason}")
            return
        # Sensors look ahead best: turn first, drive as the robot comes to face the place.
        speed = self._speed_for(distance) * max(0.0, math.cos(bearing))
        turn = max(-self.turn, min(self.turn, TURNING * bearing))
        self._driving = True
        self.velocity.emit(speed * math.cos(bearing), speed * math.sin(bearing), turn)

    def _speed_for(self, distance: float) -> float:
        return min(self.speed, max(SLOWEST, NEARING * distance))

    def _is_blocked(self, now: float) -> bool:
        safety = self._safety
        if safety is None or safety.state != "blocked" or now - safety.arrived > 1.0:
            self._blocked_since = None
            return False
        self._blocked_since = self._blocked_since or now
        return now - self._blocked_since > BLOCKED_PATIENCE

    def _end(self, reason: str) -> None:
        """Stop, once; tell why unless the pilot let go."""
        self._timer.stop()
        held, self._target = self._target is not None, None
        if self._driving:
            self._driving = False
            self.velocity.emit(0.0, 0.0, 0.0)
        if held:
            self.target_changed.emit(None)
        if reason:
            self.refused.emit(reason)
