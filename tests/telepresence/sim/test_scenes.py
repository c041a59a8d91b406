"""The scenes as files: what each must offer, that it stands still, and that a robot can drive in it."""

from __future__ import annotations

import functools
import math

import mujoco
import numpy as np
import pytest

from telepresence.sim.painter import Painter
from telepresence.sim.scene import build_world, load_scene, scene_names

MOST_GEOMS = 340
"""Limit for a scene without robots. A geom in view costs a picture 5-30 µs, one hidden by a wall almost as much."""
MOST_GEOMS_IN_VIEW = 130
"""Limit in the field of view of Pepper's camera at the start, where the first picture is judged."""
EYE_HEIGHT = 1.15
"""Pepper's top camera above the floor, rounded [m]. Source: URDF of ros-naoqi/pepper_robot 0.1.10, 1.153 m."""
FIELD_OF_VIEW = math.radians(57.2), math.radians(44.3)
"""Pepper's top camera, horizontal and vertical. Source: NAOqi 2.8 documentation, video_2D_pep."""

SOLID, FLOOR, MOVABLE, VISUAL = (1, 1), (1, 5), (3, 3), (0, 0)

# A robot reduced to what the ground feels: Pepper's wheel positions and weight on three frictionless feet, the drive of
# telepresence.sim.base without its limits.
PROBE = """
<mujoco>
  <worldbody>
    <body name="base">
      <freejoint/>
      <geom type="cylinder" size=".22 .05" pos="0 0 .12" mass="20" group="3"/>
      <geom type="cylinder" size=".12 .40" pos="0 0 .60" mass="8" group="3"/>
      <geom type="sphere" size=".03" pos=".09 .155 .03" condim="1" priority="2" contype="4" conaffinity="0" group="3"/>
      <geom type="sphere" size=".03" pos=".09 -.155 .03" condim="1" priority="2" contype="4" conaffinity="0" group="3"/>
      <geom type="sphere" size=".03" pos="-.17 0 .03" condim="1" priority="2" contype="4" conaffinity="0" group="3"/>
      <site name="drive"/>
    </body>
  </worldbody>
  <actuator>
    <velocity site="drive" gear="1 0 0 0 0 0" kv="20000" forcerange="-90 90"/>
    <velocity site="drive" gear="0 1 0 0 0 0" kv="20000" forcerange="-90 90"/>
    <velocity site="drive" gear="0 0 0 0 0 1" kv="2000" forcerange="-15 15"/>
  </actuator>
</mujoco>
"""

each_scene = pytest.mark.parametrize("scene", scene_names())
each_place = pytest.mark.parametrize("scene", [name for name in scene_names() if name != "empty"])
"""`empty` is a room for tests: its overview is inside and shows little."""


@functools.cache
def _compiled(scene: str) -> mujoco.MjModel:
    """Compile a scene without robots, with the world's solver settings. Shared by tests that do not change it."""
    return build_world(scene).model


def _at_rest(model: mujoco.MjModel) -> mujoco.MjData:
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return data


def _bits(model: mujoco.MjModel, geom: int) -> tuple[int, int]:
    return int(model.geom_contype[geom]), int(model.geom_conaffinity[geom])


def _ray(model: mujoco.MjModel, data: mujoco.MjData, start: np.ndarray, direction: np.ndarray) -> tuple[float, int]:
    """Distance [m] and geom hit; infinity and -1 where nothing is."""
    geom = np.full(1, -1, np.int32)
    distance = mujoco.mj_ray(model, data, start, direction, None, 1, -1, geom)
    return (math.inf, -1) if geom[0] < 0 else (distance, int(geom[0]))


def _is_floor(model: mujoco.MjModel, geom: int) -> bool:
    """Something to drive on, or a decal on it."""
    return geom >= 0 and (_bits(model, geom) == FLOOR or model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE)


def _free_distance(
    model: mujoco.MjModel, data: mujoco.MjData, site: str, angle: float, heights: tuple[float, ...], aside: float = 0.0
) -> float:
    """How far it is from `site` to the first obstacle in the direction `angle` [rad] from the site's x axis.

    Args:
        heights: Of the rays above the site [m].
        aside: The rays start so far to the left of the site [m].
    """
    pose = data.site(site)
    forward, left = pose.xmat.reshape(3, 3)[:, 0], pose.xmat.reshape(3, 3)[:, 1]
    direction = math.cos(angle) * forward + math.sin(angle) * left
    distances = []
    for height in heights:
        distance, geom = _ray(model, data, pose.xpos + aside * left + np.array([0.0, 0.0, height]), direction)
        distances.append(math.inf if _is_floor(model, geom) else distance)
    return min(distances)


