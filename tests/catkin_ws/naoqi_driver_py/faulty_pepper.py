"""A simulated Pepper whose sensors a test can break, commanded over standard input in lines of JSON like ros_probe.py.

Everything else is the simulator as it is: the broken values go over its real wire.
"""

from __future__ import annotations

import argparse
import json
import math
import signal
import sys
from collections.abc import Callable

from pepper_sim.simulation import Simulation

FAULTS: dict[str, Callable[[Callable], Callable]] = {
    "nan": lambda read: lambda snapshot: math.nan,
    "missing": lambda read: lambda snapshot: None,
    "minus one": lambda read: lambda snapshot: -1.0,
}


class FaultyPepper:
    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
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

    def restart(self) -> None:
        """The robot is back at its start."""
        self._simulation.restart()

    def truth(self) -> list[float]:
        """x, y, z, roll, pitch, yaw in the world [m, rad]."""
        return list(self._simulation.robot.truth())


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--port", type=int, required=True)
    parser.add_argument("--scene", default="arena")
    arguments = parser.parse_args()
    # The test ends this process; a Ctrl-C is for the test.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with Simulation(scene=arguments.scene, port=arguments.port) as simulation:
        robot = FaultyPepper(simulation)
        print(json.dumps("ready"), flush=True)
        for line in sys.stdin:
            name, values = json.loads(line)
            print(json.dumps(getattr(robot, name)(*values)), flush=True)


if __name__ == "__main__":
    main()
