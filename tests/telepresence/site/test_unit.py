"""What each robot of a site has for itself: ports, logs, a socket for its page; and what it does not get."""

from __future__ import annotations

import errno
import socket
from pathlib import Path

import pytest

from telepresence.site.site_file import Site, SiteError, parse_site
from telepresence.site.unit import (
    claimed,
    command,
    environment,
    log_folder,
    ports_of,
    require_ports,
    signs_in,
    socket_of,
)
from telepresence.station import launch_settings
from telepresence.station.up import parse

HERE = Path("/nowhere")
BOTH = "[robot.anna]\n[robot.ben]\nkind = 'robotino'\n[robot.carl]\nkind = 'both'\n"


def site_of(text: str) -> Site:
    return parse_site(text, HERE)


def test_no_two_units_want_the_same_port():
    ports = [port for unit in site_of(BOTH).units for port in ports_of(unit).values()]
    assert len(ports) == len(set(ports)) == 5 + 5 + 9


def test_stack_up_takes_every_units_command_line():
    site = site_of(BOTH)
    for unit in site.units:
        words = command(unit, site, HERE)
        arguments = parse(words[words.index("telepresence.station") + 1 :])
        assert arguments.robot == unit.kind and arguments.unit
        assert arguments.settings["gui"] == arguments.settings["teleop"] == "false"
        assert arguments.settings["page_url"] == f"https://localhost:8443/{unit.name}/"
        assert arguments.settings["page_proxy"] == f"unix:/nowhere/{unit.name}.socket"


def test_a_real_robots_ports_are_left_alone():
    (anna,) = site_of("[robot.anna]\nsettings = {sim = false, nao_ip = '10.0.0.7', page_port = 10002}").units
    assert set(ports_of(anna)) == {"master_port", "page_port", "drive_port"} and ports_of(anna)["page_port"][0] == 10002


def test_each_unit_has_a_master_and_logs_of_its_own_and_no_display():
    site = site_of(BOTH)
    base = {"PATH": "/bin", "DISPLAY": ":0", "ROS_MASTER_URI": "http://elsewhere:1"}
    made = [environment(unit, site, "key", log_folder(unit, site), base) for unit in site.units]
    for name in ("ROS_MASTER_URI", "ROS_LOG_DIR"):
        assert len({each[name] for each in made}) == 3
    assert all("DISPLAY" not in each for each in made)
    assert {each["TELEPRESENCE_SITE"] for each in made} == {"https://localhost:8443/"}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("[robot.anna]", False),
        ("[robot.anna]\nsettings = {sign_in = true}", True),
        ("[robot.anna]\nsettings = {sim = false, nao_ip = '10.0.0.7'}", True),
        ("address = '10.0.0.5'\n[robot.anna]", True),
    ],
)
def test_people_sign_in_as_with_stack_up(text, expected):
    site = site_of(text)
    assert signs_in(site.units[0], site) is expected


def test_a_unit_in_a_container_shares_its_pages_socket_and_publishes_what_the_tablet_asks_for():
    text = (
        "[robot.anna]\nimage = 'telepresence'\n[robot.ben]\nimage = 'localhost/telepresence:0.9'\nsettings = {real}\n"
    )
    site = site_of(text.replace("{real}", "{sim = false, nao_ip = '10.0.0.7', page_port = 10002}"))
    anna, ben = site.units
    words = command(anna, site, HERE)
    assert words[:2] == ["podman", "run"] and "--publish" not in words and "--read-only" in words
    arguments = parse(["--unit", *words[words.index("unit") + 1 :]])
    assert words[words.index("unit") - 1] == "telepresence" and arguments.robot == "pepper"
    assert arguments.settings["page_proxy"] == "unix:/run/telepresence/page.socket"
    assert f"{socket_of(anna, HERE).parent}:/run/telepresence:U" in words
    assert ports_of(anna) == {} and ports_of(ben) == {"page_port": (10002, False)}
    words = command(ben, site, HERE)
    assert words[words.index("--publish") + 1] == "10002:10002" and "page_port:=10002" in words
    assert signs_in(anna, site)


@pytest.mark.parametrize("name", ["list", "watch"])
def test_a_container_gets_no_folder_of_the_site_whatever_its_robot_is_called(name):
    (unit,) = site_of(f"[robot.{name}]\nimage = 'telepresence'").units
    assert not (HERE / name).is_relative_to(socket_of(unit, HERE).parent)


def test_two_running_sites_have_no_robots_of_one_name(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    one, other = site_of("[robot.anna]\n[robot.ben]"), site_of("port = 9000\n[robot.ben]\nimage = 'telepresence'")
    with claimed(one):
        with pytest.raises(SiteError, match=r"robot\.ben: another site of yours, which runs, has a robot of this name"):
            with claimed(other):
                pass
        with claimed(site_of("[robot.carl]")):
            pass
    with claimed(other):
        pass


def test_a_port_that_is_taken_or_wanted_twice_is_named(free_port):
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        taken = other.getsockname()[1]
        with pytest.raises(
            SiteError, match=rf"tcp port {taken} of 127\.0\.0\.1, nao_port of robot\.anna, cannot be had"
        ):
            require_ports(site_of(f"port = {free_port()}\n[robot.anna]\nsettings = {{nao_port = {taken}}}"))
    with pytest.raises(SiteError, match="port 9000 is wanted twice: the site's port and nao_port of "):
        require_ports(site_of("port = 9000\n[robot.anna]\nsettings = {nao_port = 9000}"))
    with pytest.raises(SiteError, match="nao_port = x is no port"):
        require_ports(site_of("[robot.anna]\nsettings = {nao_port = 'x'}"))


def test_a_port_that_is_the_administrators_is_named_with_what_allows_it(monkeypatch):
    class Probe(socket.socket):
        def bind(self, address):
            raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(launch_settings.socket, "socket", Probe)
    allows = r"allow it by  sudo sysctl net\.ipv4\.ip_unprivileged_port_start=443, or choose"
    with pytest.raises(SiteError, match=rf"tcp port 443, the site's port, is not for everybody: {allows}"):
        require_ports(site_of("port = 443\n[robot.anna]"))
    with pytest.raises(
        RuntimeError, match=rf"port 443, wanted for the pilot's page, is not .*: {allows} .* page:=<port>"
    ):
        launch_settings.require_free(443, "page", "the pilot's page")