def _probe_in(scene: str, pose: tuple[float, float, float]) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """The probe at `pose` (x, y [m], theta [rad])."""
    spec = load_scene(scene)
    x, y, theta = pose
    frame = spec.worldbody.add_frame(pos=[x, y, 0.0], quat=[math.cos(theta / 2), 0.0, 0.0, math.sin(theta / 2)])
    spec.attach(mujoco.MjSpec.from_string(PROBE), prefix="probe/", frame=frame)
    spec.option.timestep = 0.0025
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    model = spec.compile()
    return model, _at_rest(model)


def _drive(model: mujoco.MjModel, data: mujoco.MjData, speed: float, seconds: float) -> tuple[float, float]:
    """Drive forward, speeding up by 0.5 m/s². Returns the largest tilt [rad] and the base's greatest height [m]."""
    base = data.body("probe/base")
    tilt = height = 0.0
    for step in range(round(seconds / model.opt.timestep)):
        data.ctrl[0] = min(speed, 0.5 * step * model.opt.timestep)
        mujoco.mj_step(model, data)
        tilt = max(tilt, math.acos(min(1.0, base.xmat[8])))
        height = max(height, base.xpos[2])
    assert not data.warning.number.any(), "MuJoCo warned while driving"
    return tilt, height


@each_scene
def test_offers_start_poses_and_an_overview(scene: str) -> None:
    model = _compiled(scene)
    sites = {model.site(i).name for i in range(model.nsite)}
    assert {"spawn_pepper", "spawn_robotino"} <= sites
    assert "overview" in {model.camera(i).name for i in range(model.ncam)}
    assert model.nlight > 0
    assert not model.light_castshadow.any()


@each_scene
def test_geoms_keep_to_the_collision_convention(scene: str) -> None:
    model = _compiled(scene)
    for geom in range(model.ngeom):
        name = f"geom {geom} ({model.geom(geom).name or model.body(model.geom_bodyid[geom]).name})"
        bits = _bits(model, geom)
        assert bits in (SOLID, FLOOR, MOVABLE, VISUAL), f"{name} has collision bits {bits}"
        assert model.geom_group[geom] == (1 if bits == VISUAL else 0), f"{name} is in the wrong group"
        moves = model.body_weldid[model.geom_bodyid[geom]] != 0 and not _is_mocap(model, geom)
        assert bits == VISUAL or (bits == MOVABLE) == moves, f"{name} moves: {moves}, but has collision bits {bits}"


def _is_mocap(model: mujoco.MjModel, geom: int) -> bool:
    return model.body_mocapid[model.body_rootid[model.geom_bodyid[geom]]] >= 0


@each_scene
def test_sensors_see_what_stops_a_robot_at_the_border(scene: str) -> None:
    """Rays pass through alpha 0, so an invisible barrier needs something visible on its face, without gaps."""
    model = _compiled(scene)
    data = _at_rest(model)
    x_max, y_max = _floor_half_size(model)
    for axis, limit, other in ((0, x_max, y_max), (1, y_max, x_max)):
        for side in (-1.0, 1.0):
            direction = np.eye(3)[axis] * side
            for along in np.arange(-other + 0.1, other, 0.1).round(9):
                # From just inside the border, at bumper height: what stands there, or the border itself.
                start = np.array([along, along, 0.15])
                start[axis] = side * (limit - 0.3)
                distance, _ = _ray(model, data, start, direction)
                assert distance < 0.36, f"nothing at {start} towards {direction}"


@each_scene
def test_border_is_solid_all_round(scene: str) -> None:
    model = _compiled(scene)
    data = _at_rest(model)
    solid = [
        g for g in range(model.ngeom) if _bits(model, g) == SOLID and model.geom_type[g] == mujoco.mjtGeom.mjGEOM_BOX
    ]
    x_max, y_max = _floor_half_size(model)
    for axis, limit, other in ((0, x_max, y_max), (1, y_max, x_max)):
        for side in (-1.0, 1.0):
            for along in np.arange(-other, other, 0.1):
                point = np.array([along, along, 0.15])
                point[axis] = side * (limit + 0.02)
                inside = [
                    (
                        np.abs(data.geom_xmat[g].reshape(3, 3).T @ (point - data.geom_xpos[g])) <= model.geom_size[g]
                    ).all()
                    for g in solid
                ]
                assert any(inside), f"nothing solid at {point}"


