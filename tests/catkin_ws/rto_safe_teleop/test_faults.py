"""safe_omni_drive and the driver with the simulated robot, and everything that may go wrong between them."""

from __future__ import annotations

import json
import math
import signal
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
from corrupting_proxy import CorruptingProxy
from gated_station import STANDING, STOP_WITHIN, GatedStation
from guide_lines import GuideLine, tables, typed
from telepresence_ros.pseudo_terminal import Terminal

from telepresence.station.fault_sentences import UNREACHABLE
from telepresence.teleop.command_timeout import DRIVER_TIMEOUT
from telepresence.teleop.stale_command_filter import SILENCE

pytestmark = [pytest.mark.ros]

SPEED = 0.15
DISTANCES = "/data/distancesensorarray"
NOTHING = 0.41
PATIENT_GATE = """
import sys
from rto_safe_teleop import safe_drive

safe_drive.KEEP_PERIOD = 120.0
sys.exit(safe_drive.main())
"""
PLAYER = """
import rospy
from geometry_msgs.msg import Twist
from std_msgs.msg import String

rospy.init_node("player")
states = rospy.Publisher("safety_state", String, latch=True, queue_size=1)
velocities = rospy.Publisher("cmd_vel", Twist, queue_size=1)
twist = Twist()
twist.linear.y = 0.3
while not rospy.is_shutdown():
    states.publish("clear: Free.")
    velocities.publish(twist)
    rospy.rostime.wallsleep(0.05)
"""
"""Publishes what a recording of a gate holds."""
STALE = 0.002
"""Metres that nobody wants to have driven: odometry's noise. One old command is 2 cm."""
AT_ONCE = 3
"""Command lines that are typed side by side."""


class Station(GatedStation):
    def __init__(self, graph, until) -> None:
        self.graph = graph
        port = graph.free_port()
        robot = graph.run(sys.executable, "-m", "robotino_sim", "--port", str(port), "--scene", "empty")
        robot.wait_for("listening on")
        self.proxy = CorruptingProxy(port)
        self.driver = self.start("rto_node", "rto_node")
        self.start("rto_node", "rto_odometry_node")
        self.gate = self.start("rto_safe_teleop", "safe_omni_drive")
        self.join(until)
        until(lambda: self.careful() == "on by default", "the careful scan is on unless somebody chooses")
        self.switch_careful(False)  # speeds along one axis are measured here

    def join(self, until) -> None:
        """Have a pilot on the graph."""
        super().__init__(self.graph.probe("/cmd_vel:=/rto3/safe_cmd_vel"), until, "/rto3", "y")
        self.pilot.watch("/rto3/careful", "std_msgs/String", ["data"])

    def start(self, package: str, program: str, *parameters: str):
        node = str(self.graph.workspace / "lib" / package / program)
        return self.graph.run(node, *self.address(package), "__ns:=/rto3", *parameters)

    def address(self, package: str) -> list[str]:
        return [f"--hostname=127.0.0.1:{self.proxy.port}"] if package == "rto_node" else []

    def careful(self) -> str:
        return self.pilot.newest("/rto3/careful")[0]

    def switch_careful(self, wanted: bool) -> dict:
        worked, answer = self.pilot.call("/rto3/set_careful", "std_srvs/SetBool", {"data": wanted})
        assert worked, answer
        return answer

    def start_afresh(self) -> None:
        self.pilot.silence()
        self.proxy.spoil.clear()
        self.proxy.missing.clear()
        self.let_go()

    def cruise(self) -> None:
        """Drive where there is more room: the room is 6 m wide, the robot starts 1.5 m from its right wall."""
        self.way = -SPEED if self.place() > 1.0 else SPEED
        self.pilot.drive(0.0, self.way, 0.0)
        self.under_way()

    def under_way(self) -> None:
        self.until(lambda: abs(self.speed() - self.way) < 0.1 * SPEED, f"the robot drives at {self.way} m/s")


@pytest.fixture(scope="module")
def whole_station(graph, wait_until):
    made = Station(graph, wait_until)
    yield made
    made.proxy.close()


@pytest.fixture
def station(whole_station):
    whole_station.start_afresh()
    return whole_station


def test_stops_when_commands_cease_and_resumes_with_them(station):
    station.cruise()
    ceased = station.pilot.silence()
    assert station.time_to_stand(ceased) < STOP_WITHIN
    station.told("no command: No command for")
    station.cruise()


