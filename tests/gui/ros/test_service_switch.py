"""A switch of a robot's program, whose service answers late or not at all."""

import pytest
from PyQt5.QtTest import QTest

from gui.ros.channels import Answer
from gui.ros.service_switch import ServiceSwitch

TALK = "talk"
GONE = Answer(False, "The program has died.", arrived=False)


@pytest.fixture
def switch(link):
    return ServiceSwitch(link, TALK, False, link)


def asked(link) -> list[bool]:
    return [values[0] for name, *values in link.called if name == TALK]


def test_a_release_waits_for_its_press(link, switch):
    link.slow.add(TALK)
    switch.turn(True)
    switch.turn(False)
    assert asked(link) == [True], "two calls at a time could change places"
    link.waiting.pop()(Answer(True))
    assert asked(link) == [True, False]


def test_of_many_presses_the_last_counts(link, switch):
    link.slow.add(TALK)
    for wanted in (True, False, True, False):
        switch.turn(wanted)
    link.waiting.pop()(Answer(True))
    link.waiting.pop()(Answer(True))
    assert asked(link) == [True, False] and not link.waiting


def test_a_release_that_failed_is_sent_again_and_told_once(link, switch, spin):
    answers = []
    switch.answered.connect(answers.append)
    link.slow.add(TALK)
    switch.turn(False)
    for count in (1, 2):
        assert asked(link) == [False] * count
        link.waiting.pop()(GONE)
        spin(lambda: link.waiting, "it is asked for again")
    link.waiting.pop()(Answer(True))
    assert answers == [GONE, Answer(True)]


def test_a_release_counts_for_somebody_who_has_signed_out(link, switch):
    switch.turn(True)
    link.set_open(False)
    switch.turn(False)
    switch.turn(True)
    assert asked(link) == [True, False]


def test_a_microphone_is_not_opened_later_than_it_was_asked_for(link, monkeypatch):
    monkeypatch.setattr("gui.ros.service_switch.RETRY", 0)
    switch, answers = ServiceSwitch(link, TALK, False, link), []
    switch.answered.connect(answers.append)
    link.slow.add(TALK)
    switch.turn(True)
    link.waiting.pop()(GONE)
    QTest.qWait(50)
    assert answers == [GONE] and asked(link) == [True]


def test_a_program_that_says_nothing_is_told_and_asked_no_second_time(link, spin, monkeypatch):
    monkeypatch.setattr("gui.ros.service_switch.LATE", 50)
    switch, answers = ServiceSwitch(link, TALK, False, link), []
    switch.late.connect(answers.append)
    link.slow.add(TALK)
    switch.turn(False)
    spin(lambda: answers, "it is said")
    assert answers == ["/voice/talk has not answered yet."] and asked(link) == [False]


def test_a_program_that_refuses_is_asked_no_second_time(link, monkeypatch):
    monkeypatch.setattr("gui.ros.service_switch.RETRY", 0)
    switch = ServiceSwitch(link, TALK, False, link)
    link.slow.add(TALK)
    switch.turn(False)
    link.waiting.pop()(Answer(False, "There is no microphone."))
    QTest.qWait(50)
    assert asked(link) == [False]


def test_a_held_button_is_repeated_until_it_is_let_go(link, spin):
    switch = ServiceSwitch(link, TALK, False, link, repeat=10)
    switch.turn(True)
    spin(lambda: asked(link) == [True] * 4, "it is asked for again")
    switch.turn(False)
    QTest.qWait(50)
    assert asked(link) == [True] * 4 + [False]


def test_a_held_button_whose_program_dies_is_said_once_and_repeated(link, spin):
    switch, answers = ServiceSwitch(link, TALK, False, link, repeat=10), []
    switch.answered.connect(answers.append)
    link.slow.add(TALK)
    switch.turn(True)
    for answer in (Answer(True), GONE, GONE, Answer(True), GONE):
        spin(lambda: link.waiting, "it is asked for")
        link.waiting.pop()(answer)
    assert answers == [Answer(True), GONE, Answer(True), GONE]
    switch.turn(False)
    assert asked(link)[-1] is False
