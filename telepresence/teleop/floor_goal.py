"""Driving to the place on the floor that somebody points at in the picture, for as long as they hold it.

The place is computed in the odometry frame at the time when the picture was taken, so neither the delay of the picture
nor a turning head moves it. A late picture, odometry or transform stops the robot only until it has come: then the
drive goes on if the place is still held. Window and page share it. No ROS, no Qt, no clock: times are arguments,
monotonic [s].
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from telepresence.geometry import ZERO_VELOCITY, Velocity
from telepresence.teleop.floor_projection import floor_place
from telepresence.teleop.hand_speeds import USUAL_SPEED, USUAL_TURN
from telepresence.teleop.robot_readings import GATE_LIFE, BodyState, CameraView, Safety

ARRIVED = 0.15
"""[m]; as near to the place as the robot drives."""
HOLD = 0.2
"""[s] that the place must be held before the robot moves: a click that only moves the focus drives nothing."""
SLOWEST = 0.06
"""[m/s]; friction would swallow slower commands."""
NEARING = 1.0
"""[1/s]: speed per metre that is left to drive."""
TURNING = 1.5
"""[1/s]: rad/s per radian to turn."""
POSE_MAX_AGE = 0.5
BLOCKED = 0.02
"""[m/s]; where the safety gate allows less the way is blocked."""
SLOW = 0.9
"""Share of the wanted speed; where it allows less it slows the robot down. The page's ring has the same numbers."""
BLOCKED_PATIENCE = 2.0
"""[s]"""
OLDEST_PICTURE = 1.0
"""[s]; a place in an older one is not driven to."""
CLICKED = "Hold the button on the floor to drive there: the robot stops when you let go."
NO_FLOOR = "There is no floor there. Point at the floor, below the horizon."


class FloorStep(NamedTuple):
    """What follows from one look at the goal.

    Args:
        velocity: To be sent now; one zero when the robot has to stand; None for nothing.
        refused: Why the robot does not drive there, or not yet; said once.
        resumed: The drive goes on: what `refused` said is over.
        arrived: The robot has just come there.
    """

    velocity: Velocity | None = None
    refused: str = ""
    resumed: bool = False
    arrived: bool = False


