"""Invitations: links by which somebody without an account comes in, as a guest whose account ends by itself.

    https://station:8443/#i=TOKEN        in the fragment: browsers send it to no server, and to no other page

A token is a random number and a proof, made with a key of this file, that role, end and number of uses are those it was
made with. The file keeps a hash of the number: who reads it has no link, and who changes a row of it has made the link
useless. It lies beside the accounts, where page, window, command line and drive_lease all find it.

A guest is called "NAME (guest)", which no account is, and ranks below every account. Of a guest only a public key is
kept, see `telepresence.teleop.key_agreement`; the private one is in the memory of the page's program. When the
invitation ends or is withdrawn, its guests end with it, and drive_lease takes the robot from them.
"""

from __future__ import annotations

import base64
import binascii
import contextlib
import hashlib
import hmac
import os
import secrets
import sqlite3
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from telepresence.security import private_database, signing
from telepresence.security.outside_text import clean
from telepresence.teleop.accounts import ROLES, UserError, is_guest_name
from telepresence.teleop.accounts_path import default_path
from telepresence.teleop.key_agreement import KEY, Credential, public_key
from telepresence.teleop.lease_messages import PILOT, Account

SHORTEST, LONGEST = 60.0, 7 * 24 * 3600.0
"""Seconds for which an invitation may hold."""
MOST_INVITATIONS = 64
MOST_GUESTS = 16
"""Guests of one invitation at the same time."""
LONGEST_NAME = 40
"""Characters of a guest's own name."""
GUEST_RANK = -(2**31)
"""Below every account's."""
PROOF, NUMBER = 16, 16
"""Bytes of a token's two halves."""
_SCHEMA = """
CREATE TABLE IF NOT EXISTS secret (one INTEGER PRIMARY KEY CHECK (one = 1), key BLOB NOT NULL);
CREATE TABLE IF NOT EXISTS page (one INTEGER PRIMARY KEY CHECK (one = 1), address TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS invitations (
    id TEXT PRIMARY KEY, number BLOB NOT NULL UNIQUE, role TEXT NOT NULL, once INTEGER NOT NULL, ends REAL NOT NULL,
    maker TEXT NOT NULL, used INTEGER NOT NULL);
CREATE TABLE IF NOT EXISTS guests (
    name TEXT PRIMARY KEY, role TEXT NOT NULL, public BLOB NOT NULL, invitation TEXT NOT NULL);
"""


class InvitationError(UserError):
    """A link opens nothing, or cannot be made; the text is for the person."""


def may_invite(account: Account) -> bool:
    """Return whether this person may let others in."""
    return account.role == PILOT and not is_guest_name(account.name)


@dataclass(frozen=True)
class Invitation:
    """What a link allows.

    Args:
        id: For lists and for withdrawing; no secret.
        once: Whether one guest uses it up.
        ends: [s since 1970].
        maker: Name of who made it.
        used: How often somebody came in by it.
    """

    id: str
    role: str
    once: bool
    ends: float
    maker: str
    used: int = 0


def beside(users: Path | None = None) -> Path:
    """Return where the invitations are: beside the accounts, or in the home of who may not write there."""
    users = users or default_path()
    if users.parent.exists() and not os.access(users.parent, os.W_OK):
        return Path.home() / ".config" / "telepresence" / "invitations"
    return users.with_name(f"{users.name}.invitations")


