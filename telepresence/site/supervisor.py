"""A site that runs: units and proxy, each started again when it dies or freezes, and all of them ended together."""

from __future__ import annotations

import contextlib
import getpass
import os
import signal
import socket
import subprocess
import threading
import time
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import BinaryIO

from telepresence.page.certificate import fingerprint
from telepresence.site.caddyfile import Files
from telepresence.site.container import name_of
from telepresence.site.proxy import CertificateWatch, prepare, start_caddy
from telepresence.site.site_file import Elsewhere, Site, Unit
from telepresence.site.unit import (
    claimed,
    command,
    environment,
    heartbeat_of,
    log_folder,
    page_folder,
    remove_socket,
    signs_in,
    site_logs,
)
from telepresence.site.unit import socket_of as page_socket
from telepresence.station import heartbeat, processes, vitals
from telepresence.station.kept_program import KeptProgram, Report
from telepresence.station.listening_sockets import inodes_of, listening
from telepresence.station.log_folder import LogKeeper
from telepresence.station.pilot_page import FIRST_LINK_LASTS
from telepresence.station.station_folder import StationFolder
from telepresence.station.terminal_printer import TerminalPrinter
from telepresence.station.vitals import Beats
from telepresence.teleop.accounts import UserError, Users
from telepresence.teleop.invitations import InvitationError, Invitations, beside
from telepresence.teleop.lease_messages import PILOT
from telepresence.web.page_auth import make_token

PROXY = "proxy"
"""What Caddy is for people, and in names: no robot may be called so."""
UNIT_PATIENCE = 14.0
"""[s] for all units to end: each gives its programs 8."""
PROXY_PATIENCE = 2.0
OUTPUT, CADDY_OUTPUT = "unit-stdout.log", "caddy-stdout.log"
"""What a unit's programs print, and Caddy, each in its folder of logs; cut when they grow, as all logs."""
LONGEST_END = 65536
"""[bytes] that are read of such a file: whoever reads it must go on beating."""


