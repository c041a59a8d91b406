"""Joint motion: slewing to angles, following trajectories, stiffness.

The methods of `JointMotion` are called with the world's lock held.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, InvalidStateError

import mujoco
import numpy as np

from pepper_sim.body.description import JOINTS, LEAST_LEG_STIFFNESS, LEG_JOINTS, LIMITS, MOTION_CYCLE

ARRIVED = 1e-3
"""A setpoint this close [rad] to the last knot has arrived."""
SMART_MARGIN = 0.2
"""Smart stiffness leaves each motor this share of its torque beyond what the posture needs."""
STILL_SPEED = 0.02
"""A joint that turns more slowly [rad/s] does not move."""
MAX_TRAJECTORY = 3600.0
"""Longest trajectory [s]."""

_MAX_SPEED = np.array([LIMITS[j].velocity for j in JOINTS])
_EFFORT = np.array([LIMITS[j].effort for j in JOINTS])
_INDEX = {joint: i for i, joint in enumerate(JOINTS)}

_CARRIED_BY = {
    "Neck": ("HeadYaw",),
    "Head": ("HeadYaw", "HeadPitch"),
    **{
        body.format(s=side, w=side.lower()): tuple(side + joint for joint in joints)
        for side in "LR"
        for body, joints in (
            ("{s}Shoulder", ("ShoulderPitch",)),
            ("{s}Bicep", ("ShoulderPitch", "ShoulderRoll")),
            ("{s}Elbow", ("ShoulderPitch", "ShoulderRoll", "ElbowYaw")),
            ("{s}ForeArm", ("ShoulderPitch", "ShoulderRoll", "ElbowYaw", "ElbowRoll")),
            ("{w}_wrist", ("ShoulderPitch", "ShoulderRoll", "ElbowYaw", "ElbowRoll", "WristYaw")),
            ("{w}_gripper", ("ShoulderPitch", "ShoulderRoll", "ElbowYaw", "ElbowRoll", "WristYaw", "Hand")),
        )
    },
}
"""Body -> the joints whose motors carry its weight."""


def resolve(future: Future, result: bool) -> None:
    """Complete `future`, unless its owner has cancelled it in the meantime."""
    try:
        future.set_result(result)
    except InvalidStateError:
        if not future.cancelled():
            raise


class Trajectory:
    """Smooth motion of some joints through knots: a cubic without overshoot, at rest at both ends.

    It is sampled once per motion cycle and interpolated in between.
    """

    def __init__(self, joints: Sequence[int], starts: np.ndarray, knots: Sequence[Sequence[tuple[float, float]]]):
        self.joints = np.array(joints)
        self.future: Future = Future()
        self._end = max(points[-1][0] for points in knots)
        times = np.arange(math.ceil(self._end / MOTION_CYCLE) + 2) * MOTION_CYCLE
        self._samples = np.empty((len(times), len(joints)))
        for column, (start, points) in enumerate(zip(starts, knots, strict=True)):
            x = np.array([0.0, *(t for t, _ in points)])
            y = np.array([start, *(angle for _, angle in points)])
            self._samples[:, column] = monotone_cubic(x, y, times)

    def at(self, elapsed: float) -> np.ndarray:
        """Return the angles `elapsed` seconds after the start, one per joint [rad]."""
        position = elapsed / MOTION_CYCLE
        row = int(position)
        if row >= len(self._samples) - 1:
            return self._samples[-1]
        fraction = position - row
        return self._samples[row] * (1.0 - fraction) + self._samples[row + 1] * fraction

    def over(self, elapsed: float) -> bool:
        return elapsed >= self._end


def monotone_cubic(x: np.ndarray, y: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Evaluate a cubic Hermite curve through (x, y) that never overshoots; flat at its ends, constant after the last.

    Slopes: harmonic mean of the neighbouring secants where these have one sign, else zero (Fritsch and Butland, SIAM J.
    Sci. Stat. Comput. 5, 1984).
    """
    steps = np.diff(x)
    secants = np.diff(y) / steps
    slopes = np.zeros(len(x))
    product = secants[:-1] * secants[1:]
    same = product > 0.0
    slopes[1:-1][same] = 2.0 * product[same] / (secants[:-1] + secants[1:])[same]
    i = np.clip(np.searchsorted(x, at, side="right") - 1, 0, len(steps) - 1)
    h = steps[i]
    s = np.clip((at - x[i]) / h, 0.0, 1.0)
    return (
        y[i] * (1 + 2 * s) * (1 - s) ** 2
        + slopes[i] * h * s * (1 - s) ** 2
        + y[i + 1] * s * s * (3 - 2 * s)
        - slopes[i + 1] * h * s * s * (1 - s)
    )


