"""Whether the station of this machine works, for a container's healthcheck: `python3 -m telepresence.station.health`.

Exit code 0 when the ROS master answers, every driver has its robot, and the pilot's page answers; else 1, and a line
that says what is wrong. What is to be there stands in the station's folder (`note`). Standard library only, and another
program than those that it judges: it reads `drive_state` as any ROS node does, over TCPROS.
"""

from __future__ import annotations

import contextlib
import http.client
import json
import os
import socket
import ssl
import struct
import sys
import tempfile
import time
import urllib.request
import xmlrpc.client
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from telepresence.station import station_folder
from telepresence.station.fault_sentences import UNREACHABLE
from telepresence.station.ros_master import master_answers, master_proxy

NOTE = "expected"
"""File in the station's folder."""
PATIENCE = 1.0
"""[s] for each answer."""
LARGEST = 64 * 1024
"""[bytes] of a header or a message."""
NAME = "/station_health"


class Unhealthy(RuntimeError):
    """Something of the station does not work; the text says what."""


def note(folder: Path, master_uri: str, page: str, robots: int) -> None:
    """Write down what is to be there.

    Args:
        folder: The station's.
        page: Of the pilot's page: https://…, or unix:FILE; empty for none.
        robots: How many have a driver.
    """
    text = json.dumps({"master": master_uri, "page": page, "robots": robots})
    with contextlib.suppress(OSError):  # a full disk: the check says that the station is not up
        (folder / NOTE).write_text(text, encoding="utf-8")


def check(folder: Path) -> None:
    """Look at everything once.

    Args:
        folder: The station's.
    Raises:
        Unhealthy: The first thing that does not work.
    """
    try:
        expected = json.loads((folder / NOTE).read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise Unhealthy("the station is not up yet") from None
    uri = expected["master"]
    if not master_answers(uri, timeout=PATIENCE):
        raise Unhealthy(f"the ROS master does not answer at {uri}")
    states = dict(drive_states(uri))
    if len(states) < expected["robots"]:
        raise Unhealthy(f"{expected['robots'] - len(states)} of {expected['robots']} drivers do not run")
    for topic, state in states.items():
        if state.startswith(UNREACHABLE):
            raise Unhealthy(f"{topic}: {state}")
    if expected["page"]:
        require_page(expected["page"])


def drive_states(uri: str) -> Iterator[tuple[str, str]]:
    """Yield each topic `drive_state` and what its driver says there.

    Raises:
        Unhealthy: A driver does not answer.
    """
    try:
        master: Any = master_proxy(uri, timeout=PATIENCE)
        publishers = master.getSystemState(NAME)[2][0]
        for topic, nodes in publishers:
            if topic.rpartition("/")[2] == "drive_state":
                yield topic, latched_string(topic, master.lookupNode(NAME, nodes[0])[2])
    except (OSError, http.client.HTTPException, xmlrpc.client.Error) as error:
        raise Unhealthy(f"a driver does not answer: {error}") from None


def latched_string(topic: str, node: str) -> str:
    """Return the newest message of a latched topic of strings.

    Args:
        node: XML-RPC address of the node that publishes it.
    Raises:
        OSError: It does not answer.
    """
    slave: Any = master_proxy(node, timeout=PATIENCE)
    _, _, (_, host, port) = slave.requestTopic(NAME, topic, [["TCPROS"]])
    fields = [f"callerid={NAME}", f"topic={topic}", "md5sum=*", "type=*"]
    header = b"".join(struct.pack("<I", len(field)) + field.encode() for field in fields)
    with socket.create_connection((host, port), timeout=PATIENCE) as connection:
        connection.settimeout(PATIENCE)
        connection.sendall(struct.pack("<I", len(header)) + header)
        _block(connection)
        return _block(connection)[4:].decode(errors="replace")


def _block(connection: socket.socket) -> bytes:
    (length,) = struct.unpack("<I", _exactly(connection, 4))
    if length > LARGEST:
        raise OSError(f"{length} bytes announced")
    return _exactly(connection, length)


def _exactly(connection: socket.socket, count: int) -> bytes:
    deadline, read = time.monotonic() + PATIENCE, b""
    while len(read) < count:
        part = connection.recv(count - len(read))
        if not part or time.monotonic() > deadline:
            raise OSError("no message")
        read += part
    return read


def require_page(url: str) -> None:
    """Raise Unhealthy when the pilot's page does not answer.

    Args:
        url: https://…, or unix:FILE.
    """
    try:
        if url.startswith("unix:"):
            ask_by_socket(url.removeprefix("unix:"))
        else:
            ask_by_https(url)
    except (OSError, http.client.HTTPException) as error:
        place = urlsplit(url).netloc or url
        raise Unhealthy(f"the pilot's page does not answer at {place}: {error}") from None


def ask_by_https(url: str) -> None:
    """Get a page. Raises OSError."""
    context = ssl.create_default_context()
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE  # its own certificate; nothing secret is sent
    urllib.request.urlopen(url, timeout=PATIENCE, context=context).close()


def ask_by_socket(path: str) -> None:
    """Get the page of a server that listens at a unix socket. Raises OSError, HTTPException."""
    connection = http.client.HTTPConnection("localhost", timeout=PATIENCE)
    with socket.socket(socket.AF_UNIX) as connection.sock:
        connection.sock.settimeout(PATIENCE)
        connection.sock.connect(path)
        connection.request("GET", "/")
        status = connection.getresponse().status
    if status != http.HTTPStatus.OK:
        raise OSError(f"status {status}")


def station_of(folder: Path) -> Path:
    """Return the folder of the station that this user runs, of those in `folder`.

    Raises:
        Unhealthy: None or several.
    """
    found = [each for each in folder.glob(f"{station_folder.PREFIX}*") if each.stat().st_uid == os.geteuid()]
    if len(found) != 1:
        raise Unhealthy(f"{len(found)} stations run here")
    return found[0]


def main() -> int:
    """Look once; return the exit code."""
    try:
        check(station_of(Path(tempfile.gettempdir())))
    except Unhealthy as error:
        print(error)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
