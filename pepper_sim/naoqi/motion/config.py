"""ALMotion: description of the body and list of tasks."""

from __future__ import annotations

from typing import Any

from pepper_sim.body.description import MOTION_CYCLE
from pepper_sim.naoqi.identity import ARM_VERSION, BODY_VERSION, HEAD_VERSION, MODEL_TYPE
from pepper_sim.naoqi.joint_names import BODY, CHAINS, STIFFNESS, joints_of
from pepper_sim.naoqi.motion.idle import named_values
from pepper_sim.naoqi.motion_tasks import MotionTasks
from pepper_sim.naoqi.service import finite, one_of, remote
from pepper_sim.robot import Pepper

_MOTION_CONFIG = {
    *("ENABLE_DCM_LIKE", "CONTROL_JOINT_MAX_ACCELERATION", "CONTROL_USE_ACCELERATION_INTERPOLATOR"),
    *("CONTROL_FREQUENCY", "ENABLE_STIFFNESS_PROTECTION", "ENABLE_DYNAMIC_STABILIZATION", "ENABLE_MOVE_API"),
}


class MotionConfig:
    """Description and task part of ALMotion."""

    def __init__(self, robot: Pepper, tasks: MotionTasks) -> None:
        self._robot = robot
        self._tasks = tasks
        self._notifications = True

    # --- the body ----------------------------------------------------------------------------------------------------

    @remote("[s](s)")
    def getBodyNames(self, name: str) -> list[str]:
        """Lists the joints of a chain or group, or for "Chains" the chains."""
        return list(CHAINS) if name == "Chains" else joints_of(name, "name")

    @remote("[s](s)")
    def getJointNames(self, name: str) -> list[str]:
        """Old name of getBodyNames."""
        return self.getBodyNames(name)

    @remote("m(s)")
    def getLimits(self, name: str) -> list[list[float]]:
        """Returns [lower, upper, top speed, top torque] per joint [rad, rad, rad/s, N m]."""
        limits = [self._robot.LIMITS[joint] for joint in joints_of(name, "name")]
        return [[row.lower, row.upper, row.velocity, row.effort] for row in limits]

    @remote("m()")
    def getRobotConfig(self) -> list[list]:
        """Returns [[names], [values]] of the model and its versions."""
        config = {
            "Model Type": MODEL_TYPE,
            "Head Version": HEAD_VERSION,
            "Body Version": BODY_VERSION,
            "Laser": False,
            "Legs": False,
            "Arms": True,
            "Extended Arms": True,
            "Hands": True,
            "Arm Version": ARM_VERSION,
            "Number of Legs": 0,
            "Number of Arms": 2,
            "Number of Hands": 2,
        }
        return [list(config), list(config.values())]

    @remote("i()")
    def getMotionCycleTime(self) -> int:
        """Returns the controller's period [ms]."""
        return round(1000 * MOTION_CYCLE)

    @remote("s()")
    def getSummary(self) -> str:
        """Writes stiffness, command and measured angle of every joint as a table."""
        snapshot = self._robot.snapshot()
        lines = ["---------------------- Model ---------------------------"]
        lines.append(f"{'BodyName':>20}{'Stiffness':>12}{'Command':>12}{'Sensor':>12}")
        lines += [
            f"{joint:>20}{snapshot.stiffness[joint]:12.6f}{snapshot.joint_setpoints[joint]:12.6f}"
            f"{snapshot.joint_positions[joint]:12.6f}"
            for joint in BODY
        ]
        lines.append("---------------------- Tasks  --------------------------")
        lines += [f"{task.name:>20}{task.identity:12d}" for task in self._tasks.all()]
        return "\n".join(lines)

    # --- tasks -------------------------------------------------------------------------------------------------------

    @remote("m()")
    def getTaskList(self) -> list[list]:
        """Lists what moves now: [[name, number, [joints]], ...]."""
        return [[task.name, task.identity, list(task.resources)] for task in self._tasks.all()]

    @remote("b(i)")
    def killTask(self, motionTaskID: int) -> bool:
        """Ends one motion; false when it is over."""
        return self._tasks.kill(motionTaskID)

    @remote("v([s])")
    def killTasksUsingResources(self, resourceNames: list[str]) -> None:
        """Ends the motions of these joints."""
        self._tasks.end_using(_resources(resourceNames))

    @remote("b([s])")
    def areResourcesAvailable(self, resourceNames: list[str]) -> bool:
        """Whether no motion holds one of these joints."""
        return not self._tasks.using(_resources(resourceNames))

    @remote("v()")
    def killAll(self) -> None:
        """Ends everything that moves or waits for its turn, the base abruptly."""
        self._tasks.end_using((*BODY, *STIFFNESS.values()))
        self._robot.stop_move(abrupt=True)
        self._robot.stop_joints()

    @remote("b()")
    def areNotificationsEnabled(self) -> bool:
        """Whether ALMotion notifies the user of what it refuses; see setEnableNotifications."""
        return self._notifications

    @remote("v(b)")
    def setEnableNotifications(self, enable: bool) -> None:
        """Switches ALMotion's notifications on or off. Stored only: this one has none."""
        self._notifications = enable

    @remote("v(m)")
    def setMotionConfig(self, config: Any) -> None:
        """Sets internal switches, [[name, value], ...]. Checked and ignored."""
        for name, value in named_values(config, "config"):
            one_of(name, _MOTION_CONFIG, "config")
            finite(value, name)


def _resources(names: list[str]) -> list[str]:
    resources: list[str] = []
    for name in names:
        joints = [] if name in ("Base", "Wheels") else joints_of(name, "resourceNames")
        resources += [*joints, *(STIFFNESS[joint] for joint in joints)] or ["Base"]
    return resources
