"""The driver with the safety gate, the simulated robot, and everything that may go wrong with commands and sensors."""

from __future__ import annotations

import math
import sys
import textwrap
import time
from pathlib import Path

import pytest
from gated_station import STANDING, STOP_WITHIN, GatedStation
from talker import FAULTY_PEPPER, Caller

pytestmark = [pytest.mark.ros]

NODES = Path(__file__).parents[3] / "catkin_ws" / "src" / "naoqi_driver_py" / "nodes"
WAITING_DRIVER = textwrap.dedent("""
    import sys
    import threading
    from importlib.machinery import SourceFileLoader
    from naoqi_driver.base import BaseDriver

    BaseDriver.supervise = lambda *_: threading.Event().wait()  # NAOqi does not answer what is asked beside driving
    node = SourceFileLoader("naoqi_moveto", sys.argv.pop(1)).load_module()
    node.LOOK_PERIOD = node.KEEP_PERIOD = 120.0
    sys.exit(node.MoveTo().run())
""")


class Station(GatedStation):
    def __init__(self, graph, until) -> None:
        self.graph = graph
        self.robot = Caller(graph.environment, FAULTY_PEPPER, f"--port={graph.robot_port}")
        assert self.robot.process.stdout.readline(), "the simulator does not start"
        graph.run_node("naoqi_driver_py", "naoqi_joint_states.py")
        self.driver = graph.run_node("naoqi_driver_py", "naoqi_moveto.py")
        super().__init__(graph.probe(), until, "", "x")

    def start_afresh(self) -> None:
        """All sensors sound, nothing latched, nobody drives, the robot at its start."""
        self.pilot.silence()
        self.robot.fix()
        for part in ("RightBumper", "LeftBumper", "BackBumper"):
            self.robot.press(part, False)
        self.robot.place_person(3.0, -2.0)
        self.robot.restart()
        self.let_go()

    def cruise(self, speed: float = 0.25) -> None:
        """Drive straight on at this speed."""
        self.pilot.drive(speed, 0.0, 0.0)
        self.until(lambda: abs(self.speed() - speed) < 0.1 * abs(speed), f"the robot drives at {speed} m/s")


@pytest.fixture(scope="module")
def whole_station(graph, wait_until):
    made = Station(graph, wait_until)
    yield made
    made.robot.close()


@pytest.fixture
def station(whole_station):
    whole_station.start_afresh()
    return whole_station


def test_free_way_is_driven_as_commanded(station):
    station.cruise(0.3)

    def as_commanded():
        safety = station.safety
        return safety["state"] == "clear" and safety["vx"] == pytest.approx(0.3, abs=1e-3)

    station.until(as_commanded, "the gate changes nothing")
    station.until(lambda: station.drive_state == "driving", "the driver says so")
    assert len(station.safety["allowed"]) == 72


def test_stops_before_a_person_and_leaves_again(station):
    station.robot.place_person(-1.65, 0.75)
    station.pilot.drive(0.3, 0.0, 0.0)
    # The last centimetres may be NAOqi's: its own security distance stops the robot as well.
    held, ahead = ("blocked", "limited"), (*range(0, 7), *range(66, 72))

    def stopped():
        safety = station.safety
        near = safety["sector"] in ahead and 0.0 < safety["gap"] < 0.5
        return near and safety["state"] in held and abs(station.speed()) < STANDING

    station.until(stopped, "gate and robot stop before them")
    station.told("obstacle")
    if station.safety["state"] == "blocked":
        station.until(lambda: "blocked by an obstacle" in station.drive_state, "the driver says so too")
    station.pilot.drive(-0.1, 0.0, 0.0)
    station.until(lambda: station.speed() < -0.05, "away from it is free")


def test_stops_when_commands_cease_and_resumes_with_them(station):
    station.cruise()
    ceased = station.pilot.silence()
    assert station.time_to_stand(ceased) < STOP_WITHIN
    station.told("no command: No command for")
    station.cruise()


def test_stops_when_the_commanding_node_is_killed(station):
    with station.graph.run("rostopic", "pub", "-r", "10", "/cmd_vel", "geometry_msgs/Twist", "{linear: {x: 0.25}}"):
        station.until(lambda: station.speed() > 0.2, "it drives")
    killed = time.time()
    assert station.time_to_stand(killed) < STOP_WITHIN
    station.told("no command: No command for")


@pytest.mark.parametrize("nonsense", [math.nan, math.inf])
def test_stops_on_a_command_that_is_no_number_and_obeys_the_next_one(station, nonsense):
    station.cruise()
    sent = station.pilot.drive(nonsense, 0.0, 0.0)
    assert station.time_to_stand(sent) < STOP_WITHIN
    station.told("fault: The command holds a value that is not a number.")
    assert f"vx is {nonsense}" in station.drive_state
    station.cruise()


@pytest.mark.parametrize(
    ("device", "fault", "complaint"),
    [
        ("Front", "frozen", "The front laser is silent for"),
        ("Front/Horizontal", "minus one", "The front laser has no valid reading."),
        ("Front/Horizontal", "nan", "The front laser sends values that can't be used."),
    ],
)
def test_a_broken_laser_stops_the_robot_until_it_is_mended(station, device, fault, complaint):
    station.cruise()
    assert station.robot.corrupt(f"LaserSensor/{device}", fault) >= 30
    broken = time.time()
    # The gate believes a silent sensor for another half second.
    assert station.time_to_stand(broken) < 0.5 + STOP_WITHIN
    station.told(complaint)
    assert station.drive_state.startswith("stopped: the front laser")
    station.robot.fix()
    station.until(lambda: station.speed() > 0.2, "it drives on by itself")


