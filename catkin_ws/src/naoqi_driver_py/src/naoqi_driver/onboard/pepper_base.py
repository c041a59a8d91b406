# Runs on Pepper's own Python 2.7 as well as on Python 3: keep to syntax that both accept.
# ruff: noqa: UP004, UP031
"""The base of a NAOqi robot as the drive server drives it: ALMotion's move, moveTo, stopMove and killMove.

Wire (NAOqi 2.5-2.8 documentation, ALMotion): `move(x, y, theta)` [m/s, m/s, rad/s] returns at once and holds until the
next command, for ever if none comes; `moveTo(x, y, theta)` [m, m, rad] and `stopMove()` return once it has stopped;
`killMove()` ends a motion without braking ramp. No answer is waited for: each is looked at when the next step comes.
At most one velocity is on its way, so that none can queue up behind an ALMotion that hangs, or in a network.

Beside NAOqi velocities go to `move`. Over a network they go as `moveTo` over a few centimetres, in the time that they
take at that speed, again and again: whatever happens to the network, the robot ends the last of them by itself.
"""

import math

from naoqi_driver.onboard.naoqi_link import STALL
from telepresence.drive.clock import monotonic
from telepresence.drive.datagram import ENDED, INFINITY, REACHED
from telepresence.drive.server import AT_REST, CLEAR, FAULT, NO_COMMAND, STOPPED, DrivenBase, Outcome
from telepresence.robot_side.naoqi_values import NaoqiError, error_text

MYPY = False
if MYPY:
    from typing import Any, List, Optional, Tuple  # noqa: F401, UP035

    from naoqi_driver.onboard.last_stop import LastStop  # noqa: F401
    from naoqi_driver.onboard.naoqi_link import NaoqiLink  # noqa: F401
    from telepresence.drive.datagram import Goal, Vector  # noqa: F401
    from telepresence.drive.pilots import Pilots, PilotVelocity  # noqa: F401
    from telepresence.robot_side.naoqi_client import Service  # noqa: F401
    from telepresence.robot_side.naoqi_connection import Answer  # noqa: F401

BRAKING_TIME = 0.1
"""Seconds of gentle braking that a robot gets whose pilot fell silent; then `killMove`. Gently alone, ALMotion needs
0.6 s from 0.35 m/s (0.55 m/s2)."""
RELEASE_TIME = 1.5
"""Seconds after which the robot must have stopped once the keys are let go of; then `killMove`."""
ANSWER_TIMEOUT = 0.4
"""Seconds within which ALMotion answers `move` and `killMove`; else it counts as hanging, which is a fault."""
AGAIN_PERIOD, AGAIN_TIME = 0.001, 0.05
"""Seconds after which a velocity is tried again that came while the one before was on its way, and for how long so
often."""
HANGING_TIME = 5.0
"""Seconds for which a velocity may be without an answer, or stops without one that surely came last; then the link is
torn down, with which it is over: nothing else ends it."""
PROBE_PERIOD = 0.5
"""Seconds between two questions to an ALMotion that is not needed now: whether it answers."""
FAULT_TIME = 1.0
"""Seconds for which a refusal is reported."""
LOST_TIME = 1.0
"""Seconds for which the second process is asked to stop a robot that moved when NAOqi was lost: it may just start."""
AHEAD_TIME = 0.12
"""Over a network: seconds for which a motion lasts beyond its braking. Two periods, and some delay."""
FAR_SPEED = 0.2
"""Over a network: the top speed [m/s], from which a robot stands half a second after its last motion was sent."""
FAR_BRAKING = (("MaxAccXY", 0.55, 0.5), ("MaxAccTheta", 3.0, 2.7))
"""Parameter, the value that is asked for (documented as the largest), and what is counted on [m/s2, rad/s2]."""


SPARE = "The process that would stop the robot for the drive server"


