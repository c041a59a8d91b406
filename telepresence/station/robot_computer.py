#!/usr/bin/env python3
"""What a robot's own computer needs from its network and its packages, checked on that computer.

    scp telepresence/station/robot_computer.py robotino@ROBOT:   and there:   python3 robot_system.py

One file without dependencies; Python 3.6 is enough, because a robot's system is as old as the robot.
"""

import shutil
import socket
import struct
import subprocess
import sys
from pathlib import Path

HELD = ("rec-rpc", "robotino", "rto")
"""How the maker's packages begin; an upgrade of the rest must not touch what only the maker's servers have."""
LEAST_SPACE = 1 << 30
EXAMPLE_HOST = "deb.debian.org"


def main():
    well = True
    for check in (gateway, name_servers, held_packages, disk, clock):
        for fine, what, cure in check():
            print(("  ✓ " if fine else "  x ") + what + ("" if fine else "\n      -> " + cure))
            well = well and fine
    print("\nBefore any change: an image of the whole disk on a USB disk (clonezilla, dd), restored once to try it.")
    return 0 if well else 1


def gateway(route=Path("/proc/net/route")):
    """A way out of the robot's own network: needed for packages, names and the clock, not for driving."""
    found = None
    for line in route.read_text().splitlines()[1:]:
        words = line.split()
        if words[1] == "00000000" and int(words[3], 16) & 2:  # destination 0.0.0.0, flag "gateway"
            found = socket.inet_ntoa(struct.pack("<L", int(words[2], 16))), words[0]
    what = "default gateway: " + (" on ".join(found) if found else "none")
    yield found is not None, what, "sudo ip route add default via ADDRESS-OF-YOUR-ROUTER, and in netplan for good"


def name_servers(resolver=Path("/etc/resolv.conf")):
    """Names can be looked up."""
    try:
        lines = resolver.read_text().splitlines()
    except OSError:
        lines = []
    servers = [line.split()[1] for line in lines if line.startswith("nameserver") and len(line.split()) > 1]
    yield (
        bool(servers),
        "name servers: " + (", ".join(servers) or "none"),
        ("write 'nameserver 9.9.9.9' (or your site's own) into /etc/resolv.conf, or set DNS in netplan"),
    )
    if servers:
        try:
            socket.getaddrinfo(EXAMPLE_HOST, 80)
            resolves = True
        except OSError:
            resolves = False
        yield (
            resolves,
            f"the name {EXAMPLE_HOST} is known",
            ("no name server answers: check the gateway, then  ping " + servers[0]),
        )


def held_packages(status=None):
    """The maker's packages stay as they are when the rest is upgraded."""
    if status is None:
        status = _output("dpkg-query", "-W", "-f", "${Package} ${db:Status-Want}\n")
    packages = [line.split() for line in status.splitlines() if line.startswith(HELD)]
    loose = sorted(name for name, want in packages if want != "hold")
    if packages:
        yield (
            not loose,
            f"{len(packages) - len(loose)} of the maker's packages are held",
            ("an apt upgrade breaks the robot:  sudo apt-mark hold " + " ".join(loose)),
        )


def disk(free=None):
    """Space for logs: a full disk stops the robot's own services."""
    free = shutil.disk_usage("/").free if free is None else free
    yield free >= LEAST_SPACE, f"{free / 1e9:.1f} GB free on /", "make room:  sudo journalctl --vacuum-size=100M"


def clock(answer=None):
    """Pictures and commands are compared by their time."""
    if answer is None:
        answer = _output("timedatectl", "show", "-p", "NTPSynchronized", "--value")
    yield (
        answer.strip() == "yes",
        "clock synchronised",
        (
            "sudo timedatectl set-ntp true; in a network without internet name the pilot's machine in "
            "/etc/systemd/timesyncd.conf"
        ),
    )


def _output(*argv):
    """What a program prints; nothing when there is no such program here."""
    if shutil.which(argv[0]) is None:
        return ""
    found = subprocess.run(argv, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    return found.stdout.decode(errors="replace")


if __name__ == "__main__":
    sys.exit(main())
