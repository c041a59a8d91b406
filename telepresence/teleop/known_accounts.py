"""Everybody whom drive_lease knows: the accounts, or everybody where nobody signs in; and the guests of invitations."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from telepresence.teleop.accounts import Users, is_guest_name
from telepresence.teleop.invitations import Invitations
from telepresence.teleop.key_agreement import EVERYBODY
from telepresence.teleop.lease_messages import PILOT, Account


class KnownAccounts:
    """Looks people up by name. Safe for several processes and threads; calls take milliseconds.

    Args:
        users: The accounts; None where nobody signs in: then every name but a guest's is a pilot's.
    """

    def __init__(self, users: Users | None, invitations: Invitations) -> None:
        self._users, self._invitations = users, invitations

    def find(self, name: str) -> Account | None:
        """Return the account of a name. Raises UserError."""
        return self.of_lease([name])[1].get(name)

    def of_lease(self, names: Iterable[str]) -> tuple[bytes, Mapping[str, Account]]:
        """Return the private key by which windows recognize drive_lease [32 bytes], and the accounts of these names,
        without those that there are not (any more). Raises UserError."""
        names = set(names)
        guests = self._invitations.guests() if any(map(is_guest_name, names)) else {}
        if self._users is None:
            key, people = EVERYBODY, {name: Account(name, PILOT) for name in names if not is_guest_name(name)}
        else:
            key, people = self._users.of_lease()
        known = guests | people  # an account goes before a guest
        return key, {name: known[name] for name in names & known.keys()}
