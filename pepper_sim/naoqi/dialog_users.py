"""What ALDialog remembers of its users: the variables $user/..., by the user's number."""

from __future__ import annotations

from pepper_sim.naoqi.service import ServiceError
from pepper_sim.services.al_memory import ALMemory

PREFIX = "user/"
MAX_USERS, MAX_VARIABLES = 1000, 1000


class DialogUsers:
    """The users, and the one with whom the robot talks."""

    def __init__(self, memory: ALMemory) -> None:
        self._memory = memory
        self._data: dict[int, dict[str, str]] = {}
        self._present: int | None = None

    def open(self, identity: int) -> None:
        """Talk with a user: what is known of the user becomes variables."""
        self.close()
        self._present = identity
        for name, value in self.of(identity).items():
            self._memory.store(PREFIX + name, value)

    def close(self) -> None:
        """Talk with nobody: the variables are emptied."""
        for name in self.of(self._present) if self._present is not None else ():
            self._memory.store(PREFIX + name, "")
        self._present = None

    def known(self) -> list[str]:
        """List the numbers of the users of whom something is known."""
        return [str(identity) for identity, data in sorted(self._data.items()) if data]

    def of(self, identity: int) -> dict[str, str]:
        """Return what is known of a user."""
        return dict(self._data.get(identity, {}))

    def info(self, name: str) -> str | None:
        """Return what is known of the user who speaks; None if nothing is."""
        return self.of(self._present).get(name) if self._present is not None else None

    def insert(self, name: str, value: str, identity: int) -> None:
        """Remember a variable of a user.

        Raises: ServiceError: There are too many.
        """
        data = self._data.get(identity, {})
        if len(self._data) >= MAX_USERS or len(data) >= MAX_VARIABLES:
            raise ServiceError("the memory for users is full")
        self._data[identity] = {**data, name: value}

    def write(self, name: str, value: str) -> None:
        """Set a variable of the dialogue; one of the user who speaks is remembered. "" clears it."""
        self._memory.announce(name, value)
        if name.startswith(PREFIX) and self._present is not None:
            self.insert(name.removeprefix(PREFIX), value, self._present)
