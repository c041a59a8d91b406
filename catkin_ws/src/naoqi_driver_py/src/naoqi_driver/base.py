"""Drives the base of a NAOqi robot and makes sure that it stops.

Wire (NAOqi 2.5-2.8 documentation, ALMotion): `move(x, y, theta)` takes m/s, m/s, rad/s in the robot's frame, returns
at once and holds until the next command, for ever if none comes; `moveTo(x, y, theta)` [m, m, rad] and `stopMove()`
return when the robot stands; `killMove()` ends a motion without braking ramp. While it drives, this writes the
ALMemory key `Telepresence/Driver/Heartbeat`: a number that changes with every cycle, 0 when the driver lets go. The
watchdog next to NAOqi stops a robot whose heartbeat no longer changes.
"""

from __future__ import annotations

import itertools
import logging
import math
import threading

from naoqi_driver.command_gate import CommandGate, Decision, is_zero
from naoqi_driver.connection import CallRefused, Connection, PendingCall, RobotUnreachable
from naoqi_driver.gated_drive import GatedDrive
from naoqi_driver.replies import flag, kind, numbers, sequence
from telepresence.geometry import ZERO_VELOCITY, Pose, Velocity, wrap_angle
from telepresence.security.change_log import ChangeLog
from telepresence.security.outside_text import clean

log = logging.getLogger(__name__)

PERIOD = 0.05
"""Seconds between two cycles without a new command: the heartbeat and the watch over silence."""
CALL_TIMEOUT = 0.4
"""Seconds a velocity may take to be acknowledged; shorter than the watchdog's patience."""
BRAKING_TIME = 0.25
"""Seconds that a robot whose commands ceased may brake gently. At ALMotion's default of 0.3 m/s² it would need 1.2 s
from full speed, and nobody is at the controls."""
STANDING_TIME = 1.5
"""Seconds of zero velocity after which the motion is ended; braking from full speed takes 1.2 s."""
REFUSAL_KEY = "ALMotion/MoveFailed"
"""ALMemory: [cause, 0 not started or 1 stopped under way, [x, y, z] of the obstacle in the world]."""
REFUSAL_LENGTH = 80
"""Characters of a cause that are shown."""
REFUSAL_SHOWN = 2.0
"""Seconds for which a refusal stays in the state."""
LOOK_SPEED = 0.1
"""Fraction of the head's top speed; slow, for whoever stands in front."""
HEARTBEAT_KEY = "Telepresence/Driver/Heartbeat"


