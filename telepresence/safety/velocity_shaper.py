"""Path from the pilot's command to the output: speed limits, swing, turning, obstacles, ramp, reason in words."""

from __future__ import annotations

import math

import numpy as np

from .braking import turning_rate
from .careful_scan import BodySwing
from .gate_state import GateStateFilter
from .messages import SECTORS, Command, Decision, State, in_words, sector_of
from .pose_history import TURN_ARM
from .robot_profile import RobotProfile
from .tick_state import TickState

CUT = 0.98
"""A velocity of which less than this share is left has been cut."""
FREE_WAY = 0.10
"""A blocked pilot is offered the directions in which this speed is allowed [m/s]."""


class VelocityShaper:
    """Shapes commands tick by tick; keeps the last output for its ramps.

    Attributes:
        heading: When the robot was last driven [s], and in which direction in base_link [rad]; None before that.
    """

    def __init__(self, profile: RobotProfile) -> None:
        self._limits = profile.limits
        self._swing = BodySwing(profile.swing) if profile.swing else None
        self._sight = min(source.max_range for source in profile.sources) - profile.limits.margin_ahead
        """How far from the robot something may appear when the body's swing turns a beam there [m]. Not `clear_range`,
        which would cost another sixth of the speed: sensors that see no farther meet a thin leg in a hundred too late,
        at half the speed that does no harm (docs/safety.md)."""
        self._state_filter = GateStateFilter()
        self._top_turn = profile.top_turn
        self._speed = self._turn = self._output_turn = 0.0
        self.heading: tuple[float, float] | None = None

    def forget_heading(self) -> None:
        """Take the body's heading as the pilot's, whatever it was swung to, and count nothing as looked at."""
        if self._swing:
            self._swing.forget_surroundings()

    def halt(self, state: State, reason: str, command_age: float, tick: TickState | None) -> Decision:
        """Return a decision to stop, with the reason."""
        self._speed = self._turn = self._output_turn = 0.0
        if self._swing and state in (State.FAULT, State.SENSOR_STALE):
            self._swing.forget_surroundings()  # whatever the body turns by now, nothing looks
        elif self._swing:
            self._swing.forget()
        if tick is None:
            return Decision(0.0, 0.0, 0.0, state, reason, command_age=command_age)
        return Decision(0.0, 0.0, 0.0, state, reason, tick.allowed(), tick.obstacles.gap, command_age=command_age)

    def shape(
        self, now: float, dt: float, command: Command, command_age: float, theta: float, tick: TickState, careful: bool
    ) -> Decision:
        """Return what is left of a command.

        Args:
            now: [s].
            dt: Time since the last tick, for the ramps [s].
            command: Valid and in time.
            command_age: [s].
            theta: Heading in the odometry frame [rad].
            tick: Obstacles and speed limits now.
            careful: Whether to swing the body while driving.
        """
        limits = self._limits
        vx, vy = shorten(command.vx, command.vy, limits.max_speed)
        requested_speed = math.hypot(vx, vy)
        requested_turn = _clamp(command.wz, limits.escape_turn if tick.bumped else limits.max_turn)
        pilot_turn = _rise(self._turn, requested_turn, limits.acceleration_turn * dt)
        turn, offset, scanning = pilot_turn, 0.0, False
        if self._swing:
            self._swing.look(now, theta)
            scanning = careful and not tick.bumped and (vx, vy) != (0.0, 0.0)
            if scanning:
                vx, vy = shorten(vx, vy, self._swing.fastest(self._sight, limits.reaction, limits.braking))
            offset = self._swing.offset(theta)
            if (vx, vy, requested_turn) != (0.0, 0.0, 0.0):  # else it stands at once, turned as it is
                turn = _clamp(turn + self._swing.rate(theta, pilot_turn, scanning, dt), self._top_turn)
            vx, vy = _rotate(vx, vy, -offset)

        permitted, safe_turn, cause = self._within_bounds(vx, vy, turn, tick)
        speed = math.hypot(*permitted)
        if not cause and CUT * math.hypot(vx, vy) <= speed < CUT * requested_speed:
            cause = f"Slowed to {speed:.2f} m/s: the careful scan must have looked there first."
        turned = safe_turn / turn if turn else 1.0
        requested = math.hypot(requested_speed, TURN_ARM * requested_turn)
        given = math.hypot(speed, TURN_ARM * requested_turn * turned)
        state = self._state_filter.update(now, requested, given)
        if tick.bumped:
            state, cause = State.BUMPED, tick.bumped
        index = tick.tightest(vx, vy) if state is not State.CLEAR else None
        reason = self._explain(state, cause, speed, tick, index)

        output = shorten(*permitted, self._speed + limits.acceleration * dt)
        self._speed, self._turn = math.hypot(*output), pilot_turn * turned
        if self._speed > 0.0:
            self.heading = now, math.atan2(output[1], output[0])
        return Decision(
            *output,
            safe_turn,
            state,
            reason,
            tick.allowed(),
            tick.obstacles.gap,
            sector=None if index is None else sector_of(tick.bearing(index)),
            command_age=command_age,
            scanning=scanning,
            swing=offset,
        )

    def _within_bounds(
        self, vx: float, vy: float, turn: float, tick: TickState
    ) -> tuple[tuple[float, float], float, str]:
        """Return the velocity [m/s] and turning [rad/s] that sensors, latches and obstacles permit, and why a limit
        that is no obstacle cut it, empty if none did.
        """
        limits = self._limits
        safe_turn, room = turning_rate(
            turn, tick.obstacles.room, tick.obstacles.levers, limits.reaction, limits.braking_turn
        )
        turns = (0.0, *{rate * limits.lag for rate in (self._output_turn, safe_turn) if rate})
        self._output_turn = safe_turn
        capped, cause = _cap(vx, vy, tick)
        free = tick.velocity_bounds(room, turns).nearest_allowed(*capped)
        within, second_cause = (free, "") if free == capped else _cap(*free, tick)
        if math.hypot(*free) < CUT * math.hypot(*capped) or (turn and safe_turn / turn < CUT):
            cause = ""
        elif second_cause:
            cause = second_cause
        return within, safe_turn, cause

    def _explain(self, state: State, cause: str, speed: float, tick: TickState, index: int | None) -> str:
        if state is State.CLEAR:
            return "Free."
        if cause:
            return cause
        if index is None:
            if state is State.BLOCKED:
                return "An obstacle is in the way of turning."
            return f"Slowed to {speed:.2f} m/s beside an obstacle."
        if state is State.BLOCKED:
            return f"Blocked by an obstacle {tick.describe(index)}. {_offer(tick.allowed())}"
        return f"Slowed to {speed:.2f} m/s by an obstacle {tick.describe(index)}."


