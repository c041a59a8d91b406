"""ALUserSession: who the robot is dealing with. A user is somebody whose face it would know again.

Basic awareness opens a session by tracking a person; it ends when the person is no longer perceived. Somebody whose
face is not seen is the anonymous user until it is. Users who are not permanent are forgotten after ten minutes. Source:
NAOqi 2.8 documentation, ALUserSession.
"""

from __future__ import annotations

import itertools
import time
from dataclasses import dataclass

from pepper_sim.naoqi.people.attention import NOBODY
from pepper_sim.naoqi.people.population import Known, Look, Population
from pepper_sim.naoqi.service import Service, remote
from pepper_sim.services.al_basic_awareness import ALBasicAwareness
from pepper_sim.services.al_memory import ALMemory
from telepresence.naoqi.signals import Signal
from telepresence.sim.people import Person

FORGOTTEN_AFTER = 600.0
"""Users who are not permanent are forgotten after this time out of sight [s]."""
IDENTIFY_AGAIN = 3.0
"""The robot tries again after this time to see an anonymous user's face [s]."""
ANONYMOUS = 0


@dataclass
class _User:
    person: Person | None
    created: float
    opened: float | None = None
    closed: float | None = None
    ppid: int = NOBODY


class ALUserSession(Service):
    """Knows the users and who has an open session."""

    name = "ALUserSession"

    def __init__(self, memory: ALMemory, population: Population, awareness: ALBasicAwareness) -> None:
        self._memory = memory
        self._awareness = awareness
        self._users: dict[int, _User] = {}
        self._numbers = itertools.count(1)
        self._focused = NOBODY
        self._identified = 0.0
        self.createdUsers = Signal("([i])")
        self.deletedUsers = Signal("([i])")
        self.openedSessions = Signal("([i])")
        self.closedSessions = Signal("([i])")
        self.addedPermanentUsers = Signal("([i])")
        self.removedPermanentUsers = Signal("([i])")
        self.focusedUser = Signal("(i)")
        self.noOpenSession = Signal("(b)")
        memory.declare(
            f"UserSession/{event}"
            for event in (
                *("ShouldExitInteractiveActivity", "CreatedUsers", "DeletedUsers", "SessionsOpened", "SessionsClosed"),
                *("NoOpenSessions", "FocusedUser"),
            )
        )
        memory.store("UserSession/OpenSessions", [])
        population.watch(lambda: awareness.isEnabled() or bool(self._open()), self._update, tracks=False)

    # --- users -------------------------------------------------------------------------------------------------------

    @remote("b(i)")
    def doesUserExist(self, userID: int) -> bool:
        """Whether there is a user of this ID."""
        return userID in self._users

    @remote("b([i])")
    def doUsersExist(self, userIDs: list[int]) -> bool:
        """Whether there is a user for each of these IDs."""
        return all(user in self._users for user in userIDs)

    @remote("[i]()")
    def getUserList(self) -> list[int]:
        """Lists the users."""
        return list(self._users)

    @remote("i()")
    def getNumUsers(self) -> int:
        """Returns how many users there are."""
        return len(self._users)

    @remote("i()")
    def getFocusedUser(self) -> int:
        """Returns the user whom the robot deals with, or -1."""
        return self._focused

    @remote("[i]()")
    def getOpenUserSessions(self) -> list[int]:
        """Lists the users with an open session."""
        return self._open()

    @remote("b(i)")
    def isUserSessionOpen(self, userID: int) -> bool:
        """Whether a user has an open session."""
        return userID in self._open()

    @remote("b([i])")
    def areUserSessionsOpen(self, userIDs: list[int]) -> bool:
        """Whether each of these users has an open session."""
        return all(user in self._open() for user in userIDs)

    @remote("i(i)")
    def getUsidFromPpid(self, ppID: int) -> int:
        """Returns the user of an ID of ALPeoplePerception, or -1."""
        return next((number for number, user in list(self._users.items()) if user.ppid == ppID and user.opened), NOBODY)

    @remote("i(i)")
    def getPpidFromUsid(self, userID: int) -> int:
        """Returns the ALPeoplePerception ID of a user, or -1."""
        user = self._users.get(userID)
        return user.ppid if user is not None and user.opened else NOBODY

    @remote("b(i)")
    def isUserPermanent(self, userID: int) -> bool:
        """Whether a user is never forgotten: nobody is, for this robot has no page on which to make users permanent."""
        return False

    @remote("b([i])")
    def areUsersPermanent(self, userIDs: list[int]) -> bool:
        """Whether each of these users is never forgotten."""
        return not userIDs

    @remote("[i]()")
    def getPermanentUserList(self) -> list[int]:
        """Lists the users who are never forgotten."""
        return []

    # --- bindings ----------------------------------------------------------------------------------------------------

    @remote("[s]()")
    def getBindingList(self) -> list[str]:
        """Lists the names under which other services know users: none does here."""
        return []

    @remote("[s]()")
    def getBindingSources(self) -> list[str]:
        """Old name of getBindingList."""
        return []

    @remote("b(s)")
    def doesBindingExist(self, bindingName: str) -> bool:
        """Whether users have a binding of this name."""
        return False

    @remote("b(s)")
    def doesBindingSourceExist(self, bindingName: str) -> bool:
        """Old name of doesBindingExist."""
        return False

    @remote("{ss}(i)")
    def getUserBindings(self, userID: int) -> dict[str, str]:
        """Returns the bindings of a user."""
        return {}

    @remote("s(is)")
    def getUserBinding(self, userID: int, bindingName: str) -> str:
        """Returns one binding of a user; "" if there is none."""
        return ""

    @remote("[i](ss)")
    def findUsersWithBinding(self, bindingName: str, bindingValue: str) -> list[int]:
        """Lists the users with a binding."""
        return []

    # --- encounters --------------------------------------------------------------------------------------------------

    @remote("s(i)")
    def getUserCreationDate(self, userID: int) -> str:
        """Returns when a user was created; "" for somebody unknown."""
        user = self._users.get(userID)
        return _date(user.created) if user else ""

    @remote("s(i)")
    def getFirstEncounterDate(self, userID: int) -> str:
        """Returns when the robot met a user first; "" if never."""
        user = self._users.get(userID)
        return _date(user.created) if user else ""

    @remote("s(i)")
    def getCurrentEncounterDate(self, userID: int) -> str:
        """Returns when a user's open session began; "" without one."""
        user = self._users.get(userID)
        return _date(user.opened) if user and user.opened else ""

    @remote("s(i)")
    def getLastEncounterDate(self, userID: int) -> str:
        """Returns when a user's last session ended; "" without one."""
        user = self._users.get(userID)
        return _date(user.closed) if user and user.closed else ""

    @remote("i(i)")
    def getSecondsSinceLastEncounter(self, userID: int) -> int:
        """Returns how long ago a user's last session ended [s]: 0 during the first, -1 for somebody never met."""
        user = self._users.get(userID)
        if user is None:
            return -1
        return int(time.time() - user.closed) if user.closed else 0

    # --- data (deprecated) -------------------------------------------------------------------------------------------

    @remote("b(s)")
    def doesUserDataSourceExist(self, sourceName: str) -> bool:
        """Always false: there are no such sources any more (deprecated)."""
        return False

    @remote("[s]()")
    def getUserDataSources(self) -> list[str]:
        """Lists nothing: there are no such sources any more (deprecated)."""
        return []

    @remote("m(iss)")
    def getUserData(self, userID: int, dataName: str, sourceName: str) -> object:
        """Returns nothing: ALUserInfo holds the data of users (deprecated)."""
        return None

    @remote("{sm}(is)", name="getUserData")
    def getUserDataOfAllSources(self, userID: int, dataName: str) -> dict[str, object]:
        """Returns nothing: ALUserInfo holds the data of users (deprecated)."""
        return {}

    # --- inside ------------------------------------------------------------------------------------------------------

    def _open(self) -> list[int]:
        return [number for number, user in list(self._users.items()) if user.opened]

    def _update(self, look: Look) -> None:
        known = {one.number: one for one in look.known}
        now, opened = time.time(), []
        tracked = known.get(self._awareness.attention.tracked)
        focused = NOBODY
        if tracked is not None:
            focused = self._identify(tracked, look.sight.time, now)
            user = self._users[focused]
            user.ppid = tracked.number
            if not user.opened:
                user.opened = now
                opened.append(focused)
        closed = [
            number
            for number, user in self._users.items()
            if user.opened and (user.ppid not in known or (number == ANONYMOUS and focused not in (number, NOBODY)))
        ]
        for number in closed:
            self._users[number].opened, self._users[number].closed = None, now
        old = [
            number
            for number, user in self._users.items()
            if not user.opened and user.closed and now - user.closed > FORGOTTEN_AFTER
        ]
        for number in old:
            del self._users[number]
        self._report(opened, closed, old, focused)

    def _identify(self, tracked: Known, seen: float, now: float) -> int:
        """Return the user whom the robot tracks; a new one if it sees a new face, the anonymous one if it sees none."""
        person = tracked.last.person
        current = self._users.get(self._focused)
        if current is not None and current.ppid == tracked.number and current.person is person:
            return self._focused
        waiting = self._focused == ANONYMOUS and seen - self._identified < IDENTIFY_AGAIN
        if tracked.last.face is None or waiting:
            if not waiting:
                self._identified = seen
            self._users.setdefault(ANONYMOUS, _User(None, now))
            return ANONYMOUS
        for number, user in self._users.items():
            if user.person is person:
                return number
        number = next(self._numbers)
        self._users[number] = _User(person, now)
        self._memory.announce("UserSession/CreatedUsers", [number])
        self.createdUsers([number])
        return number

    def _report(self, opened: list[int], closed: list[int], deleted: list[int], focused: int) -> None:
        for event, signal, numbers in (
            ("SessionsOpened", self.openedSessions, opened),
            ("SessionsClosed", self.closedSessions, closed),
            ("DeletedUsers", self.deletedUsers, deleted),
        ):
            if numbers:
                self._memory.announce(f"UserSession/{event}", numbers)
                signal(numbers)
        if opened or closed:
            sessions = self._open()
            self._memory.store("UserSession/OpenSessions", sessions)
            before = len(sessions) - len(opened) + len(closed)
            if bool(sessions) != bool(before):
                self._memory.announce("UserSession/NoOpenSessions", not sessions)
                self.noOpenSession(not sessions)
                if not sessions:
                    self._memory.announce("UserSession/ShouldExitInteractiveActivity", True)
        if focused != self._focused:
            self._focused = focused
            self._memory.announce("UserSession/FocusedUser", focused)
            self.focusedUser(focused)


def _date(stamp: float) -> str:
    """Return a time as Boost's posix_time writes it, such as 2017-Mar-01 12:30:00."""
    return time.strftime("%Y-%b-%d %H:%M:%S", time.localtime(stamp))
