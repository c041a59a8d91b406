#!/usr/bin/env python3
"""Checks network, packages, disk and clock of a robot's own computer; to be copied there and run there.

    scp telepresence/station/robot_computer.py robotino@ROBOT:   and there:   python3 robot_computer.py [NAME]

NAME is looked up to test the name servers: one of your site where there is no internet. One file without dependencies;
Python 3.6 is enough, because a robot's system is as old as the robot.
"""

import shutil
import socket
import struct
import subprocess
import sys
from pathlib import Path

HELD = ("rec-rpc", "robotino", "rto", "librealsense", "realsense")
"""How the names of packages begin that an upgrade must leave: the vendor's own, which only the vendor's servers have,
and the RealSense camera's, whose newer versions its daemons do not load."""
LEAST_SPACE = 1 << 30
"""[bytes]"""
EXAMPLE_HOST = "example.org"
"""Looked up when no other name is given: it always exists (RFC 2606)."""


def main():
    host = sys.argv[1] if len(sys.argv) > 1 else EXAMPLE_HOST
    well = True
    for findings in (gateway(), name_servers(host=host), held_packages(), disk(), clock()):
        for fine, what, remedy in findings:
            print(("  ✓ " if fine else "  x ") + what + ("" if fine else "\n      -> " + remedy))
            well = well and fine
    print("\nBefore any change: an image of the whole disk on a USB disk, restored once to try it (docs/remote.md).")
    return 0 if well else 1


def gateway(route=Path("/proc/net/route")):
    """Check the default route: packages, names and the clock need it; driving does not."""
    found = None
    for line in route.read_text().splitlines()[1:]:
        words = line.split()
        if words[1] == "00000000" and int(words[3], 16) & 2:  # destination 0.0.0.0, flag "gateway"
            found = socket.inet_ntoa(struct.pack("<L", int(words[2], 16))), words[0]
    what = "default gateway: " + (" on ".join(found) if found else "none")
    yield found is not None, what, "sudo ip route add default via ADDRESS-OF-YOUR-ROUTER, and in netplan for good"


def name_servers(resolver=Path("/etc/resolv.conf"), host=EXAMPLE_HOST):
    """Check that name servers are set and that they know `host`."""
    try:
        lines = resolver.read_text().splitlines()
    except OSError:
        lines = []
    servers = [line.split()[1] for line in lines if line.startswith("nameserver") and len(line.split()) > 1]
    yield (
        bool(servers),
        "name servers: " + (", ".join(servers) or "none"),
        "write 'nameserver 9.9.9.9' (or your site's own) into /etc/resolv.conf, or set DNS in netplan",
    )
    if servers:
        try:
            socket.getaddrinfo(host, 80)
            resolves = True
        except OSError:
            resolves = False
        yield (
            resolves,
            f"the name {host} is known",
            f"no name server answers: check the gateway, then  ping {servers[0]}",
        )


def held_packages(status=None):
    """Check that the vendor's packages, and those they depend on, are held: an upgrade leaves them as they are."""
    if status is None:
        status = _output("dpkg-query", "-W", "-f", "${Package} ${db:Status-Want}\n")
    packages = [line.split() for line in status.splitlines() if line.startswith(HELD)]
    loose = sorted(name for name, want in packages if want != "hold")
    if packages:
        yield (
            not loose,
            f"{len(packages) - len(loose)} of {len(packages)} packages that the robot's own programs need are held",
            "an apt upgrade breaks the robot:  sudo apt-mark hold " + " ".join(loose),
        )


def disk(free=None):
    """Check the space for logs: a full disk stops the robot's own services."""
    free = shutil.disk_usage("/").free if free is None else free
    yield free >= LEAST_SPACE, f"{free / 1e9:.1f} GB free on /", "make room:  sudo journalctl --vacuum-size=100M"


def clock(answer=None):
    """Check that the clock is synchronised: pictures and commands carry times."""
    if answer is None:
        answer = _output("timedatectl", "show", "-p", "NTPSynchronized", "--value")
    yield (
        answer.strip() == "yes",
        "clock synchronised",
        "sudo timedatectl set-ntp true; in a network without internet name the pilot's machine in "
        "/etc/systemd/timesyncd.conf",
    )


def _output(*argv):
    """Return what a program prints; nothing when it is not installed."""
    if shutil.which(argv[0]) is None:
        return ""
    found = subprocess.run(argv, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    return found.stdout.decode(errors="replace")


if __name__ == "__main__":
    sys.exit(main())