class PepperBase(DrivenBase):
    """Drives and, above all, stops.

    Args:
        link: To NAOqi.
        last_stop: Stops the robot if this program cannot; None where nothing goes on by itself.
    """

    def __init__(self, link, last_stop=None):
        # type: (NaoqiLink, Optional[LastStop]) -> None
        self._link, self._last_stop = link, last_stop
        self._connections, self._since = 0, -INFINITY
        self._move = None  # type: Optional[Call]
        self._sent = None  # type: Optional[Vector]
        self._again_at = INFINITY
        self._far = None  # type: Optional[Call]
        self._asked = None  # type: Optional[Call]
        self._probed = -INFINITY
        self._moving = False  # the base moves, or may move, because of us
        self._goal = None  # type: Optional[Tuple[Goal, Call]]
        self._journeys = []  # type: List[Call]
        self._unsure_since = INFINITY  # since when no stop surely came last
        self._stop = None  # type: Optional[Call]
        self._kill_at = INFINITY
        self._kill = None  # type: Optional[Call]
        self._killed = False
        self._refusal, self._refused = "", -INFINITY
        self._spare, self._spared = "", -INFINITY  # what befell the second process, and when
        self._lost_until = -INFINITY  # until when the second process is asked to stop the robot
        self._latched = ""  # who pressed stop
        self._must_let_go = False

    def do(self, what, who):
        # type: (str, str) -> Tuple[bool, str]
        if what == "stop":
            self._latched, self._must_let_go = "%s pressed stop" % who, True
            self._moving = True  # whatever is believed: stopMove is called
            return True, "stopped until reset stop"
        if what == "reset stop":
            self._latched = ""
            return True, "let go of the controls once to drive again"
        return True, ""

    def due(self):
        # type: () -> float
        return min(self._kill_at, self._again_at)

    def step(self, now, command, goal, pilots):
        # type: (float, Optional[PilotVelocity], Optional[Goal], Pilots) -> Outcome
        wanted = command is not None or goal is not None
        self._again_at = INFINITY
        self._must_let_go = self._must_let_go and (wanted or bool(self._latched))
        motion = self._link.motion()
        state, reason, given = NO_COMMAND, "", AT_REST
        try:
            if motion is None:
                pilots.end_goal()
                if self._moving:  # NAOqi goes on with the last velocity
                    self._lost_until = now + LOST_TIME
                if now < self._lost_until and self._last_stop is not None:
                    self._last_stop.stop()
                self._forget()
            elif self._connections != self._link.connections:
                self._forget()
                self._connections, self._since = self._link.connections, now
                self._brake(motion, now, BRAKING_TIME)  # what an earlier server or link left behind must not go on
            self._take_answers(now)
            if motion is None:
                state, reason = FAULT, "NAOqi is not reachable: %s." % self._link.problem
            elif self._must_let_go:
                pilots.end_goal()
                self._rest(motion, now, BRAKING_TIME)
                state, reason = STOPPED, self._latched + "." if self._latched else "Let go of the controls once."
            elif command is not None:
                state = CLEAR
                given = self._drive(motion, now, command)
            elif goal is not None:
                state, reason = CLEAR, "Driving to a goal."
                self._follow(motion, now, goal, pilots)
            else:
                self._rest(motion, now, BRAKING_TIME if pilots.cut else RELEASE_TIME)
            self._probe(motion, now)
        except NaoqiError as error:  # the link is just breaking; there is no such method
            self._refuse(error_text(error), now)
        if self._last_stop is not None:
            befallen = self._last_stop.note(self._moving, now)
            if befallen:
                self._spare, self._spared = befallen, now
        problem = self._problem(now, motion)
        if problem:
            state, reason = FAULT, problem
        age = INFINITY if command is None else max(0.0, now - command.stamp)
        return Outcome(state, reason, given, (), INFINITY, -1, age, False)

    def end(self):
        # type: () -> None
        """Stop, and see to it that the robot has taken that, for a moment."""
        motion = self._link.motion()
        if motion is None or not self._moving:
            return
        try:
            self._brake(motion, monotonic(), RELEASE_TIME)
            if self._stop is not None:
                self._stop.answer.wait(RELEASE_TIME)
        except NaoqiError:  # the link breaks; nothing more can be done from here
            pass

    # --- inside ------------------------------------------------------------------------------------------------------

    def _drive(self, motion, now, command):
        # type: (Service, float, PilotVelocity) -> Vector
        """Command a velocity, unless the last one is still on its way; what the base is to do now."""
        velocity = command[:3]
        if velocity == AT_REST and (not self._moving or not self._link.near):
            self._rest(motion, now, RELEASE_TIME)
            return velocity
        if self._move is not None:
            self._kill_at = INFINITY  # somebody drives again
            if velocity != self._sent and now - self._move.sent < AGAIN_TIME:
                self._again_at = now + AGAIN_PERIOD
            return velocity
        self._sent = velocity
        self._begin()
        self._unsure_since = INFINITY
        if self._link.near:
            self._move = Call("move", motion.send("move", *velocity), now)
        else:
            velocity = far_velocity(velocity)
            self._far = Call("moveTo", motion.send("moveTo", *far_motion(velocity)), now)
            # moveTo is answered when it has ended; this, when it has arrived.
            self._move = Call("moveIsActive", motion.send("moveIsActive"), now)
        return velocity

    def _begin(self):
        # type: () -> None
        """The base is about to move. What ended its motion before is over: an answer to that says nothing any more."""
        self._goal, self._stop, self._kill, self._kill_at = None, None, None, INFINITY
        self._moving, self._killed = True, False

    def _follow(self, motion, now, goal, pilots):
        # type: (Service, float, Goal, Pilots) -> None
        if not self._link.near:
            self._refuse("the goal: over a network it would go on when nobody wants it any more", now)
            pilots.end_goal()
            return
        if self._goal is None or self._goal[0] is not goal:
            self._begin()
            self._unsure_since = INFINITY
            self._goal = (goal, Call("moveTo", motion.send("moveTo", *goal.pose), now))
            self._journeys.append(self._goal[1])
            return
        answer = self._goal[1].answer
        if answer.running():
            return
        self._goal = None
        try:
            reached = answer.value() is not False
        except NaoqiError as error:
            reached = False
            self._refuse("moveTo: " + error_text(error), now)
        pilots.end_goal(REACHED if reached else ENDED)

    def _rest(self, motion, now, patience):
        # type: (Service, float, float) -> None
        """Brake if the base moves because of us."""
        if now >= self._kill_at:
            self._kill_at, self._killed = INFINITY, True
            self._kill = Call("killMove", motion.send("killMove"), now, self._may_begin())
        elif self._moving and self._stop is None and self._kill is None:
            self._brake(motion, now, patience)
        elif self._stop is not None and not self._killed:
            self._kill_at = min(self._kill_at, self._stop.sent + patience)

    def _brake(self, motion, now, patience):
        # type: (Service, float, float) -> None
        self._begin()
        self._stop = Call("stopMove", motion.send("stopMove"), now, self._may_begin())
        self._kill_at = now + patience
        self._unsure_since = min(self._unsure_since, now) if self._stop.overtakes else INFINITY

    def _may_begin(self):
        # type: () -> bool
        """Whether a motion is on its way: libqi runs calls side by side, so that one sent later may come first."""
        self._journeys = [journey for journey in self._journeys if journey.answer.running()]
        return bool(self._journeys) or (self._move is not None and self._link.near)

    def _probe(self, motion, now):
        # type: (Optional[Service], float) -> None
        """See whether ALMotion answers when nothing else shows it."""
        if motion is not None and self._asked is None and now - self._probed >= PROBE_PERIOD:
            self._probed = now
            self._asked = Call("moveIsActive", motion.send("moveIsActive"), now)

    def _take_answers(self, now):
        # type: (float) -> None
        """See which answers have come."""
        for call in (self._move, self._asked, self._far, self._stop, self._kill):
            if call is None or call.answer.running():
                continue
            refused = ""
            try:
                call.answer.value()
            except NaoqiError as error:
                refused = "%s: %s" % (call.name, error_text(error))
                self._refuse(refused, now)
            if call is self._stop:
                self._stop, self._moving = None, bool(refused) or call.overtakes
                self._kill_at = now if refused and not self._killed else INFINITY
            elif call is self._kill:
                goes_on = bool(refused) or self._stop is not None or call.overtakes
                self._kill, self._moving = None, self._moving and goes_on
            elif call is self._far:
                self._far = None
            elif call is self._asked:
                self._asked = None
            else:
                self._move = None
        for call in (self._move, self._asked):
            if call is not None and not self._link.near and now - call.sent > STALL:
                self._link.drop("no answer for %g s" % STALL)
        velocity = self._move.sent if self._move is not None else INFINITY
        if self._link.near and now - min(velocity, self._unsure_since) > HANGING_TIME:
            self._link.drop("ALMotion has not answered for %g s" % HANGING_TIME)

    def _problem(self, now, motion):
        # type: (float, Optional[Service]) -> str
        for call in (self._move, self._asked, self._kill):
            if call is not None and now - call.sent > ANSWER_TIMEOUT:
                return "ALMotion has not answered %s for %.1f s." % (call.name, now - call.sent)
        if self._stop is not None and now - self._stop.sent > RELEASE_TIME + ANSWER_TIMEOUT:
            return "ALMotion has not answered stopMove for %.1f s." % (now - self._stop.sent)
        if now - self._spared <= FAULT_TIME:
            return "%s %s." % (SPARE, self._spare)
        if motion is not None and self._last_stop is not None and self._last_stop.is_blind(now, self._since):
            return "%s does not reach NAOqi." % SPARE
        return "Refused: %s." % self._refusal if now - self._refused <= FAULT_TIME else ""

    def _refuse(self, text, now):
        # type: (str, float) -> None
        self._refusal, self._refused = text, now

    def _forget(self):
        # type: () -> None
        """The link is another one: no answer comes any more."""
        self._move = self._asked = self._far = self._goal = self._stop = self._kill = None
        self._journeys, self._unsure_since = [], INFINITY
        self._kill_at, self._moving, self._killed = INFINITY, False, False


