"""ALLocalization over the wire. The empty room has blank walls: the heading comes from the wheels, and it says so."""

import math

import pytest


def test_the_robot_learns_a_home_saves_it_and_drives_back(naoqi):
    localization = naoqi.ALLocalization
    assert localization.goToHome() == 3 and localization.save("kitchen") == 3
    assert not localization.isDataAvailable() and localization.isRelocalizationRequired()
    assert localization.learnHome() == 0
    assert localization.isDataAvailable() and not localization.isRelocalizationRequired()
    assert localization.save("kitchen") == 0
    naoqi.ALMotion.moveTo(0.4, 0.2, 0.5)
    assert localization.getRobotPosition(False) == pytest.approx([0.4, 0.2, 0.5], abs=0.08)
    angle, success, confidence, wheels_only = localization.getRobotOrientation(False)
    assert angle == pytest.approx(0.5, abs=0.08) and success and 0.0 <= confidence <= 1.0
    assert wheels_only == (confidence == 0.0)
    assert localization.goToHome() == 0
    x, y, _, _, _, yaw = naoqi.robot.truth()
    assert math.dist((x, y), (0.0, 0.0)) < 0.1 and abs(yaw) < 0.1
    assert localization.clear("default") == 0 and not localization.isDataAvailable()
    assert localization.load("kitchen") == 0 and localization.isDataAvailable()
    assert localization.clear("kitchen") == 0 and localization.load("kitchen") == 105


def test_directories_stay_under_the_base(naoqi):
    localization = naoqi.ALLocalization
    for name in ("../elsewhere", "/etc", "a/../../b", "."):
        assert localization.load(name) == localization.clear(name) == localization.save(name) == 10
    assert "directory" in localization.getMessageFromErrorCode(10)
    naoqi.ALMotion.rest()
    assert localization.learnHome() == 1