def test_the_body_sways_with_the_careful_scan_and_drives_straight_on(station):
    answer = station.switch_careful(True)
    assert answer["success"] and "sways" in answer["message"]
    station.until(lambda: station.careful() == "on", "the gate reports it")
    station.cruise()
    ways = set()
    station.until(lambda: ways.add(round(station.safety["wz"])) or {-1, 1} <= ways, "the body turns to and fro")
    station.switch_careful(False)
    station.until(lambda: station.careful() == "off", "the gate reports that, too")
    station.under_way()


def test_stops_when_the_commanding_node_is_killed(station):
    twist = "{linear: {y: 0.1}}"
    with station.graph.run("rostopic", "pub", "-r", "10", "/rto3/safe_cmd_vel", "geometry_msgs/Twist", twist):
        station.until(lambda: station.speed() > 0.08, "it drives")
    killed = time.time()
    assert station.time_to_stand(killed) < STOP_WITHIN
    station.told("no command: No command for")


def test_what_holds_the_robot_holds_programs_that_know_no_gate(station):
    """The red stop, and whatever else `drive_lease` says why nobody may drive."""
    way = "0.1" if station.place() < 0.5 else "-0.1"
    twist = ("geometry_msgs/Twist", f"{{linear: {{y: {way}}}}}")
    hold = ("/rto3/drive/hold", "std_msgs/String", "anna has pressed the red stop.")
    with station.graph.run("rostopic", "pub", "-r", "10", "/rto3/cmd_vel", *twist):
        station.until(lambda: abs(station.speed()) > 0.08, "it drives")
        with station.graph.run("rostopic", "pub", "-l", *hold):
            station.until(lambda: abs(station.speed()) < 0.01, "it is held")
            station.stays()
        station.until(lambda: abs(station.speed()) > 0.08, "it drives on")


def test_what_programs_that_know_no_gate_send_goes_through_it(station):
    """Its speed and a latched stop hold on cmd_vel, too; for the bumper see the last test."""
    twist = ("geometry_msgs/Twist", f"{{linear: {{y: {'0.5' if station.place() < 0.5 else '-0.5'}}}}}")
    with station.graph.run("rostopic", "pub", "-r", "10", "/rto3/cmd_vel", *twist):
        station.until(lambda: abs(station.speed()) > 0.15, "it drives")
        assert abs(station.safety["vy"]) <= 0.201, "the gate's speed"
        assert station.trigger("stop_drive")["success"]
        assert station.time_to_stand(time.time()) < STOP_WITHIN
        station.told("stopped: Stopped: stop requested by ")
        station.stays(2.0 * DRIVER_TIMEOUT)


def test_without_its_gate_the_robot_rests_whoever_sends_velocities(station):
    twist = ("geometry_msgs/Twist", f"{{linear: {{y: {'0.1' if station.place() < 0.5 else '-0.1'}}}}}")
    with station.graph.run("rostopic", "pub", "-r", "10", "/rto3/cmd_vel", *twist):
        station.until(lambda: abs(station.speed()) > 0.08, "it drives")
        station.gate.signal(signal.SIGKILL)
        station.until(lambda: abs(station.speed()) < STANDING, "the gate has gone")
        station.stays(2.0 * DRIVER_TIMEOUT)
        station.driver.wait_for("cmd_vel is not obeyed while the safety gate of this robot does not run")
        station.gate = station.start("rto_safe_teleop", "safe_omni_drive", "_careful:=false")
        station.until(lambda: abs(station.speed()) > 0.08, "the next gate drives on")


def test_a_driver_that_is_started_with_a_gate_obeys_nobody_before_it_hears_one(station):
    driver = str(station.graph.workspace / "lib/rto_node/rto_node")
    address = f"--hostname=127.0.0.1:{station.graph.free_port()}"
    twist = ("geometry_msgs/Twist", "{linear: {x: 0.1}}")
    with (
        station.graph.run(driver, address, "__ns:=/gated", "_gated:=true") as gated,
        station.graph.run("rostopic", "pub", "-r", "10", "/gated/cmd_vel", *twist),
    ):
        gated.wait_for("cmd_vel is not obeyed while the safety gate of this robot does not run")


