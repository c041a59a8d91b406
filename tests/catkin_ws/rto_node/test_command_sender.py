"""What reaches a robot that is away for a while, or slow."""

from __future__ import annotations

import time

import pytest
from corrupting_proxy import CorruptingProxy
from rto_node.command_sender import OUTPUTS_TIMEOUT, CommandSender
from rto_node.command_watchdog import CommandWatchdog
from rto_node.link import Link

from robotino_sim.simulation import Simulation
from telepresence.teleop.command_timeout import DRIVER_TIMEOUT

OUTPUTS, WHEELS = "/data/digitaloutputarray", "/data/omnidrive"
ALL_ON = (True,) * 8


@pytest.fixture(scope="module")
def simulation():
    with Simulation(scene="empty", port=0) as running:
        yield running


@pytest.fixture
def robot(simulation):
    proxy = CorruptingProxy(int(simulation.url.rpartition(":")[2]))
    yield proxy
    proxy.close()


class Sending:
    """What the driver's thread does."""

    def __init__(self, port):
        self.watchdog, self.link = CommandWatchdog(), Link(f"127.0.0.1:{port}")
        self.sender = CommandSender(self.link, self.watchdog)

    def until(self, when):
        while time.monotonic() < when:
            self.sender.send()
            time.sleep(0.02)


def written(robot, path):
    return [value for _, name, value in robot.put if name == path]


def test_outputs_are_set_once(robot):
    sending = Sending(robot.port)
    sending.sender.set_outputs(ALL_ON)
    sending.until(time.monotonic() + 0.1)
    assert written(robot, OUTPUTS) == [[True] * 8]


@pytest.mark.parametrize("away", ["refuses", "is not there"])
def test_outputs_are_not_set_when_a_robot_comes_back(robot, free_port, away, wait_until):
    """They move grippers and valves; whoever asked has long gone away."""
    sending = Sending(robot.port if away == "refuses" else free_port())
    robot.missing.add(OUTPUTS)
    sending.sender.set_outputs(ALL_ON)
    sending.until(time.monotonic() + OUTPUTS_TIMEOUT + 0.1)
    robot.missing.clear()
    back = Link(f"127.0.0.1:{robot.port}")
    sending.link.client = back.client
    sending.until(time.monotonic() + 0.2)
    assert not written(robot, OUTPUTS)
    sending.sender.set_outputs(ALL_ON)
    wait_until(lambda: sending.sender.send() and written(robot, OUTPUTS), "the next ones are set")


def test_a_velocity_that_grew_old_while_outputs_were_set_is_not_sent(robot):
    sending = Sending(robot.port)
    robot.delay[OUTPUTS] = 0.4
    began = time.monotonic()
    sending.watchdog.command(0.2, 0.0, 0.0, began)
    sending.until(began + DRIVER_TIMEOUT - 0.2)
    driven = written(robot, WHEELS).count([0.2, 0.0, 0.0])
    assert driven > 1
    sending.sender.set_outputs(ALL_ON)
    sending.sender.send()
    assert written(robot, OUTPUTS), "they took their time"
    assert written(robot, WHEELS).count([0.2, 0.0, 0.0]) == driven
