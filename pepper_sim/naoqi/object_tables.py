"""The attributes of ALWorldRepresentation's objects: one table for each attribute of a category.

Clients ask with SQL conditions, so the tables are SQLite's, in RAM; what a client wrote only ever stands in a SELECT
that can read nothing else, and that is ended when it takes too long.
"""

from __future__ import annotations

import sqlite3
import threading
from collections.abc import Iterable, Sequence
from typing import Any

from pepper_sim.naoqi.service import ServiceError, shown

_LONGEST_QUERY = 20_000_000
"""Steps of SQLite's machine, about a second."""
_MOST_ROWS = 100_000
_READING = {sqlite3.SQLITE_SELECT, sqlite3.SQLITE_READ, sqlite3.SQLITE_FUNCTION}
OBJECT = "ObjectName"
"""The column that every table has beside the attribute's fields."""


class ObjectTables:
    """Values of attributes, newest last."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._base = sqlite3.connect(":memory:", check_same_thread=False, isolation_level=None)
        self._fields: dict[tuple[str, str], list[tuple[str, str]]] = {}

    def close(self) -> None:
        """Free the RAM."""
        with self._lock:
            self._base.close()

    def attributes(self, category: str) -> dict[str, list[tuple[str, str]]]:
        """Return name and type of the fields of each attribute of a category."""
        with self._lock:
            return {name: fields for (owner, name), fields in self._fields.items() if owner == category}

    def add(self, category: str, attribute: str, fields: Sequence[tuple[str, str]]) -> bool:
        """Make a table; false if there is one already."""
        with self._lock:
            if (category, attribute) in self._fields:
                return False
            columns = ", ".join(map(_quoted, (OBJECT, *(name for name, _ in fields))))
            try:
                self._base.execute(f"CREATE TABLE {_table(category, attribute)} ({columns})")
            except sqlite3.Error as error:
                raise ServiceError(f"these fields cannot be stored: {error}") from None
            self._fields[category, attribute] = list(fields)
        return True

    def remove_category(self, category: str) -> None:
        """Remove all tables of a category."""
        with self._lock:
            for owner, attribute in [key for key in self._fields if key[0] == category]:
                self._base.execute(f"DROP TABLE {_table(owner, attribute)}")
                del self._fields[owner, attribute]

    def remove_object(self, category: str, name: str) -> None:
        """Remove an object's values."""
        for attribute in self.attributes(category):
            with self._lock:
                self._base.execute(f"DELETE FROM {_table(category, attribute)} WHERE {_quoted(OBJECT)} = ?", (name,))

    def store(self, category: str, attribute: str, name: str, values: dict[str, Any]) -> bool:
        """Add an object's values of an attribute; false if the attribute or one of the fields is unknown."""
        with self._lock:
            fields = self._fields.get((category, attribute))
            if fields is None or not set(values) <= {field for field, _ in fields}:
                return False
            row = [name, *(values.get(field) for field, _ in fields)]
            table = _table(category, attribute)
            if self._base.execute(f"SELECT count(*) FROM {table}").fetchone()[0] >= _MOST_ROWS:
                raise ServiceError(f"there are {_MOST_ROWS} values already")
            try:
                self._base.execute(f"INSERT INTO {table} VALUES ({', '.join('?' * len(row))})", row)
            except sqlite3.Error as error:
                raise ServiceError(f"these values cannot be stored: {error}") from None
        return True

    def latest(self, category: str, attribute: str, name: str, count: int) -> list[list]:
        """Return an object's newest values of an attribute, the newest first."""
        with self._lock:
            fields = [_quoted(field) for field, _ in self._fields.get((category, attribute), ())]
            if not fields:
                return []
            rows = self._base.execute(
                f"SELECT {', '.join(fields)} FROM {_table(category, attribute)} WHERE {_quoted(OBJECT)} = ?"
                " ORDER BY rowid DESC LIMIT ?",
                (name, max(0, count)),
            )
            return [list(row) for row in rows]

    def select(self, category: str, attribute: str, criterion: str, fields: str = "*", order: str = "") -> list[list]:
        """Return the values that match a client's condition.

        Raises: ServiceError: There is no such attribute or field, or the condition is invalid.
        """
        known = self._known(category, attribute)
        wanted = known if fields.strip() == "*" else [field.strip() for field in fields.split(",")]
        _check(wanted, known)
        field, _, direction = order.strip().partition(" ")
        if order.strip():
            _check([field], known)
            if direction.strip().upper() not in ("", "ASC", "DESC"):
                raise ServiceError(f"orderBy must be 'field ASC' or 'field DESC', got {shown(order)}")
        end = f" ORDER BY {_quoted(field)} {direction}" if order.strip() else ""
        columns = ", ".join(map(_quoted, wanted))
        return self._ask(f"SELECT {columns} FROM {_table(category, attribute)}{_where(criterion)}{end}")

    def rows(self, category: str, attribute: str, name: str, criterion: str) -> list[int]:
        """Return the numbers of an object's rows that match a client's condition; raises as `select`."""
        self._known(category, attribute)
        place = f"{_where(criterion) or ' WHERE (1)'} AND {_quoted(OBJECT)} = ?"
        return [row[0] for row in self._ask(f"SELECT rowid FROM {_table(category, attribute)}{place}", (name,))]

    def remove_rows(self, category: str, attribute: str, rows: Iterable[int]) -> None:
        """Remove rows by number."""
        with self._lock:
            self._base.executemany(
                f"DELETE FROM {_table(category, attribute)} WHERE rowid = ?", [(row,) for row in rows]
            )

    def change_rows(self, category: str, attribute: str, rows: Iterable[int], values: dict[str, Any]) -> None:
        """Change fields of rows by number; raises as `select`."""
        _check(values, self._known(category, attribute))
        changes = ", ".join(f"{_quoted(field)} = ?" for field in values)
        with self._lock:
            self._base.executemany(
                f"UPDATE {_table(category, attribute)} SET {changes} WHERE rowid = ?",
                [(*values.values(), row) for row in rows],
            )

    def all(self, category: str, attribute: str) -> list[list]:
        """Return all rows, each with its object's name first."""
        with self._lock:
            return [list(row) for row in self._base.execute(f"SELECT * FROM {_table(category, attribute)}")]

    def _known(self, category: str, attribute: str) -> list[str]:
        with self._lock:
            fields = self._fields.get((category, attribute))
        if fields is None:
            raise ServiceError(f"category {shown(category)} has no attribute {shown(attribute)}")
        return [field for field, _ in fields]

    def _ask(self, query: str, values: tuple = ()) -> list[list]:
        """Run a query that holds words of a client."""
        with self._lock:
            self._base.set_authorizer(
                lambda action, *_: sqlite3.SQLITE_OK if action in _READING else sqlite3.SQLITE_DENY
            )
            self._base.set_progress_handler(lambda: 1, _LONGEST_QUERY)
            try:
                return [list(row) for row in self._base.execute(query, values)]
            except (sqlite3.Error, sqlite3.Warning) as error:
                raise ServiceError(f"the criterion cannot be used: {error}") from None
            finally:
                self._base.set_authorizer(None)
                self._base.set_progress_handler(None, 0)


def _where(criterion: str) -> str:
    return f" WHERE ({criterion})" if criterion.strip() else ""


def _check(wanted: Iterable[str], known: Sequence[str]) -> None:
    for field in wanted:
        if field not in known:
            raise ServiceError(f"there is no field {shown(field)}")


def _table(category: str, attribute: str) -> str:
    return _quoted(f"{category}/{attribute}")


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"'
