"""The map that the robot makes, against the room as it is: walls at x = ±4 m and y = ±3 m, a post at (-2.5, 2).

The wheels of this robot lie: they count three percent too much of every turn. The map must be right all the same.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from pepper_sim.navigation import exploration_file
from pepper_sim.navigation.grid import RESOLUTION
from pepper_sim.navigation.localizer import AGREEMENT, Localizer
from pepper_sim.navigation.planner import Planner
from telepresence.geometry import Pose

TWO_CELLS = 2 * RESOLUTION
POST, POST_RADIUS = np.array((-2.5, 2.0)), 0.12
START = np.array((-1.6, 1.2))
"""Where the robot stands when it begins its map, looking along x: the map's origin in the room."""


@pytest.fixture(scope="module", name="explored")
def _explored(navigation_in):
    navigation = navigation_in("empty")
    navigation.robot._base._scale_theta = 1.03
    navigation.stand_at(*START)
    navigation.surveyor.begin()
    navigation.finish(navigation.driver.explore(1.2))
    return navigation


def distance_to_surfaces(points):
    """How far points of the map are from the nearest wall or from the post."""
    points = points + START
    x, y = np.abs(points[:, 0]), np.abs(points[:, 1])
    walls = np.minimum(np.abs(x - 4.0), np.abs(y - 3.0))
    post = np.abs(np.hypot(points[:, 0] - POST[0], points[:, 1] - POST[1]) - POST_RADIUS)
    return np.minimum(walls, post)


def wall_points():
    along_x, along_y = np.arange(-3.95, 4.0, RESOLUTION), np.arange(-2.95, 3.0, RESOLUTION)
    return np.concatenate(
        [
            *(np.stack([along_x, np.full_like(along_x, y)], axis=1) for y in (-3.0, 3.0)),
            *(np.stack([np.full_like(along_y, x), along_y], axis=1) for x in (-4.0, 4.0)),
        ]
    )


def test_what_the_map_calls_occupied_is(explored):
    grid = explored.surveyor.exploration.grid
    occupied = grid.places(np.argwhere(grid.occupied()))
    assert len(occupied) > 200
    assert (distance_to_surfaces(occupied) <= TWO_CELLS).mean() > 0.95


def test_the_walls_that_the_lasers_reached_are_in_the_map(explored):
    exploration = explored.surveyor.exploration
    occupied = exploration.grid.places(np.argwhere(exploration.grid.occupied()))
    path = np.array(exploration.path)[:, :2]
    walls = wall_points() - START
    # Two metres are well within reach and hit at less than 45 degrees from most of the path.
    reached = np.hypot(*(walls[:, None] - path[None]).transpose(2, 0, 1)).min(axis=1) < 2.0
    assert reached.sum() > 60
    gaps = np.hypot(*(walls[reached][:, None] - occupied[None]).transpose(2, 0, 1)).min(axis=1)
    assert (gaps <= TWO_CELLS).mean() > 0.95


def test_what_nobody_saw_stays_unknown_and_free_floor_is_free(explored):
    grid = explored.surveyor.exploration.grid
    places = grid.places(np.argwhere(grid.free())) + START
    assert len(places) * RESOLUTION**2 > 20.0
    inside = (np.abs(places[:, 0]) < 4.0 + TWO_CELLS) & (np.abs(places[:, 1]) < 3.0 + TWO_CELLS)
    assert inside.all()
    outside = np.argwhere(np.ones(grid.lasers.shape))
    beyond = np.abs(grid.places(outside) + START) > (4.3, 3.3)
    hidden = outside[beyond.any(axis=1)]
    assert (grid.likelihoods()[hidden[:, 0], hidden[:, 1]] == 50.0).all()
    behind_the_post = grid.index(*(POST - START))
    assert grid.likelihoods()[behind_the_post] == 50.0 or grid.occupied()[behind_the_post]


def test_the_robot_knows_its_place_better_than_its_wheels_do(explored):
    """The same turn over and over: the wheels are wrong by more every time, the map is not."""
    for _ in range(3):
        explored.finish(explored.driver.sweep())
    x, y, _, _, _, yaw = explored.robot.truth()
    pose, wheels = explored.surveyor.pose(), explored.surveyor.odometry()
    assert math.dist(pose[:2] + START, (x, y)) < TWO_CELLS
    assert abs(math.remainder(pose.theta - yaw, math.tau)) < 0.05
    assert abs(math.remainder(wheels.theta - yaw, math.tau)) > 0.12


def test_the_robot_drives_to_a_place_in_its_map(explored):
    assert explored.finish(explored.driver.drive_to((0.5, -0.5))) is True
    x, y = explored.robot.truth()[:2]
    assert math.dist((x, y), (START[0] + 0.5, START[1] - 0.5)) < 0.15
    assert ("progress", pytest.approx(1.0, abs=0.2)) in explored.reports
    assert explored.finish(explored.driver.drive_to((6.0, 0.0))) is False


def test_an_exploration_comes_back_from_its_file(explored, tmp_path):
    exploration = explored.surveyor.exploration
    path = tmp_path / "folder" / exploration_file.file_name()
    assert path.name.endswith("Z.explo")
    exploration_file.save(exploration, path)
    again = exploration_file.load(path)
    assert (again.grid.lasers == exploration.grid.lasers).all() and again.path == exploration.path
    path.write_bytes(path.read_bytes()[:-200])
    with pytest.raises(exploration_file.BadExploration):
        exploration_file.load(path)
    path.write_bytes(b"a text")
    with pytest.raises(exploration_file.BadExploration):
        exploration_file.load(path)


def test_a_robot_that_was_carried_away_finds_its_place_again(explored):
    grid = explored.surveyor.exploration.grid
    explored.finish(explored.driver.sweep())
    points = explored.surveyor.obstacles(Pose(0.0, 0.0, 0.0))
    x, y, _, _, _, yaw = explored.robot.truth()
    localizer = Localizer(grid, Pose(3.0, 2.0, 0.0))
    assert localizer.search(points) > AGREEMENT
    # After half a turn the room looks the same, but for its post.
    assert math.dist(localizer.pose[:2] + START, (x, y)) < 0.15
    assert abs(math.remainder(localizer.pose.theta - yaw, math.tau)) < 0.12
    strange = np.random.default_rng(0).uniform(-2.5, 2.5, (300, 2))
    assert Localizer(grid).search(strange) < AGREEMENT


def test_no_way_leads_through_a_wall(explored):
    planner = Planner(explored.surveyor.exploration.grid, explored.surveyor.pose()[:2])
    assert planner.way_to((0.0, 2.5)) is None
    way = planner.way_to((0.0, -1.5))
    assert way and way[-1] == (0.0, -1.5)
