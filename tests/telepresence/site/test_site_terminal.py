"""A site's terminal that is paused or closed holds up neither units nor the site's end."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from site_unit import PREPARES, RUNS
from telepresence_ros.pseudo_terminal import Terminal

from telepresence.site.site_file import SiteError, read_site
from telepresence.site.unit import claimed
from telepresence.station import processes

pytestmark = pytest.mark.slow

NOTES = """
Path(sys.argv[2] + ".tmpdir").write_text(os.environ.get("TMPDIR", ""))
with open(sys.argv[2], "a") as started:
    print(os.getpid(), file=started)
"""
UNIT = PREPARES + NOTES + RUNS
"""A unit that notes its process id and where its temporary files go."""
SITE = """
import signal, sys, threading
from pathlib import Path
from telepresence.site import supervisor
from telepresence.site.site_file import read_site
from telepresence.station.station_folder import StationFolder
from telepresence.stop_signals import stop_on
file, unit, started = sys.argv[1:]
page_socket = supervisor.page_socket
supervisor.command = lambda robot, site, folder: [sys.executable, "-c", unit, str(page_socket(robot, folder)), started]
stop = threading.Event()
stop_on(stop, signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
folder = StationFolder()
code = supervisor.run(read_site(Path(file)), folder, stop)
folder.close()
sys.exit(code)
"""


@pytest.fixture
def home(monkeypatch) -> Iterator[Path]:
    with tempfile.TemporaryDirectory(prefix="site-") as name:  # a unix socket's path has 107 bytes
        for variable in ("HOME", "ROS_HOME", "TMPDIR"):
            monkeypatch.setenv(variable, name)
        monkeypatch.setenv("TELEPRESENCE_USERS", f"{name}/users.db")
        yield Path(name)


def words(home: Path, port: int) -> list[str]:
    """The command line of a site with one robot."""
    file = home / "site.toml"
    file.write_text(f"port = {port}\nlogs = '{home}/logs'\n[robot.anna]\n", encoding="utf-8")
    return [sys.executable, "-c", SITE, str(file), UNIT, str(home / "started")]


def started(home: Path) -> list[int]:
    """Process ids of the unit's starts."""
    file = home / "started"
    return [int(word) for word in file.read_text().split()] if file.exists() else []


def require_a_site_that_works(home: Path, wait_until) -> None:
    """Kill the unit, and see it back, twice: the first line may still fit into a buffer."""
    for count in (2, 3):
        os.kill(started(home)[-1], signal.SIGKILL)
        wait_until(lambda count=count: len(started(home)) == count, "the unit is back")


def test_a_paused_terminal_holds_up_neither_units_nor_the_end(home, free_port, wait_until):
    terminal = Terminal(*words(home, free_port()))
    try:
        wait_until(lambda: "anna: is up" in terminal.seen, "the unit is up")
        terminal.pause()
        require_a_site_that_works(home, wait_until)
        terminal.process.send_signal(signal.SIGTERM)
        wait_until(lambda: terminal.process.poll() is not None, "the site ends")
        assert terminal.process.returncode == 0
    finally:
        terminal.resume()
        terminal.close()


def test_whoever_stops_reading_ends_no_robot(home, free_port, wait_until):
    site = processes.start(words(home, free_port()), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        assert any("anna: is up" in line for line in iter(site.stdout.readline, ""))
        with pytest.raises(SiteError, match=r"robot\.anna: another site"), claimed(read_site(home / "site.toml")):
            pass
        site.stdout.close()
        require_a_site_that_works(home, wait_until)
        assert (home / "started.tmpdir").read_text() == os.environ["TMPDIR"], "not into the site's own folder"
        site.send_signal(signal.SIGTERM)
        wait_until(lambda: site.poll() is not None, "the site ends")
        assert site.returncode == 0
    finally:
        processes.end(site)
        site.stdout.close()


def test_a_disk_that_is_full_or_a_terminal_without_the_letters_ends_nobody(home, free_port, wait_until):
    with open("/dev/full", "w") as full:
        environment = {**os.environ, "PYTHONIOENCODING": "ascii"}
        site = processes.start(words(home, free_port()), stdout=full, stderr=full, env=environment)
    try:
        wait_until(lambda: started(home), "the unit is up")
        require_a_site_that_works(home, wait_until)
    finally:
        processes.end(site)


def test_ctrl_c_while_the_site_starts_ends_it_in_order(home, free_port, wait_until, monkeypatch):
    caddy, judges, goes_on = home / "caddy", home / "judges", home / "goes on"
    caddy.write_text(f"#!/bin/sh\ntouch '{judges}'\nwhile [ ! -e '{goes_on}' ]; do sleep 0.05; done\n")
    caddy.chmod(0o755)
    monkeypatch.setenv("PATH", f"{home}:{os.environ['PATH']}")
    terminal = Terminal(*words(home, free_port()))
    try:
        wait_until(judges.exists, "Caddy reads its configuration")
        terminal.type("\3")
        wait_until(lambda: "^C" in terminal.seen, "the terminal has sent the signal")
        goes_on.touch()
        wait_until(lambda: terminal.process.poll() is not None, "the site ends")
        assert terminal.process.returncode == 0 and "Traceback" not in terminal.seen
        assert not started(home), "no unit was started"
    finally:
        goes_on.touch()
        terminal.close()
