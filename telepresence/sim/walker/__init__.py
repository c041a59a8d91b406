"""A small four-legged robot that exists in simulation only: body, gait, robot, and a web interface.

It is included because a walking robot can fall, and because a gait can be frozen in mid-step.
"""

from telepresence.sim.walker.simulation import SimulatedWalker

__all__ = ["SimulatedWalker"]
