"""The snapshot of all of Pepper's sensors after one tick. Called with the world's lock held."""

from __future__ import annotations

import mujoco
import numpy as np

from pepper_sim.body.description import ENCODER_STEP, JOINTS, MOTION_CYCLE, WHEEL_RADIUS, WHEELS
from pepper_sim.body.inertial import InertialSensors
from pepper_sim.body.joints import JointMotion
from pepper_sim.body.motion import BaseMotion
from pepper_sim.body.power import Power
from pepper_sim.body.sensors import Sensors
from pepper_sim.body.state import Snapshot
from telepresence.sim.base import PlanarBase
from telepresence.sim.world import World


class Readings:
    """What the parts of one robot measure.

    Attributes:
        laser_odometry: Odometry (x, y, theta) [m, m, rad] at the instant at which the lasers were read.
    """

    def __init__(
        self,
        world: World,
        joints: JointMotion,
        base: PlanarBase,
        motion: BaseMotion,
        inertial: InertialSensors,
        sensors: Sensors,
        power: Power,
    ) -> None:
        self._world = world
        self._joints = joints
        self._base = base
        self._motion = motion
        self._inertial = inertial
        self._sensors = sensors
        self._power = power
        self.laser_odometry = base.odometry

    def snapshot(self, data: mujoco.MjData, *, fallen: bool) -> Snapshot:
        """Read everything; `fallen` is whether the robot lies on the floor."""
        joints, base, sensors = self._joints, self._base, self._sensors
        positions = np.round(data.qpos[joints.qpos] / ENCODER_STEP) * ENCODER_STEP
        vx, vy, wz = base.velocity
        inertial = self._inertial.read(data)
        return Snapshot(
            time=self._world.time,
            stamp=self._world.stamp,
            joint_positions=_by_joint(positions),
            joint_setpoints=_by_joint(joints.setpoints),
            joint_velocities=_by_joint(data.qvel[joints.dofs]),
            joint_torques=_by_joint(joints.torques(data)),
            stiffness=_by_joint(joints.stiffness),
            odometry=base.odometry,
            next_odometry=base.predict(MOTION_CYCLE),
            velocity=base.velocity,
            wheel_speeds={
                name: (per_vx * vx + per_vy * vy + lever * wz) / WHEEL_RADIUS
                for name, (per_vx, per_vy, lever) in WHEELS.items()
            },
            imu_base=inertial["base"],
            imu_torso=inertial["torso"],
            sonar=dict(sensors.sonar),
            laser=dict(sensors.laser),
            laser_odometry=self.laser_odometry,
            shovel=sensors.ground["Shovel"],
            vertical={side: sensors.ground[side][0] for side in ("Left", "Right")},
            infrared=dict(sensors.infrared),
            bumpers=dict(sensors.bumpers),
            touch=dict(sensors.touch),
            battery=self._power.battery,
            temperatures=_by_joint(self._power.temperatures),
            moving=self._motion.moving,
            move_failed=self._motion.failure,
            fallen=fallen,
        )


def _by_joint(values: np.ndarray) -> dict[str, float]:
    return dict(zip(JOINTS, values.tolist(), strict=True))
