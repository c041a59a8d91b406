"""Machines that are far apart: network namespaces joined by a link with delay, loss and cuts.

The link is ours, because not every kernel has `tc netem`: every namespace gets a TUN device, and one thread carries the
packets between them. Needs root, as namespaces and TUN devices do.
"""

from __future__ import annotations

import ctypes
import fcntl
import heapq
import os
import random
import select
import socket
import struct
import subprocess
import threading
import time
from pathlib import Path

from telepresence.station import processes

MASTER = "10.77.0.1"
MTU = 1500
_CLONE_NEWNET = 0x40000000  # linux/sched.h
_TUNSETIFF, _IFF_TUN, _IFF_NO_PI = 0x400454CA, 0x0001, 0x1000  # linux/if_tun.h


class FarMachine:
    """One namespace with its own address."""

    def __init__(self, address: str) -> None:
        self.address = address
        self._holder = processes.start(["unshare", "--net", "sleep", "infinity"], tied=True)
        self.namespace = f"/proc/{self._holder.pid}/ns/net"
        ours = os.readlink("/proc/self/ns/net")
        deadline = time.monotonic() + 10.0
        while os.readlink(self.namespace) == ours:
            assert time.monotonic() < deadline and self._holder.poll() is None, "no network namespace; is this root?"
            time.sleep(0.01)
        self.tun = self._open_tun()
        for words in ("link set lo up", f"addr add {address}/24 dev tun0", f"link set tun0 mtu {MTU} up"):
            subprocess.run(self.command("ip", *words.split()), check=True, timeout=10.0)

    def command(self, *argv: str) -> list[str]:
        """The words that run a program on this machine."""
        return ["nsenter", f"--net={self.namespace}", *argv]

    def start(self, *argv: str, environment: dict[str, str], log: Path) -> subprocess.Popen:
        """Run a program there until it is ended; ROS finds its master on the first machine.

        Args:
            environment: As after `. ./env.sh`.
            log: File for what it prints.
        """
        network = {"ROS_MASTER_URI": f"http://{MASTER}:11311", "ROS_IP": self.address, "PYTHONUNBUFFERED": "1"}
        with log.open("w") as output:
            return processes.start(
                self.command(*argv),
                env={**environment, **network, "ROS_HOME": str(log.parent)},
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
            )

    def close(self) -> None:
        os.close(self.tun)
        processes.end(self._holder)

    def _open_tun(self) -> int:
        """A thread may enter a namespace without its process; the file that it opens there works everywhere."""
        opened: list[int | OSError] = []

        def open_there() -> None:
            libc = ctypes.CDLL(None, use_errno=True)
            try:
                with open(self.namespace) as namespace:
                    if libc.setns(namespace.fileno(), _CLONE_NEWNET):
                        raise OSError(ctypes.get_errno(), "setns")
                tun = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
                fcntl.ioctl(tun, _TUNSETIFF, struct.pack("16sH22x", b"tun0", _IFF_TUN | _IFF_NO_PI))
                opened.append(tun)
            except OSError as error:
                opened.append(error)

        thread = threading.Thread(target=open_there)
        thread.start()
        thread.join()
        if isinstance(opened[0], OSError):
            raise opened[0]
        return opened[0]


class FarNetwork:
    """Machines with the addresses 10.77.0.1, 10.77.0.2, ... and the link between them.

    `delay` and `jitter` are one way [s], `loss` is the share of packets lost; `cut` loses all, `stalled` keeps
    all until it is over, and then they arrive at once, in order. `carried` counts the bytes that each machine
    has sent, headers included.
    """

    def __init__(self, count: int, seed: int = 0) -> None:
        self.delay = self.jitter = self.loss = 0.0
        self.cut = self.stalled = False
        self.machines = [FarMachine(f"10.77.0.{i + 1}") for i in range(count)]
        self.carried = dict.fromkeys((machine.address for machine in self.machines), 0)
        self._rng = random.Random(seed)
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._carry, name="far-network", daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._closing.set()
        self._thread.join(timeout=5.0)
        for machine in self.machines:
            machine.close()

    def _carry(self) -> None:
        by_address = {socket.inet_aton(machine.address): machine.tun for machine in self.machines}
        waiting: list[tuple[float, int, int, bytes]] = []
        count = 0
        while not self._closing.is_set():
            timeout = min(0.1, max(0.0, waiting[0][0] - time.monotonic())) if waiting and not self.stalled else 0.02
            for tun in select.select(list(by_address.values()), [], [], timeout)[0]:
                packet = os.read(tun, 65536)
                target = by_address.get(packet[16:20]) if packet[0] >> 4 == 4 else None
                if target is None or self.cut or self._rng.random() < self.loss or not self._takes(packet, target):
                    continue
                self.carried[socket.inet_ntoa(packet[12:16])] += len(packet)
                count += 1
                due = time.monotonic() + max(0.0, self.delay + self._rng.uniform(-self.jitter, self.jitter))
                heapq.heappush(waiting, (due, count, target, packet))
            while waiting and waiting[0][0] <= time.monotonic() and not self.stalled:
                _, _, target, packet = heapq.heappop(waiting)
                if not self.cut:
                    os.write(target, packet)

    def _takes(self, packet: bytes, target: int) -> bool:
        """Whether the link carries this packet; for links with further faults."""
        return True
