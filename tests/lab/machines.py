"""Machines that are network namespaces, and wires between them. Needs root."""

from __future__ import annotations

import contextlib
import ctypes
import subprocess
from collections.abc import Iterator

from telepresence.station import processes

_CLONE_NEWNET = 0x40000000  # linux/sched.h


class Machine:
    """A network namespace."""

    def __init__(self) -> None:
        self.holder = processes.start(["unshare", "--net", "sh", "-c", "ip link set lo up; echo; exec sleep infinity"],
                                      stdout=subprocess.PIPE)  # fmt: skip
        self.holder.stdout.readline()

    def command(self, *argv: str) -> list[str]:
        return ["nsenter", f"--net=/proc/{self.holder.pid}/ns/net", *argv]

    def run(self, *argv: str, **options) -> str:
        answer = subprocess.run(self.command(*argv), capture_output=True, text=True, timeout=60, **options)
        return answer.stdout + answer.stderr

    @contextlib.contextmanager
    def entered(self) -> Iterator[None]:
        """Be on this machine, with this thread and whatever it starts."""
        with open("/proc/thread-self/ns/net") as outside:
            with open(f"/proc/{self.holder.pid}/ns/net") as inside:
                _enter(inside.fileno())
            try:
                yield
            finally:
                _enter(outside.fileno())

    def close(self) -> None:
        processes.end(self.holder)
        self.holder.stdout.close()


def connect(first: Machine, second: Machine, name: str, addresses: tuple[str, str], far_name: str = "") -> None:
    """Lay a wire; it has the same name at both ends, unless `far_name` says otherwise."""
    there = str(second.holder.pid)
    names = (name, far_name or name)
    wire = ("ip", "link", "add", name, "type", "veth", "peer", "name", names[1], "netns", there)
    subprocess.run(first.command(*wire), check=True, timeout=10)
    for machine, end, address in zip((first, second), names, addresses, strict=True):
        subprocess.run(machine.command("ip", "addr", "add", f"{address}/24", "dev", end), check=True, timeout=10)
        subprocess.run(machine.command("ip", "link", "set", end, "up"), check=True, timeout=10)


def _enter(descriptor: int) -> None:
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.setns(descriptor, _CLONE_NEWNET):
        raise OSError(ctypes.get_errno(), "setns")
