"""A recording of a real graph, without a window: whole when asked to end, and when its owner is killed."""

import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import pytest
from PyQt5.QtCore import QObject

from gui.recording import recorder as recorder_module
from gui.recording.recorder import Recorder
from telepresence.station import processes

ROOT = Path(__file__).resolve().parents[3]
TALK = textwrap.dedent("""
    import rospy
    from nav_msgs.msg import Odometry
    rospy.init_node("talker")
    topic = rospy.Publisher("/odom", Odometry, queue_size=1)
    while not rospy.is_shutdown():
        message = Odometry()
        message.pose.pose.orientation.w = 1.0
        topic.publish(message)
        rospy.sleep(0.05)
""")
RECORD = textwrap.dedent("""
    import signal, sys
    from pathlib import Path
    from PyQt5.QtCore import QCoreApplication, QTimer
    from gui.recording.recorder import Recorder
    application = QCoreApplication(sys.argv)
    recorder = Recorder(Path(sys.argv[1]))
    recorder.failed.connect(lambda text: print("failed", text, flush=True))
    recorder.reported.connect(lambda page: (print("reported", page, flush=True), application.quit()))
    signal.signal(signal.SIGUSR1, lambda *_: recorder.stop())
    heartbeat = QTimer(interval=50)
    heartbeat.timeout.connect(lambda: None)
    heartbeat.start()
    recorder.start("session", ["/odom"])
    application.exec_()
""")


@pytest.fixture
def recording(ros_master, run_program, wait_until, tmp_path):
    """A process that records; its bag has begun to fill."""
    run_program(sys.executable, "-c", TALK)
    process = run_program(
        sys.executable, "-c", RECORD, str(tmp_path / "kept"), cwd=ROOT, stdout=subprocess.PIPE, text=True
    )
    active = tmp_path / "kept" / "session.bag.active"
    wait_until(active.exists, "the recording has begun")
    time.sleep(1.0)  # so that there is something in it
    return process


def messages_in(bag):
    words = ["rosbag", "info", "-y", "-k", "messages", str(bag)]
    info = subprocess.run(words, capture_output=True, text=True, timeout=30)
    return int(info.stdout or 0)


@pytest.mark.ros
def test_a_recording_that_is_ended_leaves_a_bag_and_a_report(recording, tmp_path):
    processes.send(recording.pid, signal.SIGUSR1)
    said, _ = recording.communicate(timeout=60)
    assert said.startswith("reported") and "failed" not in said
    assert messages_in(tmp_path / "kept" / "session.bag") > 5
    assert "<svg" in (tmp_path / "kept" / "session.html").read_text()


@pytest.mark.ros
def test_a_killed_owner_leaves_a_whole_bag_and_no_process(recording, tmp_path, wait_until):
    family = processes.descendants(recording.pid)
    assert family
    processes.send(recording.pid, signal.SIGKILL)
    recording.wait(10)
    bag = tmp_path / "kept" / "session.bag"
    wait_until(bag.exists, "the bag is closed")
    assert messages_in(bag) > 5
    wait_until(lambda: not {*family} & {*processes.descendants()}, "the recorder has ended")


def test_a_report_that_takes_long_is_not_taken_for_the_next_one(qt, spin, tmp_path, monkeypatch):
    """Two recordings end one after the other; the first one's report is ready last."""
    program = tmp_path / "program"
    program.write_text('#!/bin/sh\ncase "$3" in *first*) sleep 0.5; echo slow; exit 1;; esac\n')
    program.chmod(0o755)
    monkeypatch.setattr(recorder_module.sys, "executable", str(program))
    parent = QObject()
    recorder = Recorder(tmp_path, parent)
    happened = []
    recorder.reported.connect(lambda page: happened.append(Path(page).name))
    recorder.failed.connect(happened.append)
    for name in ("first", "second"):
        recorder._write_report(tmp_path / f"{name}.bag")
    spin(lambda: len(happened) == 2, "both reports have ended")
    assert happened == ["second.html", "first.bag is recorded, but its report failed: slow"]


def test_a_recorder_that_is_not_installed_is_reported(qt, spin, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    recorder = Recorder(tmp_path)
    failed = []
    recorder.failed.connect(failed.append)
    recorder.start("session", ["/odom"])
    spin(lambda: failed, "the failure is reported")
    assert failed[0].startswith("The recording cannot start: ") and not recorder.recording
