from __future__ import annotations

import time

import pytest
import qi
from naoqi_driver.base import BRAKING_TIME, HEARTBEAT_KEY, PERIOD, REFUSAL_KEY, REFUSAL_SHOWN, BaseDriver
from naoqi_driver.command_gate import CommandGate
from naoqi_driver.connection import Address, Connection


class Motion:
    """The part of ALMotion that drives, without physics: a stop takes as long as the test wants."""

    def __init__(self) -> None:
        self.calls: list[tuple] = []
        self.awake = True
        self.stops_at_once = True
        self.pending: list[qi.Promise] = []

    def move(self, x: float, y: float, theta: float) -> None:
        self.calls.append(("move", x, y, theta))

    def moveTo(self, x: float, y: float, theta: float) -> qi.Future:
        self.calls.append(("moveTo", x, y, theta))
        return self._later()

    def stopMove(self) -> qi.Future:
        self.calls.append(("stopMove",))
        if self.stops_at_once:
            self.arrive(False)
        future = self._later()
        if self.stops_at_once:
            self.arrive(True)
        return future

    def killMove(self) -> None:
        self.calls.append(("killMove",))
        self.arrive(True)

    def robotIsWakeUp(self) -> bool:
        return self.awake

    def wakeUp(self) -> qi.Future:
        self.calls.append(("wakeUp",))
        self.awake = True
        return self._later()

    def arrive(self, reached: bool) -> None:
        for promise in self.pending:
            promise.setValue(reached)
        self.pending.clear()

    def _later(self) -> qi.Future:
        self.pending.append(qi.Promise())
        return self.pending[-1].future()

    def names(self) -> list[str]:
        return [call[0] for call in self.calls]


class Memory:
    def __init__(self) -> None:
        self.values: dict[str, list] = {}

    def insertData(self, key: str, value: object) -> None:
        self.values.setdefault(key, []).append(value)

    def getTimestamp(self, key: str) -> list:
        if key not in self.values:
            raise ValueError(f"no data for {key}")
        return [self.values[key][-1], len(self.values[key]), 0]

    @property
    def beats(self) -> list:
        return self.values.get(HEARTBEAT_KEY, [])


class Drive:
    """A driver with a clock of its own."""

    def __init__(self, connection: Connection, wake_up: bool = True) -> None:
        self.gate = CommandGate()
        self.base = BaseDriver(connection, self.gate, wake_up)
        self.now = 0.0
        self._connection = connection

    def command(self, vx: float, vy: float, wz: float) -> None:
        self.gate.command(vx, vy, wz, self.now)

    def run(self, seconds: float, master_alive: bool = True) -> None:
        for _ in range(round(seconds / PERIOD)):
            self.now += PERIOD
            self.base.step(self.now, master_alive)
        if self._connection.connected:
            self._connection.call("ALMotion", "robotIsWakeUp")  # answered after everything that was sent before


@pytest.fixture
def motion(naoqi) -> Motion:
    service = Motion()
    naoqi.register("ALMotion", service)
    return service


@pytest.fixture
def memory(naoqi, motion) -> Memory:
    service = Memory()
    naoqi.register("ALMemory", service)
    return service


@pytest.fixture
def connection(naoqi, memory):
    with Connection(Address.parse("127.0.0.1", naoqi.port)) as link:
        assert link.wait_connected(10)
        yield link


@pytest.fixture
def drive(connection, motion) -> Drive:
    driver = Drive(connection)
    driver.run(0.2)
    motion.calls.clear()
    return driver


def test_velocities_reach_the_robot_in_metres_per_second(drive, motion):
    drive.command(0.2, -0.1, 0.5)
    drive.run(0.1)
    assert motion.calls == [("move", 0.2, -0.1, 0.5)] * 2
    assert drive.base.state == "driving"


def test_stops_when_commands_cease(drive, motion):
    drive.command(0.2, 0.0, 0.0)
    drive.run(1.0)
    assert motion.names()[-1] == "stopMove"
    assert motion.names().count("stopMove") == 1
    assert drive.base.state == "stopped: no command for 0.5 s"


def test_a_stop_that_takes_too_long_is_forced(drive, motion):
    motion.stops_at_once = False
    drive.command(0.2, 0.0, 0.0)
    drive.run(0.5 + BRAKING_TIME + 0.2)
    assert motion.names()[-2:] == ["stopMove", "killMove"]


def test_a_commanded_stop_brakes_gently_and_then_lets_go(drive, motion, memory):
    motion.stops_at_once = False
    drive.command(0.2, 0.0, 0.0)
    drive.run(0.1)
    for _ in range(20):
        drive.command(0.0, 0.0, 0.0)
        drive.run(0.1)
    assert ("move", 0.0, 0.0, 0.0) in motion.calls
    assert "killMove" not in motion.names()
    assert motion.names()[-1] == "stopMove"
    motion.arrive(True)
    time.sleep(0.05)
    drive.run(0.1)
    assert memory.beats[-1] == 0
    assert not drive.base.holds_robot


def test_zero_commands_do_not_take_hold_of_a_standing_robot(drive, motion, memory):
    beats = len(memory.beats)
    for _ in range(5):
        drive.command(0.0, 0.0, 0.0)
        drive.run(0.1)
    assert motion.calls == []
    assert len(memory.beats) == beats


def test_heartbeat_changes_while_driving_and_is_zero_afterwards(drive, memory):
    drive.command(0.2, 0.0, 0.0)
    drive.run(0.5)
    driving = memory.beats[-10:]
    assert len(set(driving)) == 10
    assert 0 not in driving
    drive.run(0.5)
    assert memory.beats[-1] == 0


