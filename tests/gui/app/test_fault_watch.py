"""What the window notices itself, and where it says so."""

import math
import time

import numpy as np
import pytest
from fake_window_parts import FakeLink

from gui.app.controller import Attach, Controller
from gui.ros.picture import Picture
from gui.ros.readings import DriveState, Safety, TruePose
from gui.ros.topics.station import FaultReport
from gui.widgets.video_view import STRAGGLERS
from gui.window import OperatorWindow
from telepresence.station.fault_sentences import NOTICED, OLDEST_REPORT, SHOWN_TIME, SILENT_AFTER, Cause
from telepresence.teleop.lease_messages import PILOT, Account

RUNNING = {"master": True, "joined": True, "driver": True, "feed": True}


@pytest.fixture
def window(qt, link, terminal, monkeypatch):
    monkeypatch.setattr("telepresence.station.fault_sentences.LEAST_TIME", 0.1)
    window = OperatorWindow(terminal)
    window.controller = Controller(window, link, terminal, Attach.NEVER)
    window.controller.admit(Account("anna", PILOT))
    window.show()
    link.become(**RUNNING)
    window.controller.session.start_session()
    yield window
    window.close()
    window.deleteLater()


def safety(link, state="clear", reason="Way is free."):
    still = (0.0, 0.0, 0.0)
    decision = Safety(state, reason, np.full(72, 0.2), math.nan, None, math.inf, still, False, time.monotonic())
    link.channel("safety").arrived.emit(decision)


def report(link, program, what="died: signal 9", age=0.0):
    link.channel("faults").arrived.emit(FaultReport(time.time() - age, program, what, "starts again", time.monotonic()))


def everybody_speaks(link):
    link.report_lease()
    safety(link)
    link.channel("true_pose").arrived.emit(TruePose(*[0.0] * 6, time.monotonic()))
    link.channel("drive_state").arrived.emit(DriveState("driving", time.monotonic()))


def shown(window):
    """The sentence, if banner and bottom line agree."""
    fault = window.controller.faults.fault
    if fault is None or fault.sentence not in window.gate.text or window.status.message != fault.sentence:
        return None
    return fault.sentence


def works(window, link, spin, cause):
    """Everything works, and the window has seen it."""

    def seen():
        everybody_speaks(link)
        return cause in window.controller.faults._worked and window.controller.faults.fault is None

    spin(seen, f"{cause.name} is known to work")


def lose_master(link):
    link.become()


def lose_supervisor(link):
    link.become(**RUNNING, unsupervised=True)


def lose_robot(link):
    link.channel("drive_state").arrived.emit(DriveState("robot unreachable: no route", time.monotonic()))


def lose_server(link):
    safety(link, "fault", "The drive server at 10.0.0.1:8085 does not answer for 0.6 s: is it running?")


@pytest.mark.parametrize(
    ("cause", "fail", "others"),
    [
        (Cause.MASTER, lose_master, ("lease", "safety", "pose")),
        (Cause.STATION, lose_supervisor, ("lease", "safety", "pose")),
        (Cause.LINK, lose_robot, ("lease", "safety", "pose")),
        (Cause.LINK, lose_server, ("lease", "pose")),
        (Cause.LEASE, None, ("safety", "pose")),
        (Cause.DRIVER, None, ("lease", "pose")),
        (Cause.SIMULATION, None, ("lease",)),
    ],
)
def test_each_is_said_in_the_banner_and_at_the_bottom_and_goes_away(window, link, spin, cause, fail, others):
    works(window, link, spin, cause)
    if fail:
        fail(link)
    if "lease" not in others:
        link.repeats.stop()
    speak = {
        "lease": link.report_lease, "safety": lambda: safety(link),
        "pose": lambda: link.channel("true_pose").arrived.emit(TruePose(*[0.0] * 6, time.monotonic())),
    }  # fmt: skip

    def said():
        for name in others:
            speak[name]()
        return shown(window) == NOTICED[cause].format(robot="Pepper")

    spin(said, "it is said")
    link.become(**RUNNING)
    spin(lambda: everybody_speaks(link) or window.controller.faults.fault is None, "it goes away")
    assert "Way is free" in window.gate.text and window.status.message not in NOTICED.values()
    assert window.status.chip("faults")[0] == "1 fault"


