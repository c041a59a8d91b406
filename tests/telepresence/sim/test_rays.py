"""Rays: bundles of directions, hits on known walls, the robot's own body, noise."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from telepresence.sim.rays import MANY_GEOMS, Rays, add_noise, cone, fan

BOX_ROOM = """
<mujoco>
  <worldbody>
    <geom name="wall" type="box" pos="2.05 0 0" size=".05 5 5"/>
    <geom name="floor" type="plane" size="9 9 .1" pos="0 0 -.5"/>
    <body name="robot" pos="0 0 0">
      <geom type="sphere" size=".3" group="3"/>
      <site name="eye" pos=".1 0 0"/>
      <site name="down" pos=".1 0 0" euler="0 30 0"/>
    </body>
  </worldbody>
</mujoco>
"""


@pytest.fixture(name="room")
def _room():
    model = mujoco.MjModel.from_xml_string(BOX_ROOM)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def test_a_fan_lies_in_the_plane_counter_clockwise():
    vectors = fan(np.radians([90.0, 0.0, -90.0]))
    assert vectors == pytest.approx(np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]), abs=1e-12)


@pytest.mark.parametrize(("rings", "count"), [(1, 7), (2, 19), (3, 37)])
def test_a_cone_is_filled_and_bounded(rings, count):
    vectors = cone(math.radians(30.0), rings)
    angles = np.degrees(np.arccos(vectors[:, 0]))
    assert vectors.shape == (count, 3)
    assert np.linalg.norm(vectors, axis=1) == pytest.approx(1.0)
    assert angles.max() == pytest.approx(30.0) and angles.min() == 0.0


def test_measures_the_distance_to_a_wall_past_its_own_body(room):
    model, data = room
    angles = np.radians([40.0, 0.0, -40.0])
    bundle = Rays(model, [("eye", fan(angles))], max_range=5.0)
    assert bundle.cast(data) == pytest.approx(1.9 / np.cos(angles))


@pytest.mark.parametrize("rays", [1, 9])
def test_any_number_of_robots_see_each_other_and_none_itself(rays):
    body = (
        '<body name="r{0}" pos="{0} 0 0"><freejoint/><geom size=".2"/><site name="eye{0}"/>'
        '<body><geom size=".25"/></body></body>'
    )
    robots = "".join(body.format(i) for i in range(9))
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{robots}</worldbody></mujoco>")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    for i in range(8):
        bundle = Rays(model, [(f"eye{i}", fan(np.zeros(rays)))], max_range=5.0)
        assert bundle.cast(data) == pytest.approx(0.75)
    assert (model.geom_group == 0).all(), "the groups are as they were"


@pytest.mark.parametrize(
    ("directions", "reach"),
    [(cone(math.radians(30.0)), 1.5), (fan(np.linspace(-1.2, 1.2, 40)), 2.0), (fan(np.linspace(0.0, 6.0, 13)), 9.0)],
    ids=["sonar", "laser", "all round"],
)
def test_in_a_crowd_every_ray_hits_what_a_single_ray_would(directions, reach):
    """What is not in the cone of the rays is left out; that must never be seen."""
    body = (
        '<body name="r{0}"><freejoint/><geom size=".2"/><site name="eye{0}" pos=".22 0 .1"/>'
        '<body pos="0 0 .3"><joint/><geom type="capsule" fromto="0 0 0 .5 0 0" size=".04"/></body></body>'
    )
    crowd = "".join(body.format(i) for i in range(MANY_GEOMS // 2))
    wall = '<geom type="plane" size="9 9 .1" pos="0 0 -.6"/><geom type="box" pos="3 0 0" size=".1 3 1"/>'
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{wall}{crowd}</worldbody></mujoco>")
    data = mujoco.MjData(model)
    rng = np.random.default_rng(1)
    hits = 0
    for _ in range(20):
        data.qpos[:] = rng.uniform(-1.5, 1.5, model.nq)
        mujoco.mj_forward(model, data)
        seeing = int(rng.integers(MANY_GEOMS // 2))
        site, root = data.site(f"eye{seeing}"), model.body(f"r{seeing}").id
        bundles = [(f"eye{seeing}", directions), (f"eye{seeing}", -directions)]
        seen = Rays(model, bundles, reach).cast(data)[: len(directions)]
        assert (model.geom_group == 0).all(), "the groups are as they were"
        model.geom_group[model.body_rootid[model.geom_bodyid] == root] = 5
        hit, shown = np.zeros(1, np.int32), np.array([1, 1, 1, 1, 1, 0], np.uint8)
        vectors = directions @ site.xmat.reshape(3, 3).T
        alone = np.array([mujoco.mj_ray(model, data, site.xpos, v, shown, True, -1, hit) for v in vectors])
        model.geom_group[:] = 0
        alone[(alone < 0.0) | (alone > reach)] = np.inf
        hits += int(np.isfinite(alone).sum())
        assert seen == pytest.approx(alone)
    assert hits > 50, "there is something to see"


def _ring_of_sensors(others):
    sites = "".join(f'<site name="s{i}" pos="{x} {y} .1" euler="0 0 {i * 90}"/>' for i, (x, y) in enumerate(_RIM))
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><worldbody><geom type="plane" size="9 9 .1"/><body name="robot"><freejoint/>'
        f'<geom type="cylinder" size=".2 .2" pos="0 0 .2"/>{sites}</body>{others}</worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


_RIM = [(0.2, 0.0), (0.0, 0.2), (-0.2, 0.0), (0.0, -0.2)]
_NEIGHBOUR = (
    '<body pos="0 .6 0"><freejoint/><geom type="cylinder" size=".1 .2" pos="0 0 .2"/>'
    '<geom type="box" size=".15 .15 .2" pos="0 0 .2" contype="0" conaffinity="0"/></body>'
)


def test_a_ring_sees_what_its_bundles_see_and_others_as_their_hulls():
    model, data = _ring_of_sensors(_NEIGHBOUR + '<geom type="box" pos="-.5 0 .2" size=".1 .3 .2"/>')
    beam = cone(math.radians(10.0), 1)
    bundles = [(f"s{i}", beam) for i in range(4)]
    seen = Rays(model, bundles, 0.5, all_around=True).cast(data).reshape(4, 7)
    assert seen == pytest.approx(np.stack([Rays(model, [bundle], 0.5).cast(data) for bundle in bundles]))
    assert seen[1, 0] == pytest.approx(0.3), "not what is painted around the neighbour's hull"
    assert seen[2, 0] == pytest.approx(0.2)
    assert np.isinf(seen[[0, 3]]).all()
    data.qpos[:2] = 0.0, -0.25  # and it moves
    mujoco.mj_forward(model, data)
    assert Rays(model, bundles[1:2], 0.6, all_around=True).cast(data)[0] == pytest.approx(0.55)
    assert (model.geom_group == 0).all(), "the groups are as they were"


def test_a_ring_without_anything_in_reach_casts_no_ray(monkeypatch):
    model, data = _ring_of_sensors(_NEIGHBOUR)
    monkeypatch.setattr(mujoco, "mj_multiRay", lambda *_: pytest.fail("a ray was cast"))
    beam = cone(math.radians(10.0), 1)
    ring = Rays(model, [("s0", beam), ("s2", beam)], 0.3, all_around=True)
    assert np.isinf(ring.cast(data)).all()


def test_a_sensor_of_the_scene_sees_the_scene():
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><site name="eye" pos="-1 0 0"/><geom size=".2"/></worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert Rays(model, [("eye", fan(np.zeros(1)))], 5.0).cast(data) == pytest.approx(0.8)


def test_rays_of_one_sensor_start_at_one_body():
    model, _ = _ring_of_sensors('<body name="other"><site name="elsewhere"/><geom size=".1"/></body>')
    with pytest.raises(ValueError, match="at one body, not at 2"):
        Rays(model, [("s0", fan(np.zeros(1))), ("elsewhere", fan(np.zeros(1)))], 1.0)


def test_beyond_the_range_is_a_miss(room):
    model, data = room
    bundle = Rays(model, [("eye", fan(np.radians([0.0, 180.0])))], max_range=1.5)
    assert np.isinf(bundle.cast(data)).all()


def test_sound_is_not_heard_from_a_surface_that_is_grazed(room):
    model, data = room
    bundle = Rays(model, [("down", cone(math.radians(30.0)))], max_range=5.0)
    # The lowest ray of the cone points 60 degrees down: 30 degrees from the floor's normal.
    assert bundle.cast_echo(data, math.radians(65.0)).min() == pytest.approx(0.5 / math.sin(math.radians(60.0)))
    level = Rays(model, [("eye", cone(math.radians(20.0)))], max_range=5.0)
    assert level.cast(data).min() == pytest.approx(0.5 / math.sin(math.radians(20.0)))
    assert level.cast_echo(data, math.radians(65.0)).min() == pytest.approx(1.9)


def test_noise_is_seeded_stepped_and_keeps_misses():
    true = np.array([0.02, 1.0, 2.0, np.inf])
    read = [
        add_noise(true, np.random.default_rng(7), sigma=0.01, proportional=0.01, resolution=0.03, minimum=0.25)
        for _ in range(2)
    ]
    assert read[0].tolist() == read[1].tolist()
    assert read[0][0] == 0.25
    assert read[0][1:3] / 0.03 == pytest.approx(np.round(read[0][1:3] / 0.03))
    assert np.isinf(read[0][3])


def test_noise_has_the_stated_size():
    read = add_noise(np.full(20000, 2.0), np.random.default_rng(1), sigma=0.01, proportional=0.02)
    assert read.mean() == pytest.approx(2.0, abs=0.002)
    assert read.std() == pytest.approx(0.05, rel=0.03)
