"""A station and a pilot at home, each behind a router that translates addresses, and the internet with a relay.

    station 192.168.1.2 -- gateway 203.0.113.2 -- internet, relay 203.0.113.1
    home    192.168.2.2 -- router 198.51.100.2 -- internet         198.51.100.1

A router lets in what answers; the gateway hands the page's port on, besides. By `strict` routers every way out gets a
port of its own (RFC 4787: address and port-dependent mapping), so that no direct way can be found.
"""

from __future__ import annotations

import contextlib
import subprocess
import threading
from collections.abc import Iterator
from pathlib import Path

from machines import Machine, connect

from telepresence.station import processes

STATION, GATEWAY, RELAY = "192.168.1.2", "203.0.113.2", "203.0.113.1"
RELAY_PORT = 3478
SECRET = "known to the station and to its relay"
ROUTER = """
flush ruleset
table ip nat {{
  chain leaving {{ type nat hook postrouting priority 100; oifname "wan" masquerade {ports}; }}
  chain coming {{ type nat hook prerouting priority -100; {forward}; }}
}}
table ip filter {{
  chain coming {{ type filter hook input priority 0; iifname "wan" ct state new drop; }}
  chain through {{
    type filter hook forward priority 0; ct status dnat accept
    iifname "wan" ct state new drop
  }}
}}
"""
CUT = """
table ip cut {
  chain through { type filter hook forward priority 0; policy drop; }
  chain coming { type filter hook input priority 0; policy drop; }
}
"""
PRIVATE = ("10.0.0.0-10.255.255.255", "172.16.0.0-172.31.255.255", "192.168.0.0-192.168.255.255")


class Internet:
    """The five machines.

    Args:
        folder: For the relay's files.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.station, self.gateway, self.middle, self.router, self.home = self._machines = [Machine() for _ in range(5)]
        self._relay: subprocess.Popen | None = None
        connect(self.station, self.gateway, "lan", (STATION, "192.168.1.1"))
        connect(self.gateway, self.middle, "wan", (GATEWAY, RELAY), "station")
        connect(self.router, self.middle, "wan", ("198.51.100.2", "198.51.100.1"), "home")
        connect(self.home, self.router, "lan", ("192.168.2.2", "192.168.2.1"))
        for machine, way in (
            (self.station, "192.168.1.1"), (self.gateway, RELAY), (self.router, "198.51.100.1"),
            (self.home, "192.168.2.1"),
        ):  # fmt: skip
            machine.run("ip", "route", "add", "default", "via", way, check=True)
        for machine in (self.gateway, self.middle, self.router):
            machine.run("sh", "-c", "echo 1 > /proc/sys/net/ipv4/ip_forward", check=True)
        self.secret = folder / "secret"
        self.secret.write_text(SECRET)

    def translate(self, port: int, strict: bool) -> None:
        """Load the routers' rules anew. `port`: of the page."""
        ports = "random,fully-random" if strict else ""
        forward = f'iifname "wan" tcp dport {port} dnat to {STATION}'
        for machine, own in ((self.gateway, forward), (self.router, "accept")):
            machine.run("nft", "-f", "-", input=ROUTER.format(ports=ports, forward=own), check=True)

    @contextlib.contextmanager
    def cut(self) -> Iterator[None]:
        """Lose every packet meanwhile."""
        self.middle.run("nft", "-f", "-", input=CUT, check=True)
        try:
            yield
        finally:
            self.middle.run("nft", "delete", "table", "ip", "cut", check=True)

    def start_relay(self) -> None:
        """Start coturn, set up as docs/page.md says."""
        denied = [f"--denied-peer-ip={block}" for block in PRIVATE]
        # fmt: off
        words = [
            "turnserver", "-n", f"--listening-ip={RELAY}", f"--relay-ip={RELAY}", f"--listening-port={RELAY_PORT}",
            "--use-auth-secret", f"--static-auth-secret={SECRET}", "--realm=page", "--fingerprint", "--no-cli",
            "--no-tls", "--no-dtls", "--no-multicast-peers", "--min-port=49152", "--max-port=49999", *denied,
            f"--userdb={self._folder / 'turn.db'}", f"--pidfile={self._folder / 'turn.pid'}", "--log-file=stdout",
        ]
        # fmt: on
        self._relay = processes.start(
            self.middle.command(*words), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        for line in self._relay.stdout:
            if "SQLite DB connection success" in line:  # its last step
                break
        threading.Thread(target=self._relay.stdout.read, name="relay's log", daemon=True).start()

    def kill_relay(self) -> None:
        if self._relay is not None:
            self._relay.kill()
            self._relay.wait()
            self._relay.stdout.close()
            self._relay = None

    def close(self) -> None:
        self.kill_relay()
        for machine in self._machines:
            machine.close()
