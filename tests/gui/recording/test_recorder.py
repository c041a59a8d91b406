"""A recording of a real graph, without a window: whole when asked to end, and when its owner is killed."""

import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import av
import pytest
from PyQt5.QtCore import QObject

from gui.recording import recorder as recorder_module
from gui.recording.recorder import Recorder
from telepresence.station import processes

ROOT = Path(__file__).resolve().parents[3]
TALK = textwrap.dedent("""
    import cv2, itertools, numpy, rospy, sys
    from nav_msgs.msg import Odometry
    from sensor_msgs.msg import CompressedImage
    rospy.init_node("talker")
    topic = rospy.Publisher("/odom", Odometry, queue_size=1)
    camera = rospy.Publisher("/camera/compressed", CompressedImage, queue_size=5)
    for number in itertools.count():
        if rospy.is_shutdown():
            break
        message = Odometry()
        message.pose.pose.orientation.w = 1.0
        topic.publish(message)
        picture = CompressedImage(format="jpeg")
        picture.header.stamp = rospy.Time.from_sec(1.7e9 + 0.05 * number)
        picture.data = cv2.imencode(".jpg", numpy.full((48, 64, 3), number % 200, numpy.uint8))[1].tobytes()
        camera.publish(picture)
        with open(sys.argv[1], "ab") as published:
            published.write(b".")
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
    happened = []
    def note(what):
        print(what, flush=True)
        happened.append(what)
        if len(happened) == 2:
            application.quit()
    recorder.reported.connect(lambda page: note(f"reported {page}"))
    recorder.filmed.connect(lambda film: note(f"filmed {film}"))
    signal.signal(signal.SIGUSR1, lambda *_: recorder.stop())
    heartbeat = QTimer(interval=50)
    heartbeat.timeout.connect(lambda: None)
    heartbeat.start()
    recorder.start("session", ["/odom"], "/camera/compressed")
    application.exec_()
""")


@pytest.fixture
def recording(ros_master, run_program, wait_until, tmp_path):
    """A process that records; its bag has begun to fill."""
    published = tmp_path / "published"
    published.touch()
    run_program(sys.executable, "-c", TALK, str(published))
    process = run_program(
        sys.executable, "-c", RECORD, str(tmp_path / "kept"), cwd=ROOT, stdout=subprocess.PIPE, text=True
    )
    active = tmp_path / "kept" / "session.bag.active"
    wait_until(active.exists, "the recording has begun")
    film = tmp_path / "kept" / "session.mp4"
    wait_until(film.exists, "the film has begun")
    before = published.stat().st_size
    wait_until(lambda: published.stat().st_size >= before + 20, "there is something in them")
    return process


def messages_in(bag):
    words = ["rosbag", "info", "-y", "-k", "messages", str(bag)]
    info = subprocess.run(words, capture_output=True, text=True, timeout=30)
    return int(info.stdout or 0)


def assert_whole_film(path):
    """Each picture is as bright as the number that its time belongs to."""
    with av.open(str(path)) as film:
        seen = [(frame.time, float(frame.to_ndarray(format="gray").mean())) for frame in film.decode(video=0)]
        assert (film.streams.video[0].width, film.streams.video[0].height) == (64, 48)
    assert len(seen) > 10
    for when, brightness in seen:
        number = round(when / 0.05)
        assert when == pytest.approx(0.05 * number, abs=0.002)
        assert brightness == pytest.approx((seen[0][1] + number) % 200, abs=3.0)


@pytest.mark.ros
def test_a_recording_that_is_ended_leaves_a_bag_a_film_and_a_report(recording, tmp_path):
    processes.send(recording.pid, signal.SIGUSR1)
    said, _ = recording.communicate(timeout=60)
    assert "reported" in said and "filmed" in said and "failed" not in said
    assert messages_in(tmp_path / "kept" / "session.bag") > 5
    assert "<svg" in (tmp_path / "kept" / "session.html").read_text()
    assert_whole_film(tmp_path / "kept" / "session.mp4")


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
    assert_whole_film(tmp_path / "kept" / "session.mp4")


def test_a_report_that_takes_long_is_not_taken_for_the_next_one(qt, spin, tmp_path, monkeypatch):
    """Two recordings end one after the other; the first one's report is ready last."""
    program, may_end = tmp_path / "program", tmp_path / "may end"
    wait = f"until [ -e '{may_end}' ]; do sleep 0.05; done"
    program.write_text(f'#!/bin/sh\ncase "$4" in *first*) {wait}; echo slow; exit 1;; esac\n')
    program.chmod(0o755)
    monkeypatch.setattr(recorder_module.sys, "executable", str(program))
    parent = QObject()
    recorder = Recorder(tmp_path, parent)
    happened = []
    recorder.reported.connect(lambda page: happened.append(Path(page).name))
    recorder.failed.connect(happened.append)
    for name in ("first", "second"):
        recorder._write_report(tmp_path / f"{name}.bag")
    spin(lambda: happened, "a report has ended")
    may_end.touch()
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


