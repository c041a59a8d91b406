"""What may be asked of a robot by somebody who only watches, by a pilot while another one drives, and while the red
stop is pressed."""

import pytest
from fake_window_parts import RUNNING
from PyQt5.QtCore import Qt
from PyQt5.QtTest import QTest
from PyQt5.QtWidgets import QPushButton

from telepresence.teleop.lease_messages import PILOT, WATCHER

OTHER = {"pilot": "ben", "window": "/other"}


@pytest.fixture(params=[(WATCHER, "anna may watch, not drive."), (PILOT, "ben drives. Press Ask for it.")])
def watching(request, open_window, link):
    """A window of somebody who does not have the robot."""
    role, refusal = request.param
    window = open_window(role=role)
    link.become(**RUNNING)
    link.report_lease(**OTHER)
    window.refusal = refusal
    link.called.clear()
    link.sent.clear()
    return window


def press(window, name):
    window.findChild(QPushButton, name).click()


@pytest.mark.parametrize("posture", ["posture_stand", "posture_rest", "posture_wakeup"])
def test_no_posture(watching, link, posture):
    press(watching, posture)
    assert link.called == link.sent == [] and watching.robotPanel._answer.text() == watching.refusal


def test_no_sentence_and_it_is_kept(watching, link):
    watching.robotPanel.sentence.setText("Good morning")
    QTest.keyClick(watching.robotPanel.sentence, Qt.Key_Return)
    assert link.sent == [] and watching.robotPanel.sentence.text() == "Good morning"
    assert watching.robotPanel._answer.text() == watching.refusal


def test_no_voice_but_silence(watching, link):
    sound = watching.sound
    sound.set_available(True)
    for ask, wanted in ((sound.talk, True), (sound.mute_microphone, False), (sound.mute_speaker, False)):
        ask.emit(wanted)
        assert link.called == [] and watching.status.message == watching.refusal
    for ask, wanted in ((sound.talk, False), (sound.mute_microphone, True), (sound.mute_speaker, True)):
        ask.emit(wanted)
    assert [(name, *values) for name, *values in link.called] == [
        ("talk", False),
        ("mute_microphone", True),
        ("mute_speaker", True),
    ]


def test_no_other_microphone(watching, link):
    watching.sound.microphone_chosen.emit("another one")
    assert link.sent == [] and watching.status.message == watching.refusal


def test_the_careful_scan_is_switched_by_whoever_drives_alone(open_window, link):
    window = open_window()
    link.become(**RUNNING)
    assert window.gate._may_switch
    link.report_lease(**OTHER)
    assert not window.gate._may_switch
    window.gate.careful_wanted.emit(True)
    assert "set_careful" not in [name for name, *_ in link.called]


@pytest.mark.parametrize("posture", ["posture_stand", "posture_rest"])
def test_nothing_moves_while_the_red_stop_is_pressed(open_window, link, posture):
    window = open_window()
    link.become(**RUNNING)
    link.report_lease(stopped_by="the chief")
    link.called.clear()
    link.sent.clear()
    press(window, posture)
    assert link.called == link.sent == []
    assert window.robotPanel._answer.text().startswith("the chief has pressed the red stop")
    window.robotPanel.say.emit("I was stopped.")
    assert link.sent == [("say", "I was stopped.")], "the robot may still speak"


@pytest.mark.parametrize(("role", "ended"), [(PILOT, ["session"]), (WATCHER, [])])
def test_stop_ends_the_programs_of_a_pilot_alone(open_window, link, terminal, role, ended):
    window = open_window(role=role)
    link.become(**RUNNING)
    window.stopButton.click()
    assert terminal.interrupted == ended
