"""The state of the ROS graph as plain data."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class LinkState:
    """What one poll of the master has found."""

    master_uri: str
    """The URI at which the ROS master is expected: http://host:port."""
    master: bool = False
    """The master answers."""
    joined: bool = False
    """This window is a node of the graph."""
    unsupervised: bool = False
    """The roslaunch that started the robot's programs was killed, and nobody restarts them."""
    driver: bool = False
    """A driver subscribes to cmd_vel."""
    keyboards: frozenset[str] = frozenset()
    """Names of the graph's keyboard nodes, of whatever robot, absolute."""
    feed: bool = False
    """The camera topic has a publisher."""
    robot_camera: bool = False
    """A simulator publishes the simulation guide's picture."""
