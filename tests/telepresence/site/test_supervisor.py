"""A site that runs, with real programs that are no station's: who brings whom back, and that nothing is left."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import ssl
import subprocess
import sys
import tempfile
import time
import tracemalloc
from pathlib import Path

import pytest
from site_unit import UNIT

from telepresence.site import proxy, supervisor
from telepresence.site.site_file import parse_site
from telepresence.site.supervisor import CADDY_OUTPUT, OUTPUT, PROXY, RunningSite, listens, proxy_log_folder
from telepresence.station import processes, restarts, vitals
from telepresence.station.listening_sockets import listening
from telepresence.station.log_folder import LARGEST_OUTPUT

pytestmark = pytest.mark.slow

SITE = """
import os, sys, time
from pathlib import Path
from telepresence.site import proxy, supervisor
from telepresence.site.site_file import read_site
file, unit = sys.argv[1:]
page_socket = supervisor.page_socket
supervisor.command = lambda robot, site, folder: [sys.executable, "-c", unit, str(page_socket(robot, folder))]
site, folder = read_site(Path(file)), Path(file).parent
site = supervisor.RunningSite(site, *supervisor.prepare(site, folder), os.environ, lambda text: None)
while len(site._up) < 1:
    site.poll(0.05)
    time.sleep(0.05)
print(*site.pids.values(), flush=True)
while True:
    site.poll(0.05)
    time.sleep(0.05)
