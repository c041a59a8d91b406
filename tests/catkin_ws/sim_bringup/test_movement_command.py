"""movement_command and the walker's web server command the same legs: the newest command counts."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from types import SimpleNamespace

import pytest
from sim_bringup import movement_command
from sim_bringup.movement_command import ZEROS, DirectMover, Movements
from std_msgs.msg import Int32

from telepresence.sim.scene import build_world
from telepresence.sim.walker.body import walker_model
from telepresence.sim.walker.robot import Walker
from telepresence.sim.walker.simulation import WalkerControls
from telepresence.teleop.movement import Movement

WINDOW = "/window"
PHYSICS = 20
"""Steps of the world between two looks."""


class Topic:
    """A subscriber to which the window's node is connected; counts how often that is asked."""

    def __init__(self, *_: object, **__: object) -> None:
        self.asked = 0

    @property
    def impl(self) -> SimpleNamespace:
        self.asked += 1
        return SimpleNamespace(connections=[SimpleNamespace(callerid_pub=WINDOW)])


@pytest.fixture
def listening(monkeypatch) -> Iterator:
    """Starts `Movements` for a mover, without a ROS master."""
    monkeypatch.setattr(movement_command.rospy, "Subscriber", Topic)
    monkeypatch.setattr(movement_command, "PastCommands", lambda topic: SimpleNamespace(is_past=lambda message: False))
    stop, threads = threading.Event(), []

    def listen(mover: movement_command.Mover) -> Movements:
        movements = Movements("movement_command", mover)
        threads.append(threading.Thread(target=movements.run, args=(stop,)))
        threads[-1].start()
        return movements

    yield listen
    stop.set()
    for thread in threads:
        thread.join()


def send(movements: Movements, movement: Movement) -> None:
    message = Int32(movement)
    message._connection_header = {"callerid": WINDOW}
    movements._take(message)


@pytest.fixture
def walker() -> Walker:
    """One that stands, in a world that only `walks` steps; what its web server asks for holds for ever."""
    world = build_world("flat", [walker_model()])
    return Walker(world, None, watchdog=1e9)


def walks(walker: Walker) -> bool:
    walker.world.step(PHYSICS)
    return walker.snapshot().walking


def test_a_stop_ends_what_the_web_server_has_begun(listening, walker, wait_until):
    movements = listening(DirectMover(WalkerControls(walker)))
    for _ in range(2):
        walker.set_velocity(0.25, 0.0, 0.0)
        assert walks(walker)
        send(movements, Movement.STOP)
        wait_until(lambda: not walks(walker), "it stops")


def test_a_stop_by_the_web_server_ends_what_a_movement_command_has_begun(listening, walker, wait_until):
    movements = listening(DirectMover(WalkerControls(walker)))
    send(movements, Movement.FORWARD)
    wait_until(lambda: walks(walker), "it walks")
    walker.set_velocity(0.0, 0.0, 0.0)
    asked = movements._subscriber.asked
    wait_until(lambda: movements._subscriber.asked > asked + 5, "the sender is still looked after")
    assert not walks(walker)
    send(movements, Movement.FORWARD)
    wait_until(lambda: walks(walker), "it walks when it is told to once more")


def test_a_driver_gets_a_movement_again_and_again_and_zeros_only_after_one_of_ours(listening, wait_until):
    moved: list[Movement] = []
    movements = listening(SimpleNamespace(REPEATS=True, move=moved.append))
    send(movements, Movement.STOP)
    send(movements, Movement.BACKWARD)
    wait_until(lambda: moved.count(Movement.BACKWARD) > 3, "it is repeated")
    send(movements, Movement.STOP)
    send(movements, Movement.STOP)
    wait_until(lambda: moved.count(Movement.STOP) == ZEROS, "zeros follow")
    assert moved[0] is Movement.BACKWARD
