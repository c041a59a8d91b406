"""Attacks by another user of the same computer: reading what was recorded, and having our programs write, or change the
mode of, a file of the attacker's choice by a link at a place that can be guessed."""

from __future__ import annotations

import os
import shutil
import signal
import stat
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from telepresence.station import processes
from telepresence.station.ros_master import master_answers

pytestmark = pytest.mark.ros

ROOT = Path(__file__).resolve().parents[2]
NODES = ROOT / "catkin_ws" / "devel" / "lib"
OTHERS = 0o077
SECRET = "the victim's own text"
CAMERA = textwrap.dedent("""
    import rospy
    from sensor_msgs.msg import Image
    rospy.init_node("camera")
    camera = rospy.Publisher("/camera", Image, queue_size=5)
    picture = Image(width=64, height=48, step=192, encoding="bgr8", data=bytes(64 * 48 * 3))
    while not rospy.is_shutdown():
        picture.header.stamp = rospy.get_rostime()
        camera.publish(picture)
        rospy.sleep(0.05)
""")
RECORD = textwrap.dedent("""
    import signal, sys
    from pathlib import Path
    from PyQt5.QtCore import QCoreApplication, QTimer
    from gui.recording.recorder import Recorder
    application = QCoreApplication(sys.argv)
    recorder = Recorder(Path(sys.argv[1]))
    recorder.reported.connect(lambda page: application.quit())
    signal.signal(signal.SIGUSR1, lambda *_: recorder.stop())
    heartbeat = QTimer(interval=50)
    heartbeat.timeout.connect(lambda: None)
    heartbeat.start()
    recorder.start("session", ["/camera"], "/camera")
    application.exec_()
    recorder.close()
""")
REMEMBER = textwrap.dedent("""
    import pathlib, sys
    from gui.settings import Settings
    settings = Settings(pathlib.Path(sys.argv[1]))
    settings.save("a", "b")
    settings.close()
""")


def run(*argv, check=True, **more):
    """Run a program of ours as most people's shells do: what it makes is readable for all."""
    words = ["sh", "-c", 'umask 022; exec "$@"', "sh", *map(str, argv)]
    return subprocess.run(words, check=check, cwd=ROOT, capture_output=True, text=True, timeout=60, **more)


def accounts(path, *words, check=True):
    options = ["--role", "pilot", "--password-stdin"] if words[0] == "add" else []
    return run(
        sys.executable, "-m", "gui.users", "--file", path, *words, *options, check=check, input="correct horse\n"
    )


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


@pytest.fixture
def victim(tmp_path):
    path = tmp_path / "victim"
    path.write_text(SECRET)
    path.chmod(0o644)
    return path


def untouched(victim):
    return victim.read_text() == SECRET and mode(victim) == 0o644


