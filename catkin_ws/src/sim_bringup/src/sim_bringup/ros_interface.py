"""The topics and services of a running simulation; `node.py` lists them."""

from __future__ import annotations

import contextlib
import math
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import rospy
from nav_msgs.msg import Odometry
from std_msgs.msg import Float32MultiArray, MultiArrayDimension, String
from std_srvs.srv import Trigger, TriggerRequest, TriggerResponse

from sim_bringup.movement_command import DirectMover, DriverMover, Movements
from sim_bringup.picture_topics import PictureTopic, from_cameras, from_topic
from telepresence.sim.simulated_robot import BodyState, SimulatedRobot
from telepresence.sim.simulation import RobotRequest, Simulation
from telepresence.video.images import LatestImage

CAMERA_SIZE = (640, 480)
CAMERA_RATE = 10.0
"""Rate of robot_camera and of the overview [Hz]."""
TRUTH_PERIOD = 0.02
BODY_STATE_EVERY = 5
"""body_state goes out with every fifth truth: 10 Hz."""
STANDING = 0.005
"""Slower than this [m/s] is standing."""
STOP_PATIENCE = 1.0
"""A restart waits so long for a robot to stand [s]; what its driver still holds would else move it afterwards."""
DEFAULT_SPEED = 0.2
RESTARTED = "Simulation restart requested"
"""The simulation guide's answer; here the restart is done when it comes."""


@dataclass(frozen=True)
class RobotTopics:
    """Where a robot's programs are in the ROS graph.

    Args:
        namespace: Of the robot's topics here; "" for the node's own.
        cmd_vel: Its driver or safety gate takes geometry_msgs/Twist there; "" for a robot without a driver.
        image: Its driver publishes the camera's pictures there; "" likewise.
        speed: Of `movement_command` [m/s].
    """

    namespace: str = ""
    cmd_vel: str = ""
    image: str = ""
    speed: float = DEFAULT_SPEED

    @classmethod
    def read(cls, request: RobotRequest, settings: Mapping[str, Mapping[str, Any]]) -> RobotTopics:
        """Read the parameters of the robot's kind and of its own name; {name} in a text is the robot's name.

        Raises:
            ValueError: An unknown setting, or a speed that is no positive number.
        """
        found = {**settings.get(request.kind, {}), **settings.get(request.name, {})}
        if unknown := set(found) - set(cls.__dataclass_fields__):
            raise ValueError(f"robot {request.name!r} has no setting {min(unknown)!r} of its wire")
        speed = float(found.pop("speed", DEFAULT_SPEED))
        if not (math.isfinite(speed) and speed > 0.0):
            raise ValueError(f"the speed of robot {request.name!r} must be a positive number of m/s, got {speed}")
        return cls(**{key: str(text).format(name=request.name) for key, text in found.items()}, speed=speed)

    def topic(self, name: str) -> str:
        return f"{self.namespace}/{name}" if self.namespace else name


class WorldInterface:
    """The topics and services of a simulation, between entering and leaving.

    Args:
        wires: Each robot's topics, by its name.
        stop: Ends them; leaving sets it.
    """

    def __init__(self, simulation: Simulation, wires: Mapping[str, RobotTopics], stop: threading.Event) -> None:
        self._stop = stop
        self._simulation = simulation
        self._restarting = threading.Lock()
        self._threads: list[threading.Thread] = []
        self._robots = [
            RobotInterface(simulation, name, robot, wires[name]) for name, robot in simulation.robots.items()
        ]
        self._overview = PictureTopic(
            "overview/image_raw", "overview", from_cameras(simulation.cameras.subscribe, "overview", CAMERA_RATE)
        )
        namespaces = {wire.namespace for wire in wires.values()} | {""}
        self._services = [
            rospy.Service(RobotTopics(namespace).topic("restart_simulation"), Trigger, self._restart)
            for namespace in sorted(namespaces)
        ]

    def __enter__(self) -> WorldInterface:
        loops = [self._publish_truth, self._overview.run]
        for robot in self._robots:
            loops += [robot.movements.run, *(topic.run for topic in robot.pictures)]
        for loop in loops:
            self._threads.append(threading.Thread(target=loop, args=(self._stop,), name=loop.__qualname__, daemon=True))
            self._threads[-1].start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        for service in self._services:
            service.shutdown()
        for thread in self._threads:
            thread.join(timeout=2.0)

    def _restart(self, _request: TriggerRequest) -> TriggerResponse:
        with self._restarting:
            moving = [robot for robot in self._robots if robot.movements.stop()]
            deadline = time.monotonic() + STOP_PATIENCE
            while any(not robot.stands() for robot in moving) and time.monotonic() < deadline:
                self._stop.wait(0.02)
            self._simulation.restart()
            for robot in self._robots:
                for topic in robot.pictures:
                    topic.reset()
            self._overview.reset()
        return TriggerResponse(True, RESTARTED)

    def _publish_truth(self, stop: threading.Event) -> None:
        due, count = time.monotonic(), 0
        while not stop.wait(max(0.0, due - time.monotonic())):
            due = max(due + TRUTH_PERIOD, time.monotonic() - TRUTH_PERIOD)
            count += 1
            try:
                for robot in self._robots:
                    robot.publish_truth(count % BODY_STATE_EVERY == 0)
            except rospy.ROSException:
                return  # the topics were closed: this node is being shut down


