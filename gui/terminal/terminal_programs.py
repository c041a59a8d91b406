"""What somebody has started in the window's terminal: programs that were stopped, and nodes that died and came back.

Only the processes tell: a plain roslaunch says in its terminal alone that a node of it died, and nobody says that one
was stopped.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

from gui.terminal.terminal_parts import children
from telepresence.station import vitals

STARTS_AGAIN, STAYS = "starts again", "stays stopped"
_NAME = "__name:="
"""Begins the word by which roslaunch tells a node its name."""
_INTERPRETERS = re.compile(r"python[\d.]*|bash|sh")


class Failure(NamedTuple):
    """What befell a program and what comes next, in the words of a fault."""

    what: str
    then: str


class TerminalPrograms:
    """The shells of a terminal and all that they run."""

    def __init__(self) -> None:
        self._waiting: dict[int, tuple[int, int]] = {}
        """Shell -> the job for which it waited when it was last seen: process id and when that began."""
        self._stopped: frozenset[int] = frozenset()
        self._nodes: dict[tuple[int, str], int] = {}
        """Who started a node, and its name -> the node's process id."""

    @property
    def running(self) -> bool:
        """Whether a program still runs for which a shell waited when that was last seen."""
        return any(vitals.start_time(pid) == began for pid, began in self._waiting.values())

    def poll(self, server: int) -> list[Failure]:
        """Return what has happened since the last look.

        Args:
            server: Process id of the tmux server, whose children are the shells.
        """
        shells = children(server)
        started = [(shell, child) for shell in shells for child in children(shell)]
        for _, program in started:  # it becomes longer meanwhile
            started += [(program, child) for child in children(program)]
        jobs = {shell: vitals.foreground(shell) for shell in shells if vitals.start_time(shell)}
        gone = {shell: job for shell, job in self._waiting.items() if shell not in jobs}
        waiting = {
            shell: (pid, began) for shell, pid in jobs.items() if pid != shell and (began := vitals.start_time(pid))
        }
        self._waiting = gone | waiting
        return [*self._newly_stopped([*shells, *(pid for _, pid in started)]), *self._born_again(started)]

    def _newly_stopped(self, programs: list[int]) -> list[Failure]:
        stopped = frozenset(pid for pid in programs if vitals.state(pid) == "T")
        found = [Failure(f"froze: {_name(pid)}", STAYS) for pid in sorted(stopped - self._stopped)]
        self._stopped = stopped
        return found

    def _born_again(self, started: list[tuple[int, int]]) -> list[Failure]:
        """Nodes that whoever had started them has started anew: one that ends with its roslaunch is no fault."""
        nodes = {(parent, name): pid for parent, pid in started if (name := _node_name(pid))}
        dead = [name for (parent, name), pid in nodes.items() if self._nodes.get((parent, name), pid) != pid]
        waiting = {key: pid for key, pid in self._nodes.items() if vitals.start_time(key[0])}
        self._nodes = waiting | nodes
        return [Failure(f"died: {name}", STARTS_AGAIN) for name in dead]


def _words(pid: int) -> list[str]:
    try:
        return Path(f"/proc/{pid}/cmdline").read_text(errors="replace").split("\0")
    except OSError:  # it has ended
        return []


def _node_name(pid: int) -> str:
    """Return the name that roslaunch has given a node; empty for any other program."""
    return next((word.removeprefix(_NAME) for word in _words(pid) if word.startswith(_NAME)), "")


def _name(pid: int) -> str:
    """Return what people call a program: the node's name, the script's, or its own."""
    words = [Path(word).name for word in _words(pid) if word and not word.startswith("-")]
    script = words[1:2] if words and _INTERPRETERS.fullmatch(words[0]) else []
    return _node_name(pid) or "".join(script or words[:1])