@each_scene
@pytest.mark.parametrize("sleep", [True, False], ids=["sleeping", "awake"])
def test_stands_still_by_itself(scene: str, sleep: bool) -> None:
    spec = load_scene(scene)
    spec.option.timestep = 0.0025
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    if not sleep:
        spec.option.enableflags &= ~mujoco.mjtEnableBit.mjENBL_SLEEP.value
    model = spec.compile()
    data = _at_rest(model)
    before = data.geom_xpos.copy()
    mujoco.mj_step(model, data, nstep=400)
    assert data.time == pytest.approx(1.0)
    assert np.isfinite(data.qpos).all()
    assert not data.warning.number.any()
    assert np.abs(data.geom_xpos - before).max(initial=0.0) < 0.003


@each_scene
def test_no_solid_thing_stands_in_another_that_moves(scene: str) -> None:
    model = _compiled(scene)
    for contact in _at_rest(model).contact:
        assert contact.dist > -0.001, f"{[model.geom(g).name for g in contact.geom]} overlap"


@each_scene
@pytest.mark.parametrize("site", ["spawn_pepper", "spawn_robotino"])
def test_start_is_level_and_free_all_round(scene: str, site: str) -> None:
    model = _compiled(scene)
    data = _at_rest(model)
    pose = data.site(site)
    assert pose.xmat.reshape(3, 3)[2, 2] == pytest.approx(1.0)
    for x, y in [(0.0, 0.0), (0.2, 0.0), (-0.2, 0.0), (0.0, 0.2), (0.0, -0.2)]:
        distance, geom = _ray(model, data, pose.xpos + np.array([x, y, 0.5]), np.array([0.0, 0.0, -1.0]))
        assert _is_floor(model, geom)
        assert distance == pytest.approx(0.5, abs=0.002)
    for degrees in range(0, 360, 5):
        free = _free_distance(model, data, site, math.radians(degrees), heights=(0.05, 0.3, 0.6, 0.9, EYE_HEIGHT))
        assert free > 0.7, f"an obstacle {free:.2f} m from {site} at {degrees} degrees"


@each_scene
@pytest.mark.parametrize("site", ["spawn_pepper", "spawn_robotino"])
def test_start_pose_can_be_read_before_compiling(scene: str, site: str) -> None:
    """Robots are attached to the uncompiled scene, where an orientation written as euler is not in `quat` yet."""
    written, compiled = load_scene(scene).site(site), _compiled(scene).site(site)
    assert np.allclose(written.pos, compiled.pos)
    assert np.allclose(written.quat, compiled.quat, atol=1e-6)


@each_scene
def test_pepper_can_drive_ahead_from_its_start(scene: str) -> None:
    model = _compiled(scene)
    data = _at_rest(model)
    for aside in np.linspace(-0.35, 0.35, 15):
        free = _free_distance(model, data, "spawn_pepper", 0.0, heights=(0.1, 0.3, 0.6, 0.9, 1.2), aside=float(aside))
        assert free > 1.5, f"an obstacle {free:.2f} m ahead, {aside:.2f} m to the left"


@each_scene
def test_is_cheap_enough_to_draw(scene: str) -> None:
    model = _compiled(scene)
    data = _at_rest(model)
    assert model.ngeom <= MOST_GEOMS
    pose = data.site("spawn_pepper")
    forward, left, up = pose.xmat.reshape(3, 3).T
    offset = data.geom_xpos - (pose.xpos + EYE_HEIGHT * up)
    depth = offset @ forward
    visible = (
        (depth > 0.0)
        & (np.abs(offset @ left) < depth * math.tan(FIELD_OF_VIEW[0] / 2))
        & (np.abs(offset @ up) < depth * math.tan(FIELD_OF_VIEW[1] / 2))
        & (model.geom_rgba[:, 3] > 0.0)
    )
    assert visible.sum() <= MOST_GEOMS_IN_VIEW


@each_place
def test_overview_shows_the_whole_floor(scene: str) -> None:
    model = _compiled(scene)
    data = _at_rest(model)
    camera = data.cam("overview")
    half = math.tan(math.radians(model.cam("overview").fovy[0]) / 2)
    x_max, y_max = _floor_half_size(model)
    for x, y in [(x_max, y_max), (-x_max, y_max), (-x_max, -y_max), (x_max, -y_max)]:
        right, up, back = (np.array([x, y, 0.0]) - camera.xpos) @ camera.xmat.reshape(3, 3)
        assert back < 0.0, f"the corner ({x}, {y}) is behind the camera"
        assert abs(up) < -back * half, f"the corner ({x}, {y}) is above or below the picture"
        assert abs(right) < -back * half * 4 / 3, f"the corner ({x}, {y}) is beside the picture"


