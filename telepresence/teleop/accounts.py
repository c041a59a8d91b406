"""The accounts with which people sign in:  python -m gui.users add NAME --role pilot

They are stored in an SQLite file that is created empty at first use, see `accounts_path`. Of a password only a public
key is kept (`password_key`): with what stands in the file nobody can sign in, and no window can drive. Wrong tries are
counted there too, so that restarting the window gives no new ones. An unknown name is answered as slowly as any other.
"""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import getpass
import hmac
import re
import secrets
import sqlite3
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

from telepresence.security import private_database
from telepresence.teleop import password_key
from telepresence.teleop.accounts_path import default_path
from telepresence.teleop.key_agreement import Credential, public_key
from telepresence.teleop.lease_messages import PILOT, WATCHER, Account
from telepresence.teleop.password_key import SALT, Cost

ROLES = (PILOT, WATCHER)
SHORTEST_PASSWORD = 8
LONGEST_NAME, LONGEST_PASSWORD = 64, 1024
TRIES = 5
"""Wrong passwords in a row after which every further try waits."""
LONGEST_PAUSE = 8.0
"""Seconds for which a try waits at most: nobody can lock the owner of a name out."""
LONGEST_QUEUE = 30.0
"""Seconds for which a try waits behind others of the same name; a later one is refused."""
FORGIVEN = 60.0
"""Seconds without a try after which wrong ones are forgotten."""
_SCHEMA = """
CREATE TABLE IF NOT EXISTS accounts (
    name TEXT PRIMARY KEY, role TEXT NOT NULL, rank INTEGER NOT NULL, passes INTEGER NOT NULL, memory INTEGER NOT NULL,
    lanes INTEGER NOT NULL, salt BLOB NOT NULL, public BLOB NOT NULL);
CREATE TABLE IF NOT EXISTS users (
    name TEXT PRIMARY KEY, role TEXT NOT NULL, rank INTEGER NOT NULL, salt BLOB NOT NULL, key BLOB NOT NULL);
CREATE TABLE IF NOT EXISTS lease (one INTEGER PRIMARY KEY CHECK (one = 1), private BLOB NOT NULL);
CREATE TABLE IF NOT EXISTS tries (name TEXT PRIMARY KEY, failed INTEGER NOT NULL, last REAL NOT NULL);
"""
"""`accounts`: what Argon2id needs, and the public key. `users`: accounts of versions before 0.4, with a scrypt hash;
each moves to `accounts` when its person signs in. `lease`: the private key by which windows recognize drive_lease."""


class UserError(ValueError):
    """An account could not be used or changed; the text is for the person."""


class QueueFull(UserError):
    """A try would wait for longer than it may: so many others are before it."""


class Try(NamedTuple):
    """A try to sign in that is counted as wrong, until it has been right.

    Args:
        failed: Wrong ones in a row, with this one.
        wait: [s] for which it is not to be decided yet.
    """

    failed: int = 0
    wait: float = 0.0


_GUEST = re.compile(r".+ \(guest( \d+)?\)")


def is_guest_name(name: str) -> bool:
    """Return whether a guest of an invitation is called so, see `telepresence.teleop.invitations`; no account is."""
    return _GUEST.fullmatch(name) is not None