class FloorGoal:
    """One hand that points at the floor.

    Args:
        view_of: Returns the view of the camera, in odom, when the picture was taken in which the hand points; or a
            sentence that says why it is unknown.
        picture_age: Returns how old that picture is [s].
        farthest: Places farther away than this are moved nearer [m].
    Attributes:
        speed, turn: As fast as it may [m/s, rad/s].
        body, safety: The newest odometry, and what the safety gate says.
    """

    def __init__(
        self, view_of: Callable[[], CameraView | str], picture_age: Callable[[], float], farthest: float = 3.0
    ) -> None:
        self.farthest = farthest
        self.speed, self.turn = USUAL_SPEED, USUAL_TURN
        self.body: BodyState | None = None
        self.safety: Safety | None = None
        self._view_of, self._picture_age = view_of, picture_age
        self._pixel: tuple[float, float] | None = None
        self._target: tuple[float, float] | None = None
        self._sought = False
        """Whether the place that is pointed at still has to be found."""
        self._driving = self._arrived = self._waiting = False
        self._pressed_at = 0.0
        self._blocked_since = math.inf
        self._blocked_reported = False

    @property
    def held(self) -> bool:
        """Whether a hand points somewhere."""
        return self._pixel is not None

    @property
    def target(self) -> tuple[float, float] | None:
        """The place in odom [m] while it is held and known."""
        return self._target

    @property
    def driving(self) -> bool:
        return self._driving

    def clicked(self, now: float) -> bool:
        """Whether a release now would end a click that was too short to drive."""
        return self.held and not self._waiting and now - self._pressed_at < HOLD

    def press(self, u: float, v: float, now: float) -> None:
        """Point at this pixel of the picture."""
        self._pixel, self._pressed_at = (u, v), now
        self._sought, self._arrived = True, False
        self._waiting, self._blocked_since = False, math.inf

    def drag(self, u: float, v: float) -> None:
        """Point at another pixel, without having let go."""
        if self._pixel is not None:
            self._pixel = (u, v)
            self._sought, self._arrived = True, False

    def end(self, refused: str = "") -> FloorStep:
        """Point at nothing any more: the hand has let go, or must for this reason."""
        self._pixel = self._target = None
        return FloorStep(self._stand(), refused)

    def wait(self, reason: str) -> FloorStep:
        """Stop until this reason has passed."""
        first, self._waiting = not self._waiting, True
        return FloorStep(self._stand(), reason if first else "")

    def find(self) -> FloorStep:
        """Find the place that is pointed at, without waiting for the next `step`."""
        self._find_place()
        return FloorStep() if self.held else self.end(NO_FLOOR)

    def step(self, now: float, block: str = "") -> FloorStep:
        """Return what to send; twenty times a second while it is held.

        Args:
            block: Why nothing may drive for the moment; empty for no reason.
        """
        if not self.held:
            return FloorStep()
        obstacle = block or self._obstacle(now)
        if not self.held:
            return self.end(NO_FLOOR)
        if obstacle:
            return self.wait(obstacle)
        way = self.way()
        if way is None:
            return FloorStep()
        distance, bearing = way
        if self._arrived:
            return FloorStep()
        if distance < ARRIVED:
            self._arrived = True
            return FloorStep(self._stand(), arrived=True)
        if now - self._pressed_at < HOLD:
            return FloorStep()
        resumed, self._waiting = self._waiting, False
        # The sensors see best ahead: turn first, and drive as the robot comes to face the place.
        speed = self._speed_for(distance) * max(0.0, math.cos(bearing))
        turn = max(-self.turn, min(self.turn, TURNING * bearing))
        self._driving = True
        velocity = Velocity(speed * math.cos(bearing), speed * math.sin(bearing), turn)
        return FloorStep(velocity, self._blocked(now), resumed)

    def tone(self, now: float) -> str:
        """Return the colour of the way to the place: free, slow or blocked."""
        distance, bearing = self.way() or (0.0, 0.0)
        safety = self.safety
        if safety is None or now - safety.arrived > GATE_LIFE:
            return "slow"
        allowed = safety.allowed_towards(bearing)
        wanted = self._speed_for(distance)
        return "blocked" if allowed < BLOCKED else "slow" if allowed < SLOW * wanted else "free"

    def way(self) -> tuple[float, float] | None:
        """Return distance [m] and bearing [rad] of the place as seen from the robot; None when either is unknown."""
        body = self.body
        if body is None or self._target is None:
            return None
        dx, dy = self._target[0] - body.x, self._target[1] - body.y
        return math.hypot(dx, dy), math.remainder(math.atan2(dy, dx) - body.yaw, math.tau)

    def _obstacle(self, now: float) -> str:
        """Return what keeps the robot from driving there for the moment; empty when nothing does."""
        if self.body is None or now - self.body.arrived > POSE_MAX_AGE:
            return "The robot's odometry is lost, so it cannot find the way there."
        return self._find_place()

    def _find_place(self) -> str:
        """Find the place unless it is known already; return why it cannot be found, else nothing. Where there is no
        floor the hand points at nothing any more."""
        if self._pixel is None or not self._sought:
            return ""
        if self._picture_age() > OLDEST_PICTURE:
            return "The picture is too old to drive by."
        view = self._view_of()
        if isinstance(view, str):
            return view
        place = floor_place(view, *self._pixel, self.farthest)
        if place is None:
            self._pixel = None
        else:
            self._sought, self._target = False, (place.x, place.y)
        return ""

    def _speed_for(self, distance: float) -> float:
        return min(self.speed, max(SLOWEST, NEARING * distance))

    def _blocked(self, now: float) -> str:
        """Say once why the safety gate blocks. Commands are still sent: it passes them as soon as the way is free."""
        safety = self.safety
        if safety is None or safety.state != "blocked" or now - safety.arrived > GATE_LIFE:
            self._blocked_since, self._blocked_reported = math.inf, False
        elif self._blocked_since == math.inf:
            self._blocked_since = now
        elif now - self._blocked_since > BLOCKED_PATIENCE and not self._blocked_reported:
            self._blocked_reported = True
            return f"The way is blocked: {safety.reason}"
        return ""

    def _stand(self) -> Velocity | None:
        was, self._driving = self._driving, False
        return ZERO_VELOCITY if was else None
