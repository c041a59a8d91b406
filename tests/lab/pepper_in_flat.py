"""A simulated Pepper in the flat's bedroom that counts what it touches."""

from __future__ import annotations

import mujoco
from commanded_pepper import CommandedPepper, run

from pepper_sim.simulation import Simulation

BEDROOM = (2.7, -1.75)
"""Where it starts [m], looking north: beside the doorway of 0.9 m, which is west of it."""
PERIOD = 0.02


class PepperInFlat(CommandedPepper):
    def __init__(self, simulation: Simulation) -> None:
        super().__init__(simulation)
        model = simulation.world.model
        self._floor = {i for i in range(model.ngeom) if model.geom(i).type[0] == mujoco.mjtGeom.mjGEOM_PLANE}
        self._place = int(model.joint(f"{simulation.simulated.model.prefix}root").qposadr[0])
        robot = model.body(f"{simulation.simulated.model.prefix}base_footprint").rootid[0]
        self._own = {i for i in range(model.ngeom) if model.body_rootid[model.geom_bodyid[i]] == robot}
        self._touched: set[str] = set()
        simulation.world.on_reset(self._put_into_bedroom)
        simulation.restart()
        simulation.world.every(PERIOD, self._look)

    def _put_into_bedroom(self) -> None:
        with self._simulation.world.locked() as data:
            data.qpos[self._place : self._place + 2] = BEDROOM

    def _look(self, _now: float) -> None:
        world = self._simulation.world
        with world.locked() as data:
            for one, other in data.contact.geom:
                if (one in self._own) != (other in self._own) and not {one, other} & self._floor:
                    self._touched.add(" and ".join(world.model.geom(i).name or str(i) for i in (one, other)))

    def touched(self) -> list[str]:
        """What the robot has touched since the restart."""
        return sorted(self._touched)

    def restart(self) -> None:
        super().restart()
        self._touched.clear()

    def pose(self) -> list[float]:
        """x, y, yaw in the flat [m, m, rad]."""
        truth = self.truth()
        return [truth[0], truth[1], truth[5]]


if __name__ == "__main__":
    run(PepperInFlat, "apartment")
