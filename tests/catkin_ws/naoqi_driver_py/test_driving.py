"""The driver with the simulated robot and its drive server: it drives as commanded, and stops whatever dies.

Without the safety gate, which would slow down motion where no sensor points; see test_gated_driving.py.
"""

from __future__ import annotations

import math
import re
import signal
import time
from pathlib import Path

import pytest
import qi

from telepresence.station import processes
from telepresence.teleop.stale_command_filter import SILENCE

pytestmark = pytest.mark.ros

STOP_WITHIN = 1.0 + 0.1
"""Seconds to a stand after a fault; the tenth is for odometry that comes every 0.04 s and a machine that is shared."""
TRIES = 4
"""The best of so many counts, as other programs hold up those of a busy machine."""
STANDING = 0.005
STALE = 0.002
"""Metres that nobody wants to have driven: odometry's noise. One old command is 2 cm."""


class Station:
    """Robot, drive server, driver and odometry on one graph, and somebody who drives."""

    def __init__(self, graph) -> None:
        self.graph = graph
        self.robot = graph.start_robot()
        self.odometry = graph.run_node("naoqi_driver_py", "naoqi_joint_states.py")
        self.server = graph.start_drive_server()
        self.start_driver()
        self.new_pilot()

    def start_driver(self) -> None:
        self.driver = self.graph.run_node(
            "naoqi_driver_py", "naoqi_moveto.py", "_safety:=false", self.graph.drive_server
        )

    def new_pilot(self) -> None:
        self.pilot = self.graph.probe()
        self.pilot.watch(
            "/odom",
            "nav_msgs/Odometry",
            [
                "pose.pose.position.x",
                "pose.pose.position.y",
                "twist.twist.linear.x",
                "twist.twist.angular.z",
                "header.stamp.secs",
                "header.stamp.nsecs",
            ],
        )
        self.pilot.watch("/drive_state", "std_msgs/String", ["data"])

    @property
    def state(self) -> str:
        seen = self.pilot.seen("/drive_state")
        return seen[-1][1][0] if seen else ""

    def speed(self) -> float:
        return self.pilot.latest("/odom")[2]

    def stand(self, until) -> None:
        """Nobody drives, nothing moves."""
        self.pilot.silence()
        until(lambda: abs(self.speed()) < STANDING, "the robot stands")
        until(lambda: self.state.startswith("stopped"), "the driver says so")

    def cruise(self, until, speed: float = 0.2) -> None:
        """Drive straight on at about this speed: a busy machine makes it rise and fall, and there are walls."""
        until(lambda: self.pilot.subscribers() == 1, "the driver listens")
        self.pilot.drive(speed, 0.0, 0.0)
        until(lambda: abs(self.speed() - speed) < 0.2 * abs(speed), f"the robot drives at {speed} m/s")

    def covered_since(self, since: float) -> float:
        """Return the greatest distance from where the robot was then [m]."""
        places = [value[:2] for at, value in self.pilot.seen("/odom") if at > since]
        return max(math.dist(place, places[0]) for place in places)

    def time_to_stand(self, since: float, until) -> float:
        """Return the seconds from `since` until the odometry shows no more speed."""

        def stood() -> float | None:
            return next((at for at, value in self.pilot.seen("/odom") if at > since and abs(value[2]) < STANDING), None)

        return until(stood, "the robot stands") - since


def command_line(pid: int) -> bytes:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return b""  # it has ended


def assert_stops(station, wait_until, fault, repair=lambda: None, speed=0.2):
    """`fault` spoils something and returns when; `repair` brings the station back, whatever has come of it."""
    tries = []
    while not any(seconds < STOP_WITHIN for seconds in tries):
        assert len(tries) < TRIES, f"it stands {tries} s after the fault"
        station.cruise(wait_until, speed)
        tries.append(station.time_to_stand(fault(), wait_until))
        repair()


@pytest.fixture(scope="module")
def station(graph):
    return Station(graph)


@pytest.fixture(autouse=True)
def standing(station, wait_until):
    station.stand(wait_until)


def test_drives_at_the_commanded_speed(station, wait_until):
    station.cruise(wait_until, 0.2)

    def speed() -> float:
        """Over the newest 1.6 s of odometry."""
        start, *_, end = (value for _, value in station.pilot.seen("/odom")[-40:])
        return math.dist(start[:2], end[:2]) / (end[4] - start[4] + 1e-9 * (end[5] - start[5]))

    station.pilot.forget("/odom")
    wait_until(lambda: len(station.pilot.seen("/odom")) >= 40, "1.6 s of odometry")
    wait_until(lambda: speed() == pytest.approx(0.2, rel=0.05), "it drives at 0.2 m/s")
    wait_until(lambda: station.state == "driving", "it says so")


