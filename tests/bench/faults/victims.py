"""The processes of a running station, as people call them, from the process tree alone."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from telepresence.station import processes


def victims(root: int) -> dict[str, int]:
    """Return name -> process id of a process and all its descendants, in the order in which they were started.

    A node has its full ROS name, `python -m` the name of the module, anything else that of its program; several that
    are called the same are name, name#2, ...
    """
    found: dict[str, int] = {}
    for pid in sorted({root, *processes.descendants(root)}, key=_started):
        words = _words(pid)
        if not words:
            continue
        name = process_name(words, _environment(pid))
        number = 1 + sum(other.partition("#")[0] == name for other in found)
        found[name if number == 1 else f"{name}#{number}"] = pid
    return found


def process_name(words: Iterable[str], environment: dict[str, str]) -> str:
    """Return what to call the process with this command line."""
    argv = list(words)
    remapped = dict(word.split(":=", 1) for word in argv if word.startswith("__") and ":=" in word)
    if "__name" in remapped:
        namespace = remapped.get("__ns", environment.get("ROS_NAMESPACE", "")).strip("/")
        return "/" + "/".join(filter(None, (namespace, remapped["__name"])))
    if Path(argv[0]).name.startswith("python"):
        rest = argv[1:]
        while rest and rest[0].startswith("-") and rest[0] not in ("-m", "-c"):
            rest = rest[1:]
        if rest[:1] == ["-m"]:
            return rest[1]
        if rest and rest[0] != "-c":
            return Path(rest[0]).name
    return Path(argv[0]).name.split(":")[0]  # tmux writes its state there


def frozen(pid: int) -> bool:
    """Whether the process is stopped by a signal."""
    return _stat(pid)[:1] in (["T"], ["t"])


def alive(pid: int) -> bool:
    return _stat(pid)[:1] not in ([], ["Z"])


def _started(pid: int) -> tuple[int, int]:
    stat = _stat(pid)
    return (int(stat[19]) if stat else 0, pid)  # field 22 of proc(5), counted from the state


def _stat(pid: int) -> list[str]:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return []


def _words(pid: int) -> list[str]:
    try:
        words = [os.fsdecode(word) for word in Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0") if word]
    except OSError:
        return []
    return words[0].split() if len(words) == 1 else words  # a node that roslaunch has forked shows its words as one


def _environment(pid: int) -> dict[str, str]:
    try:
        words = Path(f"/proc/{pid}/environ").read_bytes().split(b"\0")
    except OSError:
        return {}
    return dict(os.fsdecode(word).split("=", 1) for word in words if b"=" in word)