"""
"""A site, to be killed."""
TALKS = "print('x' * 10_000_000, flush=True)\n" + UNIT
BROKEN = "print('port 9559 is taken'); raise SystemExit(1)"


@pytest.fixture
def started(monkeypatch, free_port):
    """Starts a site whose units run these programs; and what looks at it until something holds."""
    with tempfile.TemporaryDirectory(prefix="site-") as name:  # a unix socket's path has 107 bytes
        folder = Path(name)
        monkeypatch.setenv("HOME", name)
        monkeypatch.setenv("ROS_HOME", name)
        monkeypatch.setenv("TELEPRESENCE_USERS", str(folder / "users.db"))
        sites, said = [], []

        def start(port: int = 0, **programs: str):
            def command(unit, site, folder):
                return [sys.executable, "-c", programs[unit.name], str(supervisor.page_socket(unit, folder))]

            monkeypatch.setattr(supervisor, "command", command)
            robots = "".join(f"[robot.{robot}]\n" for robot in programs)
            site = parse_site(f"port = {port or free_port()}\nlogs = '{name}/logs'\n{robots}", folder)
            sites.append(RunningSite(site, *supervisor.prepare(site, folder), os.environ, said.append))
            return sites[0], site, said

        yield start
        for site in sites:
            site.close()


def look_until(site: RunningSite, condition, what: str) -> None:
    deadline = time.monotonic() + 30.0
    while not condition():
        assert time.monotonic() < deadline, what
        time.sleep(vitals.PERIOD)
        site.poll(vitals.PERIOD)


def test_a_unit_that_was_killed_or_stopped_comes_back_alone(started):
    site, _, said = started(anna=UNIT, ben=UNIT)
    look_until(site, lambda: {*said} == {"anna: is up", "ben: is up", "proxy: is up"}, "all are up")
    for count, ended in enumerate((signal.SIGKILL, signal.SIGSTOP), 2):
        before = site.pids
        os.kill(before["anna"], ended)
        look_until(site, lambda count=count: said.count("anna: is up") == count, "anna is back")
        after = site.pids
        assert before["anna"] != after.pop("anna") and after.items() < before.items()


def test_neither_unit_nor_proxy_gets_what_the_site_has_for_itself(started, monkeypatch):
    """A unit that beats for the site would keep systemd from noticing that the site is frozen."""
    for name in ("NOTIFY_SOCKET", "TELEPRESENCE_STATION"):
        monkeypatch.setenv(name, "/of/the/site")
    site, _, said = started(anna=UNIT)
    look_until(site, lambda: len(said) == 2, "all is up")
    assert not [name for name, pid in site.pids.items() if "/of/the/site" in Path(f"/proc/{pid}/environ").read_text()]


def test_the_proxy_comes_back(started):
    site, file, _ = started(anna=UNIT)
    look_until(site, lambda: listens(site.pids[PROXY], file.port), "Caddy listens")
    before = site.pids[PROXY]
    os.kill(before, signal.SIGKILL)
    look_until(site, lambda: site.pids[PROXY] != before and listens(site.pids[PROXY], file.port), "it listens again")


def test_a_proxy_whose_port_another_program_has_is_not_up_and_says_why_once(started):
    with socket.create_server(("127.0.0.1", 0)) as other:
        site, file, said = started(other.getsockname()[1], anna=UNIT)
        output = proxy_log_folder(file) / CADDY_OUTPUT
        look_until(site, lambda: output.read_text().count("address already in use") > 1, "it is tried again")
        (why,) = [line for line in said if line.startswith("proxy")]
        assert why.endswith("bind: address already in use")
    look_until(site, lambda: "proxy: is up" in said, "it is up")


def test_a_renewed_certificate_is_served_and_no_unit_notices(started, monkeypatch):
    monkeypatch.setattr(proxy, "LOOK_PERIOD", 0.0)
    site, file, said = started(anna=UNIT)
    look_until(site, lambda: len(said) == 2, "all is up")
    before, served = site.pids, ssl.get_server_certificate(("127.0.0.1", file.port))
    (certificate,) = Path.home().glob(".config/telepresence/page/site-*.crt")
    certificate.write_text("half of it")
    for _ in range(5):
        site.poll(vitals.PERIOD)
    assert site.pids == before
    assert proxy.certificate_files(file, certificate.parent).certificate == certificate
    look_until(site, lambda: said.count("proxy: is up") == 2, "the proxy is up again")
    assert ssl.get_server_certificate(("127.0.0.1", file.port)) == certificate.read_text() != served
    assert site.pids["anna"] == before["anna"]


def test_a_unit_that_does_not_come_up_says_why_once(started):
    site, file, said = started(anna=BROKEN)
    look_until(site, lambda: len((file.logs / "anna" / OUTPUT).read_text().splitlines()) > 2, "it is tried again")
    assert [line for line in said if not line.startswith("proxy")] == ["anna: port 9559 is taken"]


def test_a_unit_that_ends_without_a_word_gets_none_of_an_earlier_run(started):
    logs = Path.home() / "logs" / "anna"
    logs.mkdir(parents=True)
    (logs / OUTPUT).write_text("port 9559 is taken\n")
    site, _, said = started(anna="raise SystemExit(1)")
    before = site.pids["anna"]
    look_until(site, lambda: site.pids["anna"] != before, "it is started again")
    assert [line for line in said if not line.startswith("proxy")] == []


def test_a_unit_that_takes_long_to_find_out_fills_no_log(started, monkeypatch, caplog):
    monkeypatch.setattr(restarts, "STEADY_AFTER", 0.0)  # as if each start took longer
    site, file, _ = started(anna=BROKEN)
    look_until(site, lambda: len((file.logs / "anna" / OUTPUT).read_text().splitlines()) > 3, "it is tried again")
    assert [message for message in caplog.messages if message.startswith("anna")] == [
        "anna died: exit code 1; starts again",
        "anna died: exit code 1; starts again in 0.5 s",
    ]


def test_a_proxy_that_does_not_come_up_says_why_once_and_is_there_as_soon_as_it_can(started, tmp_path, monkeypatch):
    """Caddy cannot run, as for want of memory or of the right to its port; then it can."""
    able = tmp_path / "able"
    caddy = tmp_path / "caddy"
    refusal = f'[ "$1" = validate ] || [ -e {able} ] || exec sh -c "echo Error: permission denied >&2; exit 1"'
    caddy.write_text(f'#!/bin/sh\n{refusal}\nexec {shutil.which("caddy")} "$@"\n')
    caddy.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    site, file, said = started(anna=UNIT)
    output = proxy_log_folder(file) / CADDY_OUTPUT
    look_until(site, lambda: len(output.read_text().splitlines()) > 2, "it is tried again")
    assert [line for line in said if line.startswith("proxy")] == ["proxy: Error: permission denied"]
    able.touch()
    look_until(site, lambda: "proxy: is up" in said, "it is up")
    assert listens(site.pids[PROXY], file.port)


def test_a_caddy_that_may_have_ports_below_1024_is_seen_too(monkeypatch):
    """With setcap the kernel hides what it has open, even from its own user."""

    def hidden(pid):
        raise PermissionError

    monkeypatch.setattr(supervisor, "inodes_of", hidden)
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        assert listens(os.getpid(), port)
    assert not listens(os.getpid(), port)


def test_two_sites_side_by_side_keep_what_their_proxies_print_apart(tmp_path):
    places = ("", "port = 9000\n", "address = '127.0.0.2'\n")
    sites = [parse_site(f"{place}logs = '{tmp_path}'\n[robot.anna]", tmp_path) for place in places]
    assert len({proxy_log_folder(site) for site in sites}) == 3


def test_what_a_unit_prints_is_cut(started):
    """A container's programs cannot do it: they do not see the file."""
    site, file, _ = started(anna=TALKS)
    output = file.logs / "anna" / OUTPUT
    look_until(site, Path(f"{output}.1").exists, "it is printed and cut")
    look_until(site, lambda: output.stat().st_blocks * 512 < LARGEST_OUTPUT, "it is small")


