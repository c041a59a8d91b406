#!/usr/bin/env python3
"""Drives the robot: velocity commands and goals in, to its drive server out, and a stop whenever in doubt.

Subscribes: cmd_vel (geometry_msgs/Twist, m/s and rad/s of base_footprint; newest only),
            move_base_simple/goal (geometry_msgs/PoseStamped in any frame that tf leads to odom from; one with a stamp
            is refused when it is old), unless ~goals is false; the topics of `naoqi_driver.head_topics`, by which a
            pilot turns the head; joint_angles (naoqi_bridge_msgs/JointAnglesWithSpeed), for pose_controller.
Publishes:  drive_state (std_msgs/String, latched): "driving", "stopped: <why>", "robot unreachable: <why>";
            /diagnostics; with safety what `telepresence_ros.safety_topics` lists: safety, safety_state, safety_markers.
Services:   with safety stop_drive: stop and stay stopped; reset_stop, reset_bumper (std_srvs/Trigger);
            orthogonal_security_distance, tangential_security_distance: how far NAOqi keeps from obstacles [m];
            stop_walk_srv.
Parameters: ~drive_server (""): host or host:port, 8085 unless given, of the drive server, which moves the base; its key
            is in the pilot's store, `./stack pair`. Without one this node starts one for itself;
            ~safety (true): lasers, sonars and bumpers limit velocity commands; goals are left to NAOqi's protection;
            ~goals (true): false where move_base drives, which takes the same topic;
            ~base_frame_id (base_footprint): frame of what the safety gate reports;
            ~wake_up (true): wake a sleeping robot at start, but for one that was put to rest while a driver ran that
            has died;
            ~look (0.15): HeadPitch at start, and of looking straight ahead [rad, positive down]; "none" leaves the
            head alone until a pilot turns it.
"""

import math
import sys
import threading
import time
from dataclasses import replace

import numpy as np
import rospy
from geometry_msgs.msg import Twist
from naoqi_driver.base import PERIOD, BaseDriver
from naoqi_driver.command_watchdog import CommandWatchdog
from naoqi_driver.connection import RobotError
from naoqi_driver.gated_drive import GatedDrive
from naoqi_driver.goal_topic import GoalTopic
from naoqi_driver.head_topics import HeadTopics
from naoqi_driver.naoqi_node import NaoqiNode
from naoqi_driver.own_drive_server import OwnDriveServer
from naoqi_driver.range_sensors import RangeSensorReader
from std_msgs.msg import String
from std_srvs.srv import Empty, EmptyResponse
from telepresence_ros.diagnostics import ERROR, OK, WARN, Diagnostics
from telepresence_ros.kept_state import KeptState
from telepresence_ros.safety_topics import SafetyTopics
from telepresence_ros.sender_watch import subscribe_velocities

from telepresence import ports
from telepresence.drive.link import DriveLink
from telepresence.drive.pace import Pace
from telepresence.geometry import ZERO_VELOCITY, Velocity
from telepresence.safety import PEPPER, SECTORS, Decision, Latched, State
from telepresence.security.change_log import ChangeLog
from telepresence.security.outside_text import clean
from telepresence.station import heartbeat, priority
from telepresence.teleop.stale_command_filter import BURST_ROOM, StaleCommandFilter

MOTION_CYCLE, BURST = 0.02, 3
"""Seconds between two commands on average, since ALMotion takes a new setpoint every 20 ms (NAOqi 2.8 documentation,
ALMotion); that many may follow each other at once."""
LOOK_PERIOD = 0.5
"""Seconds between two questions whether the robot is awake and moves as commanded."""
KEEP_PERIOD = 0.5
"""Seconds after which what was set is kept for the driver that follows when this one dies; a bump is kept at once."""
OFFER_AFTER = 3.0
"""Seconds after the start at which the security distances are offered and joint_angles are listened to: their messages
take a quarter of the processor time of a start, and on a busy machine the robot would wait for them."""
LOOK = 0.15
"""HeadPitch with which the pilot sees the floor ahead [rad]."""
STATE_PERIOD = 0.5
"""Seconds after which an unchanged state is repeated, so that readers notice a dead driver."""


