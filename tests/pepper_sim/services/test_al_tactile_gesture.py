"""ALTactileGesture over the wire: a person's fingers on the head."""

import time

import pytest

RESTING = 0.35
"""Seconds that a hand stays in each of its positions."""
SENSORS = ("FrontTactil", "MiddleTactil", "RearTactil")


@pytest.fixture
def gestures(naoqi, wait_until):
    """The service, more patient than usual; what it told; and a hand that shows it patterns.

    The vendor's client calls back for two signals on two threads: what it told has no order.
    """
    service, told = naoqi.ALTactileGesture, []
    service.setSettleTime(0.1)
    service.setSequenceTime(0.9)
    links = [service.onGesture.connect(told.append), service.onRelease.connect(lambda: told.append("released"))]
    memory = naoqi.ALMemory

    def touch(pattern):
        with naoqi.robot.world.locked():  # all at once, as a hand does
            for sensor, digit in zip(SENSORS, pattern, strict=True):
                naoqi.robot.press(sensor, digit == "1")
        keys = [f"{sensor}Touched" for sensor in SENSORS]
        wait_until(lambda: memory.getListData(keys) == [float(digit) for digit in pattern], "the robot felt it")
        time.sleep(RESTING)

    yield service, told, touch
    touch("000")
    service.onGesture.disconnect(links[0])
    service.onRelease.disconnect(links[1])
    service.setSettleTime(0.08)
    service.setHoldTime(0.8)
    service.setSequenceTime(0.35)


def test_a_stroke(gestures, wait_until):
    """Where a busy machine held the hand up on its way, that was no stroke: it strokes again."""
    _, told, touch = gestures

    def stroked():
        told.clear()
        for pattern in ("100", "010", "001", "000"):
            touch(pattern)
        deadline = time.monotonic() + 1.0  # until the service is sure
        while sorted(told) != ["CaressFtoR", "released"] and time.monotonic() < deadline:
            time.sleep(0.05)
        return sorted(told) == ["CaressFtoR", "released"]

    wait_until(stroked, "the stroke was recognised")


def test_a_hand_that_rests(gestures, wait_until):
    service, told, touch = gestures
    service.setHoldTime(0.4)
    touch("010")
    wait_until(lambda: told[:2] == ["SingleMiddleHold"] * 2, "it was recognised, again and again")
    touch("000")
    wait_until(lambda: told.count("released") == 1, "the release was reported")


def test_a_gesture_of_ones_own(gestures, wait_until, refused):
    service, told, touch = gestures
    name = service.createGesture(["000", "110", "000"])
    assert service.getSequence(name) == ["000", "110", "000"] == service.getGestures()[name]
    assert service.getGesture(["000", "100", "000"]) == "SingleFront"
    assert service.getGesture(["000", "011", "000"]) is None and service.getSequence("nothing") is None

    def recognised():
        """Where a busy machine held the hand up on its way, that was another gesture: it is made again."""
        told.clear()
        touch("110")
        touch("000")
        deadline = time.monotonic() + 1.0  # until the service is sure
        while sorted(told) != sorted([name, "released"]) and time.monotonic() < deadline:
            time.sleep(0.05)
        return sorted(told) == sorted([name, "released"])

    wait_until(recognised, "it was recognised")
    assert "sequence" in refused(service.createGesture, ["100"])