def test_a_recording_that_is_played_back_is_no_gate(station):
    """Nor does it keep the robot from what drives it."""
    station.gate.signal(signal.SIGSTOP)
    try:
        with station.graph.run(sys.executable, "-c", PLAYER, "__ns:=/rto3"):
            station.pilot.watch("/rto3/cmd_vel", "geometry_msgs/Twist", ["linear.y"])
            station.pilot.forget("/rto3/cmd_vel")
            station.until(lambda: len(station.pilot.seen("/rto3/cmd_vel")) > 40, "it is played")
            station.stays(2.0 * DRIVER_TIMEOUT)
    finally:
        station.gate.signal(signal.SIGCONT)
    station.cruise()


def test_two_gates_do_not_keep_each_other_going(station):
    with station.start("rto_safe_teleop", "safe_omni_drive", "__name:=another_gate", "_careful:=false") as another:
        station.until(lambda: "/rto3/another_gate" in station.pilot.nodes(), "it runs")
        station.cruise()
        ceased = station.pilot.silence()
        assert station.time_to_stand(ceased) < 2.0 * STOP_WITHIN
        station.stays()
        station.gate.wait_for("another safety gate drives this robot, too")
        another.signal(signal.SIGINT)
        station.until(lambda: "/rto3/another_gate" not in station.pilot.nodes(), "it has left")
    station.gate.kill()  # the other one has taken its services
    station.gate = station.start("rto_safe_teleop", "safe_omni_drive", "_careful:=false")


def test_a_keyboard_on_cmd_vel_does_not_take_the_gates_echo_for_another_input(station):
    keyboard = station.graph.workspace / "lib/teleop_twist_keyboard/teleop_twist_keyboard.py"
    station.pilot.watch("/rto3/cmd_vel", "geometry_msgs/Twist", ["linear.x"])
    terminal = Terminal(str(keyboard), "cmd_vel:=/rto3/cmd_vel", "_speed:=0.1", env=station.graph.environment)
    try:
        station.until(lambda: "Moving around" in terminal.seen, "it says what the keys do")
        station.until(lambda: terminal.type("i") or station.safety["vx"] > 0.09, "the key is latched")
        station.pilot.forget("/rto3/cmd_vel")
        station.until(lambda: len(station.pilot.seen("/rto3/cmd_vel")) > 40, "keyboard and gate send on one topic")
        assert "Another input" not in terminal.seen and station.safety["vx"] > 0.09
        station.pilot.drive(0.0, 0.05, 0.0)
        station.until(lambda: "Another input" in terminal.seen, "a pilot on safe_cmd_vel is one")
    finally:
        terminal.close()


@pytest.mark.parametrize("nonsense", [math.nan, math.inf])
def test_stops_on_a_command_that_is_no_number_and_obeys_the_next_one(station, nonsense):
    station.cruise()
    sent = station.pilot.drive(0.0, nonsense, 0.0)
    assert station.time_to_stand(sent) < STOP_WITHIN
    station.told("fault: The command holds a value that is not a number.")
    station.cruise()


@pytest.mark.parametrize(
    ("answer", "complaint"),
    [
        ([], "sensor stale: The infrared is silent for"),
        ([-1] * 9, "sensor stale: The infrared has no valid reading."),
        ([math.nan] * 9, "sensor stale: The infrared "),
        ([*[NOTHING] * 6, 0.25, *[NOTHING] * 2], "sensor stale: The infrared repeats itself although the robot moves."),
    ],
    ids=["missing", "minus one", "nan", "frozen"],
)
def test_broken_distance_sensors_stop_the_robot_until_they_are_mended(station, answer, complaint):
    station.cruise()
    station.proxy.spoil[DISTANCES] = lambda _: json.dumps(answer).encode()
    broken = time.time()
    # A silent sensor is believed for half a second, one that repeats itself for another 5 cm and a second.
    assert station.time_to_stand(broken) < STOP_WITHIN + (1.5 if "repeats" in complaint else 0.5)
    station.told(complaint)
    station.proxy.spoil.clear()
    station.under_way()


def test_a_silent_bumper_stops_the_robot_until_it_is_back(station):
    station.cruise()
    station.proxy.missing.add("/data/bumper")
    silent = time.time()
    assert station.time_to_stand(silent) < STOP_WITHIN + 0.5
    station.told("sensor stale: The bumper is silent for")
    station.proxy.missing.clear()
    station.proxy.spoil["/data/bumper"] = lambda _: b'{"value": 0}'
    station.under_way()


