"""A small four-legged robot of our own: body, gait, robot, and a web interface in front of it.

There is no such machine to buy; it is here because a robot that walks can fall, and a gait can be frozen in mid-step.
"""

from telepresence.sim.walker.simulation import SimulatedWalker

__all__ = ["SimulatedWalker"]
