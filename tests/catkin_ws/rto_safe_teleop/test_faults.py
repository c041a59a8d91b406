"""safe_omni_drive and the driver with the simulated robot, and everything that may go wrong between them."""

from __future__ import annotations

import json
import math
import signal
import sys
import threading
import time
from importlib import util
from pathlib import Path

import pytest

pytestmark = [pytest.mark.ros, pytest.mark.alone]

_spec = util.spec_from_file_location("corrupting_proxy", Path(__file__).with_name("corrupting_proxy.py"))
corrupting_proxy = util.module_from_spec(_spec)
_spec.loader.exec_module(corrupting_proxy)

STOP_WITHIN = 1.0 + 0.5
"""Seconds to a stand after a fault; the half is for a machine that is shared."""
STANDING = 0.005
SPEED = 0.15
SAFETY = ["state", "reason", "vx", "vy", "wz", "command_age"]
DISTANCES = "/data/distancesensorarray"
NOTHING = 0.41


class Station:
    def __init__(self, graph, until) -> None:
        self.graph, self._until = graph, until
        port = graph.free_port()
        robot = graph.run(sys.executable, "-m", "robotino_sim", "--port", str(port), "--scene", "empty")
        robot.wait_for("listening on")
        self.proxy = corrupting_proxy.CorruptingProxy(port)
        self.driver = self.start("rto_node", "rto_node")
        self.start("rto_node", "rto_odometry_node")
        self.gate = self.start("rto_safe_teleop", "safe_omni_drive")
        self.probe = graph.probe("/cmd_vel:=/rto3/safe_cmd_vel")
        self.probe.watch("/rto3/odom", "nav_msgs/Odometry", ["pose.pose.position.y", "twist.twist.linear.y"])
        self.probe.watch("/rto3/safety", "telepresence_1/SafetyState", SAFETY)
        self.probe.watch("/rto3/safety_state", "std_msgs/String", ["data"])
        self.probe.watch("/rto3/drive_state", "std_msgs/String", ["data"])
        self.until(lambda: self.probe.subscribers() == 1, "the gate listens")

    def start(self, package: str, program: str):
        return self.graph.run(
            str(self.graph.workspace / "lib" / package / program), *self.address(package), "__ns:=/rto3"
        )

    def address(self, package: str) -> list[str]:
        return [f"--hostname=127.0.0.1:{self.proxy.port}"] if package == "rto_node" else []

    def until(self, condition, what: str):
        """As `until_true`, and what the gate said when it fails."""
        try:
            return self._until(condition, what)
        except pytest.fail.Exception as failure:
            pytest.fail(f"{failure}; the gate: {self.safety}; the driver: {self.probe.newest('/rto3/drive_state')}")

    @property
    def safety(self) -> dict:
        """The newest decision."""
        return dict(zip(SAFETY, self.probe.newest("/rto3/safety"), strict=True))

    def speed(self) -> float:
        return self.probe.latest("/rto3/odom")[1]

    def trigger(self, service: str) -> dict:
        worked, answer = self.probe.call(f"/rto3/{service}", "std_srvs/Trigger", {})
        assert worked, answer
        return answer

    def start_afresh(self) -> None:
        self.probe.silence()
        self.proxy.spoil.clear()
        self.trigger("reset_stop")
        self.until(lambda: abs(self.speed()) < STANDING, "the robot stands")
        self.until(lambda: self.trigger("reset_bumper")["success"], "the bumper can be reset")
        self.until(lambda: self.safety["state"] == "no command", "nothing else is wrong")

    def cruise(self) -> None:
        """Drive where there is more room: the room is 6 m wide, the robot starts 1.5 m from its right wall."""
        self.way = -SPEED if self.probe.latest("/rto3/odom")[0] > 1.0 else SPEED
        self.probe.drive(0.0, self.way, 0.0)
        self.under_way()

    def under_way(self) -> None:
        self.until(lambda: abs(self.speed() - self.way) < 0.1 * SPEED, f"the robot drives at {self.way} m/s")

    def time_to_stand(self, since: float) -> float:
        """Seconds from `since` until the odometry tells no more speed."""

        def stood():
            seen = self.probe.seen("/rto3/odom")
            return next((at for at, value in seen if at > since and abs(value[1]) < STANDING), None)

        return self.until(stood, "the robot stands") - since

    def told(self, text: str) -> None:
        self.until(lambda: text in self.probe.newest("/rto3/safety_state")[0], f"the gate says {text!r}")

    def stays(self, seconds: float = 0.4) -> None:
        """The robot comes to stand, and does so although somebody drives."""
        self.until(lambda: abs(self.speed()) < STANDING, "the robot stands")
        ends = time.monotonic() + seconds
        while time.monotonic() < ends:
            assert abs(self.speed()) < STANDING


