"""A simulated Pepper in the arena whose sensors a test can break. Everything else is the simulator as it is: the broken
values go over its real wire."""

from __future__ import annotations

import math
from collections.abc import Callable

from commanded_pepper import CommandedPepper, run

from pepper_sim.simulation import Simulation

FAULTS: dict[str, Callable[[Callable], Callable]] = {
    "nan": lambda read: lambda snapshot: math.nan,
    "missing": lambda read: lambda snapshot: None,
    "minus one": lambda read: lambda snapshot: -1.0,
}


class FaultyPepper(CommandedPepper):
    def __init__(self, simulation: Simulation) -> None:
        super().__init__(simulation)
        self._readers = simulation.server.catalogue.memory._body
        self._sound = dict(self._readers)

    def corrupt(self, device: str, fault: str) -> int:
        """Break every ALMemory key with `device` in its name; the number of keys. "frozen" keeps what they hold now."""
        keys = [key for key in self._readers if device in key]
        snapshot = self._simulation.robot.snapshot()
        for key in keys:
            read = self._sound[key]
            if fault == "frozen":
                held = read(snapshot)
                self._readers[key] = lambda _, held=held: held
            else:
                self._readers[key] = FAULTS[fault](read)
        return len(keys)

    def fix(self) -> None:
        """All sensors work again."""
        self._readers.update(self._sound)

    def press(self, part: str, pressed: bool) -> None:
        self._simulation.robot.press(part, pressed)

    def place_person(self, x: float, y: float) -> None:
        """Stand the person of the arena somewhere [m]."""
        world = self._simulation.world
        with world.locked() as data:
            body = world.model.body("person").mocapid[0]
            data.mocap_pos[body][:2] = x, y


if __name__ == "__main__":
    run(FaultyPepper, "arena")
