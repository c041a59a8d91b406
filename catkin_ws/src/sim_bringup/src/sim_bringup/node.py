"""A world with simulated robots as a ROS node, `robot_control_node`.

Drivers reach every robot through its own wire (NAOqi, REST), as they reach a real one. Each simulator also
offers the topics of the simulation guide, and what only a simulator knows. For every robot, in its namespace (see
`ros_interface.py`):

    robot_camera      sensor_msgs/Image, 640x480 rgb8, 10 Hz, frame robot_camera: through wire and driver
    movement_command  std_msgs/Int32, taken: 0 stop, 1 forward, 2 backward: through safety gate, driver and wire
    body_state        std_msgs/Float32MultiArray, x y z [m] roll pitch yaw [rad], 10 Hz: the truth, not a measurement
    truth             nav_msgs/Odometry, 50 Hz, in the frame world: the same with velocities
    restart_simulation  std_srvs/Trigger: the whole world back to the start, in place; clients stay connected
    room_speech       std_msgs/String, taken: a person next to the robot says this (espeak-ng)
    <screen>/image_raw  sensor_msgs/Image: what the robot shows, such as Pepper's tablet

For the world: overview/image_raw (sensor_msgs/Image, 10 Hz), the place seen by a fixed camera; restart_simulation.

Parameters: ~robots: words `kind[:name[:port]]` separated by blanks. ~scene, ~seed (0), ~address (127.0.0.1),
            ~viewer (false): open MuJoCo's viewer. ~kinds/<kind>/<setting>: settings of the kind. ~wires/<kind or
            name>/{namespace, cmd_vel, image, speed}: where the driver of the robot takes commands (geometry_msgs/Twist)
            and publishes pictures; {name} stands for the robot's name.
"""

from __future__ import annotations

import logging
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import rospy
from telepresence_ros.node import Node, stop_on_signals

import telepresence
from sim_bringup.ros_interface import RobotTopics, WorldInterface
from telepresence.sim.camera import CamerasFailed
from telepresence.sim.scene import SCENES
from telepresence.sim.simulation import RobotRequest, Simulation, parse_robots
from telepresence.sim.viewer import NoDisplay, view
from telepresence.web.page_auth import was_announced

DEFAULT_SCENE = "apartment"
ROOT = Path(telepresence.__file__).parents[1]
"""The path of the world in the log is relative to this."""


def main() -> int:
    """Any robots, by the parameter ~robots; the exit code."""
    return run("robot_control_node", read_robots, DEFAULT_SCENE)


def read_robots() -> list[RobotRequest]:
    """The robots that the parameters name.

    Raises:
        ValueError: There are none, or a word that is not `kind[:name[:port]]`.
    """
    words = str(rospy.get_param("~robots", "")).split()
    if not words:
        raise ValueError("which robots? Set the parameter ~robots, for example to: pepper:anna:9559 robotino:rto3:8080")
    return parse_robots(words, rospy.get_param("~kinds", {}))


def run(name: str, robots: Callable[[], list[RobotRequest]], scene: str) -> int:
    """Run a simulation until the node is shut down.

    Args:
        name: Of the node, unless roslaunch gives it another.
        robots: Reads from the parameters who is in the world.
        scene: Where, unless the parameter ~scene says otherwise.
    Returns:
        The exit code.
    """
    # rospy's own handlers unregister the node on this thread, which may be inside a call to the ROS master: that call
    # holds the lock of rospy's connection, and both would wait for ever.
    node = Node(name, stop=stop_on_signals(threading.Event()))
    try:
        return simulate(node, robots, scene)
    finally:
        node.shut_down("the simulation ended")


def simulate(node: Node, robots: Callable[[], list[RobotRequest]], scene: str) -> int:
    """Run a simulation until `node.stop` is set; return the exit code. See `run`."""
    logging.getLogger("OpenGL").setLevel(logging.WARNING)
    place = str(rospy.get_param("~scene", scene))
    try:
        requests = robots()
        rospy.loginfo("Loading world: %s (%s terrain)", SCENES.relative_to(ROOT) / f"{place}.xml", place)
        simulation = Simulation(
            requests,
            place,
            int(rospy.get_param("~seed", 0)),
            str(rospy.get_param("~address", "127.0.0.1")),
        )
    except (OSError, CamerasFailed, ValueError) as error:
        rospy.logfatal("%s", error)
        return 1
    with simulation:
        for robot, simulated in simulation.robots.items():
            for url in simulated.urls:
                rospy.loginfo("simulated %s listens on %s", robot, url)
            if simulated.page_url and not was_announced(simulated.page_url):
                # With its key, which is nothing for a log that every program reads; standard output may be a file.
                print(f"the owner's page of {robot}: {simulated.page_url}", file=sys.stderr, flush=True)
        settings = rospy.get_param("~wires", {})
        topics = {request.name: RobotTopics.read(request, settings) for request in requests}
        with WorldInterface(simulation, topics, node.stop):
            rospy.loginfo("[%s]: Robot Control Node initialized", rospy.get_name().lstrip("/"))
            if rospy.get_param("~viewer", False):
                try:
                    view(simulation.world, node.stop)
                except NoDisplay as error:
                    rospy.logerr("%s", error)
            while not node.stop.wait(1.0):
                if simulation.failure:
                    rospy.logfatal("%s", simulation.failure)
                    return 1
    return 0
