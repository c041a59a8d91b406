"""The node rto_node: velocities and outputs to the robot, sensors from it.

Subscribes: cmd_vel (geometry_msgs/Twist, m/s and rad/s of base_link; newest only; counts for 0.5 s), but not while
            drive/hold (std_msgs/String, of drive_lease) says why nobody may drive; from when a safety gate publishes
            safety_state (std_msgs/String), only what the gate sends, which hears the other programs itself,
            set_digital_values (rto_msgs/DigitalReadings): the eight digital outputs; what the robot does not take
            within 0.5 s is dropped.
Publishes:  20 Hz: distance_sensors (sensor_msgs/PointCloud: the guide's points, 0.2 m + reading around the middle, in
            base_link, NaN for no reading; channel "range" holds the readings [m]), distance_sensors_scan
            (sensor_msgs/LaserScan: true geometry, from the middle; infinities and NaN as in REP 117), bumper
            (std_msgs/Bool), joint_states (the wheels);
            4 Hz: analog_readings, digital_readings, digital_outputs; 1 Hz: power_readings, battery
            (sensor_msgs/BatteryState); drive_state (std_msgs/String, latched): "driving", "stopped: <why>",
            "robot unreachable: <why>", "driven on the robot" (without ~drive); /diagnostics; and what
            `rto_node.rto_core_topics` says.
Parameters: ~hostname, ~max_linear_vel (0.5), ~max_angular_vel (1.0), ~min_linear_vel (0), ~min_angular_vel (0) [m/s,
            rad/s]: see `SpeedLimits`; ~rate (20) [Hz] of the sensors; ~drive (true): false leaves the wheels to the
            drive server on the robot, and cmd_vel to rto_drive_link; ~gated (false): obey nobody but a safety gate on
            this side, not even before one was heard.
Stamps are the ROS time at which the reading arrived: the robot's carry none.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable

import rospy
from geometry_msgs.msg import Point32, Twist
from rto_msgs.msg import AnalogReadings, DigitalReadings, PowerReadings
from sensor_msgs.msg import BatteryState, ChannelFloat32, JointState, LaserScan, PointCloud
from std_msgs.msg import Bool, String
from telepresence_ros.diagnostics import ERROR, OK, WARN, Diagnostics
from telepresence_ros.gate_names import GateNames
from telepresence_ros.node import ROBOT_PATIENCE, Node
from telepresence_ros.sender_watch import subscribe_velocities

from rto_node import robot_facts
from rto_node.client import Odometry, Power, RobotinoClient
from rto_node.command_sender import CommandSender
from rto_node.command_watchdog import CommandWatchdog, SpeedLimits
from rto_node.link import Link, find_address
from rto_node.rto_core_topics import RtoCoreTopics
from telepresence.security.change_log import ChangeLog
from telepresence.security.outside_text import clean
from telepresence.station import heartbeat
from telepresence.station.fault_sentences import UNREACHABLE

SEND_PERIOD = 0.05
"""Seconds between two velocities: the robot stops 0.2 s after the last."""
SHORTEST_SEND_PERIOD = 0.02
"""A new velocity goes out at once, but not more often than this [s]."""
STATE_PERIOD = 0.5
"""Seconds after which an unchanged state is repeated, so that readers notice a dead driver."""
INPUTS_EVERY, POWER_EVERY = 5, 20
"""Cycles of the sensors per reading of inputs, and of power. They have cycles of their own, so that one that the robot
does not answer in time costs no other its turn."""
DISTANCES = "distances"
OUTPUTS = 8
DRIVEN_ELSEWHERE = "driven on the robot"


class Driver:
    """Joins the robot and the topics: one thread sends velocities, one polls the sensors, each with its own link."""

    def __init__(self) -> None:
        self._wake = threading.Event()
        self._node = Node("rto_node", on_master_lost=self._wake.set)
        address = find_address()
        self._watchdog = CommandWatchdog(_read_limits())
        self._commands, self._sensors = Link(address), Link(address)
        self._sender = CommandSender(self._commands, self._watchdog)
        self._rate = float(rospy.get_param("~rate", 20.0))
        self._wheels = [0.0, 0.0, 0.0]
        self._wheels_at: float | None = None
        self._state, self._state_due = "", 0.0
        self._battery_low = ""
        self._log = ChangeLog()
        self._drive_diagnostics = Diagnostics("drive", address)
        self._sensor_diagnostics = Diagnostics("sensors", address)
        self._questions: tuple[tuple[str, int, int, Callable[[RobotinoClient], None]], ...] = (
            # name, every so many cycles, in which of them
            (DISTANCES, 1, 0, lambda client: self._publish_distances(client.distances())),
            ("bumper", 1, 0, lambda client: self._publishers["bumper"].publish(client.bumper())),
            ("odometry", 1, 0, lambda client: self._publish_wheels(client.odometry())),
            ("analog inputs", INPUTS_EVERY, 0, self._read_analog_inputs),
            ("digital inputs", INPUTS_EVERY, 1, self._read_digital_inputs),
            ("digital outputs", INPUTS_EVERY, 2, self._read_digital_outputs),
            ("power", POWER_EVERY, 3, lambda client: self._publish_power(client.power())),
        )
        self._publishers = {
            name: rospy.Publisher(name, kind, queue_size=1, latch=name == "drive_state")
            for name, kind in (
                ("drive_state", String),
                ("distance_sensors", PointCloud),
                ("distance_sensors_scan", LaserScan),
                ("bumper", Bool),
                ("joint_states", JointState),
                ("analog_readings", AnalogReadings),
                ("digital_readings", DigitalReadings),
                ("digital_outputs", DigitalReadings),
                ("power_readings", PowerReadings),
                ("battery", BatteryState),
            )
        }
        self._rto_core = RtoCoreTopics()
        self._drives = bool(rospy.get_param("~drive", True))
        self._hold = ""
        if self._drives:
            # The gate on this side has no hold on programs that publish what it would: the red stop holds them here.
            self._holds = rospy.Subscriber("drive/hold", String, self._on_hold, queue_size=1)
            self._gates, self._gated = GateNames(), bool(rospy.get_param("~gated", False))
            subscribe_velocities("cmd_vel", self._on_velocity, accepts=self._passed_the_gate)
        rospy.Subscriber("set_digital_values", DigitalReadings, self._on_outputs, queue_size=1)

    def run(self) -> int:
        """Run until the node is shut down; return the exit code."""
        return self._node.run(self._drive, self._poll)

    # --- to the robot ------------------------------------------------------------------------------------------------

    def _on_hold(self, message: String) -> None:
        self._hold = clean(message.data)

    def _passed_the_gate(self, twist: Twist) -> bool:
        """Whether to obey a velocity. A gate on this side hears what other programs send, and sends what is safe of it;
        so a robot that has had a gate waits for it."""
        if self._gates.sent(twist) or not (self._gates or self._gated):
            return True
        if not self._gates.present:
            rospy.logwarn_throttle(5.0, "cmd_vel is not obeyed while the safety gate of this robot does not run")
        return False

    def _on_velocity(self, twist: Twist) -> None:
        if self._hold and self._holds.get_num_connections():
            rospy.logwarn_throttle(5.0, "cmd_vel is not obeyed: %s", self._hold)
            twist = Twist()
        self._watchdog.command(twist.linear.x, twist.linear.y, twist.angular.z, time.monotonic())
        self._wake.set()

    def _on_outputs(self, message: DigitalReadings) -> None:
        if len(message.values) != OUTPUTS:
            rospy.logerr("set_digital_values holds %d values, the robot has %d outputs", len(message.values), OUTPUTS)
            return
        self._sender.set_outputs(tuple(message.values))
        self._wake.set()

    def _drive(self) -> None:
        sent_at = -math.inf
        while not self._node.stop.is_set():
            heartbeat.beat(ROBOT_PATIENCE)
            self._wake.wait(SEND_PERIOD)
            if self._node.stop.wait(max(0.0, sent_at + SHORTEST_SEND_PERIOD - time.monotonic())):
                break
            self._wake.clear()
            sent_at = time.monotonic()
            sent = self._sender.send(self._node.master.alive)
            lost = self._sensors.lost if sent.reached else self._commands.lost
            reason = sent.reason if self._drives else DRIVEN_ELSEWHERE
            self._report(sent_at, f"{UNREACHABLE}: {lost}" if lost else reason)
        if self._drives:
            self._commands.ask(lambda client: client.drive(0.0, 0.0, 0.0))
        self._commands.client.close()

    def _report(self, now: float, state: str) -> None:
        state = clean(state)
        self._log.note(now, state, rospy.loginfo)
        if state != self._state or now >= self._state_due:
            self._state, self._state_due = state, now + STATE_PERIOD
            self._publishers["drive_state"].publish(state)
        level = ERROR if state.startswith(UNREACHABLE) else OK
        self._drive_diagnostics.report(now, level, state, {"refused commands": self._watchdog.refused})

    # --- from the robot ----------------------------------------------------------------------------------------------

    def _poll(self) -> None:
        read, counted_at = 0, time.monotonic()
        for cycle, now in enumerate(self._node.cycles(1.0 / self._rate, ROBOT_PATIENCE)):
            read += self._read(cycle)
            rate = read / max(1e-3, now - counted_at)
            complaint = self._sensors.problem or self._battery_low
            diagnosis = sensor_diagnosis(bool(self._sensors.lost), complaint, rate, self._rate)
            if self._sensor_diagnostics.report(now, *diagnosis):
                read, counted_at = 0, now
        self._sensors.client.close()

    def _read(self, cycle: int) -> bool:
        """Ask what is due, each on its own: a robot that lacks one answers the others. Return whether there were
        distances."""
        read = False
        for name, every, turn, question in self._questions:
            if cycle % every != turn:
                continue
            answered = self._sensors.ask(question, name)
            read = read or (answered and name == DISTANCES)
            if self._sensors.lost:  # each further question would take as long
                break
        return read

    def _read_analog_inputs(self, client: RobotinoClient) -> None:
        self._publishers["analog_readings"].publish(AnalogReadings(rospy.Time.now(), client.analog_inputs()))

    def _read_digital_inputs(self, client: RobotinoClient) -> None:
        self._publishers["digital_readings"].publish(DigitalReadings(rospy.Time.now(), client.digital_inputs()))

    def _read_digital_outputs(self, client: RobotinoClient) -> None:
        self._publishers["digital_outputs"].publish(DigitalReadings(rospy.Time.now(), client.digital_outputs()))

    def _publish_distances(self, distances: tuple[float, ...]) -> None:
        stamp = rospy.Time.now()
        cloud = PointCloud()
        cloud.header.stamp, cloud.header.frame_id = stamp, "base_link"
        cloud.points = [Point32(*point) for point in robot_facts.guide_points(distances)]
        cloud.channels = [ChannelFloat32("range", list(distances))]
        self._publishers["distance_sensors"].publish(cloud)

        scan = LaserScan()
        scan.header.stamp, scan.header.frame_id = stamp, "distance_sensors_link"
        scan.angle_min, scan.angle_increment = robot_facts.SCAN_START, robot_facts.RING_STEP
        scan.angle_max = -robot_facts.SCAN_START
        scan.scan_time = 1.0 / self._rate
        scan.range_min = robot_facts.RING_RADIUS + robot_facts.NEAREST
        scan.range_max = robot_facts.RING_RADIUS + robot_facts.NOTHING
        scan.ranges = robot_facts.ring_scan(distances)
        self._publishers["distance_sensors_scan"].publish(scan)
        self._rto_core.publish_clearing(stamp)

    def _publish_wheels(self, reading: Odometry) -> None:
        """Publish speed and angle of the wheels. The robot reports how fast it goes, not how far its wheels have
        turned: that is summed up, from 0 at the start."""
        now = time.monotonic()
        speeds = robot_facts.wheel_speeds(reading.vx, reading.vy, reading.omega)
        elapsed = 0.0 if self._wheels_at is None else min(now - self._wheels_at, 1.0)
        self._wheels_at = now
        self._wheels = [angle + speed * elapsed for angle, speed in zip(self._wheels, speeds, strict=True)]
        message = JointState()
        message.header.stamp = rospy.Time.now()
        message.name = list(robot_facts.WHEEL_JOINTS)
        message.position, message.velocity = list(self._wheels), list(speeds)
        self._publishers["joint_states"].publish(message)
        self._rto_core.publish_wheels(message)

    def _publish_power(self, power: Power) -> None:
        self._battery_low = f"battery low: {power.voltage:.1f} V" if power.low else ""
        stamp = rospy.Time.now()
        self._publishers["power_readings"].publish(PowerReadings(stamp, math.nan, power.voltage))
        battery = battery_message(power)
        battery.header.stamp = stamp
        self._publishers["battery"].publish(battery)


def battery_message(power: Power) -> BatteryState:
    """Return what the robot says about its battery. A low one is in good health: /diagnostics says that it is low."""
    battery = BatteryState()
    battery.voltage = power.voltage
    # sensor_msgs/BatteryState: not a number where nothing is known.
    battery.current = battery.charge = battery.capacity = battery.design_capacity = math.nan
    battery.percentage = battery.temperature = math.nan
    battery.present = True
    battery.power_supply_status = battery.POWER_SUPPLY_STATUS_DISCHARGING
    if power.external:
        battery.power_supply_status = battery.POWER_SUPPLY_STATUS_CHARGING
    battery.power_supply_health = battery.POWER_SUPPLY_HEALTH_GOOD
    technologies = {
        "NiMH": battery.POWER_SUPPLY_TECHNOLOGY_NIMH,
        "Li-Ion": battery.POWER_SUPPLY_TECHNOLOGY_LION,
    }
    battery.power_supply_technology = technologies.get(power.kind, battery.POWER_SUPPLY_TECHNOLOGY_UNKNOWN)
    return battery


def sensor_diagnosis(lost: bool, complaint: str, rate: float, wanted: float) -> tuple[int, str]:
    """Return level and text for /diagnostics.

    Args:
        lost: The robot does not answer.
        complaint: What is wrong with a sensor, the link or the battery; empty for nothing.
        rate, wanted: How many readings a second there are, and should be.
    """
    well = rate > 0.7 * wanted and not complaint
    return ERROR if lost else OK if well else WARN, complaint or f"{rate:.1f} readings/s"


def main() -> int:
    """Run the node; the exit code."""
    return Driver().run()


def _read_limits() -> SpeedLimits:
    try:
        return SpeedLimits(
            float(rospy.get_param("~max_linear_vel", 0.5)),
            float(rospy.get_param("~max_angular_vel", 1.0)),
            float(rospy.get_param("~min_linear_vel", 0.0)),
            float(rospy.get_param("~min_angular_vel", 0.0)),
        )
    except ValueError as error:
        raise SystemExit(f"{rospy.get_name()}: {error}") from None