@pytest.fixture
def make_recorder(qt, fake_ros):
    """A recorder, and what it has said."""
    made = []

    def make():
        recorder, said = Recorder(fake_ros), []
        for signal_of in (recorder.finished, recorder.reported, recorder.filmed):
            signal_of.connect(lambda path: said.append(Path(path).name))
        recorder.failed.connect(said.append)
        made.append(recorder)
        return recorder, said

    yield make
    for held in fake_ros.glob("*.held"):
        held.unlink()
    for recorder in made:
        recorder.close()


def has_begun(folder, name):
    return (folder / f"{name}.bag").exists() and (folder / f"{name}.mp4").exists()


def test_a_film_that_ends_after_its_bag_is_still_the_recordings(make_recorder, fake_ros, spin):
    recorder, said = make_recorder()
    held = fake_ros / "first.mp4.held"
    held.touch()
    recorder.start("first", ["/odom"], "/camera/compressed")
    spin(lambda: has_begun(fake_ros, "first"), "it has begun")
    recorder.stop()
    spin(lambda: "first.html" in said, "the bag is closed")
    assert recorder.recording and recorder.ending, "the camera is still filmed"
    recorder.start("second", ["/odom"], "/camera/compressed")
    held.unlink()
    spin(lambda: not recorder.recording, "the film is closed")
    assert "first.mp4" in said and not (fake_ros / "second.bag").exists()

    recorder.start("third", ["/odom"], "/camera/compressed")
    spin(lambda: has_begun(fake_ros, "third"), "it has begun")
    assert recorder.recording and not recorder.ending
    recorder.stop()
    spin(lambda: not recorder.recording, "bag and film are closed")
    spin(lambda: {"third.bag", "third.mp4", "third.html"} <= {*said}, "all is said")


def test_a_film_ends_with_a_bag_that_ended_by_itself(make_recorder, fake_ros, spin):
    recorder, said = make_recorder()
    recorder.start("session", ["/odom"], "/camera/compressed")
    spin(lambda: has_begun(fake_ros, "session"), "it has begun")
    processes.send(recorder._process.processId(), signal.SIGKILL)
    spin(lambda: not recorder.recording, "the film is closed")
    assert any("ended unexpectedly" in text for text in said) and "session.mp4" in said


def test_a_film_that_does_not_end_is_killed(make_recorder, fake_ros, spin, monkeypatch):
    monkeypatch.setattr(recorder_module, "FILM_PATIENCE", 500)
    recorder, said = make_recorder()
    (fake_ros / "session.mp4.held").touch()
    recorder.start("session", ["/odom"], "/camera/compressed")
    spin(lambda: has_begun(fake_ros, "session"), "it has begun")
    recorder.stop()
    spin(lambda: not recorder.recording, "the film has ended")
    assert "The film did not end in order; session.mp4 holds what came before." in said


def test_a_recorder_that_is_closed_at_once_does_not_wait(make_recorder, monkeypatch):
    """Its programs do not run yet, so that nothing can be interrupted."""
    monkeypatch.setattr(recorder_module, "PATIENCE", 60000)
    recorder, said = make_recorder()
    before = time.monotonic()
    recorder.start("session", ["/odom"], "/camera/compressed")
    recorder.close()
    assert not recorder.recording and time.monotonic() - before < 30.0
    films = [text for text in said if "film" in text]
    assert films in ([], ["There is no film: the recording ended before the first picture."])


FULL = "has less than {}B left, so the recording has ended; session.bag holds what came before. Delete something."


def test_a_recording_that_rosbag_writes_no_more_is_ended_and_said(make_recorder, fake_ros, spin):
    """Some versions of rosbag run on without writing."""
    text = "\x1b[31m[ERROR] [1.0]: Less than 200M of space free on disk with session.bag.active. Disabling recording."
    recorder, said = make_recorder()
    recorder.start("session", ["/odom"], "/camera/compressed")
    spin(lambda: has_begun(fake_ros, "session"), "it has begun")
    (fake_ros / "text").write_text(text)
    (fake_ros / "text").rename(fake_ros / "session.bag.says")
    spin(lambda: recorder.ending, "it is noticed")
    spin(lambda: not recorder.recording, "bag and film are closed")
    spin(lambda: {"session.bag", "session.mp4", "session.html"} <= {*said}, "all is said")
    assert f"{fake_ros} {FULL.format('200M')}" in said and not any("unexpectedly" in text for text in said)


@pytest.mark.ros
def test_what_rosbag_says_of_a_full_disk_is_understood(ros_master, qt, spin, tmp_path, monkeypatch):
    monkeypatch.setattr(recorder_module, "MIN_SPACE", "900000G")
    recorder, said, reported = Recorder(tmp_path / "kept"), [], []
    recorder.failed.connect(said.append)
    recorder.reported.connect(reported.append)
    recorder.start("session", ["/odom"])
    spin(lambda: not recorder.recording, "the recording has ended")
    assert said[0].endswith(FULL.format("900000G"))
    spin(lambda: reported or len(said) > 1, "its report has been tried")
