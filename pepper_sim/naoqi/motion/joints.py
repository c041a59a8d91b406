"""ALMotion: joint angles. Radians and seconds; hands are fractions, 0 closed, 1 open.

Angles beyond a joint's limits are clipped. Calls that follow a trajectory end when it does. One whose joints another
trajectory uses waits for its turn; setAngles and changeAngles wait for nothing and end the trajectory (NAOqi 2.8
documentation, tools-motion-task).
"""

from __future__ import annotations

import concurrent.futures
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from pepper_sim.body.description import MOTION_CYCLE
from pepper_sim.body.joints import MAX_TRAJECTORY
from pepper_sim.naoqi.joint_names import BODY, CHAINS, GROUPS, HANDS, joints_of, per_joint, values_for
from pepper_sim.naoqi.motion.bezier import bezier_knots
from pepper_sim.naoqi.motion_tasks import MotionTasks
from pepper_sim.naoqi.service import ServiceError, finite, one_of, remote, shown, within
from pepper_sim.naoqi.tasks import all_ended
from pepper_sim.robot import Pepper
from telepresence.naoqi.incoming_call import NotNow

PEAK_OVER_MEAN_SPEED = 1.5
"""Peak speed over mean speed of a cubic motion from rest to rest."""
SHORTEST_MOTION = 0.05
_HAND_TIME = 0.6
_MAX_KNOTS = 10_000

Knots = dict[str, list[tuple[float, float]]]


