"""The small panels: safety banner, body state, link health, sound, speech and postures."""

import math
import time

import numpy as np
import pytest
from PyQt5.QtCore import Qt
from PyQt5.QtTest import QTest
from PyQt5.QtWidgets import QCheckBox, QPushButton

from gui.driving.round_trip import RoundTrip
from gui.ros.readings import Battery, BodyState, Careful, Levels, Safety, VoiceSettings, VoiceState
from gui.widgets.body_panel import BodyPanel
from gui.widgets.gate_banner import LEVELS, WORDS, GateBanner
from gui.widgets.link_health import LinkHealth
from gui.widgets.robot_panel import RobotPanel
from gui.widgets.sound_panel import FALL, LevelMeter, SoundPanel


def safety(state, reason, age=0.0):
    return Safety(state, reason, np.zeros(72), 1.0, 0, 0.0, (0, 0, 0), False, time.monotonic() - age)


def test_the_banner_tells_state_and_reason(qt):
    banner = GateBanner()
    assert banner.level == "off" and "No safety gate is running" in banner.text
    banner.show_reading(safety("blocked", "a wall 0.2 m ahead"))
    assert (banner.text, banner.level) == ("Blocked: A wall 0.2 m ahead", "bad")


def test_the_banner_knows_every_state_of_the_safety_layer():
    assert set(LEVELS) == set(WORDS) == {
        "stopped", "fault", "sensor stale", "bumped", "no command", "blocked", "limited", "clear",
    }  # fmt: skip


def test_a_silent_safety_layer_is_an_alarm(qt, spin):
    banner = GateBanner()
    banner.show_reading(safety("clear", "free", age=1.2))
    spin(lambda: banner.level == "bad", "the silence is noticed")
    assert "no protection" in banner.text


@pytest.fixture
def banner(qt):
    """The banner of a pilot, and what it asked for."""
    banner = GateBanner()
    banner.asked = []
    banner.careful_wanted.connect(banner.asked.append)
    banner.set_may_switch(True)
    banner.show()
    return banner


def test_the_careful_scan_is_switched_where_the_gate_has_one(banner):
    switch = banner.findChild(QCheckBox)
    assert not switch.isVisible(), "Pepper's gate has none"
    banner.show_reading(Careful(on=True, by_default=True))
    assert switch.isVisible() and switch.isChecked() and "sway" in switch.text() and banner.asked == []
    switch.click()
    assert banner.asked == [False] and switch.isChecked(), "the box shows what the gate reports"
    banner.show_reading(Careful(on=False, by_default=False))
    assert not switch.isChecked() and banner.careful_choice is False


def test_a_gate_for_which_nobody_has_chosen_is_switched_as_it_was_the_last_time(banner):
    banner.careful_choice = False
    banner.show_reading(Careful(on=False, by_default=True))
    banner.show_reading(Careful(on=True, by_default=False))
    assert banner.asked == [], "what the launch file or another pilot has chosen stays"
    banner.show_reading(Careful(on=True, by_default=True))
    assert banner.asked == [False]


def test_who_watches_sees_the_careful_scan_and_switches_nothing(banner):
    banner.set_may_switch(False)
    banner.careful_choice = False
    banner.show_reading(Careful(on=True, by_default=True))
    assert not banner.findChild(QCheckBox).isEnabled() and banner.asked == []
    banner.set_may_switch(True)
    banner.show_reading(Careful(False, False, "With a laser the body does not sway."))
    assert not banner.findChild(QCheckBox).isEnabled()
    assert banner.findChild(QCheckBox).toolTip() == "With a laser the body does not sway."


def test_body_state_is_written_in_degrees_and_metres_and_forgotten(qt):
    panel = BodyPanel()
    panel.resize(130, 220)
    panel.show_reading(BodyState(1.0, -2.0, 0, 0.1, -0.2, math.pi / 2, 0.3, 0.4, 0.5, "odom", time.monotonic()))
    values = dict(panel.lines())
    assert values["roll, pitch"] == "+6° −11°" and values["heading"] == "+90°"
    assert values["speed"] == "0.50 m/s" and values["x, y"] == "+1.00 −2.00"
    panel.show_reading(BodyState(1.0, -2.0, 0, 0, 0, 0, 0, 0, 0, "odom", time.monotonic() - 1.5))
    assert {value for _, value in panel.lines()} == {"–"}


def horizon_colours(roll, pitch):
    """Mean blue minus red of the left, right, upper and lower half of the horizon's disc."""
    panel = BodyPanel()
    panel.resize(150, 240)
    panel.show_reading(BodyState(0, 0, 0, roll, pitch, 0, 0, 0, 0, "odom", time.monotonic()))
    image = panel.grab().toImage()
    at = lambda x, y: image.pixelColor(x, y).blue() - image.pixelColor(x, y).red()  # noqa: E731
    sky = [[at(x, y) > 15 for x in range(35, 115, 4)] for y in range(35, 115, 4)]
    return np.array(sky, float)


def test_nose_down_shows_more_ground_and_a_roll_to_the_right_tips_the_horizon_left(qt):
    level, down = horizon_colours(0.0, 0.0), horizon_colours(0.0, 0.2)
    assert down.mean() < level.mean() - 0.1
    rolled = horizon_colours(0.4, 0.0)
    assert rolled[:, :10].mean() > rolled[:, 10:].mean() + 0.1


@pytest.mark.parametrize(("delay", "level"), [(0.024, "good"), (0.2, "warn"), (0.4, "bad")])
def test_delays_are_coloured_by_what_they_do_to_driving(qt, delay, level):
    health = LinkHealth()
    health.show_round_trip(delay)
    health.show_picture(delay, 15.0)
    assert health.gauge("command") == (f"{delay * 1000:.0f} ms", level)
    assert health.gauge("age") == (f"{delay * 1000:.0f} ms", level)


