"""What is known of the ROS graph, for widgets that know no ROS."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class LinkState:
    """One look at the graph."""

    master_uri: str
    """Where the ROS master is expected: http://host:port."""
    master: bool = False
    """The master answers."""
    joined: bool = False
    """This window is a node of the graph and can drive."""
    driver: bool = False
    """A program that moves a robot listens to cmd_vel."""
    keyboard: bool = False
    """The keyboard program runs somewhere under its usual name."""
    feed: bool = False
    """Somebody publishes the camera topic."""
