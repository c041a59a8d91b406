# Runs on Pepper's own Python 2.7 as well as on Python 3: keep to syntax that both accept.
# ruff: noqa: UP004, UP031
"""Who may drive now, and which of their commands still counts. No clock, no socket: time and address are arguments.

Whoever has the robot's key is a pilot (`telepresence.drive.session`); for others nothing is kept and nothing is done.
Any pilot may listen and stop; one at a time drives: the first to ask for a velocity keeps the robot until a second
after the last one. A command is refused that is not newer than the last, too old, or from a pilot who has received
nothing from the robot lately.

A stop is reset by who pressed it, in this session or a later one, or by a pilot of a higher rank. Names and ranks are
what pilots say about themselves: among those who have the key they prevent mistakes, not malice.

A goal is a command like any other: of the same pilot, as young, ended by the same silence. What has ended stays ended,
however often it is repeated.
"""

from collections import OrderedDict, namedtuple

from telepresence.drive import session as drive_session
from telepresence.drive.datagram import (
    DRIVING,
    ENDED,
    INFINITY,
    Ask,
    BadMessage,
    GoalState,
    encode,
    parse_for_robot,
    short,
)
from telepresence.drive.session import RobotHandshake

MYPY = False
if MYPY:
    from typing import Dict, List, Optional, Tuple, Union  # noqa: F401, UP035

    from telepresence.drive.datagram import Drive, Goal  # noqa: F401
    from telepresence.drive.session import Address, Opened  # noqa: F401
    from telepresence.security.shared_key import SharedKey  # noqa: F401

SILENCE = 0.2
"""Seconds after the last datagram with a velocity until the robot counts as left alone: four were lost."""
OLDEST = 0.5
"""A command that may be older is not obeyed [s]."""
DEAF = 1.0
"""A pilot who has received no report of the robot for this long cannot drive it [s]."""
OWNERSHIP = 1.0
"""Seconds for which the robot stays reserved for a pilot after that pilot's last velocity."""
FORGOTTEN = 2.0
"""Seconds of silence after which a session ends."""
MAX_SESSIONS = 8

WELCOME = encode(type="welcome")


class PilotVelocity(namedtuple("PilotVelocity", "vx vy wz stamp")):
    """The velocity that a pilot requests, in base_link [m/s, m/s, rad/s]; `stamp`: when it was given, robot's clock."""

    __slots__ = ()


class Outgoing(namedtuple("Outgoing", "datagram address")):
    """A datagram to be sent."""

    __slots__ = ()


class Request(namedtuple("Request", "what number pilot")):
    """What a pilot asks for, to be done by the server."""

    __slots__ = ()


class Pilot(object):
    """Somebody during one session. Times [s] on the server's clock.

    Attributes:
        reports: Stamps of the reports that it was sent lately, oldest first.
        done: The last request that was answered, and the answer's body: both may be lost.
    """

    def __init__(self, opened, address, heard):
        # type: (Opened, Address, float) -> None
        self.opened, self.address, self.heard = opened, address, heard
        self.reports = OrderedDict()  # type: OrderedDict[float, None]
        self.done = None  # type: Optional[Tuple[int, bytes]]

    @property
    def name(self):
        # type: () -> str
        name = self.opened.name  # type: str
        return name

    def __str__(self):
        # type: () -> str
        return "%s at %s" % (self.name, self.address[0])

    def send(self, body):
        # type: (bytes) -> Outgoing
        return Outgoing(self.opened.session.seal(body), self.address)

    def may_undo(self, other):
        # type: (Pilot) -> bool
        """Whether this pilot may undo what another one did."""
        return bool(self.name == other.name or self.opened.rank > other.opened.rank)


