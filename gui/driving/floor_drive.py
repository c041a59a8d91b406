"""Driving to the place on the floor that the pilot points at in the picture, for as long as the button is held.

The place is kept in the odometry frame at the picture's own time, so the delay of the picture does not move it. Letting
go stops for good. What passes by itself (a picture, odometry or a transform that came late) stops the robot until it is
there again, and the drive goes on as long as the button is held.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from PyQt5.QtCore import QObject, pyqtSignal

from gui.driving.floor_projection import floor_place
from gui.periodic_timer import PeriodicTimer
from gui.ros.readings import BodyState, CameraView, Safety

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
NO_FLOOR = "There is no floor there. Point at the floor, below the horizon."


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
    """Why the robot does not go there, or not yet."""
    resumed = pyqtSignal()
    """It goes on after what `refused` told."""
    arrived = pyqtSignal()
    keeps_control = False
    """The zero that it sends ends its control of the robot, see `InputMux`."""

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
        self._block, self._block_passes = "", False
        self._pixel: tuple[float, float] | None = None
        self._target: tuple[float, float] | None = None
        self._sought = False
        """The place under the pointer is still to be found."""
        self._driving = self._arrived = self._waiting = False
        self._pressed_at = 0.0
        self._body: BodyState | None = None
        self._safety: Safety | None = None
        self._blocked_since = math.inf
        self._blocked_told = False
        self._timer = PeriodicTimer(SEND_PERIOD, self._step, self, precise=True)

    @property
    def target(self) -> tuple[float, float] | None:
        """The place in odom [m] while the button is held and it is known."""
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

    def set_block(self, reason: str, passing: bool = False) -> None:
        """Do not drive until the reason is an empty string again.

        Args:
            passing: It passes by itself: a button that is held meanwhile counts again afterwards.
        """
        self._block, self._block_passes = reason, passing
        if reason and self._pixel is not None:
            if passing:
                self._wait_for(reason)
            else:
                self._end(reason)

    def press(self, u: float, v: float) -> None:
        """The button went down on this pixel of the picture."""
        if self._block and not self._block_passes:
            self.refused.emit(self._block)
            return
        self._pixel, self._pressed_at = (u, v), time.monotonic()
        self._waiting, self._blocked_since = False, math.inf
        self._check_again()

    def drag(self, u: float, v: float) -> None:
        """The pointer moved with the button down."""
        if self._pixel is not None:
            self._pixel = (u, v)
            self._check_again()

    def release_all(self) -> None:
        """The button went up, or whatever counts as that."""
        if self._pixel is not None:
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

    def _check_again(self) -> None:
        """The pointer is somewhere else: find the place under it."""
        self._sought, self._arrived = True, False
        if not self._timer.isActive():  # started anew with every move of the pointer it would never end
            self._timer.start()
            self._step()
        else:
            self._find_place()

    def _find_place(self) -> str:
        """Find the place under the pointer, unless it is known; why it is not."""
        if self._pixel is None or not self._sought:
            return ""
        if self._picture_age() > OLDEST_PICTURE:
            return "The picture is too old to drive by."
        view = self._view_of()
        if isinstance(view, str):
            return view
        u, v = self._pixel
        place = floor_place(view, u, v, self.farthest)
        if place is None:
            self._end(NO_FLOOR)
            return NO_FLOOR
        self._sought, self._target = False, (place.x, place.y)
        self.target_changed.emit(self._target)
        return ""

    def _obstacle(self) -> str:
        """What keeps the robot from driving there now, and will pass; empty when nothing does."""
        if self._block:
            return self._block
        if self._body is None or time.monotonic() - self._body.arrived > POSE_MAX_AGE:
            return "The robot's odometry is lost, so it cannot find the way there."
        return self._find_place()

    def _step(self) -> None:
        obstacle = self._obstacle()
        if self._pixel is None:
            return
        if obstacle:
            self._wait_for(obstacle)
            return
        way = self.way()
        if way is None:
            return
        distance, bearing = way
        if distance < ARRIVED:
            self._timer.stop()
            self._send_zero()
            if not self._arrived:
                self._arrived = True
                self.arrived.emit()
            return
        if time.monotonic() - self._pressed_at < HOLD:
            return
        if self._waiting:
            self._waiting = False
            self.resumed.emit()
        self._report_blocked()
        # Sensors look ahead best: turn first, drive as the robot comes to face the place.
        speed = self._speed_for(distance) * max(0.0, math.cos(bearing))
        turn = max(-self.turn, min(self.turn, TURNING * bearing))
        self._driving = True
        self.velocity.emit(speed * math.cos(bearing), speed * math.sin(bearing), turn)

    def _speed_for(self, distance: float) -> float:
        return min(self.speed, max(SLOWEST, NEARING * distance))

    def _report_blocked(self) -> None:
        """Say once why the safety gate lets nothing pass. It is asked on: it gives way when the way is free again."""
        safety, now = self._safety, time.monotonic()
        if safety is None or safety.state != "blocked" or now - safety.arrived > 1.0:
            self._blocked_since, self._blocked_told = math.inf, False
        elif self._blocked_since == math.inf:
            self._blocked_since = now
        elif now - self._blocked_since > BLOCKED_PATIENCE and not self._blocked_told:
            self._blocked_told = True
            self.refused.emit(f"The way is blocked: {safety.reason}")

    def _wait_for(self, reason: str) -> None:
        """Stand until it has passed; tell why, once."""
        self._send_zero()
        if not self._waiting:
            self._waiting = True
            self.refused.emit(reason)

    def _send_zero(self) -> None:
        if self._driving:
            self._driving = False
            self.velocity.emit(0.0, 0.0, 0.0)

    def _end(self, reason: str) -> None:
        """Stop, once; tell why unless the pilot let go."""
        self._timer.stop()
        known = self._target is not None
        self._pixel = self._target = None
        self._send_zero()
        if known:
            self.target_changed.emit(None)
        if reason:
            self.refused.emit(reason)
