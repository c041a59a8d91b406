"""The arguments of `./stack up`, and what it says when it cannot start."""

import getpass
import os
import re
import shutil
import socket
import subprocess
import sys
import threading

import pytest

from telepresence.page.certificate import fingerprint, names_of, server_context
from telepresence.page.entrance import Entrance
from telepresence.station import announcement, launch_settings, pilot_page, start_conditions, up
from telepresence.station.ros_master import master_answers, master_proxy
from telepresence.teleop.accounts import UserError, Users
from telepresence.teleop.invitations import Invitations, beside

pytestmark = pytest.mark.slow


def test_without_arguments_it_is_pepper():
    arguments = up.parse([])
    assert (arguments.robot, arguments.settings) == ("pepper", {})


def test_launch_arguments_may_stand_without_a_robot():
    arguments = up.parse(["gui:=false", "nao_ip:=10.0.0.7"])
    assert (arguments.robot, arguments.settings) == ("pepper", {"gui": "false", "nao_ip": "10.0.0.7"})


def test_it_loads_nothing_heavy():
    """It is there before everything else, and stays as long."""
    heavy = "{'numpy', 'gevent', 'cryptography.x509', 'cv2', 'rospy'}"
    code = f"import sys, telepresence.station.up; print(sorted({heavy} & set(sys.modules)))"
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert answer.stdout == "[]\n", answer.stdout + answer.stderr


def test_a_value_may_hold_the_sign_itself():
    assert up.parse(["pepper", "source:=http://10.0.0.7/a:=b"]).settings == {"source": "http://10.0.0.7/a:=b"}


@pytest.mark.parametrize(
    ("argv", "words"),
    [
        (["--help"], ["nao_ip", "page_port", "firewall", "default 8085, or what DRIVE_PORT says", "default not gui"]),
        (["robotino", "--help"], ["robotino_ip", "screen_port"]),
        (["--unit", "both", "--help"], ["one of: both, pepper, robotino;"]),
    ],
)
def test_help_says_what_can_be_set_for_the_robot(argv, words, capsys):
    with pytest.raises(SystemExit) as end:
        up.parse(argv)
    assert end.value.code == 0
    said = " ".join(capsys.readouterr().out.split())
    assert [word for word in words if word not in said] == [] and "$(" not in said


def test_a_unit_is_of_a_robot_that_can_be_reached(capsys):
    with pytest.raises(SystemExit):
        up.parse(["--unit", "fleet"])
    assert "known: both, pepper, robotino" in capsys.readouterr().err


@pytest.mark.parametrize("argv", [["nao"], ["pepper", "gui=false"], ["pepper", ":=1"], ["pepper", "two words:=1"]])
def test_other_arguments_are_refused_with_a_reason(argv, capsys):
    with pytest.raises(SystemExit) as refusal:
        up.parse(argv)
    assert refusal.value.code == 2
    assert argv[-1] in capsys.readouterr().err


@pytest.mark.parametrize(
    ("robot", "name", "value", "hint"),
    [
        ("pepper", "nao_prot", "9559", "nao_port"),
        ("both", "colour", "red", "robotino_ip"),
        ("robotino", "scene", "moon", "arena"),
        ("both", "terrain", "moon", "ramp"),
        ("walker", "gait", "gallop", "trot, crawl"),
    ],
)
def test_an_argument_or_scene_that_does_not_exist_is_refused_with_those_that_do(robot, name, value, hint):
    with pytest.raises(RuntimeError, match=f"{name}.*{hint}|{value}.*{hint}"):
        launch_settings.require_known(robot, {name: value})


@pytest.mark.parametrize("robot", ["pepper", "robotino", "both", "walker", "fleet"])
def test_every_argument_of_a_station_is_known(robot):
    text = (launch_settings.LAUNCH / f"{robot}.launch").read_text()
    names = set(re.findall(r'^  <arg name="(\w+)" default=', text, re.MULTILINE))
    assert {"viewer", "seed", "scene"} <= names and launch_settings.launch_arguments(robot) == names
    values = dict.fromkeys([*names, *launch_settings.OWN_SETTINGS], "rough")
    launch_settings.require_known(robot, values | {"gait": "trot"} if "gait" in names else values)