def test_a_robot_that_lacks_something_answers_all_else_and_counts_as_there(station):
    station.pilot.watch("/rto3/battery", "sensor_msgs/BatteryState", ["voltage"])
    station.pilot.watch("/rto3/digital_readings", "rto_msgs/DigitalReadings", ["values"])
    station.proxy.missing.update({"/data/digitaloutputstatus", "/data/analoginputarray"})
    station.pilot.forget("/rto3/drive_state")
    for topic in ("/rto3/battery", "/rto3/battery", "/rto3/digital_readings"):
        station.pilot.latest(topic)
    station.cruise()
    states = {state for _, (state,) in station.pilot.seen("/rto3/drive_state")}
    assert "driving" in states
    assert not any(state.startswith(UNREACHABLE) for state in states), states


def test_a_robot_that_refuses_velocities_is_not_called_unreachable(station):
    station.proxy.missing.add("/data/omnidrive")
    station.pilot.drive(0.0, 0.1, 0.0)
    station.until(lambda: "refused omnidrive: 404" in station.drive_state, "the driver says what is wrong")
    assert station.drive_state.startswith("stopped")


def test_a_robot_that_hangs_stands_and_goes_on(station):
    station.cruise()
    going_on = threading.Event()

    def hang(body: bytes) -> bytes:
        going_on.wait(10.0)
        return body

    station.proxy.spoil[DISTANCES] = hang
    hung = time.time()
    assert station.time_to_stand(hung) < STOP_WITHIN + 0.5
    station.told("sensor stale: The infrared is silent for")
    station.proxy.spoil.clear()
    going_on.set()
    station.under_way()


def test_missing_odometry_stops_the_robot_until_it_is_back(station):
    station.cruise()
    station.proxy.spoil["/data/odometry"] = lambda _: b""
    station.told("fault: Odometry is")
    station.until(lambda: station.safety["vy"] == 0.0, "zero goes out")
    station.proxy.spoil.clear()
    station.under_way()


def test_odometry_that_a_web_server_repeats_stops_the_robot_until_it_counts_on(station):
    station.cruise()
    old = json.dumps([0, 0, 0, 0, 0, 0, 7]).encode()
    station.proxy.spoil["/data/odometry"] = lambda _: old
    station.told("fault: Odometry is")
    station.until(lambda: station.safety["vy"] == 0.0, "zero goes out")
    station.proxy.spoil.clear()
    station.under_way()


def test_a_reset_of_odometry_has_the_gate_look_anew(station):
    """One too small to be noticed as a jump."""
    station.cruise()
    x, y, phi = 0.02, station.place(), 0.1
    worked, answer = station.pilot.call("/rto3/reset_odometry", "rto_msgs/ResetOdometry", {"x": x, "y": y, "phi": phi})
    assert worked, answer
    again = "fault: Odometry started again"
    states = "/rto3/safety_state"
    station.until(lambda: any(again in state for _, (state,) in station.pilot.seen(states)), "it says so for a moment")
    station.under_way()


def test_a_killed_driver_is_a_standing_robot_and_its_successor_drives_on(station):
    station.cruise()
    station.driver.signal(signal.SIGKILL)
    stopped_within = station.time_to_stand(time.time())
    station.told("sensor stale: The infrared is silent for")
    station.driver = station.start("rto_node", "rto_node")
    station.under_way()
    assert stopped_within < STOP_WITHIN  # last, so that the tests after this one have a driver


def test_a_stop_outlives_the_gate_until_it_is_reset(station):
    assert station.trigger("stop_drive")["success"]
    station.gate.kill()
    station.gate = station.start("rto_safe_teleop", "safe_omni_drive", "_careful:=false")
    station.pilot.forget("/rto3/safety_state")
    station.told("stopped: Stopped: stop requested by")
    station.trigger("reset_stop")
    station.cruise()


def test_a_killed_gate_is_a_standing_robot_and_its_successor_drives_on(station):
    station.cruise()
    station.gate.signal(signal.SIGKILL)
    stopped_within = station.time_to_stand(time.time())
    station.gate = station.start("rto_safe_teleop", "safe_omni_drive", "_careful:=false")
    station.under_way()
    assert station.careful() == "off"
    assert stopped_within < STOP_WITHIN  # last, so that the tests after this one have a gate


