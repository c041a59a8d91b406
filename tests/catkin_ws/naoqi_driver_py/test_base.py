from __future__ import annotations

import math
from collections.abc import Callable

import pytest
import qi
from naoqi_driver.base import ANSWER_TIME, PERIOD, REFUSAL_KEY, REFUSAL_SHOWN, STANDING_TIME, BaseDriver
from naoqi_driver.command_watchdog import CommandWatchdog
from naoqi_driver.connection import Address, Connection

from telepresence.drive.datagram import DRIVING, ENDED, REACHED, Report
from telepresence.drive.pilots_goal import ASKED

NOTHING, HARD = "nothing", "nothing, and brake hard"


class Motion:
    """The part of ALMotion that the driver calls itself."""

    def __init__(self) -> None:
        self.calls: list[str] = []
        self.awake = True
        self.waking: qi.Promise | None = None
        self.meanwhile: Callable[[], None] = lambda: None
        """What happens while the robot works out where it is."""

    def robotIsWakeUp(self) -> bool:
        return self.awake

    def wakeUp(self) -> qi.Future:
        self.calls.append("wakeUp")
        self.awake = True
        self.waking = qi.Promise()
        return self.waking.future()

    def getRobotPosition(self, use_sensors: bool) -> list[float]:
        self.meanwhile()
        return [1.0, 2.0, math.pi / 2]


class Memory:
    def __init__(self) -> None:
        self.refusals: list = []

    def getTimestamp(self, key: str) -> list:
        if key != REFUSAL_KEY or not self.refusals:
            raise ValueError(f"no data for {key}")
        return [self.refusals[-1], len(self.refusals), 0]


class Link:
    """A network on which nothing is lost, to a drive server that says what the test wants."""

    def __init__(self) -> None:
        self.problem = ""
        self.given: list = []
        self._goal = ENDED
        self._report: Report | None = None

    def drive(self, vx: float, vy: float, wz: float) -> None:
        self.given.append((vx, vy, wz))

    def release(self, hard: bool = False) -> None:
        self.given.append(HARD if hard else NOTHING)

    def go_to(self, x: float, y: float, theta: float) -> None:
        self.given.append(("goal", x, y, theta))
        self._goal = ASKED

    def end_goal(self) -> None:
        self.given.append("end of the goal")
        self._goal = ENDED

    def goal_state(self) -> str:
        return self._goal

    def answer(self, state: str, reason: str = "", goal: str | None = None) -> None:
        self._goal = goal or self._goal
        self._report = Report(0.0, 0, state, reason, (0.0, 0.0, 0.0), (), math.inf, -1, math.inf, False, None, 0.0)

    def report(self) -> tuple[Report | None, float]:
        return self._report, 0.0


class Drive:
    """A driver with a clock of its own."""

    def __init__(self, connection: Connection, wake_up: bool = True, rests: bool = False) -> None:
        self.watchdog = CommandWatchdog()
        self.link = Link()
        self.base = BaseDriver(connection, self.link, self.watchdog, wake_up, rests=rests)
        self.now = 0.0

    @property
    def given(self) -> list:
        return self.link.given

    def command(self, vx: float, vy: float = 0.0, wz: float = 0.0) -> None:
        self.watchdog.command(vx, vy, wz, self.now)

    def hold(self, vx: float, seconds: float) -> None:
        """Repeat a velocity as a held key does."""
        for _ in range(round(seconds / PERIOD)):
            self.command(vx)
            self.run(PERIOD)

    def run(self, seconds: float, master_alive: bool = True) -> None:
        for _ in range(round(seconds / PERIOD)):
            self.now += PERIOD
            self.base.step(self.now, master_alive)

    def supervise(self) -> None:
        self.base.supervise(self.now)


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
def drive(connection) -> Drive:
    driver = Drive(connection)
    driver.supervise()
    return driver


def test_velocities_are_given_in_metres_per_second_and_repeated(drive):
    drive.command(0.2, -0.1, 0.5)
    drive.run(0.1)
    assert drive.given == [(0.2, -0.1, 0.5)] * 2
    assert drive.base.state == "driving"


def test_gives_nothing_when_commands_cease(drive):
    drive.command(0.2)
    drive.run(1.0)
    assert drive.given[-1] == HARD
    assert drive.base.state == "stopped: no command for 0.5 s"


def test_a_commanded_stop_brakes_gently_and_then_lets_go(drive):
    drive.hold(0.2, 0.1)
    drive.hold(0.0, STANDING_TIME - 2 * PERIOD)
    assert set(drive.given[2:]) == {(0.0, 0.0, 0.0)}
    drive.hold(0.0, 0.2)
    assert drive.given[-1] == NOTHING