class Users:
    """The accounts in a file. Safe for several processes and threads; calls take milliseconds, `check` 0.1 s.

    Args:
        path: The file; it is created when it is first needed, readable for its owner only.
        cost: What one guess of a password that is set from now on costs.
    """

    def __init__(self, path: Path | None = None, cost: Cost | None = None) -> None:
        self.path = path or default_path()
        self._cost = cost or password_key.COST

    def add(self, name: str, password: str, role: str, rank: int = 0) -> None:
        """Create an account, or replace the one of this name.

        Raises:
            UserError: Name, password or role is not acceptable.
        """
        name = _clean(name)
        if role not in ROLES:
            raise UserError(f"There is no role '{role}'; there are {' and '.join(ROLES)}.")
        if len(password) < SHORTEST_PASSWORD:
            raise UserError(f"The password needs at least {SHORTEST_PASSWORD} characters.")
        if len(password) > LONGEST_PASSWORD:
            raise UserError(f"The password may have at most {LONGEST_PASSWORD} characters.")
        salt = secrets.token_bytes(SALT)
        public = public_key(password_key.private_key(password, salt, self._cost))
        with self._open() as database:
            self._store(database, Account(name, role, rank, public), salt)
            database.execute("DELETE FROM tries WHERE name = ?", (name,))

    def remove(self, name: str) -> None:
        """Delete an account. drive_lease ends its sessions within a second.

        Raises:
            UserError: There is none of this name.
        """
        name = _clean(name)
        with self._open() as database:
            tables = ("accounts", "users")
            if not sum(database.execute(f"DELETE FROM {table} WHERE name = ?", (name,)).rowcount for table in tables):
                raise UserError(f"There is nobody called '{name}'. See  ./stack exec python -m gui.users list")

    def all(self) -> list[Account]:
        """Return all accounts by name; those of versions before 0.4 have no public key until they have signed in."""
        with self._open() as database:
            rows = database.execute(
                "SELECT name, role, rank, public FROM accounts UNION"
                " SELECT name, role, rank, x'' FROM users ORDER BY name"
            ).fetchall()
        return [Account(*row) for row in rows]

    def find(self, name: str) -> Account | None:
        """Return the account with which this name may drive: one of a version before 0.4 may after it has signed in."""
        if not name.isprintable():  # nor can half a character be looked up
            return None
        with self._open() as database:
            row = database.execute("SELECT name, role, rank, public FROM accounts WHERE name = ?", (name,)).fetchone()
        return Account(*row) if row else None

    def of_lease(self) -> tuple[bytes, dict[str, Account]]:
        """Return what drive_lease needs: its private key [32 bytes], made at the first call; the accounts by name."""
        with self._open() as database:
            key = self._lease_key(database)
            rows = database.execute("SELECT name, role, rank, public FROM accounts").fetchall()
        return key, {row[0]: Account(*row) for row in rows}

    def check(
        self, name: str, password: str, now: float | None = None, sleep: Callable[[float], None] = time.sleep
    ) -> Account:
        """Return the account, with what its window needs to drive, if the password is right.

        After `TRIES` wrong passwords in a row a try waits, seconds at most, and is then decided as any other.

        Args:
            now: The time [s since 1970]; by default the clock's.
            sleep: Waits for so many seconds.
        Raises:
            UserError: It is wrong. The text does not say whether the name or the password was.
        """
        counted = self.count_try(name, now)
        if counted.wait:
            sleep(counted.wait)
        return self.decide(name, password, counted)

    def count_try(self, name: str, now: float | None = None, longest: float = LONGEST_QUEUE) -> Try:
        """Begin what `check` does, for whoever waits without a thread.

        Args:
            now: The time [s since 1970]; by default the clock's.
            longest: [s] for which the try may have to wait.
        Raises:
            QueueFull: It would wait longer; it is not counted.
        """
        with self._open() as database:
            return _count_try(database, _looked_up(name), time.time() if now is None else now, longest)

    def decide(self, name: str, password: str, counted: Try) -> Account:
        """End what `count_try` has begun, once the try has waited; see `check`. Raises UserError."""
        name, password = _looked_up(name), password[:LONGEST_PASSWORD]
        with self._open() as database:
            row = database.execute("SELECT * FROM accounts WHERE name = ?", (name,)).fetchone()
            old = database.execute("SELECT role, rank, salt, key FROM users WHERE name = ?", (name,)).fetchone()
            any_old = database.execute("SELECT 1 FROM users").fetchone() is not None
            lease = self._lease_key(database)
        # The same work in every case, or the response time would reveal which names exist.
        nobody = (name, "", 0, *self._cost, password_key.salt_of_nobody(name, lease), secrets.token_bytes(32))
        name, role, rank, passes, memory, lanes, salt, public = row or nobody
        private = password_key.private_key(password, salt, Cost(passes, memory, lanes))
        right = hmac.compare_digest(public_key(private), public) and row is not None
        upgrade = right and Cost(passes, memory, lanes) != self._cost
        if any_old:
            role_then, rank_then, salt_then, key = old or ("", 0, salt, secrets.token_bytes(32))
            right_then = hmac.compare_digest(password_key.legacy_hash(password, salt_then), key) and old is not None
            if right_then and not right:
                right, upgrade, role, rank = True, True, role_then, rank_then
        if not right:
            raise UserError(f"Wrong name or password. {_what_follows(counted.failed)}")
        account = Account(name, role, rank, public, Credential(private, public_key(lease)))
        if upgrade:
            account, salt = self._renew(account, password)
        with self._open() as database:
            database.execute("DELETE FROM tries WHERE name = ?", (name,))
            if upgrade:
                self._store(database, account, salt)
        return account

    def _renew(self, account: Account, password: str) -> tuple[Account, bytes]:
        """Return the account with keys of today's cost, and their salt."""
        assert account.credential is not None  # `check` has made it
        salt = secrets.token_bytes(SALT)
        private = password_key.private_key(password, salt, self._cost)
        credential = Credential(private, account.credential.lease)
        return dataclasses.replace(account, public=public_key(private), credential=credential), salt

    def _store(self, database: sqlite3.Connection, account: Account, salt: bytes) -> None:
        database.execute("DELETE FROM users WHERE name = ?", (account.name,))
        values = (account.name, account.role, account.rank, *self._cost, salt, account.public)
        database.execute("INSERT OR REPLACE INTO accounts VALUES (?, ?, ?, ?, ?, ?, ?, ?)", values)

    def _lease_key(self, database: sqlite3.Connection) -> bytes:
        row = database.execute("SELECT private FROM lease").fetchone()
        if row is None:
            database.execute("INSERT OR IGNORE INTO lease VALUES (1, ?)", (secrets.token_bytes(32),))
            row = database.execute("SELECT private FROM lease").fetchone()
        return bytes(row[0])

    @contextlib.contextmanager
    def _open(self) -> Iterator[sqlite3.Connection]:
        """Open the database in a transaction that is committed, also when a UserError ends it.

        Raises:
            UserError: The file cannot be used.
        """
        try:
            with private_database.opened(self.path, _SCHEMA) as database:
                try:
                    yield database
                finally:
                    database.commit()
        except (OSError, sqlite3.Error) as error:
            raise UserError(
                f"The accounts in {self.path} can't be used: {error}. Name another file with TELEPRESENCE_USERS."
            ) from error


