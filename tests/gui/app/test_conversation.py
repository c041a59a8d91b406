"""What Robot feed begins and ends besides the picture, and what the pilot says."""

import time

import pytest
from fake_window_parts import RUNNING, begun
from PyQt5.QtTest import QSignalSpy, QTest

from gui.app.controller import Attach
from gui.app.conversation import PERIOD
from gui.ros.channels import Answer
from gui.ros.readings import PageState, VoiceSettings, VoiceState
from telepresence.audio.voice_state import NO_CONVERSATION
from telepresence.teleop.lease_messages import PILOT, WATCHER, Account


@pytest.fixture
def talking(open_window, link, spin):
    """A window that has begun a conversation."""
    window = open_window(Attach.NEVER)
    link.become(**RUNNING)
    window.feedButton.click()
    spin(lambda: begun(link) == {"show_page": True, "conversation": True}, "the conversation begins")
    return window


@pytest.fixture
def silent(open_window, link):
    """A window that has begun a conversation and ended it."""
    window = open_window(Attach.NEVER)
    link.become(**RUNNING)
    for _ in range(2):
        window.feedButton.click()
    assert begun(link) == {"show_page": False, "conversation": False}
    return window


def test_a_pilot_who_comes_to_a_robot_is_seen_and_heard_there(open_window, link, spin):
    window = open_window(begins_conversation=True)
    link.lease.update(pilot="ben", window="/other")
    link.become(**RUNNING)
    QTest.qWait(PERIOD + 50)
    assert begun(link) == {} and window.feedButton.isChecked(), "somebody else has the robot"
    link.report_lease(pilot="anna", window=link.node_name)
    spin(lambda: begun(link) == {"show_page": True, "conversation": True}, "anna has it")
    window.controller.dismiss()
    assert begun(link) == {"show_page": False, "conversation": False}


@pytest.mark.parametrize(("role", "begins"), [(WATCHER, True), (PILOT, False)])
def test_nobody_else_begins_by_coming(open_window, link, role, begins):
    window = open_window(role=role, begins_conversation=begins)
    link.become(**RUNNING)
    QTest.qWait(PERIOD + 50)
    assert window.feedButton.isChecked() and begun(link) == {}


def test_who_comes_to_a_robot_in_the_back_is_not_heard_there(open_window, link):
    window = open_window(begins_conversation=True)
    window.controller.conversation.set_in_front(False)
    link.become(**RUNNING)
    window.controller.conversation.set_in_front(True)
    QTest.qWait(PERIOD + 50)
    assert begun(link) == {}, "a conversation in front is handed on"


def test_the_next_pilot_is_seen_and_heard_as_the_first_one_was(open_window, link, spin):
    window = open_window(role=WATCHER, begins_conversation=True)
    link.become(**RUNNING)
    window.controller.dismiss()
    spin(lambda: begun(link) == {"show_page": False, "conversation": False}, "nobody is signed in")
    window.controller.admit(Account("anna", PILOT))
    link.report_lease(pilot="anna", window=link.node_name)
    spin(lambda: begun(link) == {"show_page": True, "conversation": True}, "a pilot has come")
    assert window.feedButton.isChecked()


def test_a_window_that_nobody_has_signed_in_to_ends_what_an_earlier_one_began(open_window, link, spin):
    window = open_window(Attach.NEVER, begins_conversation=True)
    link.become(**RUNNING)
    window.controller.dismiss()
    spin(lambda: begun(link) == {"show_page": False, "conversation": False}, "it is quiet")


def test_who_only_watches_neither_begins_nor_ends_the_conversation(open_window, link):
    window = open_window(Attach.NEVER)
    link.lease.update(pilot="ben", window="/other")
    link.become(**RUNNING)
    for _ in range(2):
        window.feedButton.click()
        QTest.qWait(PERIOD + 50)
    assert begun(link) == {}


def test_signing_out_ends_the_conversation(talking, link):
    talking.controller.dismiss()
    assert begun(link) == {"show_page": False, "conversation": False}


