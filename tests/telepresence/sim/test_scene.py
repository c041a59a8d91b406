"""Scenes with robots in them."""

from __future__ import annotations

import mujoco
import pytest

from telepresence.sim.scene import ROBOT_GROUP, RobotModel, build_world, load_scene, scene_names

PUCK = """
<mujoco model="puck">
  <worldbody>
    <body name="base"><freejoint name="root"/><geom name="body" type="cylinder" pos="0 0 .1" size=".2 .1"/></body>
  </worldbody>
</mujoco>
"""


def puck(prefix: str, spawn: str = "spawn_pepper", offset: tuple[float, float] = (0.0, 0.0)) -> RobotModel:
    return RobotModel(lambda: mujoco.MjSpec.from_string(PUCK), prefix, spawn, offset)


def test_the_scene_for_tests_exists():
    assert "empty" in scene_names()


def test_an_unknown_scene_is_refused_with_the_names_there_are():
    with pytest.raises(ValueError, match=r"'moon'.*empty"):
        load_scene("moon")


def test_pictures_are_cheap_by_default():
    model = build_world("empty").model
    assert model.vis.quality.offsamples == 0
    assert not model.light_castshadow.any()
    assert (model.vis.global_.offwidth, model.vis.global_.offheight) == (1280, 960)


def test_robots_stand_at_their_spawn_points_in_their_own_group():
    world = build_world("empty", [puck("a/"), puck("b/", "spawn_robotino"), puck("c/", offset=(1.0, 0.5))])
    with world.locked() as data:
        places = [data.body(name + "/base").xpos[:2].tolist() for name in "abc"]
    assert places == [[0.0, 0.0], [0.0, -1.5], [1.0, 0.5]]
    assert [int(world.model.geom(name + "/body").group[0]) for name in "abc"] == [ROBOT_GROUP] * 3
    assert int(world.model.geom("floor").group[0]) == 0


def test_an_offset_is_along_the_axes_of_the_spawn_point():
    world = build_world("apartment", [puck("a/"), puck("b/", offset=(1.0, 0.25))])
    with world.locked() as data:
        a, b = (data.body(name + "/base").xpos[:2] for name in "ab")
        assert (b - a).tolist() == pytest.approx([-0.25, 1.0]), "the apartment's Pepper looks along y"


def test_two_robots_need_two_prefixes():
    with pytest.raises(ValueError, match="different prefixes"):
        build_world("empty", [puck("a/"), puck("a/", "spawn_robotino")])


def test_a_missing_spawn_point_is_named_with_those_there_are():
    with pytest.raises(ValueError, match=r"spawn_cat.*spawn_pepper"):
        build_world("empty", [puck("a/", "spawn_cat")])