def _looked_up(name: str) -> str:
    return name.strip()[:LONGEST_NAME].encode(errors="replace").decode()  # half a character cannot be looked up


def _count_try(database: sqlite3.Connection, name: str, now: float, longest: float) -> Try:
    database.execute("BEGIN IMMEDIATE")  # tries made at the same moment count, and wait, one by one
    database.execute("DELETE FROM tries WHERE last < ?", (now - FORGIVEN,))
    # Whoever waits, waits no longer than this: a later time is of a clock that was set back since.
    database.execute("UPDATE tries SET last = ? WHERE last > ?", (now, now + LONGEST_QUEUE))
    row = database.execute("SELECT failed, last FROM tries WHERE name = ?", (name,)).fetchone()
    failed, last = row or (0, now)
    turn = max(now, last + _pause(failed))
    if turn - now > longest:
        raise QueueFull("Many others try this name at this moment. Try again in a minute.")
    database.execute("INSERT OR REPLACE INTO tries VALUES (?, ?, ?)", (name, failed + 1, turn))
    database.commit()
    return Try(failed + 1, turn - now)


def _pause(failed: int) -> float:
    """Return the seconds between two tries after so many wrong ones."""
    return 0.0 if failed < TRIES else min(LONGEST_PAUSE, 2.0 ** (failed - TRIES))


def _what_follows(failed: int) -> str:
    if failed < TRIES:
        left = TRIES - failed
        return f"{left} {'try' if left == 1 else 'tries'} left before each further one waits."
    return f"The next try waits for {_pause(failed):.0f} s."


def main(argv: list[str] | None = None) -> int:
    """Run the command line and return its exit code."""
    arguments = _parse(argv)
    users = Users(arguments.file)
    try:
        if arguments.command == "list":
            for account in users.all():
                note = "" if account.public else "   (of an older version: signs in once before driving)"
                print(f"{account.name:<24} {account.role:<8} rank {account.rank}{note}")
        elif arguments.command == "remove":
            users.remove(arguments.name)
        else:
            users.add(arguments.name, _ask_password(arguments.password_stdin), arguments.role, arguments.rank)
            print(f"users: {arguments.name} may sign in where the accounts are {users.path}", file=sys.stderr)
    except UserError as error:
        print(f"users: {error}", file=sys.stderr)
        return 1
    return 0


def _parse(argv: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="./stack exec python -m gui.users", description="Who may sign in to the window."
    )
    parser.add_argument(
        "--users", "--file", dest="file", type=Path, metavar="FILE", help=f"the accounts; default {default_path()}"
    )
    commands = parser.add_subparsers(dest="command", required=True)
    add = commands.add_parser("add", help="make an account, or replace it: new password, role, rank")
    add.add_argument("name")
    add.add_argument("--role", choices=ROLES, required=True, help="pilots drive, watchers see and may stop the robot")
    add.add_argument("--rank", type=int, default=0, help="a higher one may take the robot from a lower one; default 0")
    add.add_argument("--password-stdin", action="store_true", help="read the password from standard input")
    commands.add_parser("remove", help="delete an account").add_argument("name")
    commands.add_parser("list", help="names, roles and ranks")
    return parser.parse_args(argv)


def _ask_password(from_stdin: bool) -> str:
    if from_stdin:
        return sys.stdin.readline().rstrip("\n")
    password = getpass.getpass("Password: ")
    if getpass.getpass("Once more: ") != password:
        raise UserError("The two differ; nothing was changed.")
    return password


def _clean(name: str) -> str:
    name = name.strip()
    if not name or len(name) > LONGEST_NAME or not name.isprintable():
        raise UserError(f"A name has 1 to {LONGEST_NAME} printable characters.")
    if is_guest_name(name):
        raise UserError(f"'{name}' is called as guests of an invitation are.")
    return name
