"""Where com_cam leaves a note of the page that it keeps on a robot's tablet, for other programs of the same person.

`main.py` finds the page by it, key included, and at its end leaves on the tablet what com_cam goes on showing. The note
is a file in ROS_HOME that only its owner can read, because the address may hold the key; the ROS graph would show it to
everybody.
"""

from __future__ import annotations

import contextlib
import json
import os
import socket
from dataclasses import asdict, dataclass
from pathlib import Path

from naoqi_driver.connection import Address

from telepresence.security import private_files
from telepresence_1.network import host_of


@dataclass(frozen=True)
class PageRecord:
    """What com_cam does with one robot's tablet.

    Args:
        url: The page as the tablet must ask for it, with its key.
        shown: Whether com_cam keeps it on the tablet.
        pid: The process that serves it.
    """

    url: str
    shown: bool
    pid: int

    def write(self, robot: Address) -> None:
        """Leave the note; it replaces an older one.

        Raises:
            OSError: The file cannot be written.
        """
        path = _path(robot)
        if not path.parent.exists():
            private_files.make_folder(path.parent)
        private_files.write(path, json.dumps(asdict(self)).encode())


def read_record(robot: Address) -> PageRecord | None:
    """Return the note for this robot; None if there is none, or its com_cam has ended."""
    try:
        record = PageRecord(**json.loads(private_files.read(_path(robot))))
        os.kill(record.pid, 0)
    except (OSError, ValueError, TypeError):  # none, half of one, one of another version, or its process is gone
        return None
    return record


def remove_record(robot: Address) -> None:
    """Remove the note, if it is this process's."""
    record = read_record(robot)
    if record is not None and record.pid == os.getpid():
        _path(robot).unlink(missing_ok=True)


def _path(robot: Address) -> Path:
    """The file for one robot, whichever of its names was used."""
    host, port = host_of(robot.url), robot.url.rpartition(":")[2]
    with contextlib.suppress(OSError):  # an unknown name stands for itself
        host = socket.gethostbyname(host)
    folder = Path(os.environ.get("ROS_HOME") or "~/.ros").expanduser()
    return folder / f"com_cam_{host}_{port}.json"
