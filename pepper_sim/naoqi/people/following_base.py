"""FollowingBase: the base as what follows people by itself drives it: it gives way to whoever else drives."""

from __future__ import annotations

from pepper_sim.robot import Pepper
from pepper_sim.services.al_motion import ALMotion


class FollowingBase:
    """Drives one robot's base while nobody else does, a pilot above all."""

    def __init__(self, robot: Pepper, motion: ALMotion) -> None:
        self._robot = robot
        self._motion = motion
        self._command: object = None

    @property
    def driving(self) -> bool:
        """Whether the base does what it was told here, and nobody has commanded it since."""
        return self._command is not None and self._command is self._robot.newest_command

    @property
    def free(self) -> bool:
        """Whether nobody else moves the base."""
        if self._motion.tasks.using(("Base",)):
            return False
        return self.driving or not self._robot.snapshot().moving

    def drive(self, vx: float, wz: float) -> None:
        """Drive ahead and turn [m/s, rad/s], unless somebody else drives, or begins to meanwhile."""
        with self._robot.world.locked():  # a pilot's velocity does not wait for it, all else does
            newest = self._robot.newest_command
            if self.free:
                self._command = self._robot.replace_velocity(newest, vx, 0.0, wz)

    def halt(self) -> None:
        """Stop what was begun here, and nothing else."""
        if self._command is not None:
            self._robot.replace_velocity(self._command, 0.0, 0.0, 0.0)
        self._command = None
