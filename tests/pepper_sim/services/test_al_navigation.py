"""ALNavigation over the wire, in the empty room."""

import math
from pathlib import Path

import pytest

from pepper_sim.naoqi.navigation.maps import NOT_IN_MAP
from pepper_sim.navigation.exploration_file import FOLDER

MAP = Path(__file__).parents[1] / "documented_files" / "home" / "nao" / "documented.explo"


def test_near_goals_are_driven_to_and_far_ones_ignored(naoqi):
    navigation = naoqi.ALNavigation
    assert navigation.navigateTo(0.2, 0.0) is True
    assert naoqi.ALMotion.getRobotPosition(True)[0] == pytest.approx(0.2, abs=0.06)
    assert navigation.navigateTo(5.0, 0.0) is False
    assert naoqi.ALMotion.getRobotPosition(True)[0] == pytest.approx(0.2, abs=0.06)


def test_without_a_map_every_call_about_maps_is_an_error(naoqi, refused):
    navigation = naoqi.ALNavigation
    for call, *arguments in (
        *((navigation.getMetricalMap,), (navigation.getExplorationPath,), (navigation.saveExploration,)),
        *((navigation.startLocalization,), (navigation.getRobotPositionInMap,), (navigation.relocalizeInMap,)),
        *((navigation.navigateToInMap, [0.0, 0.0, 0.0]), (navigation.relocalizeInMap, [0.0, 0.0])),
    ):
        assert "No exploration loaded" in refused(call, *arguments)
    for call in (navigation.loadExploration, navigation.setDefaultExploration):
        assert "there is no exploration" in refused(call, "/home/nao/nowhere.explo")
    path = naoqi.simulation.server.catalogue.disk.path("/home/nao/text.explo")
    path.write_text("not a map")
    assert "not an exploration" in refused(navigation.loadExploration, "/home/nao/text.explo")
    assert "radius" in refused(navigation.explore, 0.0)
    navigation.stopLocalization()
    navigation.stopExploration()
    assert not navigation.isLocalizationRunning()


def test_a_map_is_loaded_read_and_driven_in(naoqi, refused):
    navigation, disk = naoqi.ALNavigation, naoqi.simulation.server.catalogue.disk
    disk.path("/home/nao/room.explo").write_bytes(MAP.read_bytes())
    assert navigation.loadExploration("/home/nao/room.explo") is True
    path = navigation.saveExploration()
    assert path.startswith(FOLDER) and path.endswith(".explo") and disk.path(path).stat().st_size > 1000
    resolution, width, height, (left, top), pixels = navigation.getMetricalMap()
    assert width == height and len(pixels) == width * height
    assert min(pixels) < 20.0 and max(pixels) > 80.0 and 50.0 in pixels

    def pixel(x, y):
        """Aldebaran's samples find a place's pixel like this: columns first, y from the top."""
        return pixels[round((x - left) / resolution) * height + round((top - y) / resolution)]

    assert pixel(0.5, 0.3) > 80.0  # the floor around the robot
    assert min(pixel(x / 20, 3.0) for x in range(-4, 5)) < 20.0  # the wall 3 m to the left
    assert "not running" in refused(navigation.getRobotPositionInMap)
    assert len(navigation.getExplorationPath()) >= 3
    pose, uncertainty = navigation.relocalizeInMap([0.0, 0.0])
    assert navigation.isLocalizationRunning()
    # From the middle only the walls on both sides can be seen: the guess decides how far along them the robot is.
    assert pose[:2] == pytest.approx(naoqi.robot.truth()[:2], abs=0.25)
    assert len(uncertainty) == 3 and min(uncertainty) > 0.0
    assert navigation.navigateToInMap([50.0, 0.0, 0.0]) == NOT_IN_MAP
    assert navigation.navigateToInMap([0.3, 0.0, 0.0]) == 0
    assert math.dist(naoqi.robot.truth()[:2], (0.3, 0.0)) < 0.3
    assert math.dist(navigation.getRobotPositionInMap()[0][:2], naoqi.robot.truth()[:2]) < 0.3


def test_exploring_is_cancelled_stopped_and_refused_asleep(naoqi, refused):
    navigation = naoqi.ALNavigation
    exploring = navigation.explore(5.0, _async=True)
    while not naoqi.ALMotion.moveIsActive():
        assert exploring.isRunning()
    navigation.stopExploration()
    assert exploring.value(3000) == 2  # cancelled
    naoqi.ALMotion.rest()
    assert navigation.explore(1.0) == 1
    assert "could not be begun" in refused(navigation.startMapping)
    assert navigation.findFreeZone(0.5, 0.5)[0] == 1


def test_free_zones_come_from_what_was_seen(naoqi):
    navigation = naoqi.ALNavigation
    assert navigation.stopAndComputeFreeZone(0.5, 0.5)[0] == 1
    navigation.startFreeZoneUpdate()
    naoqi.ALMotion.moveTo(0.0, 0.0, 2.1)
    code, radius, centre = navigation.stopAndComputeFreeZone(0.6, 0.5)
    assert code == 0 and radius == pytest.approx(0.6) and math.hypot(*centre) <= 0.55
    code, radius, centre = navigation.getFreeZone(4.0, 0.5)
    assert code == 2 and 1.0 < radius < 3.2


def test_a_trajectory_is_driven_in_its_time(naoqi, refused):
    navigation = naoqi.ALNavigation
    before = naoqi.robot.world.time
    assert navigation.moveAlong(["Holonomic", ["Line", [0.3, 0.1]], 0.4, 2.0]) is True
    assert naoqi.robot.world.time - before > 1.7
    assert naoqi.ALMotion.getRobotPosition(True) == pytest.approx([0.3, 0.1, 0.4], abs=0.03)
    assert "trajectory" in refused(navigation.moveAlong, ["Straight on"])


def test_what_replaces_a_drive_is_driven(naoqi, wait_until):
    navigation = naoqi.ALNavigation
    for aside in (0.15, -0.15, 0.15):
        driving = navigation.navigateTo(0.8, 0.0, _async=True)
        wait_until(lambda: naoqi.ALMotion.getRobotVelocity()[0] > 0.1, "it drives")
        x, y, theta = naoqi.ALMotion.getRobotPosition(True)
        assert navigation.moveAlong(["Holonomic", ["Line", [0.0, aside]], 0.0, 2.0]) is True
        assert driving.value(10_000) is False
        dx, dy = (now - then for now, then in zip(naoqi.ALMotion.getRobotPosition(True)[:2], (x, y), strict=True))
        assert dy * math.cos(theta) - dx * math.sin(theta) == pytest.approx(aside, abs=0.05)
        assert navigation.stopNavigateTo() is None
