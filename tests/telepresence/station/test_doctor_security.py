"""What `./stack doctor --security` says of real sockets, files and libraries."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from telepresence.security import robot_key
from telepresence.security.robot_key import RobotKey
from telepresence.station import bundled_versions, doctor, doctor_security

LISTEN = """
import socket, time
everybody, loopback = socket.create_server(("0.0.0.0", 0)), socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
six = socket.create_server(("::", 0), family=socket.AF_INET6)
loopback.bind(("127.0.0.1", 0))
print(everybody.getsockname()[1], six.getsockname()[1], loopback.getsockname()[1], flush=True)
time.sleep(60)
"""


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("TELEPRESENCE_FOLDER", str(tmp_path / "recordings"))
    monkeypatch.setenv("TELEPRESENCE_USERS", str(tmp_path / "users.db"))
    return tmp_path


def test_debians_python_alone_can_ask():
    """`./stack doctor` runs before anything is installed."""
    code = "import sys; sys.path.insert(0, '.'); import telepresence.station.doctor_security"
    subprocess.run(["/usr/bin/python3", "-B", "-I", "-c", code], cwd=doctor.ROOT, check=True)


def test_a_socket_of_ours_is_found_and_judged_by_its_address(run_program):
    program = run_program(sys.executable, "-c", LISTEN, stdout=-1, text=True)
    tcp, six, udp = program.stdout.readline().split()
    found = {what.rpartition(" ")[2]: (fine, what) for fine, what, _ in doctor_security.sockets()}
    assert not found[tcp][0] and "tcp 0.0.0.0 " in found[tcp][1]
    assert not found[six][0] and "tcp :: " in found[six][1]
    assert found[udp][0] and "udp 127.0.0.1" in found[udp][1]


@pytest.mark.parametrize(("text", "address"), [("0100007F", "127.0.0.1"), ("0" * 24 + "01000000", "::1")])
def test_addresses_of_proc_are_read(text, address):
    assert doctor_security._address(text) == address
    assert doctor_security._address("0000000000000000FFFF00000100007F") == "127.0.0.1"


def test_files_that_others_can_read_are_named_with_the_remedy(home):
    RobotKey.make(robot_key.path_of("10.0.0.2"))
    recording = home / "recordings" / "drive.bag"
    recording.parent.mkdir(mode=0o700)
    recording.touch(0o600)
    (home / "users.db").touch(0o600)
    assert [fine for fine, _, _ in doctor_security.files()] == [True]
    recording.chmod(0o640)
    recording.parent.chmod(0o755)
    ((fine, what, remedy),) = doctor_security.files()
    assert not fine and what.endswith("open to others: 2")
    assert f"chmod 600 {recording}" in remedy and f"chmod 700 {recording.parent}" in remedy


def test_a_symbolic_link_among_the_keys_is_named(home):
    RobotKey.make(robot_key.path_of("10.0.0.2"))
    robot_key.path_of("10.0.0.3").symlink_to(robot_key.path_of("10.0.0.2"))
    ((fine, _, remedy),) = doctor_security.files()
    assert not fine and "10.0.0.3.key is a symbolic link" in remedy


def test_a_robot_without_a_key_is_named(capsys):
    RobotKey.make(robot_key.path_of("10.0.0.2"))
    assert [fine for fine, _, _ in doctor_security.robots("http://10.0.0.2:80")] == [True]
    ((fine, what, remedy),) = doctor_security.robots("10.0.0.3")
    assert not fine and what == "key for 10.0.0.3" and "./stack pair 10.0.0.3" in remedy
    assert "robots with a key here: 10.0.0.2" in capsys.readouterr().out


def test_a_robot_that_is_driven_is_found_by_its_launch_argument(tmp_path):
    process = tmp_path / "proc" / "1234567"
    process.mkdir(parents=True)
    words = ["/usr/bin/python3", "/usr/bin/roslaunch", "robotino.launch", "robotino_ip:=10.0.0.9", "sim:=false", ""]
    (process / "cmdline").write_text("\0".join(words))
    assert doctor_security.driven(tmp_path / "proc") == {"10.0.0.9"}


@pytest.mark.parametrize("sign", ["\0", " "], ids=["on its own", "forked by roslaunch"])
def test_a_node_has_the_name_of_its_program(tmp_path, sign):
    process = tmp_path / "1234567"
    process.mkdir()
    node = f"{doctor_security.ROOT}/catkin_ws/devel/lib/pilot_page/pilot_page"
    words = [f"{doctor_security.ROOT}/.venv/bin/python3", node, "--port", "8443", "__log:=/tmp/pilot_page-18.log"]
    (process / "cmdline").write_text(sign.join(words) + "\0")
    assert [name for name, _, _ in doctor_security.ours(tmp_path)] == ["pilot_page"]


@pytest.mark.parametrize(
    ("version", "good"),
    [("3.0.20", False), ("3.0.21", True), ("3.2.9", False), ("3.6.2", False), ("4.0.3", True), ("4.1.0", True)],
)
def test_a_version_is_judged_by_its_own_series(version, good):
    assert doctor_security.is_good(version, ("3.0.21", "3.5.7", "3.6.3", "4.0.3")) is good


def test_every_bundled_library_tells_its_version_and_is_judged(capsys):
    assert {library.name for library in doctor_security.LIBRARIES} == set(bundled_versions.READERS)
    found = list(doctor_security.libraries())
    assert all(fine for fine, _, _ in found), found  # what is old and reached must be renewed, not shown for years
    shown = capsys.readouterr().out
    assert len(found) + shown.count("not reached: ") == len(bundled_versions.versions())


def test_the_exit_status_says_whether_something_is_to_be_fixed(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["doctor", "--security"])
    for fine in (True, False):
        monkeypatch.setattr(doctor_security, "findings", lambda _, fine=fine: iter([(fine, "it", "do this")]))
        assert doctor.main() == (0 if fine else 1)
    assert "      -> do this" in capsys.readouterr().out
