"""The file that is copied to the robot runs there, without this project."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest
from rto_node.robot_sound import RobotSound
from rto_node.webrtc_camera import WebrtcCamera

from telepresence.drive.link import DriveLink
from telepresence.security.robot_key import RobotKey
from telepresence.station import pair, processes

pytestmark = pytest.mark.slow

ROBOT = Path(__file__).resolve().parents[3] / "catkin_ws" / "src" / "rto_bringup" / "robot"
NEEDED = {"drive": ("numpy",), "camera": (), "sound": ()}
"""Packages that a role may find; () for all but ours."""
SYSTEM = {"sound": ("gi",)}
"""What a role finds in the system's own Python: GStreamer's bindings do not come from PyPI."""
SYSTEM_PYTHON = Path("/usr/lib/python3/dist-packages")
ROLES = list(NEEDED)


@pytest.fixture(scope="module")
def bundle(tmp_path_factory):
    folder = tmp_path_factory.mktemp("robot") / "onboard"
    subprocess.run([sys.executable, str(ROBOT / "make_bundle.py"), str(folder)], check=True, capture_output=True)
    assert {path.name for path in folder.iterdir()} == {
        "robotino_onboard.pyz",
        "requirements.txt",
        "robotino-onboard@.service",
        "drive-watchdog.conf",
        "robot.key",
    }
    return folder / "robotino_onboard.pyz"


def provide_key(path: Path, new: bool) -> str:
    spec = importlib.util.spec_from_file_location("make_bundle", ROBOT / "make_bundle.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.provide_key(path, new)


@pytest.fixture(scope="module")
def make_python(tmp_path_factory):
    """Make the virtual environment of docs/robotino.md, with the packages that a role may find; its interpreter."""

    def make(wanted, system) -> Path:
        folder = tmp_path_factory.mktemp("opt") / "venv"
        python = Path(sys.base_prefix, "bin", "python3")
        subprocess.run([python, "-m", "venv", "--without-pip", folder], check=True, timeout=60)
        (packages,) = folder.glob("lib/python3*/site-packages")
        for package in Path(sysconfig.get_paths()["purelib"]).iterdir():
            ours = package.name.startswith(("__editable__", "telepresence"))
            if not ours and (not wanted or package.name.partition(".")[0] in wanted):
                (packages / package.name).symlink_to(package)
        for package in system:
            (packages / package).symlink_to(SYSTEM_PYTHON / package)
        return folder / "bin/python"

    return make


@pytest.fixture(scope="module")
def everything(make_python):
    """A Python with all packages but ours."""
    return make_python((), SYSTEM["sound"])


def run_alone(python, *words):
    """Run what is copied to the robot as systemd does there, and apart from this project."""
    return subprocess.run([python, "-I", *map(str, words)], cwd="/", capture_output=True, text=True, timeout=60)


@pytest.mark.parametrize("role", ROLES)
def test_explains_itself_where_nothing_is_installed(bundle, role):
    answer = run_alone(sys.executable, "-S", bundle, role, "--help")
    assert answer.returncode == 0 and "--port" in answer.stdout, answer.stderr


def test_every_module_in_it_finds_what_it_imports(bundle, everything):
    files = [name for name in zipfile.ZipFile(bundle).namelist() if name.endswith(".py") and "__main__" not in name]
    names = {name.removesuffix(".py").removesuffix("/__init__").replace("/", ".") for name in files}
    assert {"rto_bringup.onboard.sound_server", "telepresence.audio.pipeline", "rto_node.client"} <= names
    program = f"import sys; sys.path.insert(0, {str(bundle)!r}); import {', '.join(sorted(names))}"
    answer = run_alone(everything, "-c", program)
    assert answer.returncode == 0, answer.stderr


def test_a_module_that_is_not_ours_is_not_packed(bundle):
    roots = {name.partition("/")[0] for name in zipfile.ZipFile(bundle).namelist()}
    assert roots == {"__main__.py", "rto_bringup", "rto_node", "telepresence"}


@pytest.fixture
def start(bundle, make_python, everything):
    """Start a role from the bundle alone, as its systemd unit does; the process, once it has printed its first line."""
    started = []

    def run(role, *options):
        python = make_python(NEEDED[role], SYSTEM.get(role, ())) if NEEDED[role] else everything
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        program = processes.start([str(python), "-I", str(bundle), role, *options], cwd="/", text=True, **pipes)
        started.append(program)
        return program, program.stdout.readline() or pytest.fail(program.communicate(timeout=10)[1])

    yield run
    for program in started:
        assert processes.end(program, patience=10.0) == 0
        for pipe in (program.stdin, program.stdout, program.stderr):
            pipe.close()


def port_of(announcement: str) -> int:
    assert "listens on" in announcement
    return int(announcement.rpartition(":")[2])


def test_the_key_is_made_once_shown_once_and_for_its_owner_only(bundle):
    path = bundle.with_name("robot.key")
    key = RobotKey.read(path)
    again = subprocess.run(
        [sys.executable, "-S", str(ROBOT / "make_bundle.py"), str(bundle.parent)], capture_output=True, text=True
    )
    assert again.returncode == 0 and key.fingerprint in again.stdout and key.text not in again.stdout
    assert RobotKey.read(path) == key
    said = provide_key(path, new=True)
    assert RobotKey.read(path) != key and RobotKey.read(path).text in said
    path.chmod(0o644)
    refused = subprocess.run(
        [sys.executable, "-S", str(ROBOT / "make_bundle.py"), str(bundle.parent)], capture_output=True, text=True
    )
    path.chmod(0o600)
    assert refused.returncode == 1 and "chmod 600" in refused.stderr


def test_the_drive_server_reports_to_a_pilot_with_the_key_beside_it(bundle, start, free_port, wait_until):
    port = port_of(start("drive", "--port", "0", "--robot", f"127.0.0.1:{free_port()}")[1])
    without = DriveLink(f"127.0.0.1:{port}")
    wait_until(lambda: "./stack pair 127.0.0.1" in without.problem, "who has no key learns what to type")
    without.close()
    link = DriveLink(f"127.0.0.1:{port}", RobotKey.read(bundle.with_name("robot.key")))
    try:
        wait_until(
            lambda: link.report()[0] is not None and link.report()[0].state == "fault", "the gate has no sensors"
        )
    finally:
        link.close()


@pytest.fixture
def paired(bundle, tmp_path, monkeypatch):
    """This computer has the robot's key."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    assert pair.main(["127.0.0.1", "--file", str(bundle.with_name("robot.key"))]) == 0