def test_a_broken_laser_leaves_the_other_ways_open(station):
    station.robot.corrupt("LaserSensor/Front/Horizontal", "missing")
    station.pilot.drive(0.25, 0.0, 0.0)
    station.told("The front laser has no valid reading.")
    station.stays()
    station.pilot.drive(-0.1, 0.0, 0.0)
    station.until(lambda: station.speed() < -0.05, "backing out is possible")


def test_a_dead_sonar_is_named(station):
    station.robot.corrupt("Back/Sonar", "missing")
    station.pilot.drive(-0.1, 0.0, 0.0)
    station.told("The back sonar has no valid reading.")
    station.stays()


def test_a_stop_lasts_until_it_is_reset_and_the_controls_are_released(station):
    station.cruise()
    assert station.trigger("stop_drive")["success"]
    assert station.time_to_stand(time.time()) < STOP_WITHIN
    station.told("stopped: Stopped: stop requested by ")
    assert station.drive_state.startswith("stopped: stop requested")
    station.stays()
    station.trigger("reset_stop")
    station.told("Let go of the controls once")
    station.stays()
    station.pilot.drive(0.0, 0.0, 0.0)
    station.until(lambda: station.safety["state"] == "clear", "the controls were released")
    station.cruise()


def test_a_stop_ends_a_drive_to_a_goal_and_refuses_another(station):
    station.pilot.goal("base_footprint", 1.5, 0.0, 0.0)
    station.until(lambda: station.speed() > 0.1, "under way")
    station.trigger("stop_drive")
    assert station.time_to_stand(time.time()) < STOP_WITHIN
    station.pilot.goal("base_footprint", 0.5, 0.0, 0.0)
    station.driver.wait_for("goal refused: stopped: stop requested")
    station.stays()


def test_a_bump_lets_the_robot_back_out_only_until_it_is_reset(station):
    station.cruise()
    # Far enough from the start that the gate forgets the bump when the next test begins there.
    station.until(lambda: station.place() > 0.3, "under way")
    for part in ("RightBumper", "LeftBumper"):
        station.robot.press(part, True)
    assert station.time_to_stand(time.time()) < STOP_WITHIN
    station.told("bumped: A bumper was hit")
    station.stays()
    assert not station.trigger("reset_bumper")["success"]
    for part in ("RightBumper", "LeftBumper"):
        station.robot.press(part, False)
    station.stays()
    station.pilot.drive(-0.3, 0.0, 0.0)
    station.until(lambda: station.speed() < -0.08, "away from it")
    assert station.speed() > -0.11
    station.until(lambda: station.trigger("reset_bumper")["success"], "the latch is reset")
    station.until(lambda: station.safety["state"] != "bumped", "the gate knows")


@pytest.mark.parametrize("cause", ["stop", "bump"])
def test_what_a_person_has_to_reset_outlives_the_driver(station, cause):
    if cause == "stop":
        assert station.trigger("stop_drive")["success"]
    else:
        station.robot.press("BackBumper", True)
        station.until(lambda: "a bumper was hit" in station.drive_state, "the driver knows")
        station.robot.press("BackBumper", False)
    kept = {"stop": "stopped", "bump": "bumped"}[cause]
    station.until(lambda: station.pilot.parameter("/naoqi_moveto_listener/kept")[kept], "it is kept")
    station.driver.kill()
    station.driver = station.graph.run_node("naoqi_driver_py", "naoqi_moveto.py")
    station.pilot.forget("/drive_state")
    wanted = {"stop": "reset_stop", "bump": "reset_bumper"}[cause]
    station.until(lambda: wanted in station.drive_state, "the next driver says what is to be reset")
    station.pilot.drive(0.25, 0.0, 0.0)
    station.until(lambda: station.safety["state"] in ("stopped", "bumped"), "its gate, too")
    assert station.trigger(wanted)["success"]
    station.pilot.silence()
    station.until(lambda: station.safety["state"] == "no command", "the controls are let go")
    station.cruise()


def test_a_bump_is_kept_at_once_however_slowly_naoqi_answers(station):
    def bump_is_kept() -> bool:
        return (station.pilot.parameter("/naoqi_moveto_listener/kept") or {}).get("bumped", False)

    station.driver.kill()
    node = NODES / "naoqi_moveto.py"
    driver = station.graph.run(sys.executable, "-c", WAITING_DRIVER, str(node), f"--pport={station.graph.robot_port}")
    station.pilot.forget("/drive_state")
    station.until(lambda: station.drive_state.startswith("stopped"), "it runs")
    assert not bump_is_kept()
    station.robot.press("BackBumper", True)
    station.until(bump_is_kept, "it is kept")
    driver.kill()
    station.robot.press("BackBumper", False)
    station.driver = station.graph.run_node("naoqi_driver_py", "naoqi_moveto.py")


def test_markers_show_what_is_decided(station):
    station.pilot.watch(
        "/safety_markers",
        "visualization_msgs/MarkerArray",
        ["len(markers)", "markers.0.header.frame_id", "markers.1.ns", "markers.4.text"],
    )
    station.cruise(0.2)
    assert station.pilot.latest("/safety_markers")[:3] == [5, "base_footprint", "safety"]
    station.until(lambda: station.pilot.latest("/safety_markers")[3] == "clear\nFree.", "the way is free")
