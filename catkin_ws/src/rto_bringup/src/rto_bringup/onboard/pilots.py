"""Who may drive now, and which of their commands still counts. No clock, no socket: time and address are arguments.

Any pilot may listen and stop; one at a time drives: the first to ask for a velocity keeps the robot until a second
after the last one. A command is refused that is not newer than the last, too old, or from a pilot who has received
nothing from the robot lately.
"""

from __future__ import annotations

import math
import secrets
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from rto_node.drive_datagram import Ask, BadMessage, Drive, Hello, encode, parse_for_robot

from telepresence.safety import Command

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

Address = tuple[Any, ...]


class Outgoing(NamedTuple):
    datagram: bytes
    address: Address


class Request(NamedTuple):
    """What a pilot asks for, to be done by the server."""

    what: str
    number: int
    session: Session


@dataclass(eq=False)
class Session:
    """One pilot. Times [s] on the server's clock."""

    token: str
    address: Address
    heard: float
    seq: int = -1
    reports: dict[float, None] = field(default_factory=dict)
    done: tuple[int, bytes] | None = None
    """The last request that was answered, and the answer: both may be lost."""


class Pilots:
    """The sessions of a drive server.

    Attributes:
        careful: The driving pilot wants the body to swing.
        problem: Why the newest datagrams were no commands; empty when there is nothing to say.
        refused: Datagrams that could not be used.
        cut: The driver fell silent without a word, as a cut network does; not: let go of the controls.
    """

    def __init__(self) -> None:
        self.careful = False
        self.problem = ""
        self.refused = 0
        self._sessions: dict[str, Session] = {}
        self._driver: Session | None = None
        self._driven = -math.inf  # when the driver's last velocity arrived
        self._command: Command | None = None
        self._let_go = True

    @property
    def sessions(self) -> tuple[Session, ...]:
        return tuple(self._sessions.values())

    @property
    def cut(self) -> bool:
        return not self._let_go

    def receive(self, datagram: bytes, address: Address, now: float) -> list[Outgoing | Request]:
        """Take a datagram that came from `address` at `now`; what is to be sent or done for it."""
        try:
            message = parse_for_robot(datagram)
        except BadMessage as error:
            self.refused += 1
            self._drop_request(address, f"A command was refused: {error}.")
            return [Outgoing(encode(type="refused", text=f"refused: {error}"), address)]
        if isinstance(message, Hello):
            return [self._welcome(address, now)]
        session = self._sessions.get(message.session)
        if session is None or session.address != address:
            return [Outgoing(encode(type="unknown session"), address)]
        session.heard = now
        if isinstance(message, Ask):
            return self._answer(session, message)
        self._receive(session, message, now)
        return []

    def command(self, now: float) -> Command | None:
        """The command that counts now; None if there is none."""
        self._expire(now)
        return self._command

    def deadline(self) -> float:
        """When the present command ends unless another follows [s]; infinity without one."""
        return self._driven + SILENCE if self._command is not None else math.inf

    @property
    def driver(self) -> Session | None:
        """The pilot who has the robot now."""
        return self._driver

    def reported(self, session: Session, stamp: float) -> None:
        """A report with this stamp was sent to a pilot."""
        session.reports[stamp] = None
        while len(session.reports) > DEAF / 0.02:
            del session.reports[next(iter(session.reports))]

    def answered(self, request: Request, ok: bool, text: str) -> Outgoing:
        """The answer to a request that was done; it is sent again if the pilot asks again."""
        datagram = encode(type="done", id=request.number, ok=ok, text=text)
        request.session.done = (request.number, datagram)
        return Outgoing(datagram, request.session.address)

    def release(self, session: Session) -> None:
        """This pilot drives no more, and says so itself."""
        if session is self._driver:
            self._driver, self._command, self._let_go = None, None, True

    # --- inside ------------------------------------------------------------------------------------------------------

    def _welcome(self, address: Address, now: float) -> Outgoing:
        self._expire(now)
        for session in self.sessions:
            if session.address == address:
                # A greeting was repeated, or a program has started anew and counts from the beginning.
                session.heard, session.seq = now, -1
                return Outgoing(encode(type="welcome", session=session.token), address)
        if len(self._sessions) >= MAX_SESSIONS:
            return Outgoing(encode(type="refused", text=f"{MAX_SESSIONS} pilots are here, which is the limit"), address)
        session = Session(secrets.token_hex(8), address, now)
        self._sessions[session.token] = session
        return Outgoing(encode(type="welcome", session=session.token), address)

    def _answer(self, session: Session, ask: Ask) -> list[Outgoing | Request]:
        if session.done is not None and session.done[0] == ask.number:
            return [Outgoing(session.done[1], session.address)]
        if ask.what not in ("stop", "leave") and self._driver not in (None, session):
            text = f"another pilot drives, at {self._driver.address[0]}"
            return [self.answered(Request(ask.what, ask.number, session), False, text)]
        return [Request(ask.what, ask.number, session)]

    def _receive(self, session: Session, drive: Drive, now: float) -> None:
        if drive.seq <= session.seq:
            return
        session.seq = drive.seq
        if drive.velocity is None:
            if session is self._driver:
                self._command, self._let_go, self.problem = None, True, ""
            return
        self._expire(now)
        if self._driver not in (None, session):
            return
        age = now - drive.echo - drive.after
        problem = self._problem(session, drive, age, now)
        if problem:
            self.refused += 1
            self._command, self.problem = None, problem
            return
        self._driver, self._driven, self._let_go = session, now, False
        self._command = Command(*drive.velocity, now - max(0.0, age))
        self.careful, self.problem = drive.careful, ""

    def _problem(self, session: Session, drive: Drive, age: float, now: float) -> str:
        """Why a command cannot be obeyed; empty if it can."""
        if drive.echo not in session.reports:
            return "The pilot has not heard this robot yet, or not for long."
        if now - drive.echo > DEAF:
            return f"The pilot has not heard this robot for {now - drive.echo:.1f} s."
        if age < -0.05:
            return "The pilot's clock runs ahead."
        return f"Commands arrive {age:.1f} s late." if age > OLDEST else ""

    def _drop_request(self, address: Address, problem: str) -> None:
        """The driver sends what cannot be parsed: drop its last command, which must not go on."""
        if self._driver is not None and self._driver.address == address:
            self._command, self._let_go, self.problem = None, True, problem

    def _expire(self, now: float) -> None:
        if self._command is not None and now - self._driven >= SILENCE:
            self._command, self.problem = None, f"Nothing was heard from the pilot for {SILENCE:g} s."
        if self._driver is not None and now - self._driven > OWNERSHIP:
            self._driver = None
        for session in self.sessions:
            if now - session.heard > FORGOTTEN:
                del self._sessions[session.token]