class MoveTo:
    def __init__(self) -> None:
        self._wake = threading.Event()
        self._stepping = threading.Lock()  # protects the base and the pace
        self._pace = Pace(MOTION_CYCLE, BURST)
        self._late, self._late_looks = StaleCommandFilter(), StaleCommandFilter()
        self._node = NaoqiNode("naoqi_moveto_listener", on_master_lost=self._on_master_lost)
        # First, as both take their time: the greeting, and the sensors' first readings.
        self._link = self._open_link()
        self._kept = KeptState()
        self._gated = gated = GatedDrive(self._kept.keep_soon) if rospy.get_param("~safety", True) else None
        self._commands = gated or CommandWatchdog()
        if gated is not None:
            gated.restore(self._kept.latched())
            self._sensors = RangeSensorReader(
                self._node.connection, lambda reading: gated.receive(reading, time.monotonic())
            ).start()
        look = rospy.get_param("~look", LOOK)
        self._base = BaseDriver(
            self._node.connection,
            self._link,
            self._commands,
            wake_up=bool(rospy.get_param("~wake_up", True)),
            look=None if look == "none" else float(look),
            rests=self._kept.switch("rests", False, quiet=True),
        )
        ahead = LOOK if look == "none" else float(look)
        asleep = lambda: self._base.awake is False  # noqa: E731
        ended = self._kept.text("ended")
        self._head = HeadTopics(self._node, self._node.connection, ahead, asleep, self._late_looks, ended)
        self._state_publisher = rospy.Publisher("drive_state", String, queue_size=1, latch=True)
        self._state = ""
        self._log = ChangeLog()
        self._state_due = 0.0
        self._diagnostics = Diagnostics("base", str(self._node.connection.address))
        if self._gated is not None:
            frame = str(rospy.get_param("~base_frame_id", "base_footprint"))
            self._safety = SafetyTopics(PEPPER, frame, self._gated, self._gated.obstacles, self._keep)
        subscribe_velocities("cmd_vel", self._on_velocity, BURST_ROOM)
        self._goals = GoalTopic(self._node, self._base, self._wake.set) if rospy.get_param("~goals", True) else None
        rospy.Service("stop_walk_srv", Empty, self._on_stop)

    def run(self) -> int:
        self._kept.keep_always(self._keep, self._node.stop, KEEP_PERIOD)
        loops = [self._loop, self._look_after, self._head.loop, *([self._goals.loop] if self._goals else [])]
        return self._kept.forget_after(self._node.run(*loops))

    def _open_link(self) -> DriveLink:
        server = str(rospy.get_param("~drive_server", ""))
        try:
            if not server:
                ended = "the drive server that this driver had started has ended"
                own = OwnDriveServer(self._node.connection.address, lambda: self._node.fail(ended))
                self._node.at_end(own.close)
                server = own.address
            link = DriveLink(server if ":" in server else f"{server}:{ports.PEPPER_DRIVE}")
        except (RuntimeError, ValueError) as error:
            raise SystemExit(f"{rospy.get_name()}: {error}") from None
        self._node.at_end(link.close)
        return link

    def _on_master_lost(self) -> None:
        self._late.link_lost()
        self._late_looks.link_lost()
        self._wake.set()

    def _on_velocity(self, twist: Twist) -> None:
        now = time.monotonic()
        self._base.end_goals()
        if self._late.is_stale(now):
            rospy.logwarn_throttle(5.0, "commands that the network held up are refused")
            self._commands.command(*ZERO_VELOCITY, now)  # those of the burst that were taken for new ones end
            self._obey_at_once()
            return
        velocity = Velocity(twist.linear.x, twist.linear.y, twist.angular.z)
        self._commands.command(*velocity, now)
        self._obey_at_once()
        self._head.head.drives(velocity, now)

    def _on_stop(self, _request) -> EmptyResponse:
        self._base.end_goals()
        self._commands.command(0.0, 0.0, 0.0, time.monotonic())
        self._wake.set()
        return EmptyResponse()

    def _set_distance(self, method: str, distance: float) -> None:
        if not (math.isfinite(distance) and distance >= 0):
            raise rospy.ServiceException(f"{distance} is not a distance in metres")
        try:
            self._node.connection.call("ALMotion", method, float(distance))
        except RobotError as error:
            raise rospy.ServiceException(str(error)) from None

    def _obey_at_once(self) -> None:
        """Carry out a new command on the thread that brought it, since a change of threads takes as long as the
        decision; where that must wait, the loop does."""
        if not self._stepping.acquire(blocking=False):
            self._wake.set()
            return
        try:
            now = time.monotonic()
            if now >= self._pace.due() and not self._node.stop.is_set():
                self._pace.take(now)
                self._base.step(now, self._node.master.alive)
            else:
                self._wake.set()
        finally:
            self._stepping.release()

    def _loop(self) -> None:
        while not self._node.stop.is_set():
            heartbeat.beat(PERIOD + self._node.patience)
            woken = self._wake.wait(PERIOD)
            if woken:
                if self._node.stop.wait(max(0.0, self._pace.due() - time.monotonic())):
                    break
                self._wake.clear()
            with self._stepping:
                if woken:
                    self._pace.take(time.monotonic())
                self._base.step(time.monotonic(), self._node.master.alive)
            self._report(time.monotonic())
        if self._gated is not None:
            self._sensors.close()
        self._commands.clear()

    def _look_after(self) -> None:
        """What waits for the robot, beside the loop that drives."""
        offered, begun = False, time.monotonic()
        for now in self._node.cycles(LOOK_PERIOD):
            if not self._node.connection.connected:
                continue
            try:
                self._base.supervise(now)
                self._head.head.supervise(now)
            except RobotError as error:
                rospy.logdebug("%s", error)
            if not offered and now >= begun + OFFER_AFTER:
                offered = True
                self._offer_distances()
                self._relay_joint_angles()

    def _keep(self) -> None:
        self._kept.keep(self._what_is_kept)

    def _what_is_kept(self) -> dict[str, bool | str]:
        latched = self._gated.latched if self._gated is not None else Latched()
        return {"rests": self._base.awake is False, "ended": self._head.head.ended, **latched._asdict()}

    def _relay_joint_angles(self) -> None:
        from naoqi_driver.joint_angles import relay_joint_angles  # late, see `OFFER_AFTER`

        relay_joint_angles()

    def _offer_distances(self) -> None:
        # Imported late, see `OFFER_AFTER`: with it come all messages of the package.
        from naoqi_bridge_msgs import srv

        def on_orthogonal(request: srv.OrthogonalSecurityDistanceRequest) -> srv.OrthogonalSecurityDistanceResponse:
            self._set_distance("setOrthogonalSecurityDistance", request.orthogonal_distance.data)
            return srv.OrthogonalSecurityDistanceResponse()

        def on_tangential(request: srv.TangentialSecurityDistanceRequest) -> srv.TangentialSecurityDistanceResponse:
            self._set_distance("setTangentialSecurityDistance", request.tangential_distance.data)
            return srv.TangentialSecurityDistanceResponse()

        rospy.Service("orthogonal_security_distance", srv.OrthogonalSecurityDistance, on_orthogonal)
        rospy.Service("tangential_security_distance", srv.TangentialSecurityDistance, on_tangential)

    def _report(self, now: float) -> None:
        if self._gated is not None and self._gated.decision is not None:
            self._safety.report(now, with_problem(self._gated.decision, self._base.problem))
        self._log.note(now, self._base.state, rospy.loginfo)
        if self._base.state != self._state or now >= self._state_due:
            self._state = self._base.state
            self._state_due = now + STATE_PERIOD
            self._state_publisher.publish(clean(self._state))
        self._diagnostics.report(
            now,
            ERROR if self._base.problem else WARN if self._base.awake is False else OK,
            self._base.state,
            {"refused commands": self._commands.refused, "outages": self._link.outages, "awake": self._base.awake},
        )


def with_problem(decision: Decision, problem: str) -> Decision:
    """The gate's decision when nobody can drive, for the reason `problem`: nothing passes. Only a stop is worse."""
    if not problem or decision.state is State.STOPPED:
        return decision
    nothing = np.zeros(SECTORS)
    return replace(decision, vx=0.0, vy=0.0, wz=0.0, state=State.FAULT, reason=problem, allowed=nothing)


if __name__ == "__main__":
    priority.put_commands_first()
    sys.exit(MoveTo().run())