def test_unknown_values_are_dashes(qt):
    health = LinkHealth()
    health.show_picture(math.nan, 0.0)
    health.show_reading(Battery(math.nan, math.nan, False, False, 0.0))
    assert health.gauge("age") == ("–", "off") and health.gauge("rate") == ("0 /s", "bad")
    assert health.gauge("battery")[0] == "–"


@pytest.mark.parametrize(
    ("battery", "shown"),
    [
        (Battery(0.87, 25.0, False, False, 0), ("87 %", "good")),
        (Battery(0.2, 25.0, False, False, 0), ("20 %", "warn")),
        (Battery(0.1, 25.0, True, False, 0), ("10 % charging", "bad")),
        (Battery(math.nan, 24.3, False, False, 0), ("24.3 V", "good")),
        (Battery(math.nan, 21.0, False, True, 0), ("21.0 V", "bad")),
    ],
)
def test_battery(qt, battery, shown):
    health = LinkHealth()
    health.show_reading(battery)
    assert health.gauge("battery") == shown


def test_a_round_trip_is_the_first_answer_that_knows_of_the_command():
    trip = RoundTrip()
    assert trip.answered(0.0, 9.95) is None
    trip.sent(10.0)
    trip.sent(10.1)
    assert trip.answered(0.5, 10.2) is None, "this answer knows an older command"
    assert trip.answered(0.03, 10.25) == pytest.approx(0.25)
    assert trip.answered(0.05, 10.3) is None
    trip.sent(11.0)
    assert trip.answered(math.inf, 11.2) is None


def test_what_was_sent_to_a_program_that_was_gone_waits_for_no_answer():
    trip = RoundTrip()
    trip.answered(0.0, 10.0)
    trip.sent(10.1)
    assert trip.answered(1.0, 10.3) is None
    assert trip.waiting(10.3) == pytest.approx(0.2), "a slow link"
    assert trip.answered(math.inf, 11.5) is None
    assert trip.waiting(11.5) == 0.0, "nobody was there to answer"
    trip.sent(11.6)
    assert trip.answered(0.02, 11.7) == pytest.approx(0.1)


def test_meters_rise_at_once_and_fall_slowly(qt, spin):
    meter = LevelMeter()
    meter.set_level(-10.0)
    assert meter.level() == pytest.approx(-10.0, abs=1.0)
    meter.set_level(-50.0)
    assert meter.level() == pytest.approx(-10.0, abs=2.0)
    spin(lambda: meter.level() < -10.0 - 0.2 * FALL, "it falls")
    meter.set_level(math.nan)


def test_sound_controls_work_only_when_there_is_sound(qt):
    panel = SoundPanel()
    muted, talks = [], []
    panel.mute_microphone.connect(muted.append)
    panel.talk.connect(talks.append)
    assert not panel.microphone.isEnabled() and "No sound program" in panel.state
    panel.show_reading(VoiceState("connected", 0.0))
    QTest.mouseClick(panel.microphone, Qt.LeftButton)
    QTest.mousePress(panel.talk_button, Qt.LeftButton)
    QTest.mouseRelease(panel.talk_button, Qt.LeftButton)
    assert muted == [True] and talks == [True, False] and panel.state == "connected"
    panel.show_reading(Levels(-12.0, -60.0, 0.0))
    assert panel.pilot.level() > -20.0


def test_the_sound_panel_shows_what_is_muted_and_used_and_asks_only_what_a_person_asks(qt):
    panel = SoundPanel()
    asked = []
    for signal in (panel.mute_microphone, panel.mute_speaker, panel.microphone_chosen, panel.speaker_chosen):
        signal.connect(asked.append)
    panel.show_reading(VoiceSettings(True, False, "auto", "headset", ("camera",), ()))
    assert panel.microphone.isChecked() and not panel.speaker.isChecked()
    assert panel.microphones.currentText() == "Usual microphone" and panel.speakers.currentText() == "headset"
    assert asked == []

    index = panel.microphones.findText("camera")
    panel.microphones.setCurrentIndex(index)
    panel.microphones.activated.emit(index)
    QTest.mouseClick(panel.microphone, Qt.LeftButton)
    assert asked == ["camera", False]

    panel.show_reading(VoiceSettings(True, False, "auto", "auto", ("camera",), ()))
    assert panel.microphone.isChecked() and panel.microphones.currentData() == "auto", "who refused is believed"
    assert panel.speakers.findText("headset") == -1


def test_a_hidden_panel_lets_go_of_the_microphone(qt):
    panel = SoundPanel()
    panel.show()
    panel.set_available(True)
    talks = []
    panel.talk.connect(talks.append)
    QTest.mousePress(panel.talk_button, Qt.LeftButton)
    panel.hide()
    assert talks == [True, False]


def test_a_sentence_is_said_once_and_blanks_are_not(qt):
    panel = RobotPanel()
    panel.set_robot(True, ())
    said = []
    panel.say.connect(said.append)
    panel.sentence.setText("  Good   morning ")
    QTest.keyClick(panel.sentence, Qt.Key_Return)
    QTest.mouseClick(panel.say_button, Qt.LeftButton)
    assert said == ["Good morning"]


def test_only_what_a_robot_can_do_is_offered(qt):
    panel = RobotPanel()
    taken = []
    panel.posture.connect(taken.append)
    panel.set_robot(False, (("stand", "Stand"),))
    panel.show()
    assert not panel.sentence.isVisible()
    QTest.mouseClick(panel.findChild(QPushButton, "posture_stand"), Qt.LeftButton)
    assert taken == ["stand"]
    panel.set_robot(False, ())
    qt.processEvents()
    assert panel._nothing.isVisible()