class RunningSite:
    """Starts everything at once; `look` again and again, then `close`.

    Args:
        files, config: Of the proxy, see `telepresence.site.proxy.prepare`.
        base: Environment of whoever has started the site.
        say: Prints a line for the person at the terminal.
    Raises:
        OSError: A folder cannot be written.
    """

    def __init__(
        self, site: Site, files: Files, config: Path, base: Mapping[str, str], say: Callable[[str], None]
    ) -> None:
        folder = files.folder
        self._site, self._folder, self._say = site, folder, say
        self._certificate = CertificateWatch(site, files, time.monotonic())
        self._base = {name: value for name, value in base.items() if name not in _SITES_OWN}
        self._key = make_token()
        self._invitation = ""
        self._programs: dict[str, KeptProgram] = {}
        self._beats: dict[str, Beats | None] = {}
        self._up: set[str] = set()
        self._said: dict[str, str] = {}
        self._begun: dict[str, int] = {}
        self._answers: dict[str, Callable[[], bool]] = {
            unit.name: partial(takes_connections, page_socket(unit, folder)) for unit in site.units
        }
        self._answers[PROXY] = lambda: listens(self._programs[PROXY].pid, site.port)
        (folder / "watch").mkdir(mode=0o700)
        for unit in site.units:
            self._start_unit(unit)
        proxy_logs = proxy_log_folder(site)
        proxy_logs.mkdir(mode=0o700, parents=True, exist_ok=True)
        # A container's programs do not see the file with their output, and a unit that does not come up cuts nothing.
        folders = [log_folder(unit, site) for unit in site.units]
        self._keeper = LogKeeper(proxy_logs, *folders, deletes=False).start()
        output = proxy_logs / CADDY_OUTPUT
        self._beats[PROXY] = None
        self._programs[PROXY] = KeptProgram(PROXY, partial(self._proxy, config, output), self._reporter(PROXY, output))

    def _start_unit(self, unit: Unit) -> None:
        beats = None if unit.image else Beats(heartbeat_of(unit, self._folder))  # a container has its healthcheck
        self._beats[unit.name] = beats
        start = partial(self._unit, unit, beats)
        report = self._reporter(unit.name, log_folder(unit, self._site) / OUTPUT, beats)
        # Some units need ten seconds to find out that they cannot come up.
        self._programs[unit.name] = KeptProgram(unit.name, start, report, beats, ready=lambda: unit.name in self._up)

    def _reporter(self, name: str, output: Path, beats: Beats | None = None) -> Report:
        def report(_program: str, _what: str, _then: str) -> None:  # which the log says
            said = last_line(output, self._begun[name])
            if name not in self._up and said not in ("", self._said.get(name)):  # why, it has said itself
                self._said[name] = said
                self._say(f"{name}: {said}")
            self._up.discard(name)
            if beats is not None:
                beats.ready = False

        return report

    def open(self) -> str:
        """Return the link to the list, and from there to each robot's page; it lets in whoever has no account."""
        here = [unit for unit in self._site.units if not unit.image]  # containers have accounts of their own
        sign_in = [signs_in(unit, self._site) for unit in here]
        ways = [] if all(sign_in) else [f"k={self._key}"]
        if any(sign_in):
            with contextlib.suppress(UserError):  # the pages say what is wrong with the accounts
                if not Users().all():
                    ways.append(f"i={self._invite()}")
        return f"{self._site.url}#{'&'.join(ways)}" if ways else self._site.url

    def _invite(self) -> str:
        """Make an invitation to drive that ends with the site, and return its token."""
        invitation, token = Invitations(beside()).make(PILOT, FIRST_LINK_LASTS, maker=getpass.getuser())
        self._invitation = invitation.id
        return token

    @property
    def pids(self) -> dict[str, int]:
        """Process ids of the units by name, and the proxy's."""
        return {name: program.pid for name, program in self._programs.items()}

    def poll(self, elapsed: float) -> None:
        """Look once at every program.

        Args:
            elapsed: Seconds since the last look.
        """
        for program in self._programs.values():
            program.poll(elapsed)
        for name, beats in self._beats.items():
            ready = beats is None or beats.ready
            if ready and name not in self._up and self._programs[name].runs and self._answers[name]():
                self._up.add(name)
                self._say(f"{name}: is up")
        if self._certificate.renewed(time.monotonic()) and self._programs[PROXY].runs:
            self._say(f"{PROXY}: starts again, with the renewed certificate")
            # By a gentler signal it would wait for every open page, and let nobody in meanwhile.
            self._programs[PROXY].process.send_signal(signal.SIGKILL)
        processes.reap_orphans(set(self.pids.values()))

    def close(self) -> None:
        """End all of it: every unit at the same time, so that the last robot stops as soon as the first one."""
        units = [self._programs[unit.name].process for unit in self._site.units if unit.name in self._programs]
        for process in units:
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
        deadline = time.monotonic() + UNIT_PATIENCE
        while any(process.poll() is None for process in units) and time.monotonic() < deadline:
            time.sleep(0.02)
        for program in self._programs.values():
            program.close(PROXY_PATIENCE)
        self._keeper.close()
        if self._invitation:
            try:
                Invitations(beside()).withdraw(self._invitation)
            except InvitationError:
                self._invitation = ""  # somebody has withdrawn it

    def _unit(self, unit: Unit, beats: Beats | None) -> subprocess.Popen:
        logs, place = log_folder(unit, self._site), page_socket(unit, self._folder)
        for each in (logs, place.parent, *(() if unit.image else (page_folder(unit),))):
            each.mkdir(mode=0o700, parents=True, exist_ok=True)
        remove_socket(place)
        variables = self._base
        if beats is not None:
            variables = environment(unit, self._site, self._key, logs, self._base) | {"NOTIFY_SOCKET": str(beats.path)}
        with self._open(unit.name, logs / OUTPUT) as output:
            return processes.start(
                command(unit, self._site, self._folder),
                tied=True,
                env=variables,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
            )

    def _proxy(self, config: Path, path: Path) -> subprocess.Popen:
        with self._open(PROXY, path) as output:
            return start_caddy(config, output, self._base)

    def _open(self, name: str, path: Path) -> BinaryIO:
        """Open the file with what a program prints, for a start of it; what earlier starts have printed stays."""
        output = path.open("ab")
        self._begun[name] = os.fstat(output.fileno()).st_size
        return output