def test_zero_commands_do_not_take_hold_of_a_standing_robot(drive):
    drive.hold(0.0, 0.5)
    assert set(drive.given) == {NOTHING}


@pytest.mark.parametrize(("vx", "alive", "why"), [(0.2, False, "master"), (math.nan, True, "vx is nan")])
def test_lost_master_and_nonsense_give_nothing(drive, vx, alive, why):
    drive.command(0.2)
    drive.run(0.1)
    drive.command(vx)
    drive.run(0.1, alive)
    assert drive.given[-1] == HARD
    assert why in drive.base.state


def test_goal_is_driven_to_and_a_command_replaces_it(drive):
    drive.base.go_to(1.0, 0.0, 0.5)
    drive.run(0.2)
    drive.link.answer("clear", goal=DRIVING)
    drive.run(0.2)
    assert [each for each in drive.given if each != NOTHING] == [("goal", 1.0, 0.0, 0.5)]
    assert drive.base.state == "driving to the goal"
    drive.command(0.0, 0.0, 0.3)
    drive.run(0.05)
    assert drive.given[-2:] == ["end of the goal", (0.0, 0.0, 0.3)]
    assert drive.base.state == "driving"


def test_a_stop_ends_a_goal_of_a_robot_that_nobody_drove(drive):
    drive.base.go_to(1.0, 0.0, 0.0)
    drive.run(0.1)
    drive.command(0.0)
    drive.run(0.05)
    assert drive.given[-2:] == ["end of the goal", NOTHING]


def test_a_velocity_that_does_not_pass_ends_a_goal_all_the_same(drive):
    drive.base.go_to(1.0, 0.0, 0.5)
    drive.run(0.1)
    drive.base.end_goals()  # the gate refuses what the pilot commands, so that no velocity comes here
    drive.run(0.1)
    assert "end of the goal" in drive.given and drive.base.state != "driving to the goal"
    drive.base.go_to(2.0, 0.0, 0.0)
    drive.run(0.1)
    assert ("goal", 2.0, 0.0, 0.0) in drive.given, "the next one is driven to"


def test_goal_reached_is_over(drive):
    drive.base.go_to(1.0, 0.0, 0.0)
    drive.run(0.1)
    drive.link.answer("no command", "Nobody drives.", goal=REACHED)
    drive.run(0.1)
    assert drive.base.state == "stopped: no command yet"
    assert drive.given.count("end of the goal") == 0


def test_lost_master_ends_a_goal(drive):
    drive.base.go_to(1.0, 0.0, 0.0)
    drive.run(0.1)
    drive.run(0.1, master_alive=False)
    assert drive.given[-1] == HARD
    assert "end of the goal" in drive.given


def test_goal_in_odometry_is_given_as_the_robot_sees_it(drive):
    drive.base.go_to(1.0, 3.0, math.pi / 2, in_odometry=True)
    drive.run(0.1)
    goal = next(each for each in drive.given if each != NOTHING)
    assert goal[1:] == pytest.approx((1.0, 0.0, 0.0))


def stop(drive: Drive) -> None:
    """As stop_walk_srv and a zero velocity do, and nobody has looked before the zero is over."""
    drive.base.end_goals()
    drive.command(0.0)
    drive.now += 2 * drive.watchdog.timeout


@pytest.mark.parametrize(
    "interrupt",
    [
        stop,
        lambda drive: drive.hold(0.2, 0.1),
        lambda drive: drive.run(PERIOD, master_alive=False),
    ],
    ids=["stop", "velocity", "lost master"],
)
def test_goal_whose_place_comes_after_a_stop_is_refused(drive, motion, interrupt):
    def meanwhile() -> None:
        interrupt(drive)
        drive.run(2 * drive.watchdog.timeout)  # by then neither is known any more

    motion.meanwhile = meanwhile
    drive.base.go_to(1.0, 3.0, 0.0, in_odometry=True)
    drive.run(0.2)
    assert not [each for each in drive.given if each[0] == "goal"]
    motion.meanwhile = lambda: None
    drive.base.go_to(1.0, 3.0, 0.0, in_odometry=True)
    drive.run(0.2)
    assert [each for each in drive.given if each[0] == "goal"], "the next one is driven to"


def test_goal_whose_place_was_looked_for_during_a_stop_is_refused(drive):
    given = drive.base.this_moment()
    drive.base.end_goals()
    drive.base.go_to(1.0, 0.0, 0.0, given=given)
    drive.run(0.2)
    assert not [each for each in drive.given if each[0] == "goal"]
    drive.base.go_to(1.0, 0.0, 0.0, given=drive.base.this_moment())
    drive.run(0.2)
    assert [each for each in drive.given if each[0] == "goal"], "the next one is driven to"