def test_a_conversation_ends_when_somebody_else_has_the_robot_and_leaves_theirs_alone(talking, link):
    link.report_lease(pilot="ben", window="/other")
    assert begun(link) == {"show_page": False, "conversation": False}
    link.called.clear()
    for _ in range(2):
        talking.feedButton.click()
        QTest.qWait(PERIOD + 50)
    talking.controller.dismiss()
    assert begun(link) == {}, "what the new pilot has begun since then is theirs"


def test_a_conversation_goes_on_when_the_robot_comes_back(talking, link, spin):
    link.called.clear()
    link.report_lease(pilot="", window="")
    link.report_lease(pilot="anna", window=link.node_name)
    assert begun(link) == {}, "nobody else had it meanwhile"
    link.report_lease(pilot="ben", window="/other")
    link.called.clear()
    link.report_lease(pilot="anna", window=link.node_name)
    assert begun(link) == {}, "first the other pilot's window ends what it has begun"
    spin(lambda: begun(link) == {"show_page": True, "conversation": True}, "then it goes on")


def test_a_conversation_ends_for_somebody_whose_account_was_removed(talking, link, spin):
    link.report_lease(pilot="", window="")
    link.slow.add("conversation")
    talking.controller.dismiss()
    assert begun(link) == {"show_page": False, "conversation": False}
    link.called.clear()
    link.slow.clear()
    link.waiting.pop()(Answer(False, "The program has died."))
    spin(lambda: begun(link) == {"conversation": False}, "it is asked for again, though nobody is signed in")


def test_a_conversation_that_does_not_end_is_said(talking, link, spin, monkeypatch):
    monkeypatch.setattr("gui.app.conversation.PATIENCE", 0.2)
    link.slow.add("conversation")
    talking.feedButton.click()
    spin(lambda: "Not ended, for there is no answer: sound." in talking.status.message, "it is said")


@pytest.mark.parametrize("end", ["Robot feed", "signing out"])
def test_a_begin_that_is_on_its_way_is_ended_when_it_has_arrived(silent, link, end):
    link.slow.update(("show_page", "conversation"))
    silent.feedButton.click()
    if end == "Robot feed":
        silent.feedButton.click()
    else:
        silent.controller.dismiss()
    assert begun(link) == {"show_page": True, "conversation": True}, "one call at a time"
    link.slow.clear()
    for answered in link.waiting:
        answered(Answer(True))
    assert begun(link) == {"show_page": False, "conversation": False}


def test_a_conversation_outlives_the_master_and_ends_all_the_same(talking, link, spin):
    published, link.published = link.published, set()
    link.become()
    talking.controller.dismiss()
    link.become(master=True)
    link.called.clear()
    link.published = published
    link.become(**RUNNING)
    spin(lambda: begun(link) == {"show_page": False, "conversation": False}, "it ends with the next answer")


def test_a_conversation_goes_on_with_the_programs_that_are_started_next(open_window, link, spin):
    window = open_window(Attach.NEVER)
    link.become(**RUNNING)
    window.feedButton.click()
    spin(lambda: len(begun(link)) == 2, "the conversation begins")
    link.become(master=True, joined=True)
    link.called.clear()
    link.become(**RUNNING)
    spin(lambda: begun(link) == {"show_page": True, "conversation": True}, "it is begun again")


def test_a_mute_in_vain_does_not_look_muted(open_window, link):
    window = open_window(Attach.NEVER)
    link.become(**RUNNING)
    button = window.sound.microphone
    link.channel("voice_settings").arrived.emit(VoiceSettings(False, False, "auto", "auto", (), ()))
    link.slow.add("mute_microphone")
    button.click()
    link.waiting.pop()(Answer(False, "No program offers it.", arrived=False))
    assert not button.isChecked() and window.status.message == "No program offers it."
    button.click()
    assert link.called[-1] == ("mute_microphone", True)


