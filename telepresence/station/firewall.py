"""Whether the firewall rules of firewall.nft are loaded, which ROS needs when it listens on other addresses than
loopback. Needs Debian's Python alone.
"""

from __future__ import annotations

import ipaddress
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from urllib.parse import urlsplit

FILE = Path(__file__).with_suffix(".nft")
TABLE = ("list", "table", "inet", "telepresence")
MASTER_PORT = 11311
GIVEN_PORTS = Path("/proc/sys/net/ipv4/ip_local_port_range")
"""File with the range of ports that Linux chooses from when a program asks for no particular one."""
CHAIN = (
    r"type filter hook input priority filter - 5; policy accept;",
    r'iif "lo" accept',
    r"ct state established,related accept",
    r'iifname "(?P<vpn>[^"]+)" ip saddr (?P<peers>\{[^}]*\}|[\d./]+) accept',
    r"tcp dport @ports counter drop",
    r"udp dport @ports counter drop",
)
"""What `nft -s list table` prints for the chain of the file, line by line."""


def announced_address() -> str | None:
    """Return ROS_HOSTNAME or ROS_IP, as ROS chooses, when other machines reach it; None for loopback."""
    found = os.environ.get("ROS_HOSTNAME") or os.environ.get("ROS_IP") or "localhost"
    if found == "localhost":
        return None
    try:
        return None if ipaddress.ip_address(found).is_loopback else found
    except ValueError:
        return found


def problem() -> str | None:
    """Return why the rules do not protect this machine; None when they do."""
    command = ["nft", "-s", *TABLE]
    nft = shutil.which("nft") or shutil.which("nft", path="/usr/sbin:/sbin")
    if nft is None:
        return "nftables is not installed (sudo apt install nftables)"
    command[0] = nft
    answer = subprocess.run(command, capture_output=True, text=True, timeout=20)
    if answer.returncode != 0 and os.geteuid() != 0 and shutil.which("sudo"):
        # Only root may read the rules. A person at a terminal is asked for the password.
        ask = [] if sys.stdin.isatty() else ["-n"]
        answer = subprocess.run(["sudo", *ask, *command], capture_output=True, text=True)
    if "No such file" in answer.stderr:
        return "the rules are not loaded"
    if answer.returncode != 0:
        return f"the rules cannot be read ({(answer.stderr.strip().splitlines() or ['no answer'])[0]})"
    return differs(answer.stdout, needed_ports())


def needed_ports() -> list[tuple[int, int]]:
    """Return the first and last port of each range that must not be open to everybody: the master's, the nodes'."""
    first, last = map(int, GIVEN_PORTS.read_text().split())
    master = urlsplit(os.environ.get("ROS_MASTER_URI", "")).port or MASTER_PORT
    return [(first, last), (master, master)]


def differs(listing: str, needed: list[tuple[int, int]]) -> str | None:
    """Return what is wrong with a listing of `nft -s list table inet telepresence`; None for the rules of the file."""
    chain = re.search(r"chain input \{(.*?)\n\t\}", listing, re.DOTALL)
    lines = [line.strip() for line in chain[1].strip().splitlines()] if chain else []
    if len(lines) != len(CHAIN) or listing.count("chain ") != 1:
        return f"the loaded rules are not those of {FILE.name}"
    for expected, line in zip(CHAIN, lines, strict=True):
        if not re.fullmatch(expected, line):
            return f"the loaded rules are not those of {FILE.name}: {line}"
    elements = re.search(r"elements = \{([^}]*)\}", listing)
    ranges = [[int(end) for end in word.split("-")] for word in elements[1].split(",")] if elements else []
    for first, last in needed:
        if not any(found[0] <= first and last <= found[-1] for found in ranges):
            ports = str(first) if first == last else f"{first}-{last}"
            return f"the loaded rules leave ports {ports} open: add them to the set in {FILE.name} and load it again"
    return None


def advice() -> str:
    """Return the command that loads the rules, for the person at the terminal."""
    return f"sudo nft -D vpn=wg0 -D peers='{{ 10.8.0.2, 10.8.0.3 }}' -f {os.path.relpath(FILE)}"