class MotionJoints:
    """Joint part of ALMotion."""

    def __init__(self, robot: Pepper, tasks: MotionTasks) -> None:
        self._robot = robot
        self._tasks = tasks

    @remote("v(mmf)")
    def setAngles(self, names: Any, angles: Any, fractionMaxSpeed: float) -> None:
        """Moves joints to angles at a fraction of their top speed; returns at once."""
        joints = joints_of(names)
        fraction = within(fractionMaxSpeed, 0.0, 1.0, "fractionMaxSpeed")
        self._set(values_for(joints, per_joint(names, angles), "angles"), dict.fromkeys(joints, fraction))

    @remote("v(mm[f])", name="setAngles")
    def setAnglesWithSpeeds(self, names: Any, angles: Any, fractionMaxSpeeds: list[float]) -> None:
        """Moves joints to angles, each at its own fraction of top speed; returns at once."""
        joints = joints_of(names)
        fractions = values_for(joints, per_joint(names, fractionMaxSpeeds), "fractionMaxSpeeds", spread=True)
        for fraction in fractions.values():
            within(fraction, 0.0, 1.0, "fractionMaxSpeeds")
        self._set(values_for(joints, per_joint(names, angles), "angles"), fractions)

    @remote("v(mmf)")
    def changeAngles(self, names: Any, changes: Any, fractionMaxSpeed: float) -> None:
        """Moves joints by angles relative to their setpoints; returns at once."""
        joints = joints_of(names)
        fraction = within(fractionMaxSpeed, 0.0, 1.0, "fractionMaxSpeed")
        steps = values_for(joints, per_joint(names, changes), "changes")
        setpoints = self._robot.snapshot().joint_setpoints
        targets = {joint: setpoints[joint] + step for joint, step in steps.items()}
        self._set(targets, dict.fromkeys(joints, fraction))

    def quick_angles(self, names: Any, useSensors: bool) -> list[float]:
        """getAngles, while nobody has to wait for the world."""
        if not self._robot.has_snapshot():
            raise NotNow
        return self.getAngles(names, useSensors)

    @remote("[f](mb)", quick="quick_angles")
    def getAngles(self, names: Any, useSensors: bool) -> list[float]:
        """Returns the measured angles, or with useSensors false the commanded ones."""
        snapshot = self._robot.snapshot()
        angles = snapshot.joint_positions if useSensors else snapshot.joint_setpoints
        return [float(angles[joint]) for joint in joints_of(names)]

    @remote("v(mmmb)")
    def angleInterpolation(
        self, names: Any, angleLists: Any, timeLists: Any, isAbsolute: bool
    ) -> concurrent.futures.Future:
        """Moves joints through angles at times [s]; ends when they are there.

        angleLists and timeLists: a number, a list with one number per joint, or one list per joint; for a single joint
        also a list of its angles and times.
        """
        joints = joints_of(names)
        _require_distinct(joints)
        angles = _rows(joints, per_joint(names, angleLists), "angleLists")
        times = _rows(joints, per_joint(names, timeLists), "timeLists", spread=True)
        knots: Knots = {}
        for joint, row, moments in zip(joints, angles, times, strict=True):
            if len(row) != len(moments):
                raise ServiceError(f"timeLists holds {len(moments)} times for the {len(row)} angles of {joint}")
            _check_rising(moments, joint)
            # A first knot at time zero is reached one cycle later.
            knots[joint] = [(max(moment, MOTION_CYCLE), angle) for moment, angle in zip(moments, row, strict=True)]

        def relative(setpoints: Mapping[str, float]) -> Knots:
            return {joint: [(t, setpoints[joint] + step) for t, step in row] for joint, row in knots.items()}

        return self.plan("angleInterpolation", joints, (lambda _: knots) if isAbsolute else relative)

    @remote("v(mmf)")
    def angleInterpolationWithSpeed(
        self, names: Any, targetAngles: Any, maxSpeedFraction: float
    ) -> concurrent.futures.Future:
        """Moves joints to angles together, the slowest at a fraction of its top speed; ends when they are there."""
        joints = joints_of(names)
        _require_distinct(joints)
        if not 0.0 < maxSpeedFraction <= 1.0:
            raise ServiceError(f"maxSpeedFraction must be above 0 and at most 1, got {maxSpeedFraction:g}")
        return self.go(values_for(joints, per_joint(names, targetAngles), "targetAngles"), maxSpeedFraction)

    @remote("v([s]mm)")
    def angleInterpolationBezier(self, jointNames: list[str], times: Any, controlPoints: Any) -> Any:
        """Moves joints along Bezier curves, as Choregraphe exports timelines; ends when they are there.

        controlPoints: per joint a list of [angle, [type, time, angle], [type, time, angle]]; the two handles are
        relative to the point, the first before it, the second after.
        """
        joints = joints_of(jointNames, "jointNames")
        _require_distinct(joints)
        if not isinstance(times, list | tuple) or len(times) != len(joints):
            raise ServiceError(f"times must hold one list for each of the {len(joints)} joints, got {shown(times)}")
        if not isinstance(controlPoints, list | tuple) or len(controlPoints) != len(joints):
            raise ServiceError(f"controlPoints must hold one list for each of the {len(joints)} joints")
        moments = {joint: _numbers(row, f"times of {joint}") for joint, row in zip(joints, times, strict=True)}
        for joint, row in moments.items():
            _check_rising(row, joint)

        def curves(setpoints: Mapping[str, float]) -> Knots:
            return {
                joint: bezier_knots(setpoints[joint], moments[joint], points, f"controlPoints of {joint}")
                for joint, points in zip(joints, controlPoints, strict=True)
            }

        curves(self._robot.snapshot().joint_setpoints)  # what is malformed is refused now, not when its turn comes
        return self.plan("angleInterpolationBezier", joints, curves)

    @remote("v(s)")
    def openHand(self, handName: str) -> concurrent.futures.Future:
        """Stiffens a hand and opens it; ends when it is open."""
        return self._move_hand(handName, 1.0)

    @remote("v(s)")
    def closeHand(self, handName: str) -> concurrent.futures.Future:
        """Stiffens a hand and closes it; ends when it is closed."""
        return self._move_hand(handName, 0.0)

    # --- for the other services --------------------------------------------------------------------------------------

    def go(
        self, angles: Mapping[str, float], fraction: float, name: str = "angleInterpolation", *, yields: bool = False
    ) -> concurrent.futures.Future:
        """Move joints so that all arrive together, the slowest at `fraction` of its top speed; see `plan`."""
        return self.plan(name, angles, lambda setpoints: self._together(angles, fraction, setpoints), yields=yields)

    def take_posture(self, angles: Mapping[str, float], fraction: float, name: str) -> concurrent.futures.Future:
        """Move the whole body as `go` does, but each chain for itself: whoever moves the head meanwhile has it, and the
        robot stands up or crouches all the same.

        Returns:
            Future: true when the leg got there, false when another command took it.
        """

        def start() -> concurrent.futures.Future:
            knots = self._together(angles, fraction, self._robot.snapshot().joint_setpoints)
            chains = {chain: self._robot.follow({joint: knots[joint] for joint in GROUPS[chain]}) for chain in CHAINS}
            return all_ended(list(chains.values()), chains["Leg"])

        return self._tasks.book(name, angles, start)

    def follow(self, name: str, knots: Knots, *, yields: bool = False) -> concurrent.futures.Future:
        """Move joints through (seconds from the start, angle) as the task `name`; see `plan`."""
        return self.plan(name, knots, lambda _: knots, yields=yields)

    def plan(
        self,
        name: str,
        joints: Iterable[str],
        knots: Callable[[Mapping[str, float]], Knots],
        *,
        yields: bool = False,
    ) -> concurrent.futures.Future:
        """Move joints as soon as no other motion uses them.

        Args:
            name: What getTaskList calls the motion.
            knots: Gets the joints' setpoints when the motion starts; returns joint -> (seconds from the start, angle).
            yields: Another motion of these joints ends this one instead of waiting for it: for movements that only make
                the robot look alive.
        Returns:
            Future: true when the motion is over, false when another command took a joint away. Joints that are limp do
            not get there; the motion ends after its time all the same.
        """
        return self._tasks.book(
            name, joints, lambda: self._robot.follow(knots(self._robot.snapshot().joint_setpoints)), yields=yields
        )

    # --- inside ------------------------------------------------------------------------------------------------------

    def _together(self, angles: Mapping[str, float], fraction: float, setpoints: Mapping[str, float]) -> Knots:
        duration = SHORTEST_MOTION
        for joint, angle in angles.items():
            limits = self._robot.LIMITS[joint]
            distance = abs(min(max(angle, limits.lower), limits.upper) - setpoints[joint])
            duration = max(duration, PEAK_OVER_MEAN_SPEED * distance / (fraction * limits.velocity))
        return {joint: [(duration, angle)] for joint, angle in angles.items()}

    def _set(self, angles: Mapping[str, float], fractions: Mapping[str, float]) -> None:
        speeds = {joint: fractions[joint] * self._robot.LIMITS[joint].velocity for joint in angles}
        self._robot.set_angles(angles, speeds)

    def _move_hand(self, hand: str, opening: float) -> concurrent.futures.Future:
        one_of(hand, HANDS, "handName")

        def start(_: Mapping[str, float]) -> Knots:
            self._robot.set_stiffness({hand: 1.0})
            return {hand: [(_HAND_TIME, opening)]}

        return self.plan("openHand" if opening else "closeHand", (hand,), start)


