"""ALUserInfo: what is stored about users, by domain and name. Source: NAOqi 2.8 documentation, ALUserInfo."""

from __future__ import annotations

import threading
from typing import Any

from pepper_sim.naoqi.service import Service, ServiceError, remote, shown
from pepper_sim.services.al_user_session import ALUserSession
from telepresence.naoqi.signals import Signal

DOMAIN = "user-info"
_MAX_VALUES = 100_000
_TYPES = {bool: "bool", int: "int", str: "string"}


class ALUserInfo(Service):
    """Stores strings, integers and booleans about users."""

    name = "ALUserInfo"

    def __init__(self, sessions: ALUserSession) -> None:
        self._sessions = sessions
        self._lock = threading.Lock()
        self._values: dict[tuple[str, int, str], Any] = {}
        self.userInfoEdited = Signal("(ism)")
        self.userInfoRemoved = Signal("(is)")

    # --- reading -----------------------------------------------------------------------------------------------------

    @remote("m(sis)")
    def get(self, domain: str, userID: int, dataName: str) -> Any:
        """Returns a value about a user."""
        with self._lock:
            if (domain, userID, dataName) not in self._values:
                raise ServiceError(f"nothing is stored as '{shown(dataName)[1:-1]}' about user {userID}")
            return self._values[domain, userID, dataName]

    @remote("m(s)", name="get")
    def getOfFocused(self, dataName: str) -> Any:
        """Returns a value about the focused user in the domain user-info."""
        return self.get(DOMAIN, self._focused(), dataName)

    @remote("m(is)", name="get")
    def getOfUser(self, userID: int, dataName: str) -> Any:
        """Returns a value about a user in the domain user-info."""
        return self.get(DOMAIN, userID, dataName)

    @remote("m(ss)", name="get")
    def getOfDomain(self, domain: str, dataName: str) -> Any:
        """Returns a value about the focused user."""
        return self.get(domain, self._focused(), dataName)

    @remote("b(sis)")
    def has(self, domain: str, userID: int, dataName: str) -> bool:
        """Whether something is stored about a user."""
        with self._lock:
            return (domain, userID, dataName) in self._values

    @remote("b(s)", name="has")
    def hasOfFocused(self, dataName: str) -> bool:
        """Whether something is stored about the focused user in the domain user-info."""
        return self.has(DOMAIN, self._sessions.getFocusedUser(), dataName)

    @remote("b(is)", name="has")
    def hasOfUser(self, userID: int, dataName: str) -> bool:
        """Whether something is stored about a user in the domain user-info."""
        return self.has(DOMAIN, userID, dataName)

    @remote("b(ss)", name="has")
    def hasOfDomain(self, domain: str, dataName: str) -> bool:
        """Whether something is stored about the focused user."""
        return self.has(domain, self._sessions.getFocusedUser(), dataName)

    @remote("s(ss)")
    def getType(self, domain: str, dataName: str) -> str:
        """Returns the type of what is stored under a name: string, int or bool."""
        with self._lock:
            for (place, _, name), value in self._values.items():
                if (place, name) == (domain, dataName):
                    return _TYPES[type(value)]
        raise ServiceError(f"nothing is stored as '{shown(dataName)[1:-1]}' in '{shown(domain)[1:-1]}'")

    # --- writing -----------------------------------------------------------------------------------------------------

    @remote("b(sism)")
    def set(self, domain: str, userID: int, dataName: str, value: Any) -> bool:
        """Stores a string, an integer or a boolean about a user."""
        if type(value) not in _TYPES:
            raise ServiceError(f"value must be a string, an integer or a boolean, got {shown(value)}")
        with self._lock:
            if len(self._values) >= _MAX_VALUES:
                raise ServiceError(f"there are {_MAX_VALUES} values already")
            self._values[domain, userID, dataName] = value
        if domain == DOMAIN:
            self.userInfoEdited(userID, dataName, value)
        return True

    @remote("b(ssm)", name="set")
    def setOfFocused(self, domain: str, dataName: str, value: Any) -> bool:
        """Stores a string, an integer or a boolean about the focused user."""
        return self.set(domain, self._focused(), dataName, value)

    @remote("b(sis)")
    def remove(self, domain: str, userID: int, dataName: str) -> bool:
        """Removes what is stored about a user; false if there is nothing."""
        with self._lock:
            found = self._values.pop((domain, userID, dataName), None) is not None
        if found and domain == DOMAIN:
            self.userInfoRemoved(userID, dataName)
        return found

    @remote("b(ss)", name="remove")
    def removeOfFocused(self, domain: str, dataName: str) -> bool:
        """Removes what is stored about the focused user; false if there is nothing."""
        return self.remove(domain, self._sessions.getFocusedUser(), dataName)

    @remote("b(s)")
    def removeUser(self, domain: str) -> bool:
        """Removes all that is stored about the focused user in a domain; false if there is nothing."""
        focused = self._sessions.getFocusedUser()
        with self._lock:
            names = [name for place, user, name in self._values if (place, user) == (domain, focused)]
        return any([self.remove(domain, focused, name) for name in names])

    @remote("b(sis)", name="removeUser")
    def removeUserData(self, domain: str, userID: int, dataName: str) -> bool:
        """Removes what is stored about a user; false if there is nothing."""
        return self.remove(domain, userID, dataName)

    # --- inside ------------------------------------------------------------------------------------------------------

    def _focused(self) -> int:
        focused = self._sessions.getFocusedUser()
        if focused < 0:
            raise ServiceError("no user is focused")
        return focused
