"""The walker's body: trunk and head from `walker.xml`, and four legs that differ in position only."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import mujoco
import numpy as np

from telepresence.sim.scene import RobotModel
from telepresence.sim.walker.gait import HEIGHT, STANCE
from telepresence.sim.walker.kinematics import FOOT_RADIUS, HIPS, JOINTS, LEGS, OFFSET, SHANK, SIDE, THIGH, joint_angles

MJCF = Path(__file__).parent / "walker.xml"
PREFIX = "walker/"
LIMITS = {"out": (-0.7, 0.7), "hip": (-0.6, 2.0), "knee": (-2.6, -0.3)}
"""Limits of the joints [rad]; `out` for left legs, mirrored for right ones."""
STIFFNESS, DAMPING, TORQUE = 90.0, 1.6, 9.0
"""Values of the joint servos [N m/rad, N m s/rad, N m]."""
ARMATURE = 0.008
"""Inertia of a motor behind its gears [kg m²]."""
_JOINT_DAMPING = 0.05


def load_walker() -> mujoco.MjSpec:
    """Return a fresh walker that stands: root body `trunk` with a free joint, legs, servos, camera."""
    spec = mujoco.MjSpec.from_file(str(MJCF))
    spec.body("trunk").pos = [0.0, 0.0, HEIGHT + 0.002]
    for leg, hip, side in zip(LEGS, HIPS, SIDE, strict=True):
        _add_leg(spec, leg, hip, float(side))
    return spec


def walker_model(
    prefix: str = PREFIX, spawn: str = "spawn_walker", offset: tuple[float, float] = (0.0, 0.0)
) -> RobotModel:
    """Return the walker for `telepresence.sim.scene.build_world`."""
    return RobotModel(load_walker, prefix, spawn, offset)


def standing_angles() -> np.ndarray:
    """Return the joint angles of the standing robot, shape (4, 3) [rad]."""
    return joint_angles(STANCE)


def _add_leg(spec: mujoco.MjSpec, leg: str, hip: np.ndarray, side: float) -> None:
    box, capsule, cylinder, sphere = (
        mujoco.mjtGeom.mjGEOM_BOX,
        mujoco.mjtGeom.mjGEOM_CAPSULE,
        mujoco.mjtGeom.mjGEOM_CYLINDER,
        mujoco.mjtGeom.mjGEOM_SPHERE,
    )
    shoulder = spec.body("trunk").add_body(name=leg + "_shoulder", pos=hip, mass=0.28, inertia=[1.5e-4, 2e-4, 2e-4])
    shoulder.explicitinertial = True
    shoulder.ipos = [0.0, side * 0.6 * OFFSET, 0.0]
    _add_joint(spec, shoulder, leg + "_out", [1, 0, 0], sorted(side * limit for limit in LIMITS["out"]))
    front = 1.0 if hip[0] > 0.0 else -1.0
    shoulder.add_geom(type=cylinder, fromto=[-0.028, 0, 0, 0.028, 0, 0], size=[0.026, 0, 0], material="dark")
    shoulder.add_geom(
        type=cylinder, fromto=[0, side * 0.012, 0, 0, side * (OFFSET - 0.012), 0], size=[0.024, 0, 0], material="dark"
    )
    shoulder.add_geom(
        type=cylinder, fromto=[front * 0.028, 0, 0, front * 0.031, 0, 0], size=[0.016, 0, 0], material="accent"
    )

    thigh = shoulder.add_body(name=leg + "_thigh", pos=[0, side * OFFSET, 0], mass=0.26, inertia=[4e-4, 4e-4, 1e-4])
    thigh.explicitinertial = True
    thigh.ipos = [0.0, 0.0, -0.3 * THIGH]
    _add_joint(spec, thigh, leg + "_hip", [0, 1, 0], LIMITS["hip"])
    thigh.add_geom(type=capsule, fromto=[0, 0, 0, 0, 0, -THIGH], size=[0.017, 0, 0])
    thigh.add_geom(type=cylinder, fromto=[0, -0.014, 0, 0, 0.014, 0], size=[0.027, 0, 0])
    thigh.add_geom(
        type=cylinder, fromto=[0, side * 0.013, 0, 0, side * 0.0165, 0], size=[0.015, 0, 0], material="accent"
    )
    thigh.add_geom(type=box, pos=[-0.012, 0, -0.5 * THIGH], size=[0.009, 0.010, 0.030], material="dark")

    shank = thigh.add_body(name=leg + "_shank", pos=[0, 0, -THIGH], mass=0.10, inertia=[1.6e-4, 1.6e-4, 2e-5])
    shank.explicitinertial = True
    shank.ipos = [0.0, 0.0, -0.45 * SHANK]
    _add_joint(spec, shank, leg + "_knee", [0, 1, 0], LIMITS["knee"])
    shank.add_geom(type=cylinder, fromto=[0, -0.015, 0, 0, 0.015, 0], size=[0.015, 0, 0], material="dark")
    shank.add_geom(type=capsule, fromto=[0, 0, 0, 0, 0, -SHANK], size=[0.010, 0, 0], material="steel")
    shank.add_geom(type=capsule, fromto=[0, 0, -0.015, 0, 0, -0.5 * SHANK], size=[0.0125, 0, 0], material="shell")
    shank.add_geom(
        name=leg + "_foot",
        type=sphere,
        pos=[0, 0, -SHANK],
        size=[FOOT_RADIUS, 0, 0],
        material="rubber",
        contype=1,
        conaffinity=2,
        condim=3,
        priority=1,
        friction=[0.9, 0.01, 0.0001],
        # Hard, so that a standing robot does not creep down a ramp.
        solimp=[0.99, 0.9999, 0.001, 0.5, 2],
        solref=[0.005, 1.0],
    )
    spec.body(leg + "_thigh").add_geom(
        type=capsule, fromto=[0, 0, 0, 0, 0, -THIGH], size=[0.017, 0, 0], contype=1, conaffinity=2, rgba=[0, 0, 0, 0]
    )


def _add_joint(spec: mujoco.MjSpec, body: mujoco.MjsBody, name: str, axis: list[int], limits: Sequence[float]) -> None:
    body.add_joint(
        name=name,
        axis=axis,
        range=list(limits),
        limited=True,
        armature=ARMATURE,
        damping=_JOINT_DAMPING,
    )
    servo = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    servo.set_to_position(kp=STIFFNESS, kv=DAMPING)
    servo.forcelimited, servo.forcerange = True, [-TORQUE, TORQUE]


def joint_names(prefix: str = PREFIX) -> list[str]:
    """Return the names of joints and of their servos, leg by leg."""
    return [f"{prefix}{leg}_{joint}" for leg in LEGS for joint in JOINTS]