class Invitations:
    """The invitations of a station, in a file. Safe for several processes and threads; calls take milliseconds.

    Args:
        path: The file; made when the first invitation is, readable for its owner only. See `beside`.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def make(
        self, role: str, lasts: float, once: bool = False, maker: str = "", now: float | None = None
    ) -> tuple[Invitation, str]:
        """Make an invitation; return it with its token, which is kept nowhere.

        Args:
            lasts: [s].
            now: [s since 1970]; by default the clock's.
        Raises:
            InvitationError: Role or time is not acceptable, or there are too many.
        """
        now = time.time() if now is None else now
        if role not in ROLES:
            raise InvitationError(f"There is no role '{role}'; there are {' and '.join(ROLES)}.")
        if not SHORTEST <= lasts <= LONGEST:
            raise InvitationError("An invitation holds for at least one minute and at most seven days.")
        number = secrets.token_bytes(NUMBER)
        invitation = Invitation(secrets.token_hex(4), role, once, now + lasts, maker)
        with self._open() as database:
            self._forget_ended(database, now)
            (count,) = database.execute("SELECT count(*) FROM invitations").fetchone()
            if count >= MOST_INVITATIONS:
                raise InvitationError(f"There are {MOST_INVITATIONS} invitations. Withdraw one first.")
            database.execute(
                "INSERT INTO invitations VALUES (?, ?, ?, ?, ?, ?, 0)",
                (invitation.id, _hash(number), role, once, invitation.ends, maker),
            )
            proof = _proof(self._key(database), number, invitation)
        return invitation, _written(number + proof)

    def invite(self, role: str, lasts: float, once: bool, maker: str) -> tuple[Invitation, str]:
        """Make an invitation; return it with its link. See `make`.

        Raises:
            InvitationError: Role or time is not acceptable, there are too many, or no page has been started here.
        """
        self.link("")  # without a page there is nothing to open
        invitation, token = self.make(role, lasts, once, maker)
        return invitation, self.link(token)

    def all(self, now: float | None = None) -> list[Invitation]:
        """Return the invitations that hold, the one that ends first first."""
        now = time.time() if now is None else now
        with self._read() as database:
            rows = database.execute(
                "SELECT id, role, once, ends, maker, used FROM invitations WHERE ends > ? ORDER BY ends", (now,)
            ).fetchall()
        return [Invitation(id, role, bool(once), ends, maker, used) for id, role, once, ends, maker, used in rows]

    def withdraw(self, id: str) -> Invitation:
        """End an invitation, and its guests; return what it was.

        Raises:
            InvitationError: There is none of this id.
        """
        with self._open() as database:
            row = database.execute(
                "SELECT id, role, once, ends, maker, used FROM invitations WHERE id = ?", (id,)
            ).fetchone()
            if row is None:
                raise InvitationError(f"There is no invitation '{clean(id, 40)}'.")
            database.execute("DELETE FROM invitations WHERE id = ?", (id,))
            database.execute("DELETE FROM guests WHERE invitation = ?", (id,))
        return Invitation(row[0], row[1], bool(row[2]), *row[3:])

    def use(self, token: str, name: str, lease: bytes, now: float | None = None) -> tuple[Account, Invitation]:
        """Let a guest in; return the account, with what a window of it needs to drive.

        Args:
            name: As the guest wants to be called.
            lease: The public key of drive_lease [32 bytes].
        Raises:
            InvitationError: The link opens nothing (any more).
        """
        now = time.time() if now is None else now
        number, proof = _split(token)
        private = secrets.token_bytes(KEY)
        with self._open() as database:
            database.execute("BEGIN IMMEDIATE")  # two guests at the same moment use one link once
            row = database.execute(
                "SELECT id, role, once, ends, maker, used FROM invitations WHERE number = ?", (_hash(number),)
            ).fetchone()
            invitation = Invitation(row[0], row[1], bool(row[2]), *row[3:]) if row else None
            if invitation is None or not hmac.compare_digest(proof, _proof(self._key(database), number, invitation)):
                raise InvitationError("This link opens nothing: it is not complete, or it was withdrawn.")
            if invitation.ends <= now:
                raise InvitationError("This link has ended. Ask for a new one.")
            if invitation.once and invitation.used:
                raise InvitationError("This link was for one person, and has been used. Ask for a new one.")
            names = {row[0] for row in database.execute("SELECT name FROM guests")}
            (guests,) = database.execute(
                "SELECT count(*) FROM guests WHERE invitation = ?", (invitation.id,)
            ).fetchone()
            if guests >= MOST_GUESTS:
                raise InvitationError(f"{MOST_GUESTS} people have come in by this link, which is the limit.")
            account = Account(
                _guest_name(name, names),
                invitation.role,
                GUEST_RANK,
                public_key(private),
                Credential(private, lease),
            )
            database.execute("UPDATE invitations SET used = used + 1 WHERE id = ?", (invitation.id,))
            database.execute(
                "INSERT INTO guests VALUES (?, ?, ?, ?)", (account.name, account.role, account.public, invitation.id)
            )
        return account, invitation

    def leave(self, name: str) -> None:
        """Let a guest out: the name is free again."""
        with self._open() as database:
            database.execute("DELETE FROM guests WHERE name = ?", (name,))

    def guests(self, now: float | None = None) -> dict[str, Account]:
        """Return the guests whose invitation holds, by name."""
        now = time.time() if now is None else now
        with self._read() as database:
            rows = database.execute(
                "SELECT guests.name, guests.role, guests.public FROM guests JOIN invitations"
                " ON invitations.id = guests.invitation AND invitations.role = guests.role WHERE ends > ?",
                (now,),
            ).fetchall()
        return {name: Account(name, role, GUEST_RANK, public) for name, role, public in rows if is_guest_name(name)}

    def set_page(self, address: str) -> None:
        """Keep where the page is: what links begin with."""
        with self._open() as database:
            database.execute("INSERT OR REPLACE INTO page VALUES (1, ?)", (address,))

    def link(self, token: str) -> str:
        """Return the link with this token.

        Raises:
            InvitationError: No page has been started here.
        """
        with self._read() as database:
            row = database.execute("SELECT address FROM page").fetchone()
        if row is None:
            raise InvitationError("The page has not been started here yet: ./stack up does it.")
        return f"{row[0]}#i={token}"

    @staticmethod
    def _forget_ended(database: sqlite3.Connection, now: float) -> None:
        database.execute("DELETE FROM invitations WHERE ends <= ?", (now,))
        database.execute("DELETE FROM guests WHERE invitation NOT IN (SELECT id FROM invitations)")

    @staticmethod
    def _key(database: sqlite3.Connection) -> bytes:
        database.execute("INSERT OR IGNORE INTO secret VALUES (1, ?)", (secrets.token_bytes(KEY),))
        return bytes(database.execute("SELECT key FROM secret").fetchone()[0])

    @contextlib.contextmanager
    def _read(self) -> Iterator[sqlite3.Connection]:
        """Open what there is; nothing is made. Raises UserError."""
        if self.path.exists():
            with self._open() as database:
                yield database
        else:
            with contextlib.closing(sqlite3.connect(":memory:")) as database:
                database.executescript(_SCHEMA)
                yield database

    @contextlib.contextmanager
    def _open(self) -> Iterator[sqlite3.Connection]:
        """Open the database in a transaction that is committed, or undone by an exception.

        Raises:
            UserError: The file cannot be used.
        """
        try:
            with private_database.opened(self.path, _SCHEMA) as database, database:
                yield database
        except (OSError, sqlite3.Error) as error:
            raise UserError(f"The invitations in {self.path} can't be used: {error}.") from error


def _written(token: bytes) -> str:
    return base64.urlsafe_b64encode(token).decode().rstrip("=")


def _split(token: str) -> tuple[bytes, bytes]:
    """Return number and proof; of what is no token, such that open nothing."""
    try:
        decoded = base64.b64decode(token + "=", altchars=b"-_", validate=True)
    except (ValueError, binascii.Error):
        decoded = b""
    if len(decoded) != NUMBER + PROOF or _written(decoded) != token:  # the last letter has two bits that say nothing
        return bytes(NUMBER), bytes(PROOF)
    return decoded[:NUMBER], decoded[NUMBER:]


def _hash(number: bytes) -> bytes:
    return hashlib.sha256(number).digest()


def _proof(key: bytes, number: bytes, invitation: Invitation) -> bytes:
    parts = (invitation.id, invitation.role, str(int(invitation.once)), repr(invitation.ends))
    return signing.mac(key, "invitation", number, *(part.encode() for part in parts))[:PROOF]


def _guest_name(wanted: str, taken: set[str]) -> str:
    """Return "NAME (guest)", or "NAME (guest 2)" while the first is here."""
    name = " ".join(clean(wanted, LONGEST_NAME).split()) or "Guest"
    numbers = ["", *(f" {number}" for number in range(2, len(taken) + 3))]
    return next(full for number in numbers if (full := f"{name} (guest{number})") not in taken)