def test_sleeping_robot_is_woken_before_it_drives(connection, motion, wait_until):
    motion.awake = False
    driver = Drive(connection)
    driver.supervise()
    wait_until(lambda: motion.calls == ["wakeUp"], "it is woken")
    driver.hold(0.2, 0.2)
    assert driver.given[-1] == NOTHING
    assert "waking" in driver.base.state
    motion.waking.setValue(True)
    wait_until(lambda: driver.supervise() or driver.base.awake, "it is awake")
    driver.hold(0.2, 0.1)
    assert driver.given[-1] == (0.2, 0.0, 0.0)


def test_sleeping_robot_is_left_alone_when_told_so(connection, motion):
    motion.awake = False
    driver = Drive(connection, wake_up=False)
    driver.supervise()
    driver.hold(0.2, 0.1)
    assert motion.calls == []
    assert "sleeps" in driver.base.state


def test_robot_that_was_put_to_rest_is_left_alone_and_said_to_sleep(drive, motion):
    motion.awake = False
    drive.supervise()
    drive.hold(0.2, 0.1)
    assert drive.base.state == "stopped: the robot sleeps; wake it up to drive"
    assert motion.calls == []


def test_robot_that_was_put_to_rest_before_the_driver_died_is_left_alone(connection, motion):
    motion.awake = False
    drive = Drive(connection, rests=True)
    drive.supervise()
    drive.hold(0.2, 0.1)
    assert motion.calls == [] and "sleeps" in drive.base.state
    motion.awake = True
    drive.supervise()
    assert drive.base.awake, "somebody has woken it"


def test_lost_robot_is_given_nothing_and_named(naoqi, memory, make_connection, wait_until):
    wire = make_connection(naoqi.port)
    with Connection(Address.parse("127.0.0.1", wire.port)) as link:
        assert link.wait_connected(10)
        driver = Drive(link)
        driver.hold(0.2, 0.1)
        assert driver.given[-1] == (0.2, 0.0, 0.0)
        wire.freeze()  # so that no new connection comes about at once
        wire.cut()
        wait_until(lambda: not link.connected, "loss noticed")
        driver.hold(0.2, 0.1)
        assert driver.given[-1] == HARD
        assert driver.base.state.startswith("robot unreachable: ")
        assert driver.base.problem
        wire.thaw()


def test_drive_server_that_does_not_answer_is_a_problem_until_it_does(drive):
    drive.link.problem = "The drive server at pepper:8085 does not answer for 0.6 s: no route to host"
    drive.hold(0.2, 0.1)
    assert drive.base.problem == drive.link.problem
    assert drive.base.state == f"robot unreachable: {drive.link.problem}"
    assert drive.given[-1] == HARD
    drive.link.problem = ""
    drive.hold(0.2, 0.1)
    assert (drive.base.problem, drive.base.state) == ("", "driving")


def test_what_the_drive_server_cannot_do_is_a_problem_at_once(drive):
    drive.link.answer("fault", "NAOqi does not answer.")
    drive.run(PERIOD)
    assert drive.base.problem == "NAOqi does not answer."
    assert drive.base.state == "stopped: NAOqi does not answer."


def test_what_the_drive_server_refuses_is_a_problem_unless_it_said_so_before(drive):
    drive.link.answer("no command", "Nobody drives.")
    drive.hold(0.2, ANSWER_TIME - PERIOD)
    assert (drive.base.problem, drive.base.state) == ("", "driving")
    drive.link.answer("no command", "Commands arrive 0.7 s late.")
    drive.hold(0.2, 2 * PERIOD)
    assert drive.base.problem == "Commands arrive 0.7 s late."
    assert drive.given[-1] == (0.2, 0.0, 0.0), "the robot judges anew each time"


def test_refusal_of_the_robot_is_told_for_a_while(drive, memory):
    memory.refusals.append(["obstacle", 0, [1.0, 0.0, 0.0]])
    driver = Drive(drive.base._connection)
    driver.supervise()
    driver.hold(0.2, 0.1)
    assert driver.base.state == "driving", "what was refused before we looked is not news"
    memory.refusals.append(["obstacle", 1, [1.0, 0.0, 0.0]])
    driver.supervise()
    driver.hold(0.2, 0.1)
    told = "driving, but the robot refuses: obstacle, nearer than the robot itself allows; turn, or drive away from it"
    assert driver.base.state == told
    driver.hold(0.2, REFUSAL_SHOWN)
    assert driver.base.state == "driving"


def test_first_refusal_of_its_life_is_told_too(drive, memory):
    memory.refusals.append(["hatch open", 0, [0.0, 0.0, 0.0]])
    drive.supervise()
    drive.hold(0.2, 0.1)
    assert drive.base.state == "driving, but the robot refuses: hatch open"