@pytest.fixture(scope="module")
def whole_station(graph, until_true):
    made = Station(graph, until_true)
    yield made
    made.proxy.close()


@pytest.fixture
def station(whole_station):
    whole_station.start_afresh()
    return whole_station


def test_stops_when_commands_cease_and_resumes_with_them(station):
    station.cruise()
    ceased = station.probe.silence()
    assert station.time_to_stand(ceased) < STOP_WITHIN
    station.told("no command: No command for")
    station.cruise()


def test_stops_when_the_commanding_node_is_killed(station):
    twist = "{linear: {y: 0.1}}"
    pilot = station.graph.run("rostopic", "pub", "-r", "10", "/rto3/safe_cmd_vel", "geometry_msgs/Twist", twist)
    station.until(lambda: station.speed() > 0.08, "it drives")
    pilot.signal(signal.SIGKILL)
    killed = time.time()
    assert station.time_to_stand(killed) < STOP_WITHIN
    station.told("no command: No command for")


@pytest.mark.parametrize("nonsense", [math.nan, math.inf])
def test_stops_on_a_command_that_is_no_number_and_obeys_the_next_one(station, nonsense):
    station.cruise()
    sent = station.probe.drive(0.0, nonsense, 0.0)
    assert station.time_to_stand(sent) < STOP_WITHIN
    station.told("fault: The command holds a value that is not a number.")
    station.cruise()


@pytest.mark.parametrize(
    ("answer", "complaint"),
    [
        ([], "sensor stale: The infrared is silent for"),
        ([-1] * 9, "sensor stale: The infrared says of no beam what it sees."),
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


def test_a_killed_driver_is_a_standing_robot_and_its_successor_drives_on(station):
    station.cruise()
    station.driver.signal(signal.SIGKILL)
    killed = time.time()
    assert station.time_to_stand(killed) < STOP_WITHIN
    station.told("sensor stale: The infrared is silent for")
    station.driver = station.start("rto_node", "rto_node")
    station.under_way()


def test_a_killed_gate_is_a_standing_robot_and_its_successor_drives_on(station):
    station.cruise()
    station.gate.signal(signal.SIGKILL)
    killed = time.time()
    assert station.time_to_stand(killed) < STOP_WITHIN
    station.gate = station.start("rto_safe_teleop", "safe_omni_drive")
    station.under_way()


def test_a_stop_lasts_until_it_is_reset_and_the_controls_are_released(station):
    station.cruise()
    assert station.trigger("stop_drive")["success"]
    assert station.time_to_stand(time.time()) < STOP_WITHIN
    station.told("stopped: Stopped: stop requested by ")
    station.stays()
    station.trigger("reset_stop")
    station.told("Let go of the controls once")
    station.stays()
    station.probe.drive(0.0, 0.0, 0.0)
    station.until(lambda: station.safety["state"] == "clear", "the controls were released")
    station.cruise()


def test_a_bump_lets_the_robot_back_out_only_until_it_is_reset(station):
    station.cruise()
    station.proxy.spoil["/data/bumper"] = lambda _: b'{"value": true}'
    assert station.time_to_stand(time.time()) < STOP_WITHIN
    station.told("bumped: A bumper was hit")
    station.stays()
    assert not station.trigger("reset_bumper")["success"]
    station.proxy.spoil.clear()
    station.stays()
    station.probe.drive(0.0, -station.way, 0.0)
    station.until(lambda: station.speed() / -station.way > 0.5, "away from it")
    assert abs(station.speed()) < 0.11
    assert station.trigger("reset_bumper")["success"]
    station.until(lambda: station.speed() / -station.way > 0.9, "let go")
