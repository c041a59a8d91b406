"""A simulated Pepper at the address that is given: writes its true position, 100 lines a second, until it is ended."""

from __future__ import annotations

import sys
import time

from pepper_sim.simulation import Simulation

with Simulation("empty", port=9559, address=sys.argv[1]) as simulation:
    while True:
        x, y = simulation.robot.truth()[:2]
        print(x, y, flush=True)
        time.sleep(0.01)
