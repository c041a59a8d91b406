"""Events that the body raises, as clients receive them."""

import pytest

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


def test_the_chest_button_clicks(naoqi, wait_until):
    clicks = []
    subscriber = naoqi.ALMemory.subscriber("ALChestButton/SimpleClickOccurred")
    subscriber.signal.connect(clicks.append)
    naoqi.robot.press("ChestButton", True)
    wait_until(lambda: naoqi.ALMemory.getData("ChestButtonPressed") == 1.0, "the press was seen")
    naoqi.robot.press("ChestButton", False)
    wait_until(lambda: clicks, "the click was reported")


def test_data_behind_events_is_there_from_the_start(naoqi):
    memory = naoqi.ALMemory
    keys = ["BatteryChargeChanged", "BatteryPowerPluggedChanged", "PostureChanged", "robotIsWakeUp", "TouchChanged"]
    charge, plugged, posture, awake, touch = memory.getListData(keys)
    assert 0 < charge <= 100 and plugged is False and isinstance(posture, str) and awake is True
    assert isinstance(touch, list)


def test_the_events_are_listed(naoqi):
    events = set(naoqi.ALMemory.getEventList())
    assert {"FrontTactilTouched", "ALMotion/MoveFailed", "PostureChanged", "robotHasFallen"} <= events
