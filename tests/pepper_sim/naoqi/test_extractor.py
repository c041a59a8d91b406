"""What all extractors share, and the sensor services: sonar, buttons, touch, laser, battery, temperature."""

import pytest


def test_subscriptions_of_an_extractor(naoqi, refused):
    sonar = naoqi.ALSonar
    sonar.subscribe("a")
    sonar.subscribe("b", 200, 0.5)
    assert sonar.getCurrentPeriod() == 30 and sonar.getCurrentPrecision() == 1.0
    assert sonar.getMyPeriod("b") == 200 and sonar.getMyPrecision("b") == pytest.approx(0.5)
    sonar.updatePeriod("b", 10)
    sonar.updatePrecision("b", 0.25)
    assert ["b", 10, 0.25] in sonar.getSubscribersInfo() and sonar.getCurrentPeriod() == 10
    sonar.unsubscribe("a")
    sonar.unsubscribe("b")
    sonar.unsubscribe("b")
    assert sonar.getSubscribersInfo() == []
    assert "nobody" in refused(sonar.getMyPeriod, "nobody")
    assert "precision" in refused(sonar.subscribe, "c", 10, 2.0)
    assert "SonarLeftDetected" in sonar.getEventList()
    assert sonar.getOutputNames() == sonar.getMemoryKeyList() == sonar.getEventList()


def test_sonar_events_only_while_somebody_listens(naoqi, wait_until, simulation):
    service = next(s for s in simulation.server.catalogue.services if s.name == "ALSonar")
    received = []
    subscriber = naoqi.ALMemory.subscriber("SonarLeftNothingDetected")
    subscriber.signal.connect(received.append)
    wait_until(lambda: service._near is None, "it noticed that nobody listens since the test before")
    naoqi.ALSonar.subscribe("listener")
    wait_until(lambda: received, "the free way was reported")
    assert received[0] > 0.5
    near = []
    detected = naoqi.ALMemory.subscriber("SonarRightDetected")
    detected.signal.connect(near.append)
    service._poll(0.3)
    wait_until(lambda: near, "the obstacle was reported")
    assert near == [pytest.approx(0.3)]
    naoqi.ALSonar.unsubscribe("listener")


def test_a_sonar_event_that_cannot_be_raised_is_not_the_last(naoqi, wait_until, simulation, monkeypatch):
    """A client may have filled the memory, for example."""
    service = next(s for s in simulation.server.catalogue.services if s.name == "ALSonar")
    failed, received = [], []

    def fail(*_):
        failed.append(1)
        raise RuntimeError("the memory is full")

    wait_until(lambda: service._near is None, "it noticed that nobody listens since the test before")
    with monkeypatch.context() as patch:
        patch.setattr(service, "_poll", fail)
        naoqi.ALSonar.subscribe("listener")
        wait_until(lambda: failed, "it failed")
    subscriber = naoqi.ALMemory.subscriber("SonarLeftNothingDetected")
    subscriber.signal.connect(received.append)
    wait_until(lambda: received, "it tells again")
    naoqi.ALSonar.unsubscribe("listener")


def test_touch_status(naoqi, wait_until):
    touch = naoqi.ALTouch
    assert "Head/Touch/Front" in touch.getSensorList()
    naoqi.robot.press("FrontTactil", True)
    wait_until(lambda: ["Head/Touch/Front", True, []] in touch.getStatus(), "the touch shows")
    naoqi.robot.press("FrontTactil", False)
    wait_until(lambda: not any(row[1] for row in touch.getStatus()), "nothing is touched")


def test_laser_takes_old_settings(naoqi, refused):
    laser = naoqi.ALLaser
    laser.laserON()
    laser.setOpeningAngle(-1.0, 1.0)
    laser.setDetectingLength(20, 3000)
    laser.setMode("X_Y")
    laser.laserOFF()
    assert "mode" in refused(laser.setMode, "POLAR")
    assert "length_max" in refused(laser.setDetectingLength, 100, 50)
    assert "angle_min" in refused(laser.setOpeningAngle, float("nan"), 1.0)


def test_battery_and_temperature(naoqi):
    charge = naoqi.ALBattery.getBatteryCharge()
    assert isinstance(charge, int) and 0 < charge <= 100
    naoqi.ALBattery.enablePowerMonitoring(True)
    temperature = naoqi.ALBodyTemperature
    assert temperature.getTemperatureDiagnosis() is None
    temperature.setEnableNotifications(False)
    assert temperature.areNotificationsEnabled() is False
    temperature.setEnableNotifications(True)


def test_event_lists_of_the_button_extractors(naoqi):
    assert "RightBumperPressed" in naoqi.ALSensors.getEventList()
    assert "ALChestButton/SimpleClickOccurred" in naoqi.ALChestButton.getEventList()


def test_inherited_module_methods(naoqi, refused):
    module = naoqi.ALSonar
    assert module.ping() is True and module.version().startswith("2.5")
    assert {"subscribe", "ping", "getMethodList"} <= set(module.getMethodList())
    assert module.getMethodHelp("subscribe")[0][0] == "subscribe"
    assert "subscribe" in module.getUsage("subscribe") and module.getModuleHelp()[0] == "ALSonar"
    assert module.isRunning(1) is False and module.wait(1) is None and module.wait(1, 10) is False
    module.stop(1)
    assert module.getBrokerName()
    assert "fly" in refused(module.getMethodHelp, "fly")
