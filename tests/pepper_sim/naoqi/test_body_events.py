"""Events that the body raises, as clients receive them."""

import pytest

from pepper_sim.naoqi import body_events

PARTS = {
    "FrontTactil": ("FrontTactilTouched", "Device/SubDeviceList/Head/Touch/Front/Sensor/Value"),
    "MiddleTactil": ("MiddleTactilTouched", "Device/SubDeviceList/Head/Touch/Middle/Sensor/Value"),
    "RearTactil": ("RearTactilTouched", "Device/SubDeviceList/Head/Touch/Rear/Sensor/Value"),
    "HandRightBack": ("HandRightBackTouched", "Device/SubDeviceList/RHand/Touch/Back/Sensor/Value"),
    "HandLeftBack": ("HandLeftBackTouched", "Device/SubDeviceList/LHand/Touch/Back/Sensor/Value"),
    "ChestButton": ("ChestButtonPressed", "Device/SubDeviceList/ChestBoard/Button/Sensor/Value"),
    "RightBumper": ("RightBumperPressed", "Device/SubDeviceList/Platform/FrontRight/Bumper/Sensor/Value"),
    "LeftBumper": ("LeftBumperPressed", "Device/SubDeviceList/Platform/FrontLeft/Bumper/Sensor/Value"),
    "BackBumper": ("BackBumperPressed", "Device/SubDeviceList/Platform/Back/Bumper/Sensor/Value"),
}


@pytest.mark.parametrize("part", PARTS)
def test_touch_raises_its_event_and_shows_in_its_keys(naoqi, wait_until, part):
    event, key = PARTS[part]
    received, changes = [], []
    touched, changed = naoqi.ALMemory.subscriber(event), naoqi.ALMemory.subscriber("TouchChanged")
    touched.signal.connect(received.append)
    changed.signal.connect(changes.append)
    naoqi.robot.press(part, True)
    wait_until(lambda: received == [1.0], "the press was reported")
    assert naoqi.ALMemory.getListData([event, key]) == [1.0, 1.0]
    naoqi.robot.press(part, False)
    wait_until(lambda: received == [1.0, 0.0], "the release was reported")
    assert naoqi.ALMemory.getListData([event, key]) == [0.0, 0.0]
    wait_until(lambda: len(changes) == 2, "TouchChanged was raised twice")
    assert changes[0][0][1] is True and changes[1][0][1] is False


@pytest.mark.parametrize(("times", "name"), [(1, "Simple"), (2, "Double")])
def test_the_chest_button_clicks(naoqi, wait_until, monkeypatch, times, name):
    monkeypatch.setattr(body_events, "CLICK_PAUSE", 0.7)  # for a machine that has no time
    clicks, memory = [], naoqi.ALMemory
    subscribers = [memory.subscriber(event) for event in body_events.CLICKS]
    for event, subscriber in zip(body_events.CLICKS, subscribers, strict=True):
        subscriber.signal.connect(lambda _, event=event: clicks.append(event))
    for _ in range(times):
        for pressed in (True, False):
            naoqi.robot.press("ChestButton", pressed)
            wait_until(lambda: memory.getData("ChestButtonPressed") == float(pressed), "it was seen")  # noqa: B023
    wait_until(lambda: clicks, "the click was reported")
    assert clicks == [f"ALChestButton/{name}ClickOccurred"]


def test_data_behind_events_is_there_from_the_start(naoqi):
    memory = naoqi.ALMemory
    keys = ["BatteryChargeChanged", "BatteryPowerPluggedChanged", "PostureChanged", "robotIsWakeUp", "TouchChanged"]
    charge, plugged, posture, awake, touch = memory.getListData(keys)
    assert 0 < charge <= 100 and plugged is False and isinstance(posture, str) and awake is True
    assert isinstance(touch, list)


def test_the_events_are_listed(naoqi):
    events = set(naoqi.ALMemory.getEventList())
    assert {"FrontTactilTouched", "ALMotion/MoveFailed", "PostureChanged", "robotHasFallen"} <= events