def _cap(vx: float, vy: float, tick: TickState) -> tuple[tuple[float, float], str]:
    """Return a velocity within what sensors and latches permit in its direction, and why it was cut."""
    speed = math.hypot(vx, vy)
    if speed == 0.0:
        return (0.0, 0.0), ""
    sector = sector_of(math.atan2(vy, vx))
    cap = float(tick.caps[sector])
    return shorten(vx, vy, cap), tick.why(sector) if cap < speed else ""


def shorten(vx: float, vy: float, longest: float) -> tuple[float, float]:
    """Return a vector of the same direction, no longer than `longest` [m/s]."""
    length = math.hypot(vx, vy)
    if length <= longest:
        return vx, vy
    scale = max(longest, 0.0) / length
    return vx * scale, vy * scale


def _clamp(value: float, size: float) -> float:
    return max(-size, min(size, value))


def _rise(last: float, wanted: float, step: float) -> float:
    """Return `wanted`, growing by no more than `step`; falling is immediate."""
    if last * wanted <= 0.0:
        return _clamp(wanted, step)
    return _clamp(wanted, max(abs(last), 0.0) + step)


def _rotate(x: float, y: float, angle: float) -> tuple[float, float]:
    c, s = math.cos(angle), math.sin(angle)
    return c * x - s * y, s * x + c * y


def _offer(allowed: np.ndarray) -> str:
    """Return the main directions that are free, for a pilot who is blocked."""
    names = [in_words(eighth * math.tau / 8) for eighth in (0, 1, 7, 2, 6, 3, 5, 4)]
    sectors = [eighth * SECTORS // 8 for eighth in (0, 1, 7, 2, 6, 3, 5, 4)]
    free = [name for name, sector in zip(names, sectors) if allowed[sector] >= FREE_WAY]  # noqa: B905 Python 3.9
    return f"Free: {', '.join(free)}." if free else "Turn to look for a way out."
