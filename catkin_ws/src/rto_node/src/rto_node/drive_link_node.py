"""The node rto_drive_link: velocities to the drive server that runs on the robot, which gates them there.

It takes the place, and the names, of safe_omni_drive, which runs the safety gate on the pilot's side. Here the gate
runs on the robot, so losing the network cannot disable it.

Subscribes: safe_cmd_vel (geometry_msgs/Twist, m/s and rad/s of base_link; newest only; counts for 0.3 s); cmd_vel, for
            programs that know no gate: the same, but nothing while drive/hold (std_msgs/String, of drive_lease) says
            why nobody may drive.
Publishes:  safety (telepresence_msgs/SafetyState), with every report of the robot, 20 Hz; safety_state
            (std_msgs/String, latched): "<state>: <reason>"; /diagnostics.
Services:   stop_drive (std_srvs/Trigger): stop and stay stopped; reset_stop, reset_bumper (std_srvs/Trigger).
Parameters: ~server (127.0.0.1): host or host:port, 8082 unless given; its key is in the pilot's store, `./stack pair`.
            ~name (user@computer), ~rank (0): name and rank under which the robot knows this pilot; a higher rank may
            reset others' stops. ~laser (false): the robot carries a laser scanner, and needs no careful scan.
The careful scan, with its topic, service and parameters: `telepresence_ros.careful_switch`.
"""

from __future__ import annotations

import threading
import time
from functools import partial

import rospy
from geometry_msgs.msg import Twist
from std_msgs.msg import String
from std_srvs.srv import Trigger, TriggerRequest, TriggerResponse
from telepresence_msgs.msg import SafetyState
from telepresence_ros.careful_switch import CarefulSwitch
from telepresence_ros.diagnostics import ERROR, OK, WARN, Diagnostics
from telepresence_ros.kept_state import KeptState
from telepresence_ros.node import Node
from telepresence_ros.sender_watch import subscribe_velocities

from telepresence.drive.datagram import Report
from telepresence.drive.link import DriveLink
from telepresence.safety import SECTORS
from telepresence.start_patience import StartPatience
from telepresence.station import heartbeat, priority
from telepresence.station.fault_sentences import DRIVE_SERVER
from telepresence.teleop.stale_command_filter import BURST_ROOM, StaleCommandFilter

WAIT = 0.1
"""Seconds to wait for a report before checking whether the robot still answers."""
STATE_PERIOD = 0.5
"""Seconds after which an unchanged state is repeated, so that readers notice a dead node."""
LASER_SEES = "With a laser, which sees the way ahead and to the sides, the body does not sway."


