"""What a robot has said is not shown any more when nobody says it, nor to whoever signs in next."""

import time

import numpy as np
import pytest
from fake_window_parts import RUNNING, picture
from PyQt5.QtCore import Qt
from PyQt5.QtTest import QTest

from gui.app.controller import Attach
from gui.ros.readings import Battery, Careful, DriveState, PageState, Safety, VoiceSettings, VoiceState
from gui.widgets import link_health
from telepresence.teleop.drive_lease import PILOT, Account

HEARD = "you and the robot hear each other"


@pytest.fixture
def window(open_window, link):
    """A window to whom the robot's programs have said all."""
    window = open_window(Attach.NEVER)
    link.published |= {"drive_state", "voice_settings", "tablet"}
    link.become(**RUNNING)
    now = time.monotonic()
    for channel, reading in (
        ("battery", Battery(0.82, 25.0, False, False, now)),
        ("drive_state", DriveState("driving", now)),
        ("voice_state", VoiceState(HEARD, now)),
        ("voice_settings", VoiceSettings(False, False, "auto", "auto", ("camera",), ())),
        ("page", PageState("live", "http://robot:10002", True, now)),
        ("tablet", picture()),
        ("safety", Safety("clear", "free", np.zeros(72), 1.0, 0, 0.0, (0, 0, 0), False, now)),
    ):
        link.channel(channel).arrived.emit(reading)
    window.gate.show_reading(Careful(on=True, by_default=False))
    window.robotPanel.answer("Saying: Good morning")
    assert shown(window) == ("82 %", HEARD, True, "driving", True)
    return window


def shown(window):
    """Battery, sound, whether one may talk, the driver's word, whether there is a picture of the tablet."""
    sound = window.sound
    return (
        window.health.gauge("battery")[0], sound.state, sound.talk_button.isEnabled(), window.aroundLabel.text(),
        window.tablet.image is not None,
    )  # fmt: skip


def test_programs_that_are_gone_leave_nothing_behind(window, link):
    link.become(master=True, joined=True)
    _battery, sound, talks, driver, tablet = shown(window)
    assert "No sound program" in sound and not talks and driver == "" and not tablet
    assert window.aroundLabel.toolTip() == ""


def test_a_battery_that_nobody_reports_is_a_dash(window, link, monkeypatch, spin):
    assert link_health.FORGET_BATTERY_AFTER >= 3.0, "the robots' drivers report it once a second"
    monkeypatch.setattr(link_health, "FORGET_BATTERY_AFTER", 0.3)
    spin(lambda: window.health.gauge("battery") == ("–", "off"), "it is forgotten")
    link.channel("battery").arrived.emit(Battery(0.81, 25.0, False, False, time.monotonic()))
    assert window.health.gauge("battery") == ("81 %", "good")


@pytest.mark.parametrize(
    ("lost", "what"), [("voice_state", "sound"), ("drive_state", "driver"), ("tablet", "tablet"), ("page", "tablet")]
)
def test_one_program_that_is_gone_takes_its_own_values_along(window, link, lost, what):
    link.published.remove(lost)
    link.looked.emit()
    _battery, _sound, talks, driver, tablet = shown(window)
    assert {"sound": talks, "driver": bool(driver), "tablet": tablet} == {
        name: name != what for name in ("sound", "driver", "tablet")
    }


def test_a_sound_program_that_was_killed_is_gone_although_the_master_lists_it(window, link):
    link.connected["voice_state"] = 1
    link.looked.emit()
    assert window.sound.talk_button.isEnabled()
    link.connected["voice_state"] = 0
    link.looked.emit()
    assert "voice_state" in link.found and not window.sound.talk_button.isEnabled()


def test_who_comes_back_is_asked_what_was_said(window, link):
    """A program that says only what changes says it to new subscribers, too."""
    for name in ("voice_state", "voice_settings", "drive_state", "page"):
        assert link.channel(name).wanted
        link.published.remove(name)
        link.looked.emit()
        assert not link.channel(name).wanted
        link.published.add(name)
        link.looked.emit()
        assert link.channel(name).wanted
    assert not link.channel("tablet").wanted, "nobody looks at it"


def test_who_talks_lets_go_when_the_sound_is_gone(window, link):
    talks = []
    window.sound.talk.connect(talks.append)
    window.show_page(window.soundPage)
    QTest.mousePress(window.sound.talk_button, Qt.LeftButton)
    link.become(master=True, joined=True)
    assert talks == [True, False]


@pytest.mark.parametrize("straggler", [False, True], ids=["", "one word was under way"])
def test_the_next_person_sees_nothing_of_what_was_said(window, link, straggler):
    window.controller.dismiss()
    link.become()
    if straggler:
        link.channel("voice_state").arrived.emit(VoiceState(HEARD, time.monotonic()))
        link.channel("drive_state").arrived.emit(DriveState("driving", time.monotonic()))
    window.controller.admit(Account("ben", PILOT))
    battery, sound, talks, driver, tablet = shown(window)
    assert battery == "–" and "No sound program" in sound and not talks and driver == "" and not tablet
    assert "No gate" in window.gate.text and not window.gate.findChild(type(window.gate._switch)).isVisible()
    assert not window.robotPanel._answer.text()