class BaseDriver:
    """Carries out what the gate decides. One thread calls `step` on every command and at least every
    `PERIOD` seconds; `go_to` may come from another.

    Args:
        connection: The link to the robot.
        gate: Holds the newest command; a `CommandGate`, or a `GatedDrive`, which checks it against the sensors.
        wake_up: Wake a sleeping robot when the link comes up for the first time, and again when a robot that was awake
            comes back asleep (it restarted). One that was put to rest meanwhile is left alone.
        look: HeadPitch [rad, positive down] given to an awake robot when the link comes up, so that the pilot sees
            the floor ahead and not the ceiling that the Stand posture looks at; None leaves the head alone.
    """

    def __init__(
        self, connection: Connection, gate: CommandGate | GatedDrive, wake_up: bool = True, look: float | None = None
    ) -> None:
        self.state = "stopped: not connected yet"
        """What the base does and why, for people."""
        self.moves = 0
        """Velocities that the robot acknowledged."""
        self._connection = connection
        self._gate = gate
        self._wake_up = wake_up
        self._head_pitch = look
        self._greeted = 0
        self._awake: bool | None = None
        self._waking: PendingCall | None = None
        self._beats = itertools.count(1)
        self._sent: Velocity | None = None
        self._sent_changed = 0.0
        self._goal: PendingCall | None = None
        self._wanted_goal: tuple[float, float, float, bool] | None = None
        self._goal_lock = threading.Lock()
        self._stopping: PendingCall | None = None
        self._stop_began = 0.0
        self._brake_hard = False
        self._unsure = False
        self._refusal = ""
        self._refusal_until = 0.0
        self._refusal_stamp: list | None = None
        self._refusal_log = ChangeLog()

    @property
    def holds_robot(self) -> bool:
        """Whether the robot moves, or may move, because of this driver."""
        return self._sent is not None or self._goal is not None or self._stopping is not None or self._unsure

    @property
    def awake(self) -> bool | None:
        """What the robot said lately about being awake; None before the first answer."""
        return self._awake

    def note_awake(self, awake: bool) -> None:
        """Take what the robot said now; somebody may have put it to rest or woken it."""
        if self._waking is None:
            self._awake = awake

    def supervise(self, now: float, timeout: float = 0.2) -> None:
        """Ask, now and then, whether the robot is awake and whether it refused to move; both show in `state`.

        Raises:
            RobotUnreachable, CallRefused: See `Connection.call`.
        """
        self.note_awake(flag(self._connection.call("ALMotion", "robotIsWakeUp", timeout=timeout), "robotIsWakeUp"))
        try:
            answer = self._connection.call("ALMemory", "getTimestamp", REFUSAL_KEY, timeout=timeout)
            value, *stamp = sequence(answer, REFUSAL_KEY) or [None]
        except CallRefused:
            value, stamp = None, []  # it never refused anything
        if self._refusal_stamp not in (None, stamp) and value:
            cause = value[0] if isinstance(value, list | tuple) else value
            self._refusal = clean(cause, REFUSAL_LENGTH) if isinstance(cause, str) else kind(cause)
            self._refusal_until = now + REFUSAL_SHOWN
            self._refusal_log.repeat()
        if self._refusal and now < self._refusal_until:
            self._refusal_log.note(now, f"the robot refuses to move: {self._refusal}", log.warning)
        self._refusal_stamp = stamp

    def go_to(self, x: float, y: float, theta: float, in_odometry: bool = False) -> None:
        """Drive to a pose [m, m, rad], relative to the robot or in the odometry's frame.

        A velocity command or a lost master ends it; while somebody sends velocities it is ignored.
        """
        with self._goal_lock:
            self._wanted_goal = (x, y, theta, in_odometry)

    def step(self, now: float, master_alive: bool = True) -> None:
        """One cycle at `now` [s, monotonic]."""
        decision = self._gate.decide(now, master_alive)
        try:
            if self._greeted != self._connection.connections:
                self._greet()
            self._finish_stopping(now)
            if self._waking is not None and not self._waking.done:
                self.state = "stopped: the robot is waking up"
                return
            self._finish_waking()
            if decision.velocity is None:
                self._stand_or_follow_goal(decision, now, master_alive)
            else:
                self._drive(decision.velocity, decision.reason, now)
        except RobotUnreachable as error:
            self._unsure = self.holds_robot
            self._sent = self._goal = self._stopping = None
            self.state = f"robot unreachable: {self._connection.problem or error}"
        except CallRefused as error:
            self.state = f"stopped: the robot refuses: {error}"

    def halt(self, timeout: float) -> None:
        """Stop the robot, waiting at most `timeout` seconds until it stands; for the end of the program.

        Raises:
            RobotUnreachable: The command did not reach it. The watchdog on the robot will stop it.
        """
        if not self.holds_robot:
            return
        try:
            self._connection.call("ALMotion", "stopMove", timeout=timeout)
        except RobotUnreachable:
            self._connection.call("ALMotion", "killMove", timeout=CALL_TIMEOUT)
        self._connection.call("ALMemory", "insertData", HEARTBEAT_KEY, 0, timeout=CALL_TIMEOUT)

    def _greet(self) -> None:
        """Begin on a new link: wake the robot up, raise its head."""
        awake = flag(self._connection.call("ALMotion", "robotIsWakeUp"), "robotIsWakeUp")
        if self._wake_up and not awake and self._awake is not False:
            log.info("the robot sleeps: waking it up")
            self._waking = self._connection.call_async("ALMotion", "wakeUp")
        else:
            self._awake = awake
            self._raise_head()
        # What an earlier driver or a lost command started must not go on.
        self._unsure = True
        self._greeted = self._connection.connections

    def _finish_waking(self) -> None:
        if self._waking is not None:
            waking, self._waking = self._waking, None
            self._awake = waking.result(CALL_TIMEOUT) is not False
            self._raise_head()

    def _raise_head(self) -> None:
        if self._head_pitch is not None and self._awake:
            self._connection.call(
                "ALMotion", "setAngles", "HeadPitch", self._head_pitch, LOOK_SPEED, timeout=CALL_TIMEOUT
            )

    def _drive(self, velocity: Velocity, reason: str, now: float) -> None:
        if self._take_goal() is not None:
            log.warning("goal ignored: somebody drives the robot with velocity commands")
        velocity = ZERO_VELOCITY if is_zero(velocity) else velocity
        if velocity == ZERO_VELOCITY and not self.holds_robot:
            self.state = reason
            return
        if velocity == ZERO_VELOCITY and self._sent == ZERO_VELOCITY and now - self._sent_changed > STANDING_TIME:
            self._begin_stop(now, hard=False)
        if velocity == ZERO_VELOCITY and self._stopping is not None:
            self._beat()
        else:
            self._send(velocity, now)
        if self._awake is False:
            self.state = "stopped: the robot sleeps; wake it up to drive"
        elif velocity != ZERO_VELOCITY and now < self._refusal_until:
            self.state = f"driving, but the robot refuses: {self._refusal}"
        else:
            self.state = reason

    def _send(self, velocity: Velocity, now: float) -> None:
        """Command a velocity; it replaces a goal and a braking."""
        if velocity != self._sent:
            self._sent_changed = now
        self._sent = velocity
        # The pilot waits for the first, nobody for the second.
        move = self._connection.call_async("ALMotion", "move", *velocity)
        beat = self._connection.call_async("ALMemory", "insertData", HEARTBEAT_KEY, next(self._beats))
        move.result(CALL_TIMEOUT)
        beat.result(CALL_TIMEOUT)
        self._goal = self._stopping = None
        self._unsure = False
        self.moves += 1

    def _stand_or_follow_goal(self, decision: Decision, now: float, master_alive: bool) -> None:
        goals = master_alive and self._gate.allows_goals
        if not goals and self._take_goal() is not None:
            log.warning("goal refused: %s", decision.reason)
        if self._sent is not None or self._unsure or (self._goal is not None and not goals):
            self._begin_stop(now, hard=decision.fault or self._unsure)
        elif (wanted := self._take_goal()) is not None:
            self._beat(first=True)
            self._goal = self._connection.call_async("ALMotion", "moveTo", *self._relative(*wanted))
            self._stopping = None
        self._finish_goal()
        self.state = "driving to the goal" if self._goal is not None else decision.reason
        self._beat()

    def _take_goal(self) -> tuple[float, float, float, bool] | None:
        with self._goal_lock:
            wanted, self._wanted_goal = self._wanted_goal, None
        return wanted

    def _relative(self, x: float, y: float, theta: float, in_odometry: bool) -> Pose:
        """The pose as the robot sees it from where it stands."""
        if not in_odometry:
            return Pose(x, y, theta)
        robot = self._connection.call("ALMotion", "getRobotPosition", True, timeout=CALL_TIMEOUT)
        return relative_pose(Pose(x, y, theta), Pose(*numbers(robot, 3, "getRobotPosition")))

    def _finish_goal(self) -> None:
        if self._goal is not None and self._goal.done:
            goal, self._goal = self._goal, None
            reached = goal.result(CALL_TIMEOUT)
            log.info("goal reached" if reached else "the robot stopped before the goal")
            self._release()

    def _begin_stop(self, now: float, hard: bool) -> None:
        self._stopping = self._connection.call_async("ALMotion", "stopMove")
        self._sent = self._goal = None
        self._unsure = False
        self._stop_began = now
        self._brake_hard = hard

    def _finish_stopping(self, now: float) -> None:
        if self._stopping is None:
            return
        if self._stopping.done:
            stopping, self._stopping = self._stopping, None
            stopping.result(CALL_TIMEOUT)
            self._release()
        elif self._brake_hard and now - self._stop_began >= BRAKING_TIME:
            self._brake_hard = False
            self._connection.call("ALMotion", "killMove", timeout=CALL_TIMEOUT)

    def _beat(self, first: bool = False) -> None:
        """Keep the watchdog quiet while the robot may move because of us."""
        if first or self.holds_robot:
            self._connection.call("ALMemory", "insertData", HEARTBEAT_KEY, next(self._beats), timeout=CALL_TIMEOUT)

    def _release(self) -> None:
        """Let go: from now on the watchdog leaves the robot to others."""
        if not self.holds_robot:
            self._connection.call("ALMemory", "insertData", HEARTBEAT_KEY, 0, timeout=CALL_TIMEOUT)


def relative_pose(pose: Pose, origin: Pose) -> Pose:
    """Return `pose` as seen from `origin`, both in one frame."""
    dx, dy = pose.x - origin.x, pose.y - origin.y
    c, s = math.cos(origin.theta), math.sin(origin.theta)
    return Pose(c * dx + s * dy, c * dy - s * dx, wrap_angle(pose.theta - origin.theta))