def test_the_pilot_looks_ahead_and_not_at_the_ceiling(station, wait_until):
    session = qi.Session()
    session.connect(f"tcp://127.0.0.1:{station.graph.robot_port}")
    motion = session.service("ALMotion")
    wait_until(lambda: motion.getAngles("HeadPitch", True)[0] == pytest.approx(0.15, abs=0.02), "the head is level")
    session.close()


def test_turns_the_way_it_is_told(station, wait_until):
    station.pilot.drive(0.0, 0.0, 0.5)
    wait_until(lambda: station.pilot.latest("/odom")[3] == pytest.approx(0.5, rel=0.05), "turning left at 0.5 rad/s")


def test_stops_when_commands_cease(station, wait_until):
    assert_stops(station, wait_until, station.pilot.silence)
    wait_until(lambda: station.state == "stopped: no command for 0.5 s", "the reason is told")


def test_stops_from_full_speed_when_commands_cease(station, wait_until):
    assert_stops(station, wait_until, station.pilot.silence, speed=-0.35)


def test_a_command_that_is_no_number_stops_and_is_counted(station, wait_until):
    station.pilot.watch("/diagnostics", "diagnostic_msgs/DiagnosticArray", ["status.0.name", "status.0.values"])
    assert_stops(station, wait_until, lambda: station.pilot.drive(None, 0.0, 0.0))
    wait_until(lambda: "vx is nan" in station.state, "the reason is told")

    def counted() -> bool:
        seen = [fields for _, fields in station.pilot.seen("/diagnostics") if fields[0].endswith(": base")]
        return bool(seen) and int(dict(seen[-1][1])["refused commands"]) > 0

    wait_until(counted, "the diagnostics count it")


def test_goal_is_reached(station, wait_until):
    x, y = station.pilot.latest("/odom")[:2]
    station.pilot.goal("base_footprint", 0.3, 0.0, 0.0)
    wait_until(lambda: station.state == "driving to the goal", "the goal is taken")
    wait_until(lambda: station.state.startswith("stopped"), "the goal is reached")
    there = station.pilot.latest("/odom")
    assert math.hypot(there[0] - x, there[1] - y) == pytest.approx(0.3, abs=0.03)


def test_a_goal_that_was_given_long_ago_is_not_driven_to(station, wait_until):
    refused = time.time()
    station.pilot.goal("base_footprint", 0.5, 0.0, 0.0, refused - 5.0)
    station.driver.wait_for(r"goal refused: it was given \d+\.\d s ago")
    station.pilot.forget("/drive_state")
    wait_until(lambda: len(station.pilot.seen("/drive_state")) >= 2, "the driver has gone on")
    assert station.covered_since(refused) < STALE
    station.pilot.goal("base_footprint", 0.5, 0.0, 0.0, time.time())
    wait_until(lambda: station.state == "driving to the goal", "one of now is taken")
    assert station.pilot.call("/stop_walk_srv", "std_srvs/Empty", {})[0]
    wait_until(lambda: station.state == "stopped", "that stop is over: it refuses goals")


def test_a_goal_of_another_frame_is_found_by_tf(station, wait_until):
    """The map is turned by 90 degrees: one metre ahead in it is one to the left in odom."""
    x, y = station.pilot.latest("/odom")[:2]
    turned = f"{{rotation: {{z: {math.sqrt(0.5)}, w: {math.sqrt(0.5)}}}, translation: {{x: {x}, y: {y}}}}}"
    link = f"{{header: {{frame_id: odom}}, child_frame_id: map, transform: {turned}}}"
    with station.graph.run("rostopic", "pub", "-l", "/tf_static", "tf2_msgs/TFMessage", f"transforms: [{link}]"):
        wait_until(lambda: "/tf_static" in station.pilot.topics(), "the map is placed")
        station.pilot.goal("map", 0.3, 0.0, 0.0)
        wait_until(lambda: station.state == "driving to the goal", "the goal is taken")
        wait_until(lambda: station.state.startswith("stopped"), "the goal is reached")
    there = station.pilot.latest("/odom")
    assert (there[0] - x, there[1] - y) == (pytest.approx(0.0, abs=0.04), pytest.approx(0.3, abs=0.04))


