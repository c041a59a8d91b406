"""Programs about maps and moving around, run unchanged; what they did is seen in the world."""

import math
from pathlib import Path

import pytest

MAP = Path(__file__).parent / "documented_files" / "home" / "nao" / "documented.explo"


def test_exploring(naoqi, run_against_robot):
    printed = run_against_robot("map_explore", "--radius", 0.3)
    path = printed.split('"')[1]
    assert naoqi.simulation.server.catalogue.disk.path(path).is_file()
    words = printed.split()
    free, occupied = int(words[words.index("free") + 1]), int(words[words.index("occupied") + 1])
    # A disc of 3 m is 28 square metres: 11 300 cells; the walls on both sides of it are two rows of some 20 cells.
    assert 5000 < free < 16000 and 30 < occupied < 2000


def test_patrolling(naoqi, run_against_robot):
    disk = naoqi.simulation.server.catalogue.disk
    disk.path("/home/nao/room.explo").write_bytes(MAP.read_bytes())
    printed = run_against_robot("map_patrol", "/home/nao/room.explo", 0.4, 0.0, 0.4, 0.3)
    assert printed.count(": reached") == 2, printed
    assert math.dist(naoqi.robot.truth()[:2], (0.4, 0.3)) < 0.3


def test_a_place_to_dance(naoqi, run_against_robot):
    printed = run_against_robot("map_free_zone", "--radius", 0.7)
    assert "code 0 radius 0.70" in printed and "here I dance" in printed
    assert math.hypot(*naoqi.robot.truth()[:2]) <= 0.6


def test_a_trajectory(naoqi, run_against_robot):
    assert "progress [0.5, 1.0]" in run_against_robot("map_trajectory")
    x, y, _, _, _, yaw = naoqi.robot.truth()
    # A quarter around (0, 0.3) ends in (0.3, 0.3) looking left; straight back from there is downwards.
    assert (x, y) == pytest.approx((0.3, 0.0), abs=0.05) and yaw == pytest.approx(math.pi / 2, abs=0.05)