def _floor_half_size(model: mujoco.MjModel) -> tuple[float, float]:
    floor = model.geom("floor")
    if floor.type[0] == mujoco.mjtGeom.mjGEOM_HFIELD:
        return tuple(model.hfield_size[floor.dataid[0], :2])
    return tuple(floor.size[:2])


@each_place
def test_overview_is_a_picture_of_something(scene: str) -> None:
    world = build_world(scene)
    painter = Painter(world)
    try:
        painter.snapshot()
        picture = painter.draw(world.model.cam("overview").id, 320, 240, "rgb")
    finally:
        painter.close()
    colours, counts = np.unique((picture // 32).reshape(-1, 3), axis=0, return_counts=True)
    assert len(colours) > 12
    assert counts.max() < 0.7 * counts.sum()


@each_scene
def test_robot_cannot_leave(scene: str) -> None:
    x_max, y_max = _floor_half_size(_compiled(scene))
    start = _at_rest(_compiled(scene)).site("spawn_pepper").xpos
    for degrees in (0, 45, 90, 135, 180, 225, 270, 315):
        model, data = _probe_in(scene, (start[0], start[1], math.radians(degrees)))
        tilt, _ = _drive(model, data, speed=0.55, seconds=18.0)
        x, y, z = data.body("probe/base").xpos
        assert abs(x) < x_max and abs(y) < y_max, f"left towards {degrees} degrees: ({x:.2f}, {y:.2f})"
        assert -0.01 < z < 0.2
        assert tilt < math.radians(10), f"tilted by {math.degrees(tilt):.1f} degrees towards {degrees}"


@pytest.mark.parametrize(
    ("lane", "height", "slope"),
    [(0.0, 0.175, 5.0), (1.9, 0.010, 12.0), (-1.9, 0.005, 12.0)],
    ids=["ramp", "threshold", "carpet"],
)
def test_ramp_scene_is_passable(lane: float, height: float, slope: float) -> None:
    model, data = _probe_in("ramp", (-3.4, lane, 0.0))
    tilt, highest = _drive(model, data, speed=0.35, seconds=24.0)
    assert data.body("probe/base").xpos[0] > 4.0
    assert highest == pytest.approx(height, abs=0.004)
    assert tilt < math.radians(slope + 1.0)


def test_rough_ground_is_uneven_but_not_more_than_pepper_bears() -> None:
    model = _compiled("rough")
    data = _at_rest(model)
    only_floor = np.array([1, 0, 0, 0, 0, 0], np.uint8)
    heights = []
    for x in np.linspace(-2.8, 2.8, 41):
        for y in np.linspace(-2.8, 2.8, 41):
            geom = np.full(1, -1, np.int32)
            distance = mujoco.mj_ray(
                model, data, np.array([x, y, 1.0]), np.array([0, 0, -1.0]), only_floor, 1, -1, geom
            )
            if _bits(model, geom[0]) == FLOOR:
                heights.append(1.0 - distance)
    assert len(heights) > 1500
    assert 0.010 < max(heights) - min(heights) <= 0.015


def test_apartment_doorway_is_open_and_as_wide_as_said() -> None:
    model = _compiled("apartment")
    data = _at_rest(model)
    for height in (0.05, 0.5, 1.15, 1.9):
        middle = np.array([1.6, -1.7, height])
        width = sum(_ray(model, data, middle, np.array([0.0, side, 0.0]))[0] for side in (-1.0, 1.0))
        assert width == pytest.approx(0.90, abs=0.002)
        for aside in (-0.4, 0.0, 0.4):
            through, _ = _ray(model, data, np.array([1.0, -1.7 + aside, height]), np.array([1.0, 0.0, 0.0]))
            assert through > 1.5


def test_apartment_has_people_who_stay_and_things_to_push() -> None:
    model, data = _probe_in("apartment", (0.75, -1.2, math.pi / 2))
    ball, people = data.body("ball"), [data.body(name) for name in ("person_seated", "person_standing")]
    places = [person.xpos.copy() for person in people]
    before = ball.xpos.copy()
    _drive(model, data, speed=0.3, seconds=4.0)
    assert ball.xpos[1] - before[1] > 0.2
    assert all((person.xpos == place).all() for person, place in zip(people, places, strict=True))