def test_the_last_line_of_a_large_output_is_read_and_not_all_of_it(tmp_path):
    output = tmp_path / OUTPUT
    with output.open("wb") as file:
        file.seek(300_000_000)  # a hole, which takes no room
        file.write(b"a line\nport 9559 is taken\n\n")
    tracemalloc.start()
    try:
        assert supervisor.last_line(output) == "port 9559 is taken"
        assert tracemalloc.get_traced_memory()[1] < 5_000_000
    finally:
        tracemalloc.stop()
    output.write_text("short\n")
    assert supervisor.last_line(output) == "short"


def test_the_last_line_is_that_of_this_start_though_the_output_was_cut(tmp_path):
    output = tmp_path / OUTPUT
    output.write_text("of an earlier one\n")
    begun = output.stat().st_size
    assert supervisor.last_line(output, begun) == ""
    with output.open("a") as file:
        file.write("of this one\n")
    assert supervisor.last_line(output, begun) == "of this one"
    output.write_text("after a cut\n")
    assert supervisor.last_line(output, begun) == "after a cut"


def test_everything_ends_with_it(started):
    site, file, said = started(anna=UNIT, ben=UNIT)
    look_until(site, lambda: len(said) == 3, "all is up")
    pids = site.pids
    site.close()
    assert not [name for name, pid in pids.items() if processes.send(pid, signal.SIGCONT)]
    assert file.port not in {each.port for each in listening().values()}


def test_a_site_that_is_killed_leaves_nothing(free_port, monkeypatch, wait_until):
    with tempfile.TemporaryDirectory(prefix="site-") as name:
        monkeypatch.setenv("HOME", name)
        file = Path(name, "site.toml")
        file.write_text(f"port = {free_port()}\nlogs = '{name}/logs'\n[robot.anna]\n")
        with subprocess.Popen([sys.executable, "-c", SITE, file, UNIT], stdout=subprocess.PIPE, text=True) as site:
            pids = [int(word) for word in site.stdout.readline().split()]
            site.kill()
        assert len(pids) == 2
        wait_until(lambda: not any(lives(pid) for pid in pids), "unit and proxy end by themselves")


def lives(pid: int) -> bool:
    return vitals.state(pid) not in ("", "Z")


def test_the_link_lets_in_whoever_has_no_account(started, monkeypatch):
    site, file, _ = started(anna=UNIT)
    assert site.open().startswith(f"{file.url}#k=")
    monkeypatch.setattr(supervisor, "signs_in", lambda unit, site: True)
    assert site.open().startswith(f"{file.url}#i=")
    supervisor.Users().add("anna", "correct horse", "pilot")
    assert site.open() == file.url


def test_the_link_lets_in_everywhere_where_some_sign_in_and_others_do_not(started, monkeypatch):
    site, file, _ = started(anna=UNIT, ben=UNIT)
    monkeypatch.setattr(supervisor, "signs_in", lambda unit, site: unit.name == "ben")
    key, _, invitation = site.open().removeprefix(f"{file.url}#").partition("&")
    assert key.startswith("k=") and invitation.startswith("i=")
    token = invitation.removeprefix("i=")
    account, _ = supervisor.Invitations(supervisor.beside()).use(token, "carl", b"")
    assert account.role == supervisor.PILOT
    supervisor.Users().add("anna", "correct horse", "pilot")
    assert site.open() == f"{file.url}#{key}"
