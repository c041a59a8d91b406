"""The accounts with which people sign in:  python -m gui.users add NAME --role pilot

They are stored in an SQLite file that is created empty at first use: gui/users.db, or the file that TELEPRESENCE_USERS
names. Of a password only a salted scrypt hash is kept (RFC 7914); wrong tries are counted there too, so that restarting
the window gives no new ones. An unknown name is answered as slowly as any other.
"""

from __future__ import annotations

import argparse
import contextlib
import getpass
import hashlib
import hmac
import os
import secrets
import sqlite3
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from telepresence.teleop.drive_lease import PILOT, WATCHER, Account

ROLES = (PILOT, WATCHER)
SHORTEST_PASSWORD = 8
LONGEST_NAME, LONGEST_PASSWORD = 64, 1024
TRIES = 5
"""Wrong passwords in a row after which a name is locked."""
LOCK_TIME = 60.0
"""Seconds for which a name stays locked."""
_COST = {"n": 1 << 15, "r": 8, "p": 1, "maxmem": 1 << 26, "dklen": 32}
"""32 MiB and about 0.1 s for one guess."""
_SCHEMA = """
CREATE TABLE IF NOT EXISTS users (
    name TEXT PRIMARY KEY, role TEXT NOT NULL, rank INTEGER NOT NULL, salt BLOB NOT NULL, key BLOB NOT NULL);
CREATE TABLE IF NOT EXISTS tries (name TEXT PRIMARY KEY, failed INTEGER NOT NULL, last REAL NOT NULL);
"""


class UserError(ValueError):
    """An account could not be used or changed; the text is for the person."""


def default_path() -> Path:
    """Return the path of the accounts: TELEPRESENCE_USERS, else gui/users.db."""
    return Path(os.environ.get("TELEPRESENCE_USERS") or Path(__file__).resolve().parents[2] / "gui" / "users.db")


class Users:
    """The accounts in a file. Safe for several processes and threads; calls take milliseconds, `check` 0.1 s.

    Args:
        path: The file; it is created when it is first needed, readable for its owner only.
    """

    def __init__(self, path: Path | None = None) -> None:
        self.path = path or default_path()

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
        salt = secrets.token_bytes(16)
        with self._open() as database:
            database.execute(
                "INSERT OR REPLACE INTO users VALUES (?, ?, ?, ?, ?)", (name, role, rank, salt, _hash(password, salt))
            )
            database.execute("DELETE FROM tries WHERE name = ?", (name,))

    def remove(self, name: str) -> None:
        """Delete an account.

        Raises:
            UserError: There is none of this name.
        """
        with self._open() as database:
            if database.execute("DELETE FROM users WHERE name = ?", (_clean(name),)).rowcount == 0:
                raise UserError(f"There is nobody called '{name}'. See  python -m gui.users list")

    def all(self) -> list[Account]:
        """Return all accounts by name, without keys."""
        with self._open() as database:
            rows = database.execute("SELECT name, role, rank FROM users ORDER BY name").fetchall()
        return [Account(*row) for row in rows]

    def find(self, name: str) -> Account | None:
        """Return the account of this name, with its key."""
        with self._open() as database:
            row = database.execute("SELECT name, role, rank, key FROM users WHERE name = ?", (name,)).fetchone()
        return Account(*row) if row else None

    def check(self, name: str, password: str, now: float | None = None) -> Account:
        """Return the account if the password is right.

        Args:
            now: The time [s since 1970]; by default the clock's.
        Raises:
            UserError: It is wrong, or has been wrong too often. The text does not say whether the name or the password
                was.
        """
        now = time.time() if now is None else now
        name, password = name.strip()[:LONGEST_NAME], password[:LONGEST_PASSWORD]
        with self._open() as database:
            row = database.execute("SELECT name, role, rank, key, salt FROM users WHERE name = ?", (name,)).fetchone()
        known, role, rank, key, salt = row or ("", "", 0, secrets.token_bytes(32), b"a salt for nobody")
        # Hashed in every case, or the response time would reveal which names exist.
        right = hmac.compare_digest(_hash(password, salt), key) and row is not None
        with self._open() as database:
            # Decided in one transaction: tries made at the same moment count one by one.
            database.execute("BEGIN IMMEDIATE")
            database.execute("DELETE FROM tries WHERE last < ?", (now - LOCK_TIME,))
            (failed,) = database.execute("SELECT failed FROM tries WHERE name = ?", (name,)).fetchone() or (0,)
            if failed >= TRIES:
                (last,) = database.execute("SELECT last FROM tries WHERE name = ?", (name,)).fetchone()
                wait = max(1, round(last + LOCK_TIME - now))
                raise UserError(f"Too many wrong tries. '{name}' is locked for {wait} s.")
            if right:
                database.execute("DELETE FROM tries WHERE name = ?", (name,))
                return Account(known, role, rank, key)
            database.execute("INSERT OR REPLACE INTO tries VALUES (?, ?, ?)", (name, failed + 1, now))
        left = TRIES - failed - 1
        if left == 0:
            raise UserError(f"Wrong name or password. '{name}' is locked for {LOCK_TIME:.0f} s.")
        raise UserError(f"Wrong name or password. {left} {'try' if left == 1 else 'tries'} left.")

    @contextlib.contextmanager
    def _open(self) -> Iterator[sqlite3.Connection]:
        """Open the database in a transaction that is committed, also when a UserError ends it.

        Raises:
            UserError: The file cannot be used.
        """
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            os.close(os.open(self.path, os.O_RDWR | os.O_CREAT, 0o600))
            with contextlib.closing(sqlite3.connect(self.path, timeout=5.0)) as database:
                database.executescript(_SCHEMA)
                try:
                    yield database
                finally:
                    database.commit()
        except (OSError, sqlite3.Error) as error:
            raise UserError(
                f"The accounts in {self.path} can't be used: {error}. Name another file with TELEPRESENCE_USERS."
            ) from error


def main(argv: list[str] | None = None) -> int:
    """Run the command line and return its exit code."""
    arguments = _parse(argv)
    users = Users(arguments.file)
    try:
        if arguments.command == "list":
            for account in users.all():
                print(f"{account.name:<24} {account.role:<8} rank {account.rank}")
        elif arguments.command == "remove":
            users.remove(arguments.name)
        else:
            users.add(arguments.name, _ask_password(arguments.password_stdin), arguments.role, arguments.rank)
    except UserError as error:
        print(f"users: {error}", file=sys.stderr)
        return 1
    return 0


def _parse(argv: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m gui.users", description="Who may sign in to the window.")
    parser.add_argument("--file", type=Path, help="the accounts; default TELEPRESENCE_USERS or gui/users.db")
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
    return name


def _hash(password: str, salt: bytes) -> bytes:
    return hashlib.scrypt(password.encode("utf-8", "surrogatepass"), salt=salt, **_COST)