def test_what_was_sent_to_a_frozen_gate_never_moves_the_robot(station):
    station.cruise()
    station.gate.signal(signal.SIGSTOP)
    frozen = time.time()
    try:
        assert station.time_to_stand(frozen) < STOP_WITHIN
        station.until(lambda: time.time() > frozen + 2.0 * SILENCE, "commands lie in the frozen gate's socket")
    finally:
        station.pilot.silence()
        stood = station.place()
        station.gate.signal(signal.SIGCONT)
    station.pilot.forget("/rto3/safety")
    station.until(lambda: len(station.pilot.seen("/rto3/safety")) >= 20, "the gate has looked at all of them")
    assert abs(station.place() - stood) < STALE


def test_the_guides_lines_print_what_the_page_of_the_guides_says(station):
    """Not about a fault, but a driver and a gate are here."""

    def type_it(line: GuideLine) -> None:
        with typed(line, station.graph.environment):
            pass

    with ThreadPoolExecutor(AT_ONCE) as hands:
        list(hands.map(type_it, tables()["The Robotino guide: beside the robot"]))


def test_a_stop_lasts_until_it_is_reset_and_the_controls_are_released(station):
    station.cruise()
    assert station.trigger("stop_drive")["success"]
    assert station.time_to_stand(time.time()) < STOP_WITHIN
    station.told("stopped: Stopped: stop requested by ")
    station.stays()
    station.trigger("reset_stop")
    station.told("Let go of the controls once")
    station.stays()
    station.pilot.drive(0.0, 0.0, 0.0)
    station.until(lambda: station.safety["state"] == "clear", "the controls were released")
    station.cruise()


def test_a_master_that_dies_is_a_standing_robot_and_its_successor_knows_everybody(station, wait_until):
    station.cruise()
    station.graph.master.kill()
    stopped_within = station.time_to_stand(time.time())
    station.driver.wait_for("stopped: the ROS master does not answer")
    station.pilot.silence()
    station.graph.start_master()
    station.join(wait_until)
    station.until(lambda: station.drive_state.startswith("stopped"), "the driver is registered again")
    station.cruise()
    assert stopped_within < STOP_WITHIN  # last, so that the tests after this one have a master


def test_a_bump_lets_the_robot_back_out_only_until_it_is_reset(station):
    station.cruise()
    station.proxy.spoil["/data/bumper"] = lambda _: b'{"value": true}'
    assert station.time_to_stand(time.time()) < STOP_WITHIN
    station.told("bumped: A bumper was hit")
    station.stays()
    assert not station.trigger("reset_bumper")["success"]
    station.proxy.spoil.clear()
    station.stays()
    station.pilot.drive(0.0, -station.way, 0.0)
    station.until(lambda: station.speed() / -station.way > 0.5, "away from it")
    assert abs(station.speed()) < 0.11
    assert station.trigger("reset_bumper")["success"]
    station.until(lambda: station.speed() / -station.way > 0.9, "let go")


def test_a_bump_is_kept_at_once(station):
    def bump_is_kept() -> bool:
        return (station.pilot.parameter("/rto3/safe_omni_drive/kept") or {}).get("bumped", False)

    station.gate.kill()
    gate = station.graph.run(sys.executable, "-c", PATIENT_GATE, "__ns:=/rto3")
    station.pilot.forget("/rto3/safety")
    station.until(lambda: station.safety["state"] == "no command", "it runs")
    assert not bump_is_kept()
    station.proxy.spoil["/data/bumper"] = lambda _: b'{"value": true}'
    station.until(bump_is_kept, "it is kept")
    gate.kill()
    station.proxy.spoil.clear()
    station.gate = station.start("rto_safe_teleop", "safe_omni_drive")


def test_a_bump_holds_programs_that_know_no_gate(station):
    """Last, so that no other test has to get away from what was hit."""
    twist = ("geometry_msgs/Twist", f"{{linear: {{y: {'0.2' if station.place() < 0.5 else '-0.2'}}}}}")
    with station.graph.run("rostopic", "pub", "-r", "10", "/rto3/cmd_vel", *twist):
        station.until(lambda: abs(station.speed()) > 0.15, "it drives")
        station.proxy.spoil["/data/bumper"] = lambda _: b'{"value": true}'
        station.told("bumped: A bumper was hit")
        station.stays(2.0 * DRIVER_TIMEOUT)