def test_a_goal_that_tf_does_not_reach_is_refused_and_says_why(station):
    station.pilot.goal("nowhere", 0.3, 0.0, 0.0)
    station.driver.wait_for(r"goal refused: .*nowhere.* passed to lookupTransform")


def test_a_stop_ends_a_goal_that_came_while_tf_was_asked_about_the_one_before(station, wait_until):
    begun = time.time()
    station.pilot.goal("elsewhere", 0.3, 0.0, 0.0)
    station.pilot.goal("base_footprint", 0.5, 0.0, 0.0)
    assert station.pilot.call("/stop_walk_srv", "std_srvs/Empty", {})[0]
    stopped = time.time()
    station.driver.wait_for(r"goal refused: (another one has come|.*elsewhere)")

    def states_since(since: float) -> list[str]:
        return [state for at, (state,) in station.pilot.seen("/drive_state") if at > since]

    wait_until(lambda: len(states_since(stopped)) >= 5, "what came of it is told")
    assert not any("goal" in state for state in states_since(stopped)[2:])
    station.pilot.goal("base_footprint", 0.3, 0.0, 0.0)
    wait_until(lambda: station.state == "driving to the goal", "the next one is driven to")
    assert station.covered_since(begun) < 0.3


def test_stop_service_ends_a_goal(station, wait_until):
    station.pilot.goal("base_footprint", 2.0, 0.0, 0.0)
    wait_until(lambda: station.speed() > 0.1, "under way")
    assert station.pilot.call("/stop_walk_srv", "std_srvs/Empty", {})[0]
    assert station.time_to_stand(time.time(), wait_until) < 3.0


def test_security_distances_can_be_set_and_nonsense_is_refused(station):
    service, kind = "/orthogonal_security_distance", "naoqi_bridge_msgs/OrthogonalSecurityDistance"
    assert station.pilot.call(service, kind, {"orthogonal_distance": 0.5}) == [True, {}]
    ok, error = station.pilot.call(service, kind, {"orthogonal_distance": None})
    assert not ok
    assert "nan is not a distance" in error


def test_joint_angles_that_nobody_takes_are_told_by_the_topic_that_is_missing(station):
    angles = "{joint_names: [HeadYaw], joint_angles: [0.1], speed: 0.1}"
    with station.graph.run(
        "rostopic", "pub", "-r", "5", "/joint_angles", "naoqi_bridge_msgs/JointAnglesWithSpeed", angles
    ):
        station.driver.wait_for("joint_angles goes no farther: nobody takes /pose/joint_angles")


def test_robot_of_a_killed_driver_stands_and_its_successor_drives(station, wait_until):
    def kill():
        station.driver.kill()
        return time.time()

    def bring_back():
        station.pilot.silence()
        station.start_driver()

    assert_stops(station, wait_until, kill, bring_back)
    station.cruise(wait_until)


def test_robot_that_was_put_to_rest_sleeps_on_when_its_driver_dies(station, wait_until):
    """It must not stand up because a program has died."""
    session = qi.Session()
    session.connect(f"tcp://127.0.0.1:{station.graph.robot_port}")
    motion = session.service("ALMotion")
    motion.rest()
    wait_until(lambda: station.pilot.parameter("/naoqi_moveto_listener/kept")["rests"], "the driver knows")
    station.driver.kill()
    station.start_driver()
    wait_until(lambda: station.pilot.subscribers() == 1, "the next driver listens")
    station.pilot.drive(0.2, 0.0, 0.0)
    wait_until(lambda: "sleeps" in station.state, "the pilot is told")
    assert not motion.robotIsWakeUp()
    station.pilot.silence()
    motion.wakeUp()
    station.cruise(wait_until)
    session.close()


def test_robot_moves_by_itself_again_when_its_driver_has_died(station, wait_until):
    session = qi.Session()
    session.connect(f"tcp://127.0.0.1:{station.graph.robot_port}")
    awareness = session.service("ALBasicAwareness")
    before = awareness.isEnabled(), awareness.getTrackingMode()
    awareness.setTrackingMode("MoveContextually")
    awareness.setEnabled(True)
    station.cruise(wait_until)
    wait_until(lambda: awareness.getTrackingMode() == "Head", "the base does not turn beside who drives")
    wait_until(lambda: station.pilot.parameter("/naoqi_moveto_listener/kept")["ended"], "it is kept")
    station.driver.kill()
    station.pilot.silence()
    station.start_driver()
    wait_until(lambda: awareness.getTrackingMode() == "MoveContextually", "nobody drives any more")
    awareness.setEnabled(before[0])
    awareness.setTrackingMode(before[1])
    session.close()


