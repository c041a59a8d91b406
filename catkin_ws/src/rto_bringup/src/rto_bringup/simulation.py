"""The simulated Robotino as a ROS node: REST on a TCP port, and beside it what only a simulator can tell.

Drivers reach the robot by REST, as they reach a real one. The topics here are for people and tests.

Publishes:  overview/image_raw (sensor_msgs/Image, rgb8): the place seen by a fixed camera, 10 Hz, frame overview, while
            somebody subscribes; truth (nav_msgs/Odometry, 20 Hz): where base_link really is, in the frame world.
Services:   restart_simulation (std_srvs/Trigger): everything back to the start; clients stay connected.
Parameters: ~address (127.0.0.1), ~port (8080; 0 takes a free one), ~scene (arena), ~seed (0), ~watchdog (0.2) [s],
            ~laser (false), ~battery (NiMH), ~camera_width, ~camera_height (640, 480), ~viewer (false): open MuJoCo's.
"""

from __future__ import annotations

import logging
import math
import threading

import rosgraph
import rospy
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Image
from std_srvs.srv import Trigger, TriggerRequest, TriggerResponse

from robotino_sim.simulation import DEFAULT_PORT, DEFAULT_SCENE, Simulation
from telepresence.images import fill_image_message
from telepresence.ros_master import MasterWatch, master_answers
from telepresence.sim.camera import CamerasFailed
from telepresence.sim.viewer import view

OVERVIEW = ("overview", 640, 480, 10.0)
"""Camera, width and height [px], pictures per second."""
TRUTH_PERIOD = 0.05
PICTURE_TIMEOUT = 0.2
"""Seconds to wait for a picture before looking for subscribers again."""


def main() -> int:
    """Run until the node is shut down; the exit code."""
    uri = rosgraph.get_master_uri()
    if not master_answers(uri, timeout=2.0):
        raise SystemExit(f"no ROS master answers at {uri}: start roscore, or set ROS_MASTER_URI to where one runs")
    rospy.init_node("robotino_sim")
    logging.getLogger("OpenGL").setLevel(logging.WARNING)
    try:
        simulation = Simulation(
            scene=rospy.get_param("~scene", DEFAULT_SCENE),
            seed=int(rospy.get_param("~seed", 0)),
            address=rospy.get_param("~address", "127.0.0.1"),
            port=int(rospy.get_param("~port", DEFAULT_PORT)),
            watchdog=float(rospy.get_param("~watchdog", 0.2)),
            laser=bool(rospy.get_param("~laser", False)),
            battery=rospy.get_param("~battery", "NiMH"),
            camera_size=(int(rospy.get_param("~camera_width", 640)), int(rospy.get_param("~camera_height", 480))),
        )
    except (OSError, CamerasFailed, ValueError) as error:
        rospy.logfatal("%s", error)
        return 1
    with simulation:
        MasterWatch(rospy).start()
        rospy.loginfo("simulated Robotino listens on %s", simulation.url)
        surface = SimulationSurface(simulation)
        surface.start()
        if rospy.get_param("~viewer", False):
            view(simulation.world, surface.stop)
        while not surface.stop.wait(1.0):
            if not simulation.world.running:
                rospy.logfatal("the simulated world has stopped")
                return 1
    return 0


class SimulationSurface:
    """The topics and the service of a running simulation."""

    def __init__(self, simulation: Simulation) -> None:
        self.stop = threading.Event()
        self._simulation = simulation
        self._truth = rospy.Publisher("truth", Odometry, queue_size=1)
        self._overview = rospy.Publisher("overview/image_raw", Image, queue_size=1)
        rospy.Service("restart_simulation", Trigger, self._restart)
        rospy.on_shutdown(self.stop.set)

    def start(self) -> None:
        for target in (self._tell_truth, self._show_overview):
            threading.Thread(target=target, name=target.__name__.strip("_"), daemon=True).start()

    def _restart(self, _request: TriggerRequest) -> TriggerResponse:
        self._simulation.restart()
        return TriggerResponse(True, "everything is back at the start")

    def _tell_truth(self) -> None:
        while not self.stop.wait(TRUTH_PERIOD):
            x, y, z, _, _, yaw = self._simulation.robot.truth()
            message = Odometry()
            message.header.stamp = rospy.Time.now()
            message.header.frame_id, message.child_frame_id = "world", "base_link"
            position, q = message.pose.pose.position, message.pose.pose.orientation
            position.x, position.y, position.z = x, y, z
            q.z, q.w = math.sin(yaw / 2), math.cos(yaw / 2)
            self._publish(self._truth, message)

    def _show_overview(self) -> None:
        while not self.stop.is_set():
            if not self._overview.get_num_connections():
                self.stop.wait(PICTURE_TIMEOUT)
                continue
            with self._simulation.cameras.subscribe(*OVERVIEW) as feed:
                sequence = 0
                while self._overview.get_num_connections() and not self.stop.is_set():
                    picture = feed.image.wait_newer(sequence, PICTURE_TIMEOUT)
                    if picture is None:
                        continue
                    sequence = picture.sequence
                    message = fill_image_message(Image(), picture.pixels, "rgb8")
                    message.header.stamp = rospy.Time.from_sec(picture.stamp)
                    message.header.frame_id = "overview"
                    self._publish(self._overview, message)

    def _publish(self, publisher: rospy.Publisher, message: object) -> None:
        try:
            publisher.publish(message)
        except rospy.ROSException:
            self.stop.set()  # the topic was closed: this node is being shut down
