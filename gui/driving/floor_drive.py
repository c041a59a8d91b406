"""Driving to the place on the floor that the pilot points at in the picture, for as long as the button is held.

The place is computed in the odometry frame at the time when the picture was taken, so the delay of the picture does
not move it. Releasing the button ends the drive. A late picture, odometry or transform stops the robot only until it
has come: then the drive goes on if the button is still held.
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
"""[m]; as near to the place as the robot drives."""
HOLD = 0.2
"""[s] that the button must be held before the robot moves: a click that only moves the focus drives nothing."""
SLOWEST = 0.06
"""[m/s]; friction would swallow slower commands."""
NEARING = 1.0
"""[1/s]: speed per metre that is left to drive."""
TURNING = 1.5
"""[1/s]: rad/s per radian to turn."""
POSE_MAX_AGE = 0.5
BLOCKED_PATIENCE = 2.0
"""[s]"""
OLDEST_PICTURE = 1.0
"""[s]; a place in an older one is not driven to."""
CLICKED = "Hold the button on the floor to drive there: the robot stops when you let go."
NO_FLOOR = "There is no floor there. Point at the floor, below the horizon."


class FloorDrive(QObject):
    """An input device that drives to a place.

    Args:
        view_of: Returns the view of the camera, in odom, when the shown picture was taken; or a sentence that says why
            it is unknown.
        picture_age: Returns how old that picture is [s].
        farthest: Places farther away than this are moved nearer [m].
    """

    velocity = pyqtSignal(float, float, float)
    """Forward, left [m/s], counter-clockwise [rad/s]: 20 times a second while driving, zero once at the end."""
    target_changed = pyqtSignal(object)
    """(x, y) in odom [m], or None."""
    refused = pyqtSignal(str)
    """Why the robot does not drive there, or not yet."""
    resumed = pyqtSignal()
    """The drive goes on: what `refused` reported is over."""
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
        """Whether the place under the pointer still has to be found."""
        self._driving = self._arrived = self._waiting = False
        self._pressed_at = 0.0
        self._body: BodyState | None = None
        self._safety: Safety | None = None
        self._blocked_since = math.inf
        self._blocked_reported = False
        self._timer = PeriodicTimer(SEND_PERIOD, self._step, self, precise=True)

    @property
    def target(self) -> tuple[float, float] | None:
        """The place in odom [m] while the button is held and it is known."""
        return self._target

    @property
    def driving(self) -> bool:
        return self._driving

    def show_reading(self, reading: object) -> None:
        """Use a `BodyState` or `Safety`; other readings are ignored."""
        if isinstance(reading, BodyState):
            self._body = reading
        elif isinstance(reading, Safety):
            self._safety = reading

    def set_block(self, reason: str, passing: bool = False) -> None:
        """Do not drive until the reason is an empty string again.

        Args:
            passing: The cause will pass on its own: a button that is still held then drives on.
        """
        self._block, self._block_passes = reason, passing
        if reason and self._pixel is not None:
            if passing:
                self._wait_for(reason)
            else:
                self._end(reason)

    def press(self, u: float, v: float) -> None:
        """Start: the button was pressed on this pixel of the picture."""
        if self._block and not self._block_passes:
            self.refused.emit(self._block)
            return
        self._pixel, self._pressed_at = (u, v), time.monotonic()
        self._waiting, self._blocked_since = False, math.inf
        self._check_again()

    def drag(self, u: float, v: float) -> None:
        """Change the place: the pointer was moved with the button held."""
        if self._pixel is not None:
            self._pixel = (u, v)
            self._check_again()

    def release(self) -> None:
        """End the drive: the button was released. After a click say why the robot does not go there by itself."""
        clicked = self._pixel is not None and not self._waiting and time.monotonic() - self._pressed_at < HOLD
        self.release_all()
        if clicked:
            self.refused.emit(CLICKED)

    def release_all(self) -> None:
        """End the drive: something happened that counts as releasing the button."""
        if self._pixel is not None:
            self._end("")

    def tone(self) -> str:
        """Return the colour of the path to the place: free, slow or blocked."""
        distance, bearing = self.way() or (0.0, 0.0)
        safety = self._safety
        if safety is None or time.monotonic() - safety.arrived > 1.0:
            return "slow"
        allowed = safety.allowed_towards(bearing)
        wanted = self._speed_for(distance)
        return "blocked" if allowed < 0.02 else "slow" if allowed < 0.9 * wanted else "free"

    def way(self) -> tuple[float, float] | None:
        """Return distance [m] and bearing [rad] of the place as seen from the robot; None when either is unknown."""
        body = self._body
        if body is None or self._target is None:
            return None
        dx, dy = self._target[0] - body.x, self._target[1] - body.y
        return math.hypot(dx, dy), math.remainder(math.atan2(dy, dx) - body.yaw, math.tau)

    def _check_again(self) -> None:
        """Find the place under the pointer, which has moved."""
        self._sought, self._arrived = True, False
        if not self._timer.isActive():  # restarted by every move of the pointer it would never fire
            self._timer.start()
            self._step()
        else:
            self._find_place()

    def _find_place(self) -> str:
        """Find the place under the pointer unless it is known already; return why it cannot be found, else nothing."""
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
        """Return what keeps the robot from driving there for the moment; empty when nothing does."""
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
        # The sensors see best ahead: turn first, and drive as the robot comes to face the place.
        speed = self._speed_for(distance) * max(0.0, math.cos(bearing))
        turn = max(-self.turn, min(self.turn, TURNING * bearing))
        self._driving = True
        self.velocity.emit(speed * math.cos(bearing), speed * math.sin(bearing), turn)

    def _speed_for(self, distance: float) -> float:
        return min(self.speed, max(SLOWEST, NEARING * distance))

    def _report_blocked(self) -> None:
        """Say once why the safety gate blocks. Commands are still sent: it passes them as soon as the path is free."""
        safety, now = self._safety, time.monotonic()
        if safety is None or safety.state != "blocked" or now - safety.arrived > 1.0:
            self._blocked_since, self._blocked_reported = math.inf, False
        elif self._blocked_since == math.inf:
            self._blocked_since = now
        elif now - self._blocked_since > BLOCKED_PATIENCE and not self._blocked_reported:
            self._blocked_reported = True
            self.refused.emit(f"The way is blocked: {safety.reason}")

    def _wait_for(self, reason: str) -> None:
        """Stop until this reason has passed; report it once."""
        self._send_zero()
        if not self._waiting:
            self._waiting = True
            self.refused.emit(reason)

    def _send_zero(self) -> None:
        if self._driving:
            self._driving = False
            self.velocity.emit(0.0, 0.0, 0.0)

    def _end(self, reason: str) -> None:
        """End the drive; report the reason unless the pilot released the button."""
        self._timer.stop()
        known = self._target is not None
        self._pixel = self._target = None
        self._send_zero()
        if known:
            self.target_changed.emit(None)
        if reason:
            self.refused.emit(reason)
