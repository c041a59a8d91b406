"""Keys to velocities. No ROS, no terminal and no clock of its own: `now` is an argument.

A terminal sends characters and never says that a key was released. So a motion key is latched: the robot keeps going
until the next key. Layout and step sizes are those of teleop_twist_keyboard (https://wiki.ros.org/teleop_twist_keyboard).
"""

from __future__ import annotations

import math
import re
from typing import NamedTuple


class Velocity(NamedTuple):
    """What the robot shall do, in base_footprint: forward, left, up [m/s], counter-clockwise [rad/s]."""

    vx: float = 0.0
    vy: float = 0.0
    vz: float = 0.0
    wz: float = 0.0


class Direction(NamedTuple):
    """A motion key: its name for the pilot and the signs of forward, left, up and counter-clockwise."""

    name: str
    x: int = 0
    y: int = 0
    z: int = 0
    theta: int = 0


DIRECTIONS: dict[str, Direction] = {
    "i": Direction("forward", x=1),
    "o": Direction("forward, turning right", x=1, theta=-1),
    "j": Direction("turning left", theta=1),
    "l": Direction("turning right", theta=-1),
    "u": Direction("forward, turning left", x=1, theta=1),
    ",": Direction("backward", x=-1),
    ".": Direction("backward, turning left", x=-1, theta=1),
    "m": Direction("backward, turning right", x=-1, theta=-1),
    # With Shift the robot keeps its heading: for bases that drive sideways.
    "I": Direction("forward", x=1),
    "O": Direction("forward and right", x=1, y=-1),
    "J": Direction("left", y=1),
    "L": Direction("right", y=-1),
    "U": Direction("forward and left", x=1, y=1),
    "<": Direction("backward", x=-1),
    ">": Direction("backward and right", x=-1, y=-1),
    "M": Direction("backward and left", x=-1, y=1),
    # A robot on the ground ignores up and down, and so stands still.
    "t": Direction("up", z=1),
    "b": Direction("down", z=-1),
    "up": Direction("forward", x=1),
    "down": Direction("backward", x=-1),
    "left": Direction("turning left", theta=1),
    "right": Direction("turning right", theta=-1),
}

SPEED_FACTORS: dict[str, tuple[float, float]] = {
    "q": (1.1, 1.1),
    "z": (0.9, 0.9),
    "w": (1.1, 1.0),
    "x": (0.9, 1.0),
    "e": (1.0, 1.1),
    "c": (1.0, 0.9),
}
"""Key -> factors of driving and turning speed."""

HELP = """\
Keys of this terminal become velocities (Twist).
-----------------------------------------------
Moving around:
   u    i    o
   j    k    l
   m    ,    .
With Shift, keeping the heading (for a base that drives sideways):
   U    I    O
   J    K    L
   M    <    >

t/b : up/down (a robot on the ground ignores them); arrows : as i , j l
any other key : stop

q/z : both speeds up/down by 10 %
w/x : only the driving speed
e/c : only the turning speed

CTRL-C to quit; a key holds until the next one
"""

HELP_EVERY = 15
"""Speed keys after which the help is printed again, as in the telepresence report."""

STOP_DURATION = 0.5
"""Seconds for which zero is repeated after a stop; then the topic is left to other inputs."""

LONGEST_PAUSE = 0.5
"""Seconds between two calls of `command` after which a latched command is dropped. The program was stopped (Ctrl-Z) or
the machine slept: the robot has been standing since, and must not start unasked."""

_ESCAPE_SEQUENCE = re.compile(r"\x1b(?:\[[0-9;?]*[ -/]*[@-~]|O[@-~]|[^\x1b])?|[\s\S]")
_ARROWS = {"A": "up", "B": "down", "C": "right", "D": "left"}