def test_both_robots_are_announced_with_their_addresses():
    text = announcement.banner("both", {"nao_port": "9000", "robotino_ip": "10.0.0.1"}, "http://m:1", False)
    assert "pepper, real, tcp://127.0.0.1:9000" in text and "robotino, real, http://10.0.0.1:80" in text


@pytest.mark.parametrize(
    ("address", "url"),
    [
        ("10.0.0.7", "tcp://10.0.0.7:9503"),
        ("10.0.0.7:9559", "tcp://10.0.0.7:9559"),
        ("tcps://10.0.0.7", "tcps://10.0.0.7:9503"),
        ("tcps://10.0.0.7:9504", "tcps://10.0.0.7:9504"),
        ("tcps://[fe80::1]", "tcps://[fe80::1]:9503"),
    ],
)
def test_an_address_keeps_the_scheme_and_the_port_that_it_has(address, url):
    text = announcement.banner("pepper", {"nao_ip": address, "nao_port": "9503"}, "http://m:1", False)
    assert f"pepper, real, {url}\n" in text


def test_the_pilots_page_is_on_loopback_unless_a_person_names_another_address():
    assert pilot_page.pilot_page_address({}) == "127.0.0.1"
    assert pilot_page.pilot_page_address({"page": "false"}) is None
    assert pilot_page.pilot_page_address({"page": "127.0.0.2", "sign_in": "false"}) == "127.0.0.2"
    text = announcement.banner("both", {}, "http://m:1", True, link="https://127.0.0.1:9443/#k=1")
    assert "pilot's page https://127.0.0.1:9443/#k=1\n" in text
    assert "pilot's page" not in announcement.banner("walker", {}, "http://m:1", True)


def test_the_link_to_the_page_opens_it_only_where_there_is_no_other_way_in(tmp_path, monkeypatch):
    users = Users(tmp_path / "users.db")
    monkeypatch.setenv("TELEPRESENCE_USERS", str(users.path))
    monkeypatch.setenv(pilot_page.PILOT_PAGE_KEY, "of another station")
    invitations = Invitations(beside(users.path))
    link = pilot_page.OwnPage({"sim": "false"}, simulated=False).open()
    assert link.startswith("https://127.0.0.1:8443/#i=") and pilot_page.PILOT_PAGE_KEY not in os.environ
    assert invitations.use(link.partition("#i=")[2], "ben", bytes(32))[0].role == "pilot"
    first = pilot_page.OwnPage({"page": "127.0.0.2"}, simulated=True)
    link = first.open()
    assert link.startswith("https://127.0.0.2:8443/#i=")
    first.close()
    with pytest.raises(UserError, match="withdrawn"):
        invitations.use(link.partition("#i=")[2], "ben", bytes(32))
    users.add("anna", "correct horse", "pilot")
    assert pilot_page.OwnPage({}, simulated=False).open() == "https://127.0.0.1:8443/"
    assert pilot_page.OwnPage({"page": "false"}, simulated=True).open() == ""
    server_context(tmp_path, ["127.0.0.1"])
    own = {"page_certificate": str(tmp_path / "page.crt")}
    assert pilot_page.OwnPage(own, simulated=False).open() == f"https://{names_of(tmp_path / 'page.crt')[0]}:8443/"
    with pytest.raises(RuntimeError, match=r"page_certificate:=.*No such file"):
        pilot_page.OwnPage({"page_certificate": str(tmp_path / "none")}, simulated=True)
    link = pilot_page.OwnPage({"pilot_page_port": "9443"}, simulated=True).open()
    assert link == f"https://127.0.0.1:9443/#k={os.environ[pilot_page.PILOT_PAGE_KEY]}"