def test_robot_of_a_frozen_driver_stands_and_what_was_sent_meanwhile_never_moves_it(station, wait_until):
    def freeze():
        station.driver.signal(signal.SIGSTOP)
        return time.time()

    def wake():
        frozen = time.time()
        wait_until(lambda: time.time() > frozen + SILENCE, "commands lie in the frozen driver's socket")
        station.pilot.silence()
        woken = time.time()
        station.driver.signal(signal.SIGCONT)
        station.pilot.forget("/drive_state")
        wait_until(lambda: len(station.pilot.seen("/drive_state")) >= 3, "the driver has looked at all of them")
        assert station.covered_since(woken) < STALE

    try:
        assert_stops(station, wait_until, freeze, wake)
    finally:
        station.driver.signal(signal.SIGCONT)


def test_interrupted_driver_stops_the_robot_and_ends_in_time(station, wait_until):
    station.cruise(wait_until)
    interrupted = time.time()
    code, ended = station.driver.end(), time.time()
    stood, output = station.time_to_stand(interrupted, wait_until), station.driver.output
    station.pilot.silence()
    station.start_driver()
    assert code == 0 and "Traceback" not in output
    assert ended - interrupted < 5.0
    assert stood < 1.5


def test_killed_drive_server_is_named_and_its_successor_drives(station, wait_until):
    station.cruise(wait_until)
    station.server.kill()
    wait_until(lambda: station.state.startswith("robot unreachable: The drive server at 127.0.0.1:"), "it is named")
    station.pilot.silence()
    station.server = station.graph.start_drive_server()
    wait_until(lambda: station.state.startswith("stopped"), "the driver is back")
    station.cruise(wait_until)


def test_restarted_robot_is_driven_again(station, wait_until):
    station.cruise(wait_until)
    station.robot.kill()
    wait_until(lambda: station.state.startswith("robot unreachable"), "the driver notices")
    station.pilot.silence()
    station.robot = station.graph.start_robot()
    wait_until(lambda: station.state.startswith("stopped"), "the driver is back")
    station.cruise(wait_until)
    assert "Traceback" not in station.driver.output


def test_lost_master_stops_the_robot_and_its_successor_knows_the_driver(station, wait_until):
    def kill():
        station.graph.master.kill()
        return time.time()

    def bring_back():
        states.append(station.state)
        station.pilot.silence()
        station.graph.start_master()
        station.new_pilot()

    states = []
    assert_stops(station, wait_until, kill, bring_back)
    assert "master" in states[-1]
    station.cruise(wait_until)


def test_a_driver_that_was_started_alone_ends_when_its_own_drive_server_dies(station, graph, wait_until):
    node = graph.run_node("naoqi_driver_py", "naoqi_moveto.py", "_safety:=false", "__name:=alone")
    wait_until(lambda: station.pilot.subscribers() == 2, "it listens to the pilot, too")

    def servers() -> list[int]:
        """The server, before the process that it forks to stop the robot in its place; neither is the shell."""
        below = processes.descendants(node.process.pid)
        return sorted(
            pid for pid in below if re.match(rb"[^\0]*python[^\0]*\0[^\0]*drive_server.py", command_line(pid))
        )

    processes.send(wait_until(servers, "it starts one")[0], signal.SIGKILL)
    assert node.process.wait(20) == 1, "so that roslaunch starts both again"
    assert "the drive server that this driver had started has ended" in node.output


def test_unreachable_robot_is_reported_once_without_a_traceback(graph):
    node = graph.run(str(graph.workspace / "lib/naoqi_driver_py/naoqi_joint_states.py"), "--pport=1", "__name:=lonely")
    node.wait_for(r"cannot reach the robot at tcp://127\.0\.0\.1:1: .*Connection refused")
    assert node.end() == 0
    assert node.output.count("cannot reach") == 1
    assert "Traceback" not in node.output


def test_wrong_address_ends_the_node_with_an_error(graph):
    node = graph.run(
        str(graph.workspace / "lib/naoqi_driver_py/naoqi_joint_states.py"), "--pip=http://x", "__name:=odd"
    )
    assert node.process.wait(30) == 1
    assert "scheme must be tcp or tcps" in node.output
