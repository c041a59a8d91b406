"""The node safe_omni_drive: lets through what is safe of safe_cmd_vel, and of what other programs send on cmd_vel.

Subscribes: safe_cmd_vel (geometry_msgs/Twist); cmd_vel, for programs that know no gate: the same, but nothing while
            drive/hold (std_msgs/String, of drive_lease) says why nobody may drive; distance_sensors
            (sensor_msgs/PointCloud; its channel "range", or the guide's formula backwards), bumper (std_msgs/Bool),
            odom (nav_msgs/Odometry), odom_restarted (std_msgs/Empty).
Publishes:  cmd_vel (geometry_msgs/Twist), which rto_node then obeys from nobody else; /diagnostics, and what
            `telepresence_ros.safety_topics` lists: safety, safety_state, safety_markers.
Services:   stop_drive: stop and stay stopped; reset_stop, reset_bumper (std_srvs/Trigger). Not for the bubble.
Parameters: ~layer ("gate", or "bubble": the guide's filter exactly, to be compared with), ~base_frame_id (base_link).
            For the gate: ~bumper (true): the robot has one, and does not drive while it is silent.
            For the bubble: ~safety_radius (0.4) [m], ~max_linear_vel (0.2), ~min_linear_vel (0.05), ~max_angular_vel
            (1.0), ~min_angular_vel (0.1).
The careful scan, with its topic, service and parameters: `telepresence_ros.careful_switch`. Not for the bubble.
"""

from __future__ import annotations

import threading
import time
from functools import partial

import numpy as np
import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rto_node.robot_facts import SENSORS, ranges_of_guide_points
from sensor_msgs.msg import PointCloud
from std_msgs.msg import Bool, Empty, String
from telepresence_ros.careful_switch import CarefulSwitch
from telepresence_ros.diagnostics import OK, WARN, Diagnostics
from telepresence_ros.gate_names import GateNames
from telepresence_ros.kept_state import KeptState
from telepresence_ros.node import Node
from telepresence_ros.safety_topics import SafetyTopics
from telepresence_ros.sender_watch import SenderWatch, subscribe_velocities

from rto_safe_teleop.bubble import ClampLimits
from rto_safe_teleop.gates import SAFETY_RADIUS, Answer, BubbleGate, Gate, RobotGate
from telepresence.geometry import yaw_of
from telepresence.safety import ROBOTINO, State, VelocityGate
from telepresence.security.outside_text import clean
from telepresence.station import priority
from telepresence.teleop.stale_command_filter import BURST_ROOM, StaleCommandFilter

PERIOD = 0.05
KEEP_PERIOD = 0.5
"""Seconds after which what was set is kept for the gate that follows when this one dies; a bump is kept at once."""
LAYERS = ("gate", "bubble")