@pytest.fixture(scope="module")
def graph(tmp_path_factory, free_port, wait_until):
    """The environment of a ROS graph with a camera, whose folder of logs is open to all."""
    folder = tmp_path_factory.mktemp("graph")
    (folder / "ros" / "log").mkdir(parents=True, mode=0o755)
    uri = f"http://127.0.0.1:{(port := free_port())}"
    environment = {**os.environ, "ROS_MASTER_URI": uri, "ROS_HOME": str(folder / "ros"), "ROS_IP": "127.0.0.1"}
    quiet = {"env": environment, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    programs = [processes.start(["rosmaster", "--core", "-p", str(port)], **quiet)]
    wait_until(lambda: master_answers(uri), "the ROS master answers")
    programs.append(processes.start([sys.executable, "-c", CAMERA], **quiet))
    yield environment
    for program in reversed(programs):
        processes.end(program, patience=5.0)


@pytest.fixture(scope="module")
def recorded(graph, tmp_path_factory, wait_until):
    """A folder of recordings that version 0.3 has made, and today's recording in it."""
    folder = tmp_path_factory.mktemp("home") / "telepresence"
    folder.mkdir(mode=0o755)
    for name in ("old.png", "old.bag"):
        (folder / name).write_bytes(b"a face")
        (folder / name).chmod(0o644)
    words = ["sh", "-c", 'umask 022; exec "$@"', "sh", sys.executable, "-c", RECORD, str(folder)]
    process = processes.start(words, env=graph, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        active = folder / "session.bag.active"
        wait_until(lambda: active.exists() and active.stat().st_size > 10_000, "the recording has begun")
        wait_until((folder / "session.mp4").exists, "the film has begun")
        process.send_signal(signal.SIGUSR1)
        wait_until(lambda: process.poll() is not None, "the report is written")
    finally:
        processes.end(process, patience=5.0)
    return folder


@pytest.mark.parametrize("name", ["session.bag", "session.mp4", "session.html", "old.png", "old.bag"])
def test_another_user_reads(recorded, name):
    """Recordings, films, reports and photographs, of today and of earlier versions, are for their owner."""
    assert mode(recorded / name) & OTHERS == 0


def test_another_user_lists_the_recordings(recorded):
    """The folder is closed, even if an earlier version has left it open."""
    assert mode(recorded) & OTHERS == 0


def test_another_user_reads_what_nodes_have_logged(graph, run_program, wait_until, tmp_path):
    """What was said to the robot stands in logs: a node closes their folder before it writes."""
    log = Path(graph["ROS_HOME"], "log")
    run_program(str(NODES / "avatar_gui" / "drive_lease"), f"_users:={tmp_path / 'users.db'}", env=graph)
    wait_until(lambda: any(log.rglob("*drive_lease*.log")), "the node logs")
    assert mode(log) & OTHERS == 0


def test_a_film_is_written_through_a_link(graph, recorded, victim, tmp_path, run_program, wait_until):
    """The film is refused; the file that the link names is not touched."""
    (tmp_path / "film.mp4").symlink_to(victim)
    film = run_program(str(NODES / "avatar_gui" / "record_film"), "/camera", tmp_path / "film.mp4", env=graph)
    wait_until(lambda: film.poll() is not None or victim.stat().st_size != len(SECRET), "it has given up, or written")
    assert untouched(victim)


def test_a_report_is_written_through_a_link(recorded, victim, tmp_path):
    """The report takes the link's place; the file that the link names is not touched."""
    shutil.copy(recorded / "session.bag", tmp_path / "copy.bag")
    (tmp_path / "copy.html").symlink_to(victim)
    run(sys.executable, "-m", "gui.session_report", tmp_path / "copy.bag")
    assert untouched(victim)


def test_another_user_reads_accounts_that_were_left_readable(tmp_path):
    """They are tightened as soon as they are used, and that is said."""
    path = tmp_path / "users.db"
    accounts(path, "list")
    path.chmod(0o644)
    said = accounts(path, "list").stderr
    assert mode(path) & OTHERS == 0 and str(path) in said


def test_accounts_are_made_where_a_link_points(tmp_path):
    """A link at the place of the accounts is not followed."""
    (tmp_path / "users.db").symlink_to(tmp_path / "elsewhere")
    assert accounts(tmp_path / "users.db", "add", "anna", check=False).returncode == 1
    assert not (tmp_path / "elsewhere").exists()


def test_accounts_that_somebody_else_has_put_there_are_used(tmp_path):
    """Somebody else's file would be somebody else's choice of who drives."""
    path = tmp_path / "users.db"
    accounts(path, "list")
    if os.geteuid() == 0:
        os.chown(path, 65534, 65534)
    else:
        path = Path("/etc/passwd")
    assert accounts(path, "list", check=False).returncode == 1


@pytest.mark.parametrize("left", [False, True], ids=["new", "left readable"])
def test_another_user_reads_the_windows_settings(tmp_path, left):
    """Robots' addresses and the pilot's name are for their owner."""
    path = tmp_path / "window.ini"
    if left:
        path.write_text("[General]\na=c\n")
        path.chmod(0o644)
    run(sys.executable, "-c", REMEMBER, path)
    assert mode(path) & OTHERS == 0 and "a=b" in path.read_text()


def test_settings_are_written_through_a_link(tmp_path, victim):
    """A link at the place of the settings is not followed."""
    (tmp_path / "window.ini").symlink_to(victim)
    run(sys.executable, "-c", REMEMBER, tmp_path / "window.ini")
    assert untouched(victim)


def test_the_note_about_the_tablets_page_is_written_through_a_link(tmp_path, victim, monkeypatch):
    """It holds the page's key; its scratch file has a name that nobody can guess."""
    from naoqi_driver.connection import Address
    from telepresence_1.page_record import PageRecord, read_record

    monkeypatch.setenv("ROS_HOME", str(tmp_path))
    (tmp_path / f"com_cam_127.0.0.1_9559.{os.getpid()}").symlink_to(victim)
    robot = Address("tcp://127.0.0.1:9559")
    PageRecord("http://127.0.0.1/?k=key", True, os.getpid()).write(robot)
    assert read_record(robot).url.endswith("key") and untouched(victim)


def test_a_sound_recording_of_the_simulated_robot_is_readable_or_follows_a_link(tmp_path, victim):
    """What the robot said is for its owner, and goes nowhere else."""
    from pepper_sim.sound.loudspeaker_output import LoudspeakerOutput
    from pepper_sim.sound.room import Track

    before = os.umask(0o022)
    try:
        with LoudspeakerOutput(Track(), record=tmp_path / "said.wav"):
            pass
        assert mode(tmp_path / "said.wav") & OTHERS == 0
        (tmp_path / "link.wav").symlink_to(victim)
        with pytest.raises(OSError), LoudspeakerOutput(Track(), record=tmp_path / "link.wav"):
            pass
        assert untouched(victim)
    finally:
        os.umask(before)