def test_the_fingerprint_of_a_page_for_other_machines_stands_below_its_link(tmp_path, monkeypatch):
    monkeypatch.setattr(pilot_page, "_is_ours", lambda address: True)
    monkeypatch.setenv("TELEPRESENCE_USERS", str(tmp_path / "users.db"))
    settings = {"page": "10.0.0.7", "page_folder": str(tmp_path)}

    def said(**more: str) -> str:
        link = pilot_page.OwnPage(settings | more, simulated=True).open()
        return announcement.banner("pepper", settings | more, "http://m:1", True, link=link)

    text = said()
    shown = fingerprint(tmp_path / "page.crt")
    assert re.search(rf"  pilot's page https://10\.0\.0\.7:8443/#i=\S+\n  certificate  SHA-256 {shown}\n", text)
    server_context(tmp_path, {"10.0.0.7"})  # the page's program
    assert fingerprint(tmp_path / "page.crt") == shown and said().count(shown) == 1
    assert "SHA-256" not in said(page="true"), "only this computer reaches it"
    assert "SHA-256" not in said(page_certificate=str(tmp_path / "page.crt")), "a person's own, which browsers trust"
    assert "SHA-256" not in said(page_url="https://robots.example/anna/", page_proxy="10.8.0.5"), "the proxy's counts"
    (tmp_path / "file").touch()
    assert "SHA-256" not in said(page_folder=str(tmp_path / "file")), "the page says what is wrong"


def test_the_key_of_the_link_is_the_person_who_started_a_station_where_nobody_signs_in(tmp_path):
    users = Users(tmp_path / "users.db")
    invitations = Invitations(beside(users.path))
    account, invitation = Entrance(users, invitations, sign_in=False, own_key="secret").accept("secret", "eve")
    assert (account.name, account.role, invitation) == (getpass.getuser(), "pilot", None)
    for entrance, token in (
        (Entrance(users, invitations, sign_in=True, own_key="secret"), "secret"),
        (Entrance(users, invitations, sign_in=False, own_key="secret"), "secreT"),
        (Entrance(users, invitations, sign_in=False), ""),
    ):
        with pytest.raises(UserError):
            entrance.accept(token, "eve")


@pytest.mark.parametrize("address", ["yes", "0.0.0.0", "203.0.113.7", "::1"])
def test_a_page_at_no_address_of_this_machine_is_refused(address):
    with pytest.raises(RuntimeError, match=f"page:={address}.*this machine"):
        pilot_page.pilot_page_address({"page": address})


def test_nobody_drives_without_an_account_by_a_page_that_others_reach(monkeypatch):
    monkeypatch.setattr(pilot_page, "_is_ours", lambda address: True)
    assert pilot_page.pilot_page_address({"page": "10.0.0.7"}) == "10.0.0.7"
    with pytest.raises(RuntimeError, match="everybody"):
        pilot_page.pilot_page_address({"page": "10.0.0.7", "sign_in": "false"})


def test_the_link_to_a_page_behind_a_proxy_has_the_proxys_address(monkeypatch):
    settings = {"page_url": "https://robots.example/anna/", "page_proxy": "unix:/run/anna.socket", "sign_in": "false"}
    page = pilot_page.OwnPage(settings, simulated=True)
    assert (page.socket, page.url) == ("/run/anna.socket", "unix:/run/anna.socket")
    assert page.open().startswith("https://robots.example/anna/#k=")
    monkeypatch.setenv(pilot_page.SITE, "https://robots.example/")
    assert page.open() == "https://robots.example/anna/", "the site has a link to all of them"
    page = pilot_page.OwnPage(settings | {"page_proxy": "10.8.0.5"}, simulated=True)
    assert (page.socket, page.url) == ("", "https://127.0.0.1:8443/")


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"page_url": "https://robots.example/anna/"}, "belong together"),
        ({"page_proxy": "10.8.0.5"}, "belong together"),
        ({"page_url": "http://robots.example/", "page_proxy": "10.8.0.5"}, "is not of the form https"),
        ({"page_url": "https://robots.example/anna/", "page_proxy": "there"}, "page_proxy:=there"),
    ],
)
def test_what_is_no_proxy_of_the_page_is_refused(settings, says):
    with pytest.raises(RuntimeError, match=says):
        pilot_page.OwnPage(settings, simulated=True)