def test_the_camera_sends_pictures(paired, start, wait_until):
    camera = WebrtcCamera(f"127.0.0.1:{port_of(start('camera', '--port', '0', '--source', 'test')[1])}")
    try:
        camera.want(True)
        wait_until(lambda: camera.received > 2, "pictures come")
    finally:
        camera.close()


def test_the_camera_also_sends_by_copy_and_paste(start):
    program, first = start("camera", "--copy-paste", "--source", "test", "--address", "127.0.0.1")
    assert first.startswith("-- Please send this message")
    assert next(line for line in program.stdout if line.startswith("{")).endswith('"type": "offer"}\n')


def test_the_sound_server_sends_what_the_microphone_picks_up(paired, start, wait_until):
    port = port_of(start("sound", "--port", "0", "--microphone", "test", "--speaker", "none")[1])
    sound = RobotSound(f"127.0.0.1:{port}", lambda _frames: None).start()
    try:
        wait_until(lambda: sound.frames > 2, "sound comes")
    finally:
        sound.close()


def test_each_program_has_its_service_in_the_documentation():
    page = (ROBOT.parents[3] / "docs/robotino.md").read_text()
    unit = (ROBOT / "robotino-onboard@.service").read_text()
    for role in ROLES:
        assert f"robotino-onboard@{role}" in page and f"robotino-onboard@{role}" in unit


def test_systemd_starts_a_drive_server_anew_that_hangs():
    """What it says of itself: test_drive_server.py."""
    lines = (ROBOT / "drive-watchdog.conf").read_text().splitlines()
    assert {"Type=notify", "NotifyAccess=main", "WatchdogSec=2", "WatchdogSignal=SIGKILL"} <= set(lines)
    page = (ROBOT.parents[3] / "docs/robotino.md").read_text()
    (place,) = (line.strip("# ") for line in lines if line.endswith("watchdog.conf"))
    assert f"drive-watchdog.conf {place}" in page


@pytest.mark.parametrize(
    "line",
    [
        "NoNewPrivileges=yes",
        "CapabilityBoundingSet=",
        "ProtectSystem=strict",
        "ProtectHome=yes",
        "PrivateTmp=yes",
        "RestrictAddressFamilies=AF_INET AF_INET6 AF_UNIX AF_NETLINK",
        "SystemCallFilter=@system-service",
        "DevicePolicy=closed",
        "MemoryMax=1G",
    ],
)
def test_a_program_that_is_taken_over_can_do_little_else(line):
    """`systemd-analyze security --offline=true` rates the unit 1.8 of 10 ("OK"); without these lines 9.2 ("UNSAFE")."""
    assert line in (ROBOT / "robotino-onboard@.service").read_text().splitlines()