class RobotInterface:
    """The topics of one simulated robot: its truth, its pictures, its movement commands."""

    def __init__(self, simulation: Simulation, name: str, robot: SimulatedRobot, wire: RobotTopics) -> None:
        self._pose: Callable[[], BodyState] = lambda: simulation.truth(name)
        self._frame = robot.BASE_FRAME
        self._truth = rospy.Publisher(wire.topic("truth"), Odometry, queue_size=1)
        self._body_state = rospy.Publisher(wire.topic("body_state"), Float32MultiArray, queue_size=1)
        mover = DirectMover(robot.controls) if robot.controls else DriverMover(wire.cmd_vel, wire.speed)
        rospy.Subscriber(
            wire.topic("room_speech"), String, lambda message: robot.say_nearby(message.data), queue_size=5
        )
        self.movements = Movements(wire.topic("movement_command"), mover)
        self.pictures = [
            PictureTopic(wire.topic(f"{screen}/image_raw"), f"{screen.capitalize()}_frame", _keep(source), first=True)
            for screen, source in robot.screens.items()
        ]
        if robot.controls:
            source = from_cameras(robot.controls.subscribe_camera, None, CAMERA_RATE)
        else:
            source = from_topic(wire.image, CAMERA_SIZE)
        self.pictures.append(PictureTopic(wire.topic("robot_camera"), "robot_camera", source, rate=CAMERA_RATE))

    def stands(self) -> bool:
        return math.hypot(*self._pose().velocity[:2]) < STANDING

    def publish_truth(self, body_state_too: bool) -> None:
        """Publish where the robot is, for those who listen."""
        truth, body_state = self._truth.get_num_connections(), self._body_state.get_num_connections()
        if not truth and not (body_state and body_state_too):
            return
        pose = self._pose()
        if truth:
            self._truth.publish(_odometry(pose, self._frame))
        if body_state and body_state_too:
            message = Float32MultiArray()
            message.layout.dim = [MultiArrayDimension("x y z roll pitch yaw", 6, 6)]
            message.data = [pose.x, pose.y, pose.z, pose.roll, pose.pitch, pose.yaw]
            self._body_state.publish(message)


def _keep(source: Callable[[], LatestImage]) -> Callable[[], contextlib.AbstractContextManager]:
    @contextlib.contextmanager
    def opened() -> Iterator[Callable[[], LatestImage]]:
        yield source

    return opened


def _odometry(pose: BodyState, frame: str) -> Odometry:
    message = Odometry()
    message.header.stamp = rospy.Time.now()
    message.header.frame_id, message.child_frame_id = "world", frame
    position, q = message.pose.pose.position, message.pose.pose.orientation
    position.x, position.y, position.z = pose.x, pose.y, pose.z
    (sr, cr), (sp, cp), (sy, cy) = (
        (math.sin(angle / 2), math.cos(angle / 2)) for angle in (pose.roll, pose.pitch, pose.yaw)
    )
    q.x, q.y = sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy
    q.z, q.w = cr * cp * sy - sr * sp * cy, cr * cp * cy + sr * sp * sy
    twist = message.twist.twist
    twist.linear.x, twist.linear.y, twist.linear.z = pose.velocity
    twist.angular.x, twist.angular.y, twist.angular.z = pose.turning
    return message