class Pilots(object):
    """Who has a session with a drive server.

    Args:
        key: The robot's; None on loopback only.
    Attributes:
        careful: The driving pilot wants the body to swing.
        problem: Why the newest datagrams were no commands; empty when there is nothing to say.
        refused: Datagrams that could not be used, and `refusal`: the newest one's reason.
        cut: The driver fell silent without a word, as a cut network does, or failed; not: let go of the controls.
    """

    def __init__(self, key=None):
        # type: (Optional[SharedKey]) -> None
        self.careful = False
        self.problem = ""
        self.refused, self.refusal = 0, ""
        self._handshake = RobotHandshake(key)
        self._pilots = {}  # type: Dict[bytes, Pilot]
        self._driver = None  # type: Optional[Pilot]
        self._driven = -INFINITY  # when the driver's last velocity arrived
        self._command = None  # type: Optional[PilotVelocity]
        self._goal = None  # type: Optional[Goal]
        self._goal_of = None  # type: Optional[Pilot]
        self._goal_state = ENDED
        self._let_go = True
        self._stopper = None  # type: Optional[Pilot]

    @property
    def everyone(self):
        # type: () -> Tuple[Pilot, ...]
        return tuple(self._pilots.values())

    @property
    def cut(self):
        # type: () -> bool
        return not self._let_go

    def receive(self, datagram, address, now):
        # type: (bytes, Address, float) -> List[Union[Outgoing, Request]]
        """Take a datagram that came from `address` at `now`; what is to be sent or done for it.

        What proves nothing changes nothing here, and its answer, if any, is shorter.
        """
        named = drive_session.session_of(datagram)
        pilot = self._pilots.get(named)
        if pilot is None:
            # The first datagrams after an outage are of a session that has ended meanwhile; there is a new one soon.
            return self._refuse("of no open session", address) if named else self._greet(datagram, address, now)
        body = pilot.opened.session.unseal(datagram) if pilot.address == address else None
        if body is None:
            return self._refuse("forged, repeated or out of order", address)
        pilot.heard = now
        try:
            message = parse_for_robot(body)
        except BadMessage as error:
            self._refuse(str(error), address)
            if pilot is self._driver:  # its last command must not go on
                self._end(False, "A command was refused: %s." % error)
            return [pilot.send(encode(type="refused", text=short("refused: %s" % error)))]
        if isinstance(message, Ask):
            return self._answer(pilot, message)
        self._receive(pilot, message, now)
        return []

    def command(self, now):
        # type: (float) -> Optional[PilotVelocity]
        """The command that counts now; None if there is none."""
        self._expire(now)
        return self._command

    def goal(self, now):
        # type: (float) -> Optional[Goal]
        """The goal to which to drive now; None if there is none."""
        self._expire(now)
        return self._goal if self._goal_state == DRIVING else None

    def goal_state(self, pilot):
        # type: (Pilot) -> Optional[GoalState]
        """What became of the newest goal; None unless it was this pilot's."""
        return GoalState(self._goal.number, self._goal_state) if self._goal and pilot is self._goal_of else None

    def end_goal(self, state=ENDED):
        # type: (str) -> None
        """The goal to which the robot drove counts no more; another one does."""
        if self._goal_state == DRIVING:
            self._goal_state = state

    def deadline(self):
        # type: () -> float
        """When the present command or goal ends unless another follows [s]; infinity without one."""
        active = self._command is not None or self._goal_state == DRIVING
        return self._driven + SILENCE if active else INFINITY

    @property
    def driver(self):
        # type: () -> Optional[Pilot]
        """The pilot who has the robot now."""
        return self._driver

    def reported(self, pilot, stamp):
        # type: (Pilot, float) -> None
        """A report with this stamp was sent to a pilot."""
        pilot.reports[stamp] = None
        while len(pilot.reports) > DEAF / 0.02:
            pilot.reports.popitem(last=False)

    def answered(self, request, ok, text):
        # type: (Request, bool, str) -> Outgoing
        """The answer to a request that was done; it is sent again if the pilot asks again."""
        body = encode(type="done", id=request.number, ok=ok, text=short(text))
        pilot = request.pilot  # type: Pilot
        pilot.done = (request.number, body)
        return pilot.send(body)

    def release(self, pilot):
        # type: (Pilot) -> None
        """This pilot leaves, and says so itself."""
        self._pilots.pop(pilot.opened.session.id, None)
        if pilot is self._driver:
            self._end(True)
            self._driver = None

    def _end(self, let_go, problem=""):
        # type: (bool, str) -> None
        """No command and no goal counts from now on."""
        self._command, self._let_go, self.problem = None, let_go, problem
        self.end_goal()

    # --- inside ------------------------------------------------------------------------------------------------------

    def _greet(self, datagram, address, now):
        # type: (bytes, Address, float) -> List[Union[Outgoing, Request]]
        """Answer what belongs to no session."""
        challenge = self._handshake.challenge(datagram, address, now)
        if challenge is not None:
            return [Outgoing(challenge, address)]
        cookie = drive_session.cookie_of(datagram)
        for pilot in self.everyone:
            if cookie and pilot.opened.cookie == cookie and pilot.address == address:
                return [pilot.send(WELCOME)]  # the first one was lost
        try:
            opened = self._handshake.accept(datagram, address, now)
        except BadMessage as error:
            return self._refuse(str(error), address)
        return self._refuse("without the robot's key", address) if opened is None else self._open(opened, address, now)

    def _open(self, opened, address, now):
        # type: (Opened, Address, float) -> List[Union[Outgoing, Request]]
        self._expire(now)
        pilot = Pilot(opened, address, now)
        # Who comes back from an outage, or starts anew, at the same place is the same pilot.
        before = next((each for each in self.everyone if each.address == address), None)
        if before is not None:
            del self._pilots[before.opened.session.id]
            self._driver = pilot if self._driver is before else self._driver
        if len(self._pilots) >= MAX_SESSIONS:
            return [pilot.send(encode(type="refused", text="%d pilots are here, which is the limit" % MAX_SESSIONS))]
        self._pilots[opened.session.id] = pilot
        return [pilot.send(WELCOME)]

    def _refuse(self, reason, address):
        # type: (str, Address) -> List[Union[Outgoing, Request]]
        self.refused, self.refusal = self.refused + 1, "%s, from %s" % (reason, address[0])
        return []

    def _answer(self, pilot, ask):
        # type: (Pilot, Ask) -> List[Union[Outgoing, Request]]
        if pilot.done is not None and pilot.done[0] == ask.number:
            return [pilot.send(pilot.done[1])]
        if ask.what == "reset stop" and pilot.done is not None and ask.number < pilot.done[0]:
            return []  # a later request was done since, which may have been a stop
        request = Request(ask.what, ask.number, pilot)
        obstacle = self._obstacle(pilot, ask.what)
        if obstacle:
            return [self.answered(request, False, obstacle)]
        if ask.what == "stop" and (self._stopper is None or pilot.opened.rank > self._stopper.opened.rank):
            self._stopper = pilot
        elif ask.what == "reset stop":
            self._stopper = None
        return [request]

    def _obstacle(self, pilot, what):
        # type: (Pilot, str) -> str
        """Why this pilot may not have that done; empty if it may."""
        if what in ("stop", "leave"):
            return ""
        if what == "reset stop" and self._stopper is not None:
            mine = pilot.may_undo(self._stopper)
            text = "%s has pressed stop; %s or a higher rank resets it" % (self._stopper, self._stopper.name)
            return "" if mine else text
        if self._driver is not None and self._driver is not pilot and not pilot.may_undo(self._driver):
            return "another pilot drives: %s" % self._driver
        return ""

    def _receive(self, pilot, drive, now):
        # type: (Pilot, Drive, float) -> None
        if drive.velocity is None and drive.goal is None:
            if pilot is self._driver:
                self._end(not drive.hard)
            return
        self._expire(now)
        if self._driver not in (None, pilot):
            return
        age = now - drive.echo - drive.after
        problem = self._problem(pilot, drive, age, now)
        if problem:
            self._refuse(problem, pilot.address)
            self._end(self._let_go, problem)
            return
        self._driver, self._driven, self._let_go = pilot, now, False
        self.careful, self.problem = drive.careful, ""
        if drive.velocity is not None:
            self._command = PilotVelocity(*(drive.velocity + (now - max(0.0, age),)))  # noqa: RUF005
            self.end_goal()
        elif drive.goal is not None:
            self._command = None
            self._take_goal(pilot, drive.goal)

    def _take_goal(self, pilot, goal):
        # type: (Pilot, Goal) -> None
        same = self._goal is not None and pilot is self._goal_of and goal.number == self._goal.number
        if not same:
            self._goal, self._goal_of, self._goal_state = goal, pilot, DRIVING

    def _problem(self, pilot, drive, age, now):
        # type: (Pilot, Drive, float, float) -> str
        """Why a command cannot be obeyed; empty if it can."""
        if drive.echo not in pilot.reports:
            return "The pilot has received no recent report from this robot."
        if now - drive.echo > DEAF:
            return "The pilot has received no report from this robot for %.1f s." % (now - drive.echo)
        if age < -0.05:
            return "The pilot's clock runs ahead."
        return "Commands arrive %.1f s late." % age if age > OLDEST else ""

    def _expire(self, now):
        # type: (float) -> None
        if now >= self.deadline():
            self._end(self._let_go, "Nothing was heard from the pilot for %g s." % SILENCE)
        if self._driver is not None and now - self._driven > OWNERSHIP:
            self._driver = None
        for pilot in self.everyone:
            if now - pilot.heard > FORGOTTEN:
                del self._pilots[pilot.opened.session.id]
