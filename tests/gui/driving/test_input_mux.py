"""Several input devices, one robot."""

import pytest
from PyQt5.QtCore import QObject, pyqtSignal

from gui.driving.input_mux import InputMux

AHEAD, BACK, ZERO = (0.2, 0.0, 0.0), (-0.2, 0.0, 0.0), (0.0, 0.0, 0.0)


class InputDevice(QObject):
    keeps_control = False
    velocity = pyqtSignal(float, float, float)

    def __init__(self):
        super().__init__()
        self.speed = self.turn = 0.0
        self.block, self.passing, self.moving = "", False, False

    def move(self, velocity):
        self.moving = any(velocity)
        self.velocity.emit(*velocity)

    def release_all(self):
        if self.moving:
            self.move(ZERO)

    def set_block(self, reason, passing=False):
        self.block, self.passing = reason, passing
        if reason:
            self.release_all()


@pytest.fixture
def mux(qt):
    mux = InputMux()
    mux.pad, mux.stick = InputDevice(), InputDevice()
    mux.add(mux.pad)
    mux.add(mux.stick)
    mux.sent = []
    mux.velocity.connect(lambda *velocity: mux.sent.append(velocity))
    return mux


def test_what_began_last_drives_and_the_other_is_released(mux):
    mux.pad.move(AHEAD)
    mux.stick.move(BACK)
    assert mux.sent == [AHEAD, BACK] and not mux.pad.moving and mux.driver is mux.stick
    mux.stick.move(ZERO)
    assert mux.sent == [AHEAD, BACK, ZERO] and mux.driver is None


def test_a_zero_of_a_hand_that_does_not_drive_is_not_passed_on(mux):
    mux.pad.move(AHEAD)
    mux.stick.move(ZERO)
    assert mux.sent == [AHEAD]


def test_a_reason_not_to_drive_stops_and_holds_for_all(mux):
    mux.pad.move(AHEAD)
    mux.set_block("The picture is lost.")
    assert mux.sent == [AHEAD, ZERO] and mux.stick.block == "The picture is lost."
    mux.stick.move(BACK)
    assert mux.sent == [AHEAD, ZERO]
    mux.set_block("")
    mux.stick.move(BACK)
    assert mux.sent[-1] == BACK


def test_stop_sends_zero_even_when_nothing_moves(mux):
    mux.stop()
    mux.pad.move(AHEAD)
    mux.stop()
    assert mux.sent[0] == ZERO and mux.sent[-1] == ZERO and not mux.pad.moving


def test_speeds_reach_every_device_also_a_later_one(mux):
    mux.set_speeds(0.3, 0.7)
    late = InputDevice()
    mux.add(late)
    assert {(device.speed, device.turn) for device in (mux.pad, mux.stick, late)} == {(0.3, 0.7)}


def test_every_device_is_told_whether_a_block_passes_by_itself(mux):
    late = InputDevice()
    mux.set_block("the picture is late", passing=True)
    mux.add(late)
    assert mux.pad.block == late.block == "the picture is late" and mux.pad.passing and late.passing
    mux.set_block("the picture is late")
    assert late.block == "the picture is late" and not mux.pad.passing and not late.passing


def test_a_zero_keeps_control_while_something_is_held(mux):
    mux.stick.keeps_control = True
    mux.stick.move(AHEAD)
    mux.stick.move(ZERO)
    assert mux.sent == [AHEAD, ZERO] and mux.driver is mux.stick
    mux.stick.keeps_control = False
    mux.stick.move(ZERO)
    assert mux.driver is None


def test_who_begins_releases_what_the_others_hold(mux):
    waiting = []
    mux.stick.release_all = lambda: waiting.append("released")
    mux.pad.move(AHEAD)
    assert waiting and mux.sent == [AHEAD]