def proxy_log_folder(site: Site) -> Path:
    """Return the folder of Caddy's logs: two sites of one user, whose robots have other names, run side by side."""
    return site_logs(site) / PROXY / f"{site.address}-{site.port}"


def takes_connections(path: Path) -> bool:
    """Return whether a page listens at a unix socket; one that was killed leaves the file."""
    with socket.socket(socket.AF_UNIX) as probe:
        probe.setblocking(False)
        return probe.connect_ex(str(path)) == 0


def listens(pid: int, port: int) -> bool:
    """Return whether this process takes connections at a tcp port: another program may have it."""
    there = {inode for inode, each in listening().items() if (each.protocol, each.port) == ("tcp", port)}
    try:
        return not there.isdisjoint(inodes_of(pid))
    except PermissionError:  # nobody sees what a Caddy has open that setcap lets have ports below 1024, or a zombie
        return bool(there) and vitals.state(pid) != "Z"


def last_line(path: Path, begun: int = 0) -> str:
    """Return the last line that a program has printed; empty for none.

    Args:
        begun: Length of the file when the program was started [bytes].
    """
    try:
        with path.open("rb") as file:
            end = file.seek(0, os.SEEK_END)
            begun = begun if begun <= end else 0  # it was cut meanwhile
            file.seek(max(begun, end - LONGEST_END))
            lines = file.read(LONGEST_END).decode(errors="replace").splitlines()
    except OSError:
        return ""
    return next((line for line in reversed(lines) if line.strip()), "")


_SITES_OWN = ("NOTIFY_SOCKET", "TELEPRESENCE_STATION")
"""Variables that a site has for itself: each unit makes its own."""


def run(site: Site, folder: StationFolder, stop: threading.Event) -> int:
    """Bring a site up and keep it so until `stop` is set; return the exit code. Raises what `claimed`, `prepare` and
    `RunningSite` do."""
    with contextlib.ExitStack() as ends:
        # Whoever writes to a terminal that nobody reads waits, and a supervisor that waits brings nobody back.
        printer = ends.enter_context(TerminalPrinter(site_logs(site)))
        ends.enter_context(claimed(site))
        files, config = prepare(site, folder.path)
        if stop.is_set():  # Ctrl-C meanwhile: no unit needs to be ended
            return 0
        running = RunningSite(site, files, config, folder.environment_before, printer.say)
        ends.callback(running.close)
        printer.say(banner(site, running.open(), fingerprint(files.certificate)))
        heartbeat.notify("READY=1")
        looked = time.monotonic()
        while not stop.wait(vitals.PERIOD):
            heartbeat.beat()
            elapsed, looked = time.monotonic() - looked, time.monotonic()
            running.poll(elapsed)
        heartbeat.notify("STOPPING=1")
        printer.say("\nEnding everything ...")
    return 0


def banner(site: Site, link: str, certificate: str) -> str:
    """Return what runs where."""
    lines = ["", f"  robots       {link}", f"  certificate  SHA-256 {certificate}"]
    for robot in site.robots:
        lines.append(f"  {robot.name:<12} {site.page_url(robot)}  {_where(robot)}")
    lines.append(f"  logs         {site_logs(site)}")
    contained = next((unit for unit in site.units if unit.image), None)
    if contained is not None:
        invite = f"podman exec {name_of(contained)} /opt/telepresence/stack invite --drive"
        lines.append(f"  a way in     {invite}")
    return "\n".join([*lines, "", "  Ctrl-C ends all of it.", ""])


def _where(robot: Unit | Elsewhere) -> str:
    if isinstance(robot, Elsewhere):
        return robot.url
    words = robot.kind, "simulated" if robot.simulated else "real", *(["in a container"] if robot.image else [])
    return ", ".join(words)