@pytest.mark.parametrize("robot", ["pepper", "robotino", "both"])
def test_a_unit_has_neither_window_nor_keyboard(robot, capsys):
    quiet = {"gui": "false", "teleop": "false", "conversation": "false"}
    assert up.parse(["--unit", robot]).settings == quiet
    assert up.parse(["--unit", robot, "conversation:=true"]).settings == quiet | {"conversation": "true"}
    with pytest.raises(SystemExit):
        up.parse(["--unit", robot, "gui:=true"])
    assert "a unit has neither window nor terminal" in capsys.readouterr().err


def test_who_has_neither_window_nor_keyboard_is_shown_the_page():
    said = announcement.next_steps(False, "https://robots.example/#k=1", keyboard=False)
    assert said == "Everything is started. Drive in any browser:\n  https://robots.example/#k=1\nCtrl-C ends all of it."
    assert announcement.next_steps(False, "", keyboard=False) == "Everything is started.\nCtrl-C ends all of it."
    assert "Drive from here" in announcement.next_steps(False, "")


def test_a_taken_port_is_named_with_the_argument_that_changes_it():
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        with pytest.raises(RuntimeError, match=rf"{port}.*nao_port:=<port>"):
            launch_settings.require_free(port, "nao_port", "the simulated robot")
    with socket.socket(type=socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        port = other.getsockname()[1]
        with pytest.raises(RuntimeError, match=rf"udp port {port}.*drive_port:=<port>"):
            launch_settings.require_free(port, "drive_port", "Pepper's drive server", udp=True)


def test_a_walker_whose_port_is_taken_does_not_start():
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = str(other.getsockname()[1])
        with pytest.raises(RuntimeError, match=rf"port {port}, wanted for the walker's web server, is taken"):
            launch_settings.require_ports("walker", {"port": port}, True)
    with pytest.raises(RuntimeError, match="port:=x is not a port"):
        launch_settings.require_ports("walker", {"port": "x"}, True)
    launch_settings.require_ports("walker", {"port": "0"}, True)


def test_the_drive_servers_of_a_station_are_known(monkeypatch):
    monkeypatch.delenv("DRIVE_PORT", raising=False)
    ports = lambda *station: {drive.argument: drive.port for drive in launch_settings.drive_ports(*station)}  # noqa: E731
    assert ports("pepper", {}, True) == ports("pepper", {}, False) == {"drive_port": 8085}
    assert ports("both", {}, True) == {"pepper_drive_port": 8085, "drive_port": 8082}
    assert ports("pepper", {"drive_server": "10.0.0.7"}, False) == ports("robotino", {}, False) == {}
    assert ports("walker", {}, True) == {}


@pytest.mark.ros
def test_a_persons_roscore_is_kept_and_its_open_port_named(ros_environment, run_program, wait_until):
    """Debian's rosout listens on every address; the master itself on loopback."""
    uri = ros_environment["ROS_MASTER_URI"]
    run_program("roscore", "-p", uri.rpartition(":")[2], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    wait_until(lambda: master_answers(uri), "the master answers")
    wait_until(lambda: master_proxy(uri).lookupNode("/test", "/rosout")[0] == 1, "rosout runs")
    port = master_proxy(uri).lookupNode("/test", "/rosout")[2].strip("/").rpartition(":")[2]
    assert f"(port {port})" in start_conditions.exposure(uri)


def test_ros_for_other_machines_is_refused_without_firewall_rules(monkeypatch):
    monkeypatch.delenv("ROS_HOSTNAME", raising=False)
    monkeypatch.setenv("ROS_IP", "127.0.0.1")
    start_conditions.require_protection(None)
    monkeypatch.setenv("ROS_IP", "10.8.0.1")
    start_conditions.require_protection("mine")
    for setting, words in ((None, "the rules are not loaded.*firewall:=mine"), ("off", "mine is the only value")):
        with pytest.raises(RuntimeError, match=re.compile(words, re.DOTALL)):
            start_conditions.require_protection(setting)


@pytest.mark.ros
def test_a_bare_rosmaster_is_named_as_what_it_is_instead_of_waited_for(ros_master, monkeypatch):
    uri = ros_master["ROS_MASTER_URI"]
    monkeypatch.setattr(start_conditions, "RUN_ID_PATIENCE", 0.3)
    master_proxy(uri).deleteParam("/test", "/run_id")
    with pytest.raises(RuntimeError, match=r"bare rosmaster.*roscore"):
        start_conditions.require_roscore(uri, threading.Event())
    master_proxy(uri).setParam("/test", "/run_id", "as roscore sets it")
    start_conditions.require_roscore(uri, threading.Event())


@pytest.mark.parametrize("name", ["nao_ip", "robotino_ip"])
def test_the_address_of_a_real_robot_needs_word_that_it_is_real(name):
    launch_settings.require_loopback({}, name)
    launch_settings.require_loopback({name: "localhost"}, name)
    with pytest.raises(RuntimeError, match=f"{name}:=10.0.0.7.*sim:=false"):
        launch_settings.require_loopback({name: "10.0.0.7"}, name)


def test_a_folder_with_a_space_is_refused_with_the_reason(request, tmp_path):
    folder = tmp_path / "two words"
    folder.mkdir()
    shutil.copy(request.config.rootpath / "stack", folder)
    answer = subprocess.run([folder / "stack", "build"], capture_output=True, text=True, timeout=30)
    assert answer.returncode == 1
    assert "space in its path" in answer.stderr


def test_a_roslaunch_that_fails_later_is_started_again():
    assert up.ended_for_good(1, started=False), "a mistake in the launch file"
    assert up.ended_for_good(0, started=False) and up.ended_for_good(0, started=True), "a person has ended it"
    assert not up.ended_for_good(1, started=True), "the master died while it went on with the nodes"
    assert not up.ended_for_good(-9, started=False) and not up.ended_for_good(-9, started=True)


def test_stack_names_its_commands(request):
    stack = request.config.rootpath / "stack"
    answer = subprocess.run([stack, "--help"], capture_output=True, text=True, cwd="/", timeout=30)
    assert answer.returncode == 0
    for command in ("up", "test", "bench", "exec", "doctor"):
        assert f"\n  {command} " in answer.stdout
    assert subprocess.run([stack, "fly"], capture_output=True, timeout=30).returncode != 0


def test_exec_sets_the_environment_up_from_any_folder(request, tmp_path):
    """Run as from a person's shell: another python3 first in PATH, nothing of ROS in the environment."""
    clean = {
        name: value for name, value in os.environ.items() if not name.startswith(("ROS", "CMAKE", "PYTHON", "VIRTUAL"))
    }
    impostor = tmp_path / "python3"
    impostor.write_text("#!/bin/sh\necho impostor\n")
    impostor.chmod(0o755)
    clean["PATH"] = f"{tmp_path}:/usr/bin:/bin"
    code = "import rospy, mujoco, qi; print('all there')"
    answer = subprocess.run(
        [request.config.rootpath / "stack", "exec", "python3", "-c", code],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env=clean,
        timeout=120,
    )
    assert answer.stdout == "all there\n", answer.stderr
    packages = subprocess.run(
        [request.config.rootpath / "stack", "exec", "rospack", "find", "pepper_bringup"],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env=clean,
        timeout=120,
    )
    assert packages.stdout.strip().endswith("catkin_ws/src/pepper_bringup"), packages.stderr


def test_doctor_finds_a_robot_that_listens_and_one_that_does_not(request, free_port):
    stack = request.config.rootpath / "stack"
    with socket.socket() as robot:
        robot.bind(("127.0.0.1", 0))
        robot.listen()
        answer = subprocess.run(
            [stack, "doctor", f"127.0.0.1:{robot.getsockname()[1]}"], capture_output=True, text=True, timeout=300
        )
        assert "✓ robot at 127.0.0.1" in answer.stdout, answer.stdout + answer.stderr
    answer = subprocess.run([stack, "doctor", f"127.0.0.1:{free_port()}"], capture_output=True, text=True, timeout=300)
    assert answer.returncode == 1
    assert "it refuses" in answer.stdout
