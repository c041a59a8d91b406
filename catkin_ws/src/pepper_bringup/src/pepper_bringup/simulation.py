"""The simulated Pepper as a ROS node: NAOqi's services on a TCP port, and beside them what only a simulator can tell.

Drivers reach the robot through NAOqi, as they reach a real one. The topics here are for people and tests.

Publishes:  tablet/image_raw (sensor_msgs/Image, rgb8): what the tablet shows; overview/image_raw: the place seen by a
            fixed camera, 10 Hz, frame overview; both only while somebody subscribes. truth (nav_msgs/Odometry, 20 Hz):
            where base_footprint really is, in the frame world.
Services:   restart_simulation (std_srvs/Trigger): everything back to the start; clients stay connected.
Parameters: ~address (127.0.0.1), ~port (9559; 0 takes a free one), ~scene (apartment), ~seed (0), ~viewer (false):
            open MuJoCo's viewer.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable

import numpy as np
import rosgraph
import rospy
from naoqi_driver.body import quaternion
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Image
from std_srvs.srv import Trigger, TriggerResponse

from pepper_sim.server import CannotListen
from pepper_sim.simulation import DEFAULT_PORT, Simulation
from telepresence.images import LatestImage, fill_image_message
from telepresence.ros_master import MasterWatch, master_answers
from telepresence.sim.camera import CamerasFailed
from telepresence.sim.viewer import view

OVERVIEW = ("overview", 640, 480, 10.0)
"""Camera, width and height [px], pictures per second."""
DARK = np.zeros((400, 640, 3), np.uint8)
"""The tablet before anything was shown on it."""
TRUTH_PERIOD = 0.05
PICTURE_TIMEOUT = 0.2
"""Seconds to wait for a picture before looking for subscribers again."""


def main() -> int:
    """Run until the node is shut down; the exit code."""
    if not master_answers(rosgraph.get_master_uri(), timeout=2.0):
        raise SystemExit(f"no ROS master answers at {rosgraph.get_master_uri()}: start roscore, or set ROS_MASTER_URI")
    rospy.init_node("pepper_sim")
    logging.getLogger("OpenGL").setLevel(logging.WARNING)
    try:
        simulation = Simulation(
            scene=rospy.get_param("~scene", "apartment"),
            seed=int(rospy.get_param("~seed", 0)),
            address=rospy.get_param("~address", "127.0.0.1"),
            port=int(rospy.get_param("~port", DEFAULT_PORT)),
        )
    except (CannotListen, CamerasFailed, ValueError) as error:
        rospy.logfatal("%s", error)
        return 1
    with simulation:
        MasterWatch(rospy).start()
        rospy.loginfo("simulated Pepper listens on %s", simulation.url)
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
        self._tablet = rospy.Publisher("tablet/image_raw", Image, queue_size=1)
        self._overview = rospy.Publisher("overview/image_raw", Image, queue_size=1)
        rospy.Service("restart_simulation", Trigger, self._restart)
        rospy.on_shutdown(self.stop.set)

    def start(self) -> None:
        for target in (self._tell_truth, self._show_tablet, self._show_overview):
            threading.Thread(target=target, name=target.__name__.strip("_"), daemon=True).start()

    def _restart(self, _request: object) -> TriggerResponse:
        self._simulation.restart()
        return TriggerResponse(True, "everything is back at the start")

    def _tell_truth(self) -> None:
        while not self.stop.wait(TRUTH_PERIOD):
            x, y, z, roll, pitch, yaw = self._simulation.robot.truth()
            message = Odometry()
            message.header.stamp = rospy.Time.now()
            message.header.frame_id = "world"
            message.child_frame_id = "base_footprint"
            position, q = message.pose.pose.position, message.pose.pose.orientation
            position.x, position.y, position.z = x, y, z
            q.x, q.y, q.z, q.w = quaternion(roll, pitch, yaw)
            linear, angular = message.twist.twist.linear, message.twist.twist.angular
            linear.x, linear.y, angular.z = self._simulation.robot.snapshot().velocity
            self._truth.publish(message)

    def _show_tablet(self) -> None:
        self._show(self._tablet, lambda: self._simulation.tablet.image, "Tablet_frame")

    def _show_overview(self) -> None:
        while not self.stop.is_set():
            if not self._overview.get_num_connections():
                self.stop.wait(PICTURE_TIMEOUT)
                continue
            with self._simulation.cameras.subscribe(*OVERVIEW) as feed:
                self._show(self._overview, lambda feed=feed: feed.image, "overview", until_nobody=True)

    def _show(
        self, publisher: rospy.Publisher, source: Callable[[], LatestImage], frame: str, until_nobody: bool = False
    ) -> None:
        """Publish every new picture of `source()`; a reader that comes later gets the newest one at once."""
        sequence, readers = 0, 0
        while not self.stop.is_set():
            before, readers = readers, publisher.get_num_connections()
            if readers == 0:
                if until_nobody:
                    return
                self.stop.wait(PICTURE_TIMEOUT)
                continue
            picture = source().wait_newer(0 if readers > before else sequence, PICTURE_TIMEOUT)
            if picture is not None:
                sequence = picture.sequence
                self._publish_picture(publisher, picture.pixels, picture.stamp, frame)
            elif readers > before and not until_nobody:
                self._publish_picture(publisher, DARK, time.time(), frame)  # nothing was ever shown

    @staticmethod
    def _publish_picture(publisher: rospy.Publisher, pixels: np.ndarray, stamp: float, frame: str) -> None:
        message = fill_image_message(Image(), pixels, "rgb8")
        message.header.stamp = rospy.Time.from_sec(stamp)
        message.header.frame_id = frame
        publisher.publish(message)