class DriveLinkNode:
    def __init__(self) -> None:
        # One for each topic: a program that talks all the time would hide the silence of a pilot who was cut off.
        self._late = {topic: StaleCommandFilter() for topic in ("safe_cmd_vel", "cmd_vel")}
        self._judging = threading.Lock()  # protects the filters: each sender has a thread of its own
        self._node = Node("rto_drive_link", on_master_lost=self._on_master_lost)
        self._careful = False
        self._state, self._state_due = "", 0.0
        self._refused = 0
        self._safety = rospy.Publisher("safety", SafetyState, queue_size=1)
        self._states = rospy.Publisher("safety_state", String, queue_size=1, latch=True)
        try:
            self._link = DriveLink(
                str(rospy.get_param("~server", "127.0.0.1")),
                name=str(rospy.get_param("~name", "")),
                rank=int(rospy.get_param("~rank", 0)),
            )
        except (TypeError, ValueError) as error:
            raise SystemExit(f"{rospy.get_name()}: {error}") from None
        self._kept = KeptState()
        unavailable = LASER_SEES if rospy.get_param("~laser", False) else ""
        self._switch = CarefulSwitch(partial(setattr, self, "_careful"), self._kept, self._keep, unavailable)
        self._switch.start()
        self._diagnostics = Diagnostics("drive link", f"{self._link.host}:{self._link.port}")
        subscribe_velocities("safe_cmd_vel", partial(self._on_velocity, "safe_cmd_vel"), BURST_ROOM, self._on_failure)
        self._lost, self._patience = False, StartPatience()
        self._hold = ""
        self._holds = rospy.Subscriber("drive/hold", String, self._on_hold, queue_size=1, tcp_nodelay=True)
        subscribe_velocities("cmd_vel", self._on_ungated, BURST_ROOM, self._on_failure)
        for service in ("stop_drive", "reset_stop", "reset_bumper"):
            what = "stop" if service == "stop_drive" else service.replace("_", " ")
            rospy.Service(service, Trigger, lambda request, what=what: self._ask(what, request))

    def run(self) -> int:
        """Run until the node is shut down; return the exit code."""
        self._kept.keep_always(self._keep, self._node.stop, STATE_PERIOD)
        return self._kept.forget_after(self._node.run(self._report))

    def _keep(self) -> None:
        self._kept.keep(lambda: self._switch.kept)

    def _on_master_lost(self) -> None:
        # Whoever published our velocities may be gone with it, and nobody can be asked to stop.
        with self._judging:
            for late in self._late.values():
                late.link_lost()
        self._on_failure()

    def _on_failure(self) -> None:
        """What gave the velocity has failed, nobody has let go: the robot brakes fast."""
        self._link.release(hard=True)

    def _on_velocity(self, topic: str, twist: Twist) -> None:
        with self._judging:
            late = self._late[topic].is_stale(time.monotonic())
        if late or not self._node.master.alive:
            self._on_failure()  # what came before it in a burst was taken for new
            return
        try:
            self._link.drive(twist.linear.x, twist.linear.y, twist.angular.z, self._careful)
        except ValueError as error:
            self._refused += 1
            rospy.logwarn_throttle(5.0, "command refused: %s", error)

    def _on_ungated(self, twist: Twist) -> None:
        """Take a velocity of a program that knows no gate. The lease watches safe_cmd_vel only: obey its holds here."""
        if self._hold and self._holds.get_num_connections():
            rospy.logwarn_throttle(5.0, "cmd_vel is not obeyed: %s", self._hold)
            twist = Twist()
        self._on_velocity("cmd_vel", twist)

    def _on_hold(self, message: String) -> None:
        self._hold = message.data

    def _ask(self, what: str, _request: TriggerRequest) -> TriggerResponse:
        done = self._link.ask(what)
        return TriggerResponse(done.ok, done.text)

    def _report(self) -> None:
        while not self._node.stop.is_set():
            heartbeat.beat()
            came = self._link.wait_report(WAIT)
            report, _ = self._link.report()
            problem, now = self._link.problem, time.monotonic()
            if problem or report is None:
                self._safety.publish(_unknown(problem))
                self._say(f"{SafetyState.FAULT}: {problem}", now)
            elif came:
                self._safety.publish(_message(report))
                self._say(f"{report.state}: {report.reason}", now)
            level = ERROR if problem or report is None else WARN if report.state in ("fault", "sensor stale") else OK
            values = {"outages": self._link.outages, "refused commands": self._refused}
            self._diagnostics.report(now, level, problem or self._state, values)
        self._link.close()

    def _say(self, state: str, now: float) -> None:
        if state == self._state and now < self._state_due:
            return
        lost = state.startswith(f"{SafetyState.FAULT}: {DRIVE_SERVER}")
        if not lost:
            self._patience.works()
        if lost and not self._lost and self._patience.over:
            rospy.logerr("%s", state)
            self._lost = True
        elif not lost and self._state.startswith(f"{SafetyState.FAULT}: {DRIVE_SERVER}"):
            rospy.loginfo("the drive server on the robot answers")
            self._lost = False
        self._state, self._state_due = state, now + STATE_PERIOD
        self._states.publish(state)


def _message(report: Report) -> SafetyState:
    message = SafetyState()
    message.header.stamp, message.header.frame_id = rospy.Time.now(), "base_link"
    message.state, message.reason = report.state, report.reason
    message.allowed = list(report.allowed)
    message.gap, message.sector, message.command_age = report.gap, report.sector, report.command_age
    message.vx, message.vy, message.wz = report.given
    message.scanning = report.scanning
    return message


def _unknown(problem: str) -> SafetyState:
    """Nothing is known about the robot: nothing may be taken for free."""
    message = SafetyState()
    message.header.stamp, message.header.frame_id = rospy.Time.now(), "base_link"
    message.state, message.reason = SafetyState.FAULT, problem
    message.allowed = [0.0] * SECTORS
    message.gap, message.sector, message.command_age = float("inf"), -1, float("inf")
    return message


def main() -> int:
    """Run the node; the exit code."""
    priority.put_commands_first()
    return DriveLinkNode().run()
