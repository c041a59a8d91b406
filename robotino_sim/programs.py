"""Robotino View programs on the robot: a list that clients can fill, rename, start and empty.

The simulated robot doesn't execute them. Source of names and meanings: restapid's ProgramHandler.cpp (mirror
BusHero/robotino_api2), whose program list has id, name, old, suffix and action ("running" or "stopped"). Of
uploadProgram only the contents are published: name, raw size, base64 data; here they are called name, size and data.
"""

from __future__ import annotations

import base64
import binascii
import threading
from typing import Any

from telepresence.web.json_app import BadRequest, member, number, text

MAX_PROGRAMS = 100


class Programs:
    """Any thread may use it."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._files: dict[tuple[str, str], bytes] = {}
        self._running: tuple[str, str] | None = None

    def listing(self) -> list[dict[str, Any]]:
        """As the web page shows it, numbered from 1."""
        with self._lock:
            return [
                {
                    "id": number,
                    "name": name,
                    "old": name,
                    "suffix": suffix,
                    "action": "running" if (name, suffix) == self._running else "stopped",
                }
                for number, (name, suffix) in enumerate(sorted(self._files), start=1)
            ]

    def read(self, file_name: str) -> bytes | None:
        """The program called `name.suffix`, or None."""
        with self._lock:
            return self._files.get(_split(file_name))

    def upload(self, body: Any) -> None:
        """Store {"name": "file.rvwx", "size": bytes, "data": base64}.

        Raises:
            BadRequest: A member is missing or wrong, or there are too many programs.
        """
        meaning = "name, size and data of a program"
        file_name = text(member(body, "name", meaning), meaning)
        size = number(member(body, "size", meaning), meaning)
        try:
            data = base64.b64decode(text(member(body, "data", meaning), meaning), validate=True)
        except (binascii.Error, ValueError) as error:
            raise BadRequest(f"the program's data is not base64: {error}") from None
        if len(data) != size:
            raise BadRequest(f"the program was announced with {size:.0f} bytes and has {len(data)}")
        if "/" in file_name:
            raise BadRequest(f"a program's name is a plain file name, got {file_name!r}")
        with self._lock:
            if _split(file_name) not in self._files and len(self._files) >= MAX_PROGRAMS:
                raise BadRequest(f"there are {MAX_PROGRAMS} programs already; remove one")
            self._files[_split(file_name)] = data

    def start_or_stop(self, body: Any) -> None:
        """Stop the program {"name", "suffix"} if it runs, else let it be the one that runs."""
        key = _key(body)
        with self._lock:
            self._require(key)
            self._running = None if self._running == key else key

    def remove(self, body: Any) -> None:
        """Remove the program {"name", "suffix"}."""
        key = _key(body)
        with self._lock:
            self._require(key)
            del self._files[key]
            if self._running == key:
                self._running = None

    def rename(self, body: Any) -> None:
        """Rename every entry {"old", "name", "suffix"} of an array whose two names differ."""
        if not isinstance(body, list):
            raise BadRequest("expected an array of programs with old, name and suffix")
        changes = []
        for entry in body:
            old = text(member(entry, "old", "a program's old name"), "a program's old name")
            changes.append(((old, _key(entry)[1]), _key(entry)))
        with self._lock:
            for old_key, new_key in changes:
                self._require(old_key)
                if old_key != new_key and new_key in self._files:
                    raise BadRequest(f"there is a program {'.'.join(new_key)!r} already")
            for old_key, new_key in changes:
                self._files[new_key] = self._files.pop(old_key)
                if self._running == old_key:
                    self._running = new_key

    def _require(self, key: tuple[str, str]) -> None:
        if key not in self._files:
            raise BadRequest(f"there is no program {'.'.join(key)!r}")


def _key(body: Any) -> tuple[str, str]:
    meaning = "name and suffix of a program"
    return text(member(body, "name", meaning), meaning), text(member(body, "suffix", meaning), meaning)


def _split(file_name: str) -> tuple[str, str]:
    name, _, suffix = file_name.partition(".")
    return name, suffix