def test_lost_master_stops_the_robot(drive, motion):
    drive.command(0.2, 0.0, 0.0)
    drive.run(0.1)
    drive.run(0.1, master_alive=False)
    assert motion.names()[-1] == "stopMove"
    assert "master" in drive.base.state


def test_nan_stops_the_robot(drive, motion):
    drive.command(0.2, 0.0, 0.0)
    drive.run(0.1)
    drive.command(float("nan"), 0.0, 0.0)
    drive.run(0.1)
    assert motion.names()[-1] == "stopMove"
    assert "vx is nan" in drive.base.state


def test_goal_is_driven_to_and_a_command_replaces_it(drive, motion, memory):
    drive.base.go_to(1.0, 0.0, 0.5)
    drive.run(0.2)
    assert motion.calls == [("moveTo", 1.0, 0.0, 0.5)]
    assert drive.base.state == "driving to the goal"
    assert memory.beats[-1] > 0
    drive.command(0.0, 0.0, 0.3)
    drive.run(0.05)
    assert motion.calls[-1] == ("move", 0.0, 0.0, 0.3)
    assert drive.base.state == "driving"


def test_goal_reached_lets_go(drive, motion, memory):
    drive.base.go_to(1.0, 0.0, 0.0)
    drive.run(0.1)
    motion.arrive(True)
    time.sleep(0.05)
    drive.run(0.1)
    assert memory.beats[-1] == 0
    assert not drive.base.holds_robot


def test_lost_master_ends_a_goal(drive, motion):
    drive.base.go_to(1.0, 0.0, 0.0)
    drive.run(0.1)
    drive.run(0.1, master_alive=False)
    assert motion.names() == ["moveTo", "stopMove"]


def test_what_an_earlier_driver_left_running_is_stopped(connection, motion):
    Drive(connection).run(0.1)
    assert motion.names() == ["stopMove"]


def test_sleeping_robot_is_woken_before_it_drives(connection, motion):
    motion.awake = False
    driver = Drive(connection)
    driver.command(0.2, 0.0, 0.0)
    driver.run(0.2)
    assert motion.calls == [("wakeUp",)]
    assert "waking" in driver.base.state
    motion.arrive(True)
    time.sleep(0.05)
    driver.command(0.2, 0.0, 0.0)
    driver.run(0.1)
    assert motion.calls[-1] == ("move", 0.2, 0.0, 0.0)


def test_sleeping_robot_is_left_alone_when_told_so(connection, motion):
    motion.awake = False
    driver = Drive(connection, wake_up=False)
    driver.run(0.2)
    driver.command(0.2, 0.0, 0.0)
    driver.run(0.1)
    assert "wakeUp" not in motion.names()
    assert "sleeps" in driver.base.state


def test_lost_link_stops_first_when_it_is_back(naoqi, memory, motion, make_connection, wait_until):
    wire = make_connection(naoqi.port)
    with Connection(Address.parse("127.0.0.1", wire.port)) as link:
        assert link.wait_connected(10)
        driver = Drive(link)
        driver.command(0.2, 0.0, 0.0)
        driver.run(0.1)
        wire.freeze()  # so that no new connection comes about at once
        wire.cut()
        wait_until(lambda: not link.connected, "loss noticed")
        driver.run(0.1)
        assert driver.base.state.startswith("robot unreachable: ")
        motion.calls.clear()
        wire.thaw()
        wait_until(lambda: link.connections == 2, "connected again")
        driver.now += 1.0
        driver.run(0.1)
    assert motion.names()[0] == "stopMove"
    assert "move" not in motion.names()


def test_halt_stops_and_lets_go(drive, motion, memory):
    drive.command(0.2, 0.0, 0.0)
    drive.run(0.1)
    drive.base.halt(timeout=1.0)
    assert motion.names()[-1] == "stopMove"
    assert memory.beats[-1] == 0


def test_halt_forces_a_robot_that_does_not_stop(drive, motion):
    motion.stops_at_once = False
    drive.command(0.2, 0.0, 0.0)
    drive.run(0.1)
    drive.base.halt(timeout=0.1)
    assert motion.names()[-2:] == ["stopMove", "killMove"]


def test_refusal_of_the_robot_is_told_for_a_while(drive, memory):
    memory.insertData(REFUSAL_KEY, ["obstacle", 0, [1.0, 0.0, 0.0]])
    drive.base.supervise(drive.now)
    drive.command(0.2, 0.0, 0.0)
    drive.run(0.1)
    assert drive.base.state == "driving", "what was refused before we looked is not news"
    memory.insertData(REFUSAL_KEY, ["obstacle", 1, [1.0, 0.0, 0.0]])
    drive.base.supervise(drive.now)
    drive.command(0.2, 0.0, 0.0)
    drive.run(0.1)
    assert drive.base.state == "driving, but the robot refuses: obstacle"
    drive.run(REFUSAL_SHOWN)
    drive.command(0.2, 0.0, 0.0)
    drive.run(0.1)
    assert drive.base.state == "driving"


def test_first_refusal_of_its_life_is_told_too(drive, memory):
    drive.base.supervise(drive.now)
    memory.insertData(REFUSAL_KEY, ["obstacle", 0, [1.0, 0.0, 0.0]])
    drive.base.supervise(drive.now)
    drive.command(0.2, 0.0, 0.0)
    drive.run(0.1)
    assert drive.base.state == "driving, but the robot refuses: obstacle"


def test_robot_that_was_put_to_rest_is_told(drive, motion):
    motion.awake = False
    drive.base.supervise(drive.now)
    drive.command(0.2, 0.0, 0.0)
    drive.run(0.1)
    assert drive.base.state == "stopped: the robot sleeps; wake it up to drive"