class _Ramp:
    """A change of the stiffness of some joints over time."""

    def __init__(self, joints: np.ndarray, start: np.ndarray, goal: np.ndarray, begin: float, duration: float) -> None:
        self.joints = joints
        self.future: Future = Future()
        self._start, self._goal, self._begin, self._duration = start, goal, begin, duration

    def at(self, now: float) -> np.ndarray:
        """Return the stiffness of each joint at the time `now` [s]."""
        share = 1.0 if self.over(now) else (now - self._begin) / self._duration
        return self._start + share * (self._goal - self._start)

    def over(self, now: float) -> bool:
        return now >= self._begin + self._duration


class JointMotion:
    """Setpoints of the 17 joint servos."""

    def __init__(self, model: mujoco.MjModel, prefix: str, post: Callable[[Callable[[], None]], None]) -> None:
        """`post` runs a callable later, outside the world's lock."""
        self._model = model
        self._post = post
        first = model.actuator(prefix + JOINTS[0]).id
        if [model.actuator(first + i).name for i in range(len(JOINTS))] != [prefix + joint for joint in JOINTS]:
            raise ValueError(f"{prefix}: the joint actuators must follow each other in the order of JOINTS")
        joints = [model.joint(prefix + joint) for joint in JOINTS]
        self.actuators = slice(first, first + len(JOINTS))
        self.qpos = np.array([joint.qposadr[0] for joint in joints])
        self.dofs = np.array([joint.dofadr[0] for joint in joints])
        self._carried = [
            (model.body(prefix + body).id, np.array([_INDEX[j] for j in carriers]))
            for body, carriers in _CARRIED_BY.items()
        ]
        self._legs = np.array([_INDEX[joint] for joint in LEG_JOINTS])
        self.setpoints = np.zeros(len(JOINTS))
        self.stiffness = np.ones(len(JOINTS))
        self._targets = np.zeros(len(JOINTS))
        self._speeds = _MAX_SPEED.copy()
        self._running: list[tuple[float, Trajectory]] = []
        self._slewing = False
        self._limp: np.ndarray = np.zeros(0, int)
        self._braked: np.ndarray = np.zeros(0, int)
        self._ramps: list[_Ramp] = []
        # A damped servo lags behind a moving setpoint by damping / stiffness seconds; the lead compensates for that.
        damping = model.dof_damping[self.dofs] - model.actuator_biasprm[self.actuators, 2]
        self._lag = damping / model.actuator_gainprm[self.actuators, 0]
        self._lead = np.zeros(len(JOINTS))
        self._leading = False

    def reset(self, data: mujoco.MjData, angles: Mapping[str, float]) -> None:
        """Put the joints at `angles` at once, stiff and at rest."""
        self.stop(JOINTS)
        values = np.array([angles[joint] for joint in JOINTS])
        data.qpos[self.qpos] = values
        self.setpoints[:] = self._targets[:] = values
        data.ctrl[self.actuators] = values
        self.set_stiffness(dict.fromkeys(JOINTS, 1.0))

    def set_angles(self, angles: Mapping[str, float], speeds: Mapping[str, float]) -> None:
        """Slew to `angles` at `speeds`; both are clipped to the joints' limits. Ends trajectories of these joints."""
        indices = _indices(angles)
        _indices(speeds)
        _require_finite("angle", angles)
        _require_finite("speed", speeds)
        self.stop(angles)
        for index, (joint, angle) in zip(indices, angles.items(), strict=True):
            limits = LIMITS[joint]
            self._targets[index] = min(max(angle, limits.lower), limits.upper)
            self._speeds[index] = min(max(speeds.get(joint, limits.velocity), 0.0), limits.velocity)
        self._slewing = True

    def follow(self, knots: Mapping[str, Sequence[tuple[float, float]]], now: float) -> Future:
        """Move through `knots` (seconds from now, angle). Ends what these joints did before."""
        indices = _indices(knots)
        for joint, points in knots.items():
            _check_knots(joint, points)
        self.stop(knots)
        clipped = [
            [(t, min(max(angle, LIMITS[joint].lower), LIMITS[joint].upper)) for t, angle in points]
            for joint, points in knots.items()
        ]
        trajectory = Trajectory(indices, self.setpoints[indices], clipped)
        self._speeds[indices] = _MAX_SPEED[indices]
        self._running.append((now, trajectory))
        return trajectory.future

    def stop(self, joints: Mapping[str, object] | Sequence[str]) -> None:
        """Hold these joints at their present setpoints; trajectories that use one of them end with False."""
        indices = _indices(joints)
        for entry in [e for e in self._running if np.isin(e[1].joints, indices).any()]:
            self._running.remove(entry)
            self._targets[entry[1].joints] = self.setpoints[entry[1].joints]
            self._finish(entry[1].future, False)
        self._targets[indices] = self.setpoints[indices]

    def set_stiffness(self, stiffness: Mapping[str, float]) -> None:
        """Limit the motors' torque to a fraction of their effort. Limp arms fall; brakes hold the leg.

        Ends ramps of these joints.
        """
        indices = _indices(stiffness)
        _require_finite("stiffness", stiffness)
        for ramp in [ramp for ramp in self._ramps if np.isin(ramp.joints, indices).any()]:
            self._ramps.remove(ramp)
            self._finish(ramp.future, False)
        for index, value in zip(indices, stiffness.values(), strict=True):
            self.stiffness[index] = min(max(value, 0.0), 1.0)
        self._apply_stiffness()

    def ramp_stiffness(self, stiffness: Mapping[str, float], duration: float, now: float) -> Future:
        """Change the stiffness of joints evenly over `duration` [s]; the future is true when it is reached."""
        indices = np.array(_indices(stiffness), int)
        _require_finite("stiffness", stiffness)
        goals = np.clip(np.array(list(stiffness.values())), 0.0, 1.0)
        ramp = _Ramp(indices, self.stiffness[indices], goals, now, duration)
        self._ramps.append(ramp)
        return ramp.future

    def _apply_stiffness(self) -> None:
        torque = self.stiffness * _EFFORT
        torque[self._legs] = _EFFORT[self._legs]
        self._model.actuator_forcerange[self.actuators] = np.stack([-torque, torque], axis=1)
        for body, carriers in self._carried:
            self._model.body_gravcomp[body] = float(self.stiffness[carriers].min() > 0.0)
        off = np.flatnonzero(self.stiffness == 0.0)
        self._limp = np.setdiff1d(off, self._legs)
        self._braked = np.intersect1d(off, self._legs)

    @property
    def legs_limp(self) -> bool:
        """Whether the legs are not stiff enough for the base to move."""
        return bool((self.stiffness[self._legs] <= LEAST_LEG_STIFFNESS).any())

    def torques(self, data: mujoco.MjData) -> np.ndarray:
        """Return the torques of the motors, gravity compensation included, in the order of JOINTS [N m]."""
        return data.qfrc_actuator[self.dofs] + data.qfrc_gravcomp[self.dofs]

    def smart_stiffness(self, data: mujoco.MjData, torques: np.ndarray) -> np.ndarray:
        """Return the stiffness that the posture needs, never more than was set; what was set while a joint moves.

        Source: NAOqi 2.8 documentation, reflexes-smart-stiffness. `torques` are the motors' [N m].
        """
        if np.abs(data.qvel[self.dofs]).max() > STILL_SPEED:
            return self.stiffness
        return np.minimum(self.stiffness, np.abs(torques) / _EFFORT + SMART_MARGIN)

    def tick(self, now: float, dt: float, data: mujoco.MjData) -> None:
        """Advance all setpoints by one tick and hand them to the servos."""
        if self._ramps:
            self._advance_ramps(now)
        if not (self._running or self._slewing or self._leading or len(self._limp)):
            return
        for entry in tuple(self._running):
            started, trajectory = entry
            self._targets[trajectory.joints] = trajectory.at(now - started)
            self._slewing = True
            if trajectory.future.cancelled():
                self._running.remove(entry)
                self._targets[trajectory.joints] = self.setpoints[trajectory.joints]
            elif trajectory.over(now - started) and self._arrived(trajectory):
                self._running.remove(entry)
                self._finish(trajectory.future, True)
        if len(self._braked):
            self._targets[self._braked] = self.setpoints[self._braked]
        if self._slewing:
            change = self._targets - self.setpoints
            reach = self._speeds * dt
            step = np.clip(change, -reach, reach)
            self.setpoints += step
            self._slewing = bool((np.abs(change) > reach).any())
            self._lead = self._lag * (step / dt)
            self._leading = bool(step.any())
        elif self._leading:
            self._lead = np.zeros(len(JOINTS))
            self._leading = False
        if len(self._limp):
            self.setpoints[self._limp] = self._targets[self._limp] = data.qpos[self.qpos[self._limp]]
        data.ctrl[self.actuators] = self.setpoints + self._lead

    def _arrived(self, trajectory: Trajectory) -> bool:
        """Whether the joints are there: a trajectory above their top speed takes longer than its knots say.

        Those whose motors are off get nowhere, and nobody waits for them.
        """
        joints = trajectory.joints[self.stiffness[trajectory.joints] > 0.0]
        return bool((np.abs(self._targets[joints] - self.setpoints[joints]) < ARRIVED).all())

    def _advance_ramps(self, now: float) -> None:
        for ramp in tuple(self._ramps):
            if not ramp.future.cancelled():
                self.stiffness[ramp.joints] = ramp.at(now)
            if ramp.future.cancelled() or ramp.over(now):
                self._ramps.remove(ramp)
                self._finish(ramp.future, True)
        self._apply_stiffness()

    def _finish(self, future: Future, result: bool) -> None:
        self._post(lambda: resolve(future, result))


def _indices(joints: Mapping[str, object] | Sequence[str]) -> list[int]:
    unknown = [joint for joint in joints if joint not in _INDEX]
    if unknown:
        raise ValueError(f"unknown joint {unknown[0]!r}; joints: {', '.join(JOINTS)}")
    return [_INDEX[joint] for joint in joints]


def _require_finite(what: str, values: Mapping[str, float]) -> None:
    for joint, value in values.items():
        if not math.isfinite(value):
            raise ValueError(f"the {what} of {joint} must be a finite number, got {value}")


def _check_knots(joint: str, points: Sequence[tuple[float, float]]) -> None:
    if not points:
        raise ValueError(f"{joint} has no knots")
    before = 0.0
    for moment, angle in points:
        if not (math.isfinite(moment) and math.isfinite(angle)):
            raise ValueError(f"the knots of {joint} must be finite, got ({moment}, {angle})")
        if moment <= before:
            raise ValueError(f"the times of {joint} must be positive and increasing, got {moment} after {before}")
        before = moment
    if before > MAX_TRAJECTORY:
        raise ValueError(f"the trajectory of {joint} lasts {before:.0f} s; at most {MAX_TRAJECTORY:.0f} s are possible")