def test_who_speaks_again_after_a_silence_is_looked_for_at_once(window, link, monkeypatch):
    """The master lists a driver that was started again, and the window need not wait for its next poll to know."""
    now = time.monotonic()
    monkeypatch.setattr("gui.app.fault_watch.time.monotonic", lambda: now)
    for passed, looks in ((0.0, 0), (0.1, 0), (SILENT_AFTER + 0.1, 1), (0.1, 1)):
        now += passed
        safety(link)
        assert link.looks == looks


def test_what_has_never_worked_and_what_the_pilot_ends_is_no_fault(window, link, spin):
    lose_server(link)
    lose_robot(link)
    window.controller.faults.poll()
    assert window.controller.faults.fault is None, "the robot is still being started"
    works(window, link, spin, Cause.DRIVER)
    window.stopButton.click()
    last = time.monotonic()
    spin(lambda: time.monotonic() - last > SILENT_AFTER + 0.3, "the programs have been silent")
    assert window.controller.faults.fault is None and not window.controller.faults.recent


def test_a_driver_that_speaks_after_its_drive_server_is_not_a_robot_that_was_lost(window, link):
    safety(link)
    window.controller.faults.poll()
    lose_robot(link)
    window.controller.faults.poll()
    assert window.controller.faults.fault is None and window.status.chip("faults")[0] != "1 fault"


def test_a_terminal_that_dies_takes_its_roslaunch_along(window, link, terminal, spin):
    works(window, link, spin, Cause.STATION)
    terminal.failed.emit("window terminal", "died", "opens again")
    assert shown(window) == "The terminal of this window died; it opens again."
    lose_supervisor(link)
    last = time.monotonic()
    said = set()

    def over():
        everybody_speaks(link)
        said.add(shown(window))
        return time.monotonic() - last > SHOWN_TIME + 0.5

    spin(over, "the sentence is over")
    assert NOTICED[Cause.STATION] not in said, "the station's own watches on"


def test_a_report_is_said_once_and_one_kept_for_newcomers_is_not(window, link):
    report(link, "/drive_lease", age=OLDEST_REPORT + 1.0)
    assert window.controller.faults.fault is None
    report(link, "/drive_lease")
    assert "decides who drives died (signal 9); it starts again" in shown(window)
    assert "decides who drives" in window.status._chips["faults"].toolTip()


def test_a_walker_shows_the_banner_for_a_fault_only(qt, terminal):
    window, link = OperatorWindow(terminal), FakeLink("walker")
    Controller(window, link, terminal, Attach.NEVER).admit(Account("anna", PILOT))
    window.show()
    link.become(**RUNNING)
    assert not window.gate.isVisible()
    report(link, "/robot_control_node", "froze")
    assert window.gate.isVisible() and "The simulated robot froze; it starts again." in window.gate.text
    window.close()
    window.deleteLater()


def show(link):
    pixels = np.zeros((4, 4, 3), np.uint8)
    link.channel("picture").arrived.emit(Picture(pixels, "rgb8", time.time(), time.monotonic()))


def test_the_end_of_the_camera_s_program_is_not_waited_for(window, link):
    """A report comes sooner than a picture is missed; what still arrives was under way."""
    link.feed = "/pepper_robot/camera/front/image_raw"
    show(link)
    assert not window.video.late
    report(link, "/pepper_robot/camera/bottom")
    assert not window.video.late, "nobody looks through that one"
    report(link, "/pepper_robot/camera/front")
    assert window.video.late and "The front camera's program died" in shown(window)
    show(link)
    assert window.video.late
    time.sleep(STRAGGLERS)
    show(link)
    assert not window.video.late
