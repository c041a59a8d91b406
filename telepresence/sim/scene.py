"""Scenes: a place by name, with robots put into it.

A scene is an MJCF file `scenes/<name>.xml`. It offers a site per robot kind (`spawn_pepper`, ...) where a robot stands
at the start, with x forward, and a camera `overview`. Its geoms are in the groups 0 and 1, those of robots in group 3.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from telepresence.sim.rotation import rotation_of
from telepresence.sim.world import World

SCENES = Path(__file__).parent / "scenes"
ROBOT_GROUP = 3
"""Geom group of robots."""

PICTURE_WIDTH, PICTURE_HEIGHT = 1280, 960
"""Largest picture that can be drawn [px]."""


@dataclass(frozen=True)
class RobotModel:
    """A robot to put into a scene.

    Args:
        load: Returns a fresh MjSpec whose root body is the robot's base with a free joint, origin on the floor.
        prefix: Put before every name of the robot, e.g. `"pepper/"`; different for every robot of a world.
        spawn: Site of the scene where the robot starts.
        offset: Where it stands relative to `spawn`, along that site's axes (x, y [m]); for several robots at one.
        furnish: Puts what the robot's options ask for into the scene: called with the scene and the pose where the
            robot starts, a homogeneous matrix (4, 4), x forward.
    """

    load: Callable[[], mujoco.MjSpec]
    prefix: str
    spawn: str
    offset: tuple[float, float] = (0.0, 0.0)
    furnish: Callable[[mujoco.MjSpec, np.ndarray], None] | None = None


def scene_names() -> list[str]:
    """Return the names of the scenes."""
    return sorted(path.stem for path in SCENES.glob("*.xml"))


def load_scene(name: str) -> mujoco.MjSpec:
    """Return the scene called `name` without robots.

    Raises:
        ValueError: There is no such scene; the message names those that exist.
    """
    path = SCENES / f"{name}.xml"
    if name not in scene_names():
        raise ValueError(f"there is no scene {name!r}; scenes: {', '.join(scene_names())}")
    spec = mujoco.MjSpec.from_file(str(path))
    _set_picture_quality(spec)
    return spec


def build_world(scene: str = "apartment", robots: Sequence[RobotModel] = (), seed: int = 0) -> World:
    """Build a world with `robots` standing at their spawn points in `scene`.

    Raises:
        ValueError: Unknown scene, a spawn point that the scene lacks, or two robots with one prefix.
    """
    spec = load_scene(scene)
    if len({robot.prefix for robot in robots}) != len(robots):
        raise ValueError(f"robots in one world need different prefixes, got {[robot.prefix for robot in robots]}")
    for robot in robots:
        _attach(spec, robot, scene)
    return World(spec, seed=seed)


def _attach(spec: mujoco.MjSpec, robot: RobotModel, scene: str) -> None:
    spawn = spec.site(robot.spawn)
    if spawn is None:
        sites = sorted(site.name for site in spec.sites if site.name.startswith("spawn"))
        raise ValueError(f"scene {scene!r} has no site {robot.spawn!r}; it has: {', '.join(sites) or 'none'}")
    if robot.furnish is not None:
        robot.furnish(spec, _start(spawn, robot.offset))
    child = robot.load()
    for geom in child.geoms:
        geom.group = ROBOT_GROUP
    for body in child.worldbody.bodies:
        body.pos = np.add(body.pos, (*robot.offset, 0.0))
    spec.attach(child, prefix=robot.prefix, site=spawn)


def _start(spawn: mujoco.MjsSite, offset: tuple[float, float]) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, :3] = rotation_of(spawn.quat)
    pose[:3, 3] = spawn.pos + pose[:3, :3] @ (*offset, 0.0)
    return pose


def _set_picture_quality(spec: mujoco.MjSpec) -> None:
    """Fewer slices and no multisampling draw ten times faster on a CPU and are hard to tell apart at 640x480."""
    spec.visual.global_.offwidth = PICTURE_WIDTH
    spec.visual.global_.offheight = PICTURE_HEIGHT
    spec.visual.quality.offsamples = 0
    spec.visual.quality.numslices = 12
    spec.visual.quality.numstacks = 8
    spec.visual.quality.numquads = 2
    # Clipping planes are multiples of the extent; a fixed extent makes them metres, whatever the scene's size.
    spec.stat.extent = 1.0
    spec.visual.map.znear = 0.02
    spec.visual.map.zfar = 60.0
    for light in spec.lights:
        light.castshadow = False
