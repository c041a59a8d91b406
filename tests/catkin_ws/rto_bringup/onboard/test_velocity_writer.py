"""What reaches the wheels of a robot whose web server is slow, as from a computer that rides on the robot."""

from __future__ import annotations

import time

import pytest
from corrupting_proxy import CorruptingProxy
from rto_bringup.onboard.robotino_base import RobotinoBase
from rto_bringup.onboard.velocity_writer import LONGEST_WAIT, VelocityWriter

from robotino_sim.simulation import Simulation
from telepresence.drive.pilots import PilotVelocity
from telepresence.drive.server import AT_REST

WHEELS = "/data/omnidrive"
READINGS = ("/data/distancesensorarray", "/data/bumper", "/data/odometry")
FORWARD, FASTER = (0.1, 0.0, 0.0), (0.15, 0.0, 0.0)
PERIOD = 0.05


@pytest.fixture
def robot(simulation):
    proxy = CorruptingProxy(int(simulation.url.rpartition(":")[2]))
    yield proxy
    proxy.close()


@pytest.fixture
def writer(robot):
    made = VelocityWriter(f"127.0.0.1:{robot.port}")
    yield made
    made.close()


def written(robot):
    return [tuple(value) for _, path, value in robot.put if path == WHEELS]


class Driving:
    """A pilot whose commands come in time."""

    cut, careful = False, False

    def deadline(self):
        return time.monotonic() + 0.2


def drive(base, seconds):
    """Decide as the drive server does, twenty times a second; the outcomes."""
    outcomes, end = [], time.monotonic() + seconds
    while (now := time.monotonic()) < end:
        outcomes.append(base.step(now, PilotVelocity(*FORWARD, now), None, Driving()))
        time.sleep(PERIOD)
    return outcomes


def test_a_slow_web_server_is_driven_evenly(robot, simulation, wait_until):
    robot.delay.update({WHEELS: 0.16, **dict.fromkeys(READINGS, 0.1)})
    with RobotinoBase(f"127.0.0.1:{robot.port}", laser=False) as base:
        wait_until(lambda: drive(base, PERIOD)[-1].given[0] > 0.09, "it drives")
        outcomes = drive(base, 3.0)
        faults = [outcome.reason for outcome in outcomes if outcome.state == "fault"]
        assert len(faults) < 0.1 * len(outcomes), faults
        assert sum(outcome.given[0] > 0.09 for outcome in outcomes) > 0.9 * len(outcomes)
        base.end()
    assert written(robot)[-1] == AT_REST


def test_a_robot_that_is_switched_off_and_on_is_driven_on(free_port, wait_until):
    port = free_port()
    with RobotinoBase(f"127.0.0.1:{port}", laser=False) as base:
        for _ in range(2):
            with Simulation("empty", port=port) as robot:
                wait_until(lambda: drive(base, PERIOD)[-1].given[0] > 0.09, "it drives")
                wait_until(lambda: drive(base, PERIOD) and robot.robot.snapshot().odometry.vx > 0.09, "the wheels turn")
            wait_until(lambda: drive(base, PERIOD)[-1].state == "fault", "its loss is noticed")


def test_deciding_never_waits_for_the_web_server(robot, writer, wait_until):
    robot.delay[WHEELS] = 0.3
    for velocity in (FORWARD, FASTER, AT_REST):
        writer.write(velocity)
    assert not written(robot), "none of them had its answer"
    wait_until(lambda: AT_REST in written(robot), "the zero gets there")


def test_a_stop_does_not_wait_for_the_velocity_before_it_and_outlasts_it(robot, writer, wait_until):
    robot.delay[WHEELS] = 0.35
    writer.write(FORWARD)
    wait_until(lambda: robot.asked[WHEELS] == 1, "a velocity is under way")
    robot.delay[WHEELS] = 0.0
    writer.write(AT_REST)
    wait_until(lambda: FORWARD in written(robot), "the server obeys the velocity at last")
    assert written(robot)[0] == AT_REST, "it has stopped long before"
    wait_until(lambda: written(robot)[-1] == AT_REST, "and stops again")


def test_what_waits_when_the_robot_is_stopped_is_never_written(robot, writer, wait_until):
    robot.delay[WHEELS] = 0.3
    writer.write(FORWARD)
    wait_until(lambda: robot.asked[WHEELS] == 1, "a velocity is under way")
    writer.write(FASTER)
    writer.write(AT_REST)
    wait_until(lambda: written(robot)[-2:] == [AT_REST, AT_REST], "the robot is stopped, twice to be sure")
    assert written(robot) == [FORWARD, AT_REST, AT_REST]


def test_a_velocity_that_nothing_replaces_grows_too_old_to_be_written(robot, writer, wait_until):
    robot.delay[WHEELS] = LONGEST_WAIT + 0.15
    writer.write(FORWARD)
    wait_until(lambda: robot.asked[WHEELS] == 1, "a velocity is under way")
    writer.write(FASTER)  # and then whoever decides hangs
    wait_until(lambda: written(robot), "the first one is obeyed")
    writer.finish()
    writer.write(AT_REST)
    wait_until(lambda: AT_REST in written(robot), "the robot is stopped")
    assert FASTER not in written(robot)


def test_a_web_server_that_hangs_is_a_fault_and_none_any_more_when_it_answers(robot, writer, wait_until):
    robot.delay[WHEELS] = 1.0
    wait_until(lambda: writer.write(FORWARD) or writer.problem(time.monotonic()), "it is a fault")
    assert "does not answer" in writer.problem(time.monotonic())
    robot.delay.clear()
    wait_until(lambda: writer.write(FORWARD) or not writer.problem(time.monotonic()), "it answers")
    writer.write(AT_REST)
    writer.finish()
