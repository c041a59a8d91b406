"""Carries out what watchdog and gate decide: velocities and goals to the drive server, and nothing whenever in doubt.

Only the drive server (`telepresence.drive`) moves the base. It judges how old a command is, brakes when this driver
falls silent, and says what it made of a command; none of that waits for an answer here. NAOqi itself is asked for the
rest (NAOqi 2.5-2.8 documentation, ALMotion): `robotIsWakeUp`, `wakeUp`, `setAngles` for the head,
`getRobotPosition(True)`, which is x, y, theta of the odometry [m, m, rad], and why it last refused to move.
"""

from __future__ import annotations

import logging
import math

from naoqi_driver.command_watchdog import CommandWatchdog, WheelCommand, is_zero
from naoqi_driver.connection import CallRefused, Connection, PendingCall
from naoqi_driver.gated_drive import GatedDrive
from naoqi_driver.replies import flag, kind, numbers, sequence
from telepresence.drive.datagram import DRIVING, REACHED
from telepresence.drive.link import DriveLink
from telepresence.drive.pilots_goal import ASKED
from telepresence.geometry import ZERO_VELOCITY, Pose, Velocity, wrap_angle
from telepresence.safety import State
from telepresence.security.change_log import ChangeLog
from telepresence.security.outside_text import clean
from telepresence.station.fault_sentences import UNREACHABLE

log = logging.getLogger(__name__)

PERIOD = 0.05
"""Seconds between two cycles without a new command."""
STANDING_TIME = 1.5
"""Seconds for which zeros are sent after driving, then nothing; braking gently from full speed takes 1.2 s."""
ANSWER_TIME = 0.3
"""Seconds of driving after which the drive server must have obeyed; what it said before was about something else."""
REFUSAL_KEY = "ALMotion/MoveFailed"
"""ALMemory: [cause, 0 not started or 1 stopped under way, [x, y, z] of the obstacle in the world]."""
OBSTACLE = "obstacle"
WAY_OUT = "nearer than the robot itself allows; turn, or drive away from it"
"""What a pilot can do whom the safety gate lets drive and ALMotion's own security distances do not."""
REFUSAL_LENGTH = 80
"""Characters of a cause that are shown."""
REFUSAL_SHOWN = 2.0
"""Seconds for which a refusal stays in the state."""
LOOK_SPEED = 0.1
"""Fraction of the head's top speed; slow, for whoever stands in front."""


