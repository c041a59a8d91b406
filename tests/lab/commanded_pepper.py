"""A simulated Pepper in a process of its own, commanded over standard input; see `talker.Caller`."""

from __future__ import annotations

import argparse
import json
import signal
import sys
from collections.abc import Callable

from pepper_sim.simulation import Simulation


class CommandedPepper:
    """Methods of those that inherit can be asked for, too."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation

    def restart(self) -> None:
        """The robot is back at its start."""
        self._simulation.restart()

    def truth(self) -> list[float]:
        """x, y, z, roll, pitch, yaw in the world [m, rad]."""
        return list(self._simulation.robot.truth())


def run(make: Callable[[Simulation], CommandedPepper], scene: str) -> None:
    """Answer until standard input ends. The first line says that the robot is there."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--port", type=int, required=True)
    arguments = parser.parse_args()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a Ctrl-C is for the test, which ends this process
    with Simulation(scene, port=arguments.port) as simulation:
        robot = make(simulation)
        print(json.dumps("ready"), flush=True)
        for line in sys.stdin:
            name, values = json.loads(line)
            print(json.dumps(getattr(robot, name)(*values)), flush=True)