def split_keys(characters: str) -> list[str]:
    """What a terminal sent, as keys: one character each, arrows as "up", "down", "left", "right".

    Any other escape sequence (function keys, Alt with a key) is one key, so that none of its letters drives the robot.
    """
    keys = []
    for sequence in _ESCAPE_SEQUENCE.findall(characters):
        arrow = len(sequence) == 3 and sequence[1] in "[O" and _ARROWS.get(sequence[2])
        keys.append(arrow or sequence)
    return keys


class LatchedKeys:
    """The pilot's keys, latched into one command.

    Args:
        speed: Driving speed to begin with [m/s].
        turn: Turning speed to begin with [rad/s].
        speed_limit, turn_limit: What the speed keys can reach [m/s], [rad/s]. Defaults: the most that Pepper's base
            does (NAOqi documentation, ALMotion, "Pepper's base": 0.55 m/s, 2.0 rad/s).
        key_timeout: Stop this long after the last key [s]; 0 means never.
    Attributes:
        speed_keys: How many speed keys were pressed so far.
    Raises:
        ValueError: A number is negative, not finite, or a speed is above its limit.
    """

    def __init__(
        self,
        speed: float = 0.2,
        turn: float = 0.5,
        speed_limit: float = 0.55,
        turn_limit: float = 2.0,
        key_timeout: float = 0.0,
    ) -> None:
        for name, value, limit in (("speed", speed, speed_limit), ("turn", turn, turn_limit)):
            if not (math.isfinite(limit) and 0.0 < value <= limit):
                raise ValueError(f"{name} must be above 0 and at most {name}_limit, which is {limit}; it is {value}")
        if not (math.isfinite(key_timeout) and key_timeout >= 0.0):
            raise ValueError(f"key_timeout must be a number of seconds, 0 for none; it is {key_timeout}")
        self.speed = speed
        self.turn = turn
        self._speed_limit = speed_limit
        self._turn_limit = turn_limit
        self._key_timeout = key_timeout
        self.speed_keys = 0
        self._direction: Direction | None = None
        self._pressed_at = 0.0
        self._asked_at = -math.inf
        self._quiet_at = -math.inf

    @property
    def moving(self) -> bool:
        """Whether a motion key is latched."""
        return self._direction is not None

    def press(self, key: str, now: float) -> None:
        """A key of `split_keys`, at `now` [s]. Whatever has no meaning of its own stops the robot."""
        if key in SPEED_FACTORS:
            speed_factor, turn_factor = SPEED_FACTORS[key]
            self.speed = min(self._speed_limit, self.speed * speed_factor)
            self.turn = min(self._turn_limit, self.turn * turn_factor)
            self.speed_keys += 1
        elif key in DIRECTIONS:
            self._direction = DIRECTIONS[key]
            # A pause that ends with this key is no reason to drop it.
            self._asked_at = now
        else:
            self.release(now)
        self._pressed_at = now

    def release(self, now: float) -> None:
        """Stop: zero for a while, then quiet."""
        self._direction = None
        self._quiet_at = now + STOP_DURATION

    def let_go(self) -> None:
        """Be quiet at once, without a zero: another input drives now."""
        self._direction = None
        self._quiet_at = -math.inf

    def command(self, now: float) -> Velocity | None:
        """What to publish at `now` [s]; None means nothing. To be asked at a steady rate, at least twice a second."""
        paused = now - self._asked_at > LONGEST_PAUSE
        timed_out = 0.0 < self._key_timeout <= now - self._pressed_at
        self._asked_at = now
        if self.moving and (paused or timed_out):
            self.release(now)
        if self._direction is None:
            return Velocity() if now < self._quiet_at else None
        return Velocity(
            self._direction.x * self.speed,
            self._direction.y * self.speed,
            self._direction.z * self.speed,
            self._direction.theta * self.turn,
        )

    def describe_motion(self) -> str:
        """Return what is latched, for the pilot."""
        return self._direction.name if self._direction else "stop"

    def describe_speeds(self) -> str:
        """Return the speeds [m/s, rad/s] in the line of the telepresence report."""
        return f"currently:\tspeed {self.speed:.3g}\tturn {self.turn:.3g}"