class BaseDriver:
    """One thread at a time calls `step`, on every command and at least every `PERIOD` seconds; it never waits for the
    robot. `supervise` and `go_to`, which do, are for other threads, and `end_goals` is for all.

    Args:
        connection: The link to NAOqi.
        link: The link to the drive server.
        commands: Holds the newest command; a `CommandWatchdog`, or a `GatedDrive`, which checks it against the sensors.
        wake_up: Wake a sleeping robot when the link comes up for the first time, and again when a robot that was awake
            comes back asleep (it restarted). One that was put to rest meanwhile is left alone.
        rests: Whether it was put to rest already while a driver ran that has died.
        look: HeadPitch [rad, positive down] given to an awake robot when the link comes up, so that the pilot sees
            the floor ahead and not the ceiling that the Stand posture looks at; None leaves the head alone.
    Attributes:
        state: What the base does and why, for people.
        problem: Why nobody can drive the robot now, a sentence; empty while somebody can.
        awake: What the robot said lately about being awake; None before the first answer.
    """

    def __init__(
        self,
        connection: Connection,
        link: DriveLink,
        commands: CommandWatchdog | GatedDrive,
        wake_up: bool = True,
        look: float | None = None,
        rests: bool = False,
    ) -> None:
        self.state = "stopped: not connected yet"
        self.problem = ""
        self.awake: bool | None = False if rests else None
        self._connection = connection
        self._link = link
        self._commands = commands
        self._wake_up = wake_up
        self._head_pitch = look
        self._greeted = 0
        self._waking: PendingCall | None = None
        self._driving_since = math.inf
        self._zeros_until = -math.inf
        self._wanted_goal: Pose | None = None
        self._following = False
        self._goals_ended = object()  # a new one at each end: two threads that counted at once might count as one
        self._goal_since = self._goals_ended  # the end before the newest goal
        self._refusal = ""
        self._refusal_until = 0.0
        self._refusal_stamp: list | None = None
        self._refusal_log = ChangeLog()

    def step(self, now: float, master_alive: bool = True) -> None:
        """One cycle at `now` [s, monotonic]."""
        command = self._commands.decide(now, master_alive)
        lost = self._connection.problem or self._link.problem
        if lost or self._waking is not None:
            self._stand("the robot is not there" if lost else "the robot is waking up", hard=bool(lost))
            self.problem = lost
            self.state = f"{UNREACHABLE}: {lost}" if lost else "stopped: the robot is waking up"
            return
        if command.velocity is None:
            self._stand_or_follow_goal(command, master_alive)
        else:
            self._drive(command.velocity, command.reason, now)
        self.problem = self._objection(now)
        if self.problem:
            self.state = f"stopped: {self.problem}"

    def go_to(self, x: float, y: float, theta: float, in_odometry: bool = False, given: object = None) -> None:
        """Drive to a pose [m, m, rad], relative to the robot or in the odometry's frame.

        A velocity command or a lost master ends it; while somebody sends velocities it is ignored. So is one whose
        place the robot still works out when it is ended.

        Args:
            given: What `this_moment` returned when the goal was given, if that was not just now.
        Raises:
            RobotUnreachable, CallRefused: The robot does not say where it is; see `Connection.call`.
        """
        goal, ended = Pose(x, y, theta), given or self._goals_ended
        if in_odometry:
            robot = self._connection.call("ALMotion", "getRobotPosition", True)
            goal = relative_pose(goal, Pose(*numbers(robot, 3, "getRobotPosition")))
        if self._goals_ended is not ended:
            log.warning("goal refused: the robot was stopped or driven while it said where it is")
            return
        self._goal_since, self._wanted_goal = ended, goal

    def this_moment(self) -> object:
        """Return a mark for `go_to`, for a goal whose place must first be found."""
        return self._goals_ended

    def end_goals(self) -> None:
        """End goals that have been given, also those that `step` does not know yet. To be called at every stop and
        velocity, which may count for less time than the robot takes to say where it is, or not pass the gate."""
        self._goals_ended = object()

    def supervise(self, now: float, timeout: float = 1.0) -> None:
        """Greet a robot on a new link; ask whether it is awake, and whether it refused to move. To be called now and
        then.

        Raises:
            RobotUnreachable, CallRefused: See `Connection.call`.
        """
        if self._waking is not None:
            if not self._waking.done:
                return
            waking, self._waking = self._waking, None
            self.awake = waking.result() is not False
            self._raise_head()
        connections = self._connection.connections
        awake = flag(self._connection.call("ALMotion", "robotIsWakeUp", timeout=timeout), "robotIsWakeUp")
        if self._greeted == connections:
            self.awake = awake
        elif self._wake_up and not awake and self.awake is not False:
            log.info("the robot sleeps: waking it up")
            self._waking = self._connection.call_async("ALMotion", "wakeUp")
        else:
            self.awake = awake
            self._raise_head()
        self._greeted = connections
        self._look_for_refusals(now, timeout)

    def _look_for_refusals(self, now: float, timeout: float) -> None:
        try:
            answer = self._connection.call("ALMemory", "getTimestamp", REFUSAL_KEY, timeout=timeout)
            value, *stamp = sequence(answer, REFUSAL_KEY) or [None]
        except CallRefused:
            value, stamp = None, []  # it never refused anything
        if self._refusal_stamp not in (None, stamp) and value:
            cause = value[0] if isinstance(value, list | tuple) else value
            self._refusal = clean(cause, REFUSAL_LENGTH) if isinstance(cause, str) else kind(cause)
            if self._refusal.lower() == OBSTACLE:
                self._refusal = f"{OBSTACLE}, {WAY_OUT}"
            self._refusal_until = now + REFUSAL_SHOWN
            self._refusal_log.repeat()
        if self._refusal and now < self._refusal_until:
            self._refusal_log.note(now, f"the robot refuses to move: {self._refusal}", log.warning)
        self._refusal_stamp = stamp

    def _raise_head(self) -> None:
        if self._head_pitch is not None and self.awake:
            self._connection.call("ALMotion", "setAngles", "HeadPitch", self._head_pitch, LOOK_SPEED)

    def _drive(self, velocity: Velocity, reason: str, now: float) -> None:
        """Give a velocity that somebody commands. Zeros do not take hold of a robot that stands."""
        self._end_goal("somebody drives the robot with velocity commands")
        self.state = reason
        if not is_zero(velocity):
            self._driving_since, self._zeros_until = min(self._driving_since, now), now + STANDING_TIME
            self._link.drive(*velocity)
            if self.awake is False:
                self.state = "stopped: the robot sleeps; wake it up to drive"
            elif now < self._refusal_until:
                self.state = f"driving, but the robot refuses: {self._refusal}"
            return
        self._driving_since = math.inf
        if now < self._zeros_until:
            self._link.drive(*ZERO_VELOCITY)
        else:
            self._link.release()

    def _stand(self, why: str, hard: bool) -> None:
        """Give nothing. Hard: the drive server brakes as fast as the robot can."""
        self._driving_since, self._zeros_until = math.inf, -math.inf
        self._link.release(hard)
        self._end_goal(why)

    def _stand_or_follow_goal(self, command: WheelCommand, master_alive: bool) -> None:
        self.state = command.reason
        if not (master_alive and self._commands.allows_goals):
            self._stand(command.reason, command.fault)
            return
        self._driving_since, self._zeros_until = math.inf, -math.inf
        self._link.release(command.fault)
        given = self._following or self._wanted_goal is not None
        if given and self._goal_since is not self._goals_ended:
            self._end_goal("the robot was stopped or driven")
        wanted, self._wanted_goal = self._wanted_goal, None
        if wanted is not None:
            self._link.go_to(*wanted)
            self._following = True
        if not self._following:
            return
        goal = self._link.goal_state()
        self._following = goal in (ASKED, DRIVING)
        if self._following:
            self.state = "driving to the goal"
        else:
            log.info("goal reached" if goal == REACHED else "the robot stopped before the goal")

    def _end_goal(self, why: str) -> None:
        self.end_goals()
        if self._following:
            self._link.end_goal()
            log.warning("goal given up: %s", why)
        if self._wanted_goal is not None:
            log.warning("goal refused: %s", why)
        self._following, self._wanted_goal = False, None

    def _objection(self, now: float) -> str:
        """Why the drive server does not do what it is given; empty if it does."""
        report, _ = self._link.report()
        if report is None:
            return ""
        answered = now - self._driving_since >= ANSWER_TIME
        refused = report.state == State.FAULT or (answered and report.state == State.NO_COMMAND)
        return report.reason if refused else ""


def relative_pose(pose: Pose, origin: Pose) -> Pose:
    """Return `pose` as seen from `origin`, both in one frame."""
    dx, dy = pose.x - origin.x, pose.y - origin.y
    c, s = math.cos(origin.theta), math.sin(origin.theta)
    return Pose(c * dx + s * dy, c * dy - s * dx, wrap_angle(pose.theta - origin.theta))