class SafeDrive:
    def __init__(self) -> None:
        self._late, self._late_ungated = StaleCommandFilter(), StaleCommandFilter()
        self._logged = ""
        self._node = Node("safe_omni_drive", on_master_lost=self._on_master_lost)
        self._gate = _choose_gate()
        self._kept = KeptState()
        self._lock = threading.Lock()  # protects the gate: callbacks come on threads of their own
        gate = self._gate if isinstance(self._gate, RobotGate) else None
        if gate is not None:
            gate.gate.restore(self._kept.latched())
            self._careful = CarefulSwitch(partial(setattr, gate.gate, "careful"), self._kept, self._keep)
            self._careful.start()
        self._topics = SafetyTopics(
            ROBOTINO,
            str(rospy.get_param("~base_frame_id", "base_link")),
            latches=self if gate else None,
            obstacles=self._obstacles if gate else None,
            on_latch=self._keep,
        )
        self._diagnostics = Diagnostics("safety", type(self._gate).__name__)
        self._hold = ""
        self._holds = rospy.Subscriber("drive/hold", String, self._on_hold, queue_size=1, tcp_nodelay=True)
        self._gates = GateNames(wait=False)
        with self._lock:  # what comes at once waits until it can be answered
            subscribe_velocities("cmd_vel", self._on_ungated, BURST_ROOM, accepts=self._knows_no_gate, others_only=True)
            self._velocities = rospy.Publisher("cmd_vel", Twist, queue_size=1)
        subscribe_velocities("safe_cmd_vel", self._on_command, BURST_ROOM)
        SenderWatch("odom", Odometry, self._on_odometry, self._on_odometry_lost)
        for topic, kind, callback in (
            ("distance_sensors", PointCloud, self._on_distances),
            ("bumper", Bool, self._on_bumper),
            ("odom_restarted", Empty, self._on_odometry_restarted),
        ):
            rospy.Subscriber(topic, kind, callback, queue_size=1, tcp_nodelay=True)

    def run(self) -> int:
        """Run until the node is shut down; return the exit code."""
        self._kept.keep_always(self._keep, self._node.stop, KEEP_PERIOD)
        return self._kept.forget_after(self._node.run(self._loop))

    def _loop(self) -> None:
        for now in self._node.cycles(PERIOD):
            with self._lock:
                answer = self._gate.tick(now)
            if answer is not None:
                self._give(answer, now)
        self._velocities.publish(Twist())

    def _keep(self) -> None:
        if isinstance(self._gate, RobotGate):
            self._kept.keep(lambda: {**self._velocity_gate.latched._asdict(), **self._careful.kept})

    def _give(self, answer: Answer, now: float) -> None:
        if answer.velocity is not None:
            message = Twist()
            message.linear.x, message.linear.y, message.angular.z = answer.velocity
            self._velocities.publish(message)
        self._topics.report(now, answer.decision)
        level = WARN if answer.decision.state in (State.FAULT, State.SENSOR_STALE) else OK
        self._diagnostics.report(now, level, f"{answer.state}: {answer.reason}")

    def _on_master_lost(self) -> None:
        self._late.link_lost()
        self._late_ungated.link_lost()

    def _on_command(self, twist: Twist) -> None:
        self._take(twist, self._late)

    def _take(self, twist: Twist, late: StaleCommandFilter) -> None:
        now = time.monotonic()
        with self._lock:
            if late.is_stale(now):
                rospy.logwarn_throttle(5.0, "commands that the network held up are refused")
                twist = Twist()  # those of the burst that were taken for new ones end
            answer = self._gate.receive_command(twist.linear.x, twist.linear.y, twist.angular.z, now)
            lines = self._gate.log_lines() if isinstance(self._gate, BubbleGate) else ""
        if lines != self._logged:
            self._logged = lines
            rospy.loginfo("%s", lines)
        if answer is not None:
            self._give(answer, now)

    def _on_ungated(self, twist: Twist) -> None:
        """Take a velocity of a program that knows no gate. The lease watches safe_cmd_vel only: obey its holds here."""
        if self._hold and self._holds.get_num_connections():
            rospy.logwarn_throttle(5.0, "cmd_vel is not obeyed: %s", self._hold)
            twist = Twist()
        self._take(twist, self._late_ungated)

    def _knows_no_gate(self, twist: Twist) -> bool:
        """Whether a velocity on cmd_vel is for this gate. Two gates that took each other's would never fall silent."""
        if not self._gates.sent(twist):
            return True
        rospy.logwarn_throttle(5.0, "another safety gate drives this robot, too: end one of the two")
        return False

    def _on_hold(self, message: String) -> None:
        self._hold = clean(message.data)

    def _on_distances(self, cloud: PointCloud) -> None:
        ranges = next((channel.values for channel in cloud.channels if channel.name == "range"), None)
        if ranges is None:
            ranges = ranges_of_guide_points([(point.x, point.y) for point in cloud.points])
        if len(ranges) != SENSORS:
            rospy.logwarn_throttle(10.0, "distance_sensors holds %d readings, expected %d", len(ranges), SENSORS)
            return
        with self._lock:
            self._gate.receive_ranges(ranges, time.monotonic())

    def _on_bumper(self, message: Bool) -> None:
        with self._lock:
            self._gate.receive_bumper(message.data, time.monotonic())
        if message.data:  # it comes again while the bumper is pressed; what is the same is not kept anew
            self._kept.keep_soon()

    def _on_odometry(self, message: Odometry) -> None:
        position, q = message.pose.pose.position, message.pose.pose.orientation
        theta = yaw_of(q.w, q.x, q.y, q.z)
        with self._lock:
            self._gate.receive_odometry(position.x, position.y, theta, time.monotonic())

    def _on_odometry_lost(self) -> None:
        with self._lock:
            self._gate.lose_odometry()

    def _on_odometry_restarted(self, _: Empty) -> None:
        with self._lock:
            self._gate.forget_surroundings()

    def stop(self, reason: str) -> None:
        """Stop and stay stopped; `reason` completes "Stopped: ..."."""
        with self._lock:
            self._velocity_gate.stop(reason)

    def reset_stop(self) -> None:
        with self._lock:
            self._velocity_gate.reset_stop()

    def reset_bumper(self) -> bool:
        """False while the bumper is still pressed."""
        with self._lock:
            return self._velocity_gate.reset_bumper()

    @property
    def _velocity_gate(self) -> VelocityGate:
        assert isinstance(self._gate, RobotGate), "the bubble has no latches and no obstacles"
        return self._gate.gate

    def _obstacles(self) -> np.ndarray:
        with self._lock:
            return self._velocity_gate.obstacles()


def main() -> int:
    """Run the node; the exit code."""
    priority.put_commands_first()
    return SafeDrive().run()


def _choose_gate() -> Gate:
    """Raises SystemExit for an unknown gate or limits that make no sense."""
    name = str(rospy.get_param("~layer", LAYERS[0]))
    if name == "gate":
        return RobotGate(bool(rospy.get_param("~bumper", True)))
    if name != "bubble":
        raise SystemExit(f"{rospy.get_name()}: layer:={name}: choose {' or '.join(LAYERS)}")
    rospy.logwarn("the guide's bubble drives this robot: it has no memory and no watchdog")
    defaults = ClampLimits()
    limits = ClampLimits(
        float(rospy.get_param("~max_linear_vel", defaults.max_linear)),
        float(rospy.get_param("~min_linear_vel", defaults.min_linear)),
        float(rospy.get_param("~max_angular_vel", defaults.max_angular)),
        float(rospy.get_param("~min_angular_vel", defaults.min_angular)),
    )
    try:
        return BubbleGate(float(rospy.get_param("~safety_radius", SAFETY_RADIUS)), limits)
    except ValueError as error:
        raise SystemExit(f"{rospy.get_name()}: {error}") from None
