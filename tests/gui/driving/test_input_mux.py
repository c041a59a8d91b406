"""Several hands, one robot."""

import pytest
from PyQt5.QtCore import QObject, pyqtSignal

from gui.driving.input_mux import DriveHub

AHEAD, BACK, ZERO = (0.2, 0.0, 0.0), (-0.2, 0.0, 0.0), (0.0, 0.0, 0.0)


class Hand(QObject):
    velocity = pyqtSignal(float, float, float)

    def __init__(self):
        super().__init__()
        self.speed = self.turn = 0.0
        self.block, self.moving = "", False

    def move(self, velocity):
        self.moving = any(velocity)
        self.velocity.emit(*velocity)

    def release_all(self):
        if self.moving:
            self.move(ZERO)

    def set_block(self, reason):
        self.block = reason
        if reason:
            self.release_all()


@pytest.fixture
def hub(qt):
    hub = DriveHub()
    hub.pad, hub.stick = Hand(), Hand()
    hub.add(hub.pad)
    hub.add(hub.stick)
    hub.sent = []
    hub.velocity.connect(lambda *velocity: hub.sent.append(velocity))
    return hub


def test_what_began_last_drives_and_the_other_is_released(hub):
    hub.pad.move(AHEAD)
    hub.stick.move(BACK)
    assert hub.sent == [AHEAD, BACK] and not hub.pad.moving and hub.driver is hub.stick
    hub.stick.move(ZERO)
    assert hub.sent == [AHEAD, BACK, ZERO] and hub.driver is None


def test_a_zero_of_a_hand_that_does_not_drive_is_not_passed_on(hub):
    hub.pad.move(AHEAD)
    hub.stick.move(ZERO)
    assert hub.sent == [AHEAD]


def test_a_reason_not_to_drive_stops_and_holds_for_all(hub):
    hub.pad.move(AHEAD)
    hub.set_block("The picture is lost.")
    assert hub.sent == [AHEAD, ZERO] and hub.stick.block == "The picture is lost."
    hub.stick.move(BACK)
    assert hub.sent == [AHEAD, ZERO]
    hub.set_block("")
    hub.stick.move(BACK)
    assert hub.sent[-1] == BACK


def test_stop_sends_zero_even_when_nothing_moves(hub):
    hub.stop()
    hub.pad.move(AHEAD)
    hub.stop()
    assert hub.sent[0] == ZERO and hub.sent[-1] == ZERO and not hub.pad.moving


def test_speeds_reach_every_hand_also_a_later_one(hub):
    hub.set_speeds(0.3, 0.7)
    late = Hand()
    hub.add(late)
    assert {(hand.speed, hand.turn) for hand in (hub.pad, hub.stick, late)} == {(0.3, 0.7)}


def test_only_who_waits_hears_that_a_block_passes_by_itself(hub):
    class Waiter(Hand):
        waits = True

        def set_block(self, reason, passing):
            self.block = (reason, passing)

    waiter = Waiter()
    hub.add(waiter)
    hub.set_block("the picture is late", passing=True)
    assert waiter.block == ("the picture is late", True) and hub.pad.block == "the picture is late"
    hub.set_block("the picture is late")
    assert waiter.block == ("the picture is late", False)


def test_who_begins_ends_what_the_others_hold_even_when_that_waits(hub):
    waiting = []
    hub.stick.release_all = lambda: waiting.append("released")
    hub.pad.move(AHEAD)
    assert waiting and hub.sent == [AHEAD]
