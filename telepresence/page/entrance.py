"""Who may come in by the page, and as what: accounts by password, guests by invitation. No HTTP."""

from __future__ import annotations

import dataclasses
import getpass
import hmac
import ipaddress
from collections.abc import Iterable

from telepresence.security.outside_text import clean
from telepresence.teleop.accounts import LONGEST_NAME, Try, UserError, Users, is_guest_name
from telepresence.teleop.invitations import Invitation, Invitations
from telepresence.teleop.key_agreement import OPEN, public_key
from telepresence.teleop.known_accounts import KnownAccounts
from telepresence.teleop.lease_messages import PILOT, Account

_OWN_LINK = "Open the link that ./stack up has printed: it lets in whoever has started the station."


class Entrance:
    """Lets people in. Safe for several threads; `admit` takes 0.1 s, everything else milliseconds.

    Args:
        users: The accounts.
        sign_in: Whether drive_lease checks names. Where it does not, `own_key` or this machine makes a pilot.
        own_key: Of the link that lets in, as the window does, the person who has started the station; "" for none: then
            whoever uses this machine comes in.
    """

    def __init__(self, users: Users, invitations: Invitations, sign_in: bool = True, own_key: str = "") -> None:
        self._users, self._sign_in = users, sign_in
        self._own_key = own_key.encode()
        self._known = KnownAccounts(users if sign_in else None, invitations)
        self.invitations = invitations

    def asks(self, address: str) -> bool:
        """Return whether somebody at this address needs a password, or a link."""
        return self._sign_in or bool(self._own_key) or not _is_loopback(address)

    @property
    def hint(self) -> str:
        """How one comes in, where a name and a password are not the way; empty where they are."""
        return _OWN_LINK if self._own_key and not self._sign_in else ""

    def count_try(self, name: str, password: str, longest: float) -> Try:
        """Count a try to come in by `admit`.

        Args:
            longest: [s] for which it may have to wait before it is decided.
        Raises:
            QueueFull: It would wait longer.
            UserError: The accounts cannot be used.
        """
        return self._users.count_try(name, longest=longest) if self._sign_in or password else Try()

    def admit(self, name: str, password: str, address: str, counted: Try) -> Account:
        """Return the account of somebody with a password; of everybody at this very machine, where nobody signs in and
        there is no link either.

        Args:
            address: From which the request came.
            counted: By `count_try`; it has waited.
        Raises:
            UserError: The person may not come in.
        """
        if self._sign_in:
            return self._users.decide(name, password, counted)
        if password:
            account = self._users.decide(name, password, counted)
            return dataclasses.replace(account, public=OPEN.lease, credential=OPEN)
        if not _is_loopback(address):
            raise UserError("From another machine one comes in by a link (./stack invite) or with a password.")
        if self._own_key:  # this machine may have other users
            raise UserError(_OWN_LINK)
        name = clean(name, LONGEST_NAME).strip() or "Pilot"
        if is_guest_name(name):
            raise UserError("Guests are called so. Choose another name.")
        return Account(name, PILOT)

    def accept(self, token: str, name: str) -> tuple[Account, Invitation | None]:
        """Return the account of a guest, and by what it came in; None for the station's own link. Raises UserError."""
        offered = token.encode("utf-8", "surrogatepass")
        if self._own_key and not self._sign_in and hmac.compare_digest(offered, self._own_key):
            return Account(getpass.getuser(), PILOT), None
        return self.invitations.use(token, name, public_key(self._known.of_lease(())[0]))

    def outdated(self, accounts: Iterable[Account]) -> dict[str, str]:
        """Return those names whose account is not any more what is given here, and why, as a sentence."""
        accounts = list(accounts)
        known = self._known.of_lease(account.name for account in accounts)[1]
        return {
            account.name: _why(account, known.get(account.name))
            for account in accounts
            if known.get(account.name) != account and (self._sign_in or is_guest_name(account.name))
        }


def _why(then: Account, today: Account | None) -> str:
    if is_guest_name(then.name):
        return "Your invitation has ended."
    if today is None:
        return "Your account was removed."
    return "Your password was changed." if today.public != then.public else "Your account was changed."


def _is_loopback(address: str) -> bool:
    try:
        found = ipaddress.ip_address(address.partition("%")[0])
    except ValueError:
        return False
    mapped = getattr(found, "ipv4_mapped", None)
    return (mapped or found).is_loopback
