"""ALNavigation over the wire."""

import pytest


def test_near_goals_are_driven_to_and_maps_are_missing(naoqi, refused):
    navigation = naoqi.ALNavigation
    assert navigation.navigateTo(0.2, 0.0) is True
    assert naoqi.ALMotion.getRobotPosition(True)[0] == pytest.approx(0.2, abs=0.02)
    assert "3 m" in refused(navigation.navigateTo, 5.0, 0.0)
    for call in (navigation.getRobotPositionInMap, navigation.getMetricalMap, navigation.startLocalization):
        assert "no map" in refused(call)
    assert "exploration" in refused(navigation.explore, 2.0)
    assert navigation.loadExploration("/home/nao/map.explo") is False and not navigation.isLocalizationRunning()
    navigation.stopLocalization()