class Call(object):
    """A call that was sent at `sent` [s], and what has come of its answer.

    Attributes:
        overtakes: It ends motions, and one was on its way that may begin after it: its answer says nothing.
    """

    def __init__(self, name, answer, sent, overtakes=False):
        # type: (str, Answer, float, bool) -> None
        self.name, self.answer, self.sent, self.overtakes = name, answer, sent, overtakes


def far_velocity(velocity):
    # type: (Vector) -> Vector
    """Return the velocity, slowed down to what is allowed over a network."""
    speed = math.hypot(velocity[0], velocity[1])
    scale = min(1.0, FAR_SPEED / speed) if speed else 1.0
    return velocity[0] * scale, velocity[1] * scale, velocity[2] * scale


def far_motion(velocity):
    # type: (Vector) -> Tuple[Any, ...]
    """Return moveTo's arguments for a motion that goes on at this velocity for `AHEAD_TIME` and then ends."""
    speed, rate = math.hypot(velocity[0], velocity[1]), abs(velocity[2])
    (acc_name, acc, acc_counted), (turn_name, turn, turn_counted) = FAR_BRAKING
    braking = max(speed / acc_counted, rate / turn_counted)
    cruise = AHEAD_TIME + braking / 2.0
    limits = [["MaxVelXY", max(0.1, speed)], ["MaxVelTheta", max(0.2, rate)], [acc_name, acc], [turn_name, turn]]
    return tuple(part * cruise for part in velocity) + (cruise + braking, limits)  # noqa: RUF005