def _require_distinct(joints: Sequence[str]) -> None:
    for joint in BODY:
        if joints.count(joint) > 1:
            raise ServiceError(f"names: {joint} is named twice")


def _numbers(row: Any, argument: str) -> list[float]:
    if not isinstance(row, list | tuple) or not 0 < len(row) <= _MAX_KNOTS:
        raise ServiceError(f"{argument} must be a list of 1 to {_MAX_KNOTS} numbers, got {shown(row)}")
    return [finite(value, f"{argument}[{index}]") for index, value in enumerate(row)]


def _rows(joints: Sequence[str], value: Any, argument: str, *, spread: bool = False) -> list[list[float]]:
    """Return one list of numbers per joint from the forms that angleInterpolation accepts."""
    if not isinstance(value, list | tuple):
        if len(joints) > 1 and not spread:
            raise ServiceError(
                f"{argument} must hold one entry for each of the {len(joints)} joints, got {shown(value)}"
            )
        return [[finite(value, argument)] for _ in joints]
    nested = any(isinstance(item, list | tuple) for item in value)
    if len(joints) == 1 and not nested:
        return [_numbers(value, argument)]
    if len(value) != len(joints):
        raise ServiceError(f"{argument} holds {len(value)} entries for {len(joints)} joints")
    return [
        _numbers(item if isinstance(item, list | tuple) else [item], f"{argument}[{index}]")
        for index, item in enumerate(value)
    ]


def _check_rising(moments: Sequence[float], joint: str) -> None:
    before = 0.0
    for index, moment in enumerate(moments):
        if moment < 0.0 or (index and moment <= before):
            raise ServiceError(f"the times of {joint} must be positive and increasing, got {moment:g} after {before:g}")
        if moment > MAX_TRAJECTORY:  # before a curve is sampled, which takes memory for each moment
            raise ServiceError(f"the times of {joint} must be at most {MAX_TRAJECTORY:g} s, got {moment:g}")
        before = moment