def test_a_sentence_that_nobody_hears_stays_in_its_field(open_window, link):
    window = open_window(Attach.NEVER)
    link.become(**RUNNING)
    panel = window.robotPanel
    link.unheard.update(("say", "posture"))
    panel.sentence.setText("May I come in?")
    panel.say_button.click()
    assert panel.sentence.text() == "May I come in?" and "No program listens to /speech" in panel._answer.text()
    panel.posture.emit("crouch")
    assert "No program of the robot takes postures" in panel._answer.text()
    assert not [name for name, *_ in link.sent if name in ("say", "posture")]
    link.unheard.clear()
    panel.say_button.click()
    assert ("say", "May I come in?") in link.sent and panel.sentence.text() == ""


def test_programs_that_are_started_after_an_end_begin_as_they_are_told(silent, link):
    link.become(master=True, joined=True)
    link.called.clear()
    link.become(**RUNNING)
    QTest.qWait(PERIOD + 50)
    assert begun(link) == {}


def test_a_conversation_ends_when_another_robot_comes_to_the_front(talking, link):
    handed_on = QSignalSpy(talking.controller.conversation.handed_on)
    talking.controller.conversation.set_in_front(False)
    assert begun(link) == {"show_page": False, "conversation": False} and len(handed_on) == 1
    link.called.clear()
    talking.controller.conversation.set_in_front(True)
    assert begun(link) == {}, "it begins when it is handed on to this robot, and not by the tab alone"


def test_what_the_programs_have_begun_is_taken_along(open_window, link):
    window = open_window(Attach.NEVER)
    handed_on = QSignalSpy(window.controller.conversation.handed_on)
    link.become(**RUNNING)
    say_sound(link, "you: live; robot: live")
    window.controller.conversation.set_in_front(False)
    assert begun(link)["conversation"] is False and len(handed_on) == 1


def test_a_robot_in_the_back_stays_silent_and_that_begins_nothing_in_front(open_window, link):
    window = open_window(Attach.NEVER)
    handed_on = QSignalSpy(window.controller.conversation.handed_on)
    window.controller.conversation.set_in_front(False)
    link.become(**RUNNING)
    for _ in range(2):  # its programs begin with sound, or somebody turns it on
        link.called.clear()
        say_sound(link, NO_CONVERSATION)
        say_sound(link, "you: live; robot: live")
        assert begun(link)["conversation"] is False
    assert len(handed_on) == 0, "the pilot has not turned to another robot"


@pytest.mark.parametrize("who", ["nobody talks", "only the page is on", "another pilot has the robot", "it was taken"])
def test_what_is_no_conversation_of_this_window_is_not_taken_along(open_window, link, who):
    window = open_window(Attach.NEVER)
    handed_on = QSignalSpy(window.controller.conversation.handed_on)
    link.become(**RUNNING)
    if who == "it was taken":
        window.feedButton.click()
    if who in ("it was taken", "another pilot has the robot"):
        link.report_lease(pilot="ben", window="/other")
    link.called.clear()
    say_sound(link, "you: live; robot: live" if who == "another pilot has the robot" else NO_CONVERSATION)
    link.channel("page").arrived.emit(PageState("live", "", who == "only the page is on", time.monotonic()))
    window.controller.conversation.set_in_front(False)
    assert "conversation" not in begun(link) and len(handed_on) == 0


def test_who_was_muted_is_muted_before_the_robot_could_hear_anything(open_window, link, spin):
    window = open_window(Attach.NEVER)
    link.become(**RUNNING)
    link.slow.add("mute_microphone")
    window.controller.conversation.want(True, muted=True)
    QTest.qWait(PERIOD + 50)
    assert ("mute_microphone", True) in link.called and "conversation" not in begun(link)
    link.waiting.pop()(Answer(False, "The program has died."))
    spin(lambda: link.waiting, "it is asked for again")
    assert "conversation" not in begun(link)
    link.waiting.pop()(Answer(True))
    assert begun(link) == {"show_page": True, "conversation": True}


def say_sound(link, text):
    link.channel("voice_state").arrived.emit(VoiceState(text, time.monotonic()))
