"""The table of sockets in docs/security.md, compared with what the programs of a station listen on.

A row of the table:  | `program` ... | protocol port (`argument`) | where | modes | who may | what for |
    program   as `program_of` names it, or "every ROS node"
    port      a number with the argument that chooses another one, or "given by Linux"
    where     loopback, or ROS_IP in the mode VPN
    modes     the stations in which it must be seen
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from telepresence.station import processes
from telepresence.station.listening_sockets import Listening, inodes_of, listening

PAGE = Path(__file__).resolve().parents[2] / "docs" / "security.md"
NODES = "every ROS node"
SOCKETS_OF_A_NODE = 2
"""TCP: its XML-RPC server and its TCPROS server."""
PROGRAM_FOLDER = "catkin_ws/devel/lib/"


@dataclass(frozen=True)
class Row:
    """A row; `port` 0 is given by Linux, `argument` is empty where none chooses the port."""

    programs: frozenset[str]
    protocol: str
    port: int
    argument: str
    modes: frozenset[str]

    def fits(self, program: str, is_node: bool, found: Listening, ports: Mapping[str, int]) -> bool:
        named = program in self.programs or (NODES in self.programs and is_node)
        port = ports.get(self.argument, self.port)
        return named and found.protocol == self.protocol and (found.port == port if port else True)


def rows() -> list[Row]:
    """Read the table."""
    text = PAGE.read_text().partition("<!-- sockets -->")[2].partition("<!-- end of sockets -->")[0]
    found = []
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if len(cells) != 6 or cells[0] in ("program", "") or set(cells[0]) <= {"-", ":"}:
            continue
        programs = set(re.findall(r"`([^`]+)`", cells[0])) | ({NODES} if NODES in cells[0] else set())
        match = re.fullmatch(r"(tcp|udp) (\d+|given by Linux)(?: \(`(\w+)`\))?", cells[1])
        assert match, f"{PAGE.name}: {cells[1]!r} names no port"
        port = int(match[2]) if match[2].isdigit() else 0
        modes = frozenset(re.findall(r"pepper|robotino|both|VPN", cells[3]))
        found.append(Row(frozenset(programs), match[1], port, match[3] or "", modes))
    assert found, f"{PAGE.name} has no table of sockets"
    return found


def program_of(pid: int) -> tuple[str, bool]:
    """Return the name of a process's program, with the first word after it if that names a part, and whether it is
    one of ROS's nodes."""
    # A node that roslaunch has forked shows its words as one.
    words = Path(f"/proc/{pid}/cmdline").read_bytes().decode().replace("\0", " ").split()
    if "python" in Path(words[0]).name and len(words) > 1:
        words = words[words.index("-m") + 1 :] if words[1] in ("-m", "-P") else words[1:]
    path, rest = words[0], words[1:]
    name = Path(path).name
    if name == "robotino_onboard":
        return f"{name} {rest[0]}", False
    return name, PROGRAM_FOLDER in path or name == "telepresence_ros.rosout"


def listening_of(pids: Iterable[int]) -> dict[int, list[Listening]]:
    """Return the listening sockets of each of these processes that has one; those of others' processes are not seen."""
    namespaces: dict[str, dict[int, Listening]] = {}
    found = {}
    for pid in pids:
        try:
            namespace = os.readlink(f"/proc/{pid}/ns/net")
            if namespace not in namespaces:
                namespaces[namespace] = listening(pid)
            own = inodes_of(pid)
        except OSError:
            continue  # it ended meanwhile, or is somebody else's
        every = namespaces[namespace]
        sockets = sorted(every[inode] for inode in own if inode in every)
        if sockets:
            found[pid] = sockets
    return found


def agrees(roots: Iterable[int], mode: str, ports: Mapping[str, int], own: str = "127.0.0.1") -> bool:
    """Whether `compare` finds nothing; what it finds is printed."""
    different = compare(roots, mode, ports, own)
    print("sockets:", *different, sep="\n  ")
    return not different


def compare(roots: Iterable[int], mode: str, ports: Mapping[str, int], own: str = "127.0.0.1") -> list[str]:
    """Compare what these processes and their descendants listen on with the rows of a mode.

    Args:
        ports: Argument -> port, where it is not the usual one.
        own: ROS_IP.
    Returns:
        What differs: sockets that no row has, rows of which no socket was seen.
    """
    table, seen, wrong = rows(), set(), []
    pids = [pid for root in roots for pid in (root, *processes.descendants(root))]
    for pid, sockets in listening_of(pids).items():
        program, is_node = program_of(pid)
        given = 0
        for found in sockets:
            fitting = [row for row in table if mode in row.modes and row.fits(program, is_node, found, ports)]
            exact = [row for row in fitting if row.port] or fitting
            seen.update(exact[:1])
            given += bool(exact) and NODES in exact[0].programs
            if not exact or given > SOCKETS_OF_A_NODE:
                wrong.append(f"{program} listens on {found.protocol} {found.address}:{found.port}, not in the table")
            elif found.address not in ("127.0.0.1", own):
                wrong.append(f"{program} listens on {found.address}, port {found.port}")
    missing = [row for row in table if mode in row.modes and row not in seen]
    return wrong + [f"nothing listens as in the row of {sorted(row.programs)}, {row.protocol}" for row in missing]
