"""No call is left without an answer: every documented method of every service is called while the joints are limp, and
those that move the robot while it sleeps, lives, lies on the floor or moves already. Errors are answers too.

What takes time is called all at once: motions of one joint wait for each other, so their times are added up.
"""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Iterable, Iterator
from types import ModuleType
from typing import Any

import pytest
from documented_calls import DOCUMENTED
from naoqi_clients import connected

from pepper_sim.body.description import JOINTS
from pepper_sim.documentation import Call, Method
from pepper_sim.simulation import Simulation

PATIENCE = 5.0
"""Seconds after its documented time in which a call must be answered."""
DONE_SOON = 60.0
"""Seconds for what is called before and after."""
BUSY = 1.0
"""How long the motion of `_busy` takes [s]."""
MOVING = ("ALMotion", "ALRobotPosture")
"""Services whose methods that take time are called in every state."""
STATE_CHANGES = {
    "wakeUp",
    "rest",
    "setState",
    "openHand",
    "closeHand",
    "stiffnessInterpolation",
    "stopMove",
    "stopWalk",
}
"""Methods that take time and end the state or other motions: called when the others have been answered."""


def _quick(service: str) -> list[tuple[str, Method]]:
    """The methods that take no time."""
    return [(service, method) for method in DOCUMENTED[service].methods if not method.seconds]


def _slow(services: Iterable[str]) -> Iterator[list[tuple[str, Method]]]:
    """The methods that take time: those that leave the state as it is, then the others."""
    found = [(service, method) for service in services for method in DOCUMENTED[service].methods if method.seconds]
    for last in (False, True):
        yield [(service, method) for service, method in found if (method.name in STATE_CHANGES) == last]


class Calls:
    """Calls under way, each with the moment at which it must have been answered."""

    def __init__(self, naoqi: Any) -> None:
        self._service_of = functools.cache(naoqi.session.service)
        self._offered = {
            service.name: {binding.name for binding in service.bindings()}
            for service in naoqi.simulation.server.catalogue.services
        }
        self._under_way: list[tuple[str, Any, float]] = []
        self.unanswered: list[str] = []

    def start(self, service: str, method: str, arguments: Iterable[Any], seconds: float) -> Any:
        """Call a method that has `seconds` and the patience; return the call's future."""
        if method not in self._offered.get(service, ()):
            return None
        try:
            call = getattr(self._service_of(service), method)(*arguments, _async=True)
        except (RuntimeError, TypeError):  # the client's library has refused it
            return None
        self._under_way.append((f"{service}.{method}{tuple(arguments)}", call, time.monotonic() + seconds + PATIENCE))
        return call

    def wait(self) -> None:
        """Wait for all answers; what has none in its time is cancelled and noted."""
        for name, call, deadline in self._under_way:
            call.wait(max(1, round(1000 * (deadline - time.monotonic()))))
            if not call.isFinished():
                self.unanswered.append(name)
                call.cancel()
        self._under_way.clear()

    def answer(self, call: Call) -> Any:
        """Make a call and return its answer; None for an error."""
        future = self.start(call.service, call.method, call.arguments, DONE_SOON)
        self.wait()
        return future.value() if future is not None and future.isFinished() and not future.hasError() else None


def _call_all(naoqi: Any, methods: Iterable[tuple[str, Method]], taken: float = 0.0) -> list[str]:
    """Call each method with what its documentation gives for it; return the calls that were not answered.

    Joints are in use by something else for `taken` seconds.
    """
    calls = Calls(naoqi)
    preparing = Calls(naoqi)
    after: list[Call] = []
    for service, method in methods:
        answers = [preparing.answer(call) for call in method.before]
        places = {f"${number}": answer for number, answer in enumerate(answers)}
        taken += method.seconds
        for arguments in (method.valid or ((),))[: 1 if method.seconds else None]:
            filled = [places.get(word, word) if isinstance(word, str) else word for word in arguments]
            calls.start(service, method.name, filled, taken)
        after += method.after
    calls.wait()
    for call in after:
        preparing.answer(call)
    return calls.unanswered + preparing.unanswered


def _limp(naoqi: Any, wait_until: Callable) -> None:
    naoqi.robot.set_stiffness(dict.fromkeys(JOINTS, 0.0))


def _asleep(naoqi: Any, wait_until: Callable) -> None:
    naoqi.ALMotion.rest()


def _alive(naoqi: Any, wait_until: Callable) -> None:
    naoqi.ALAutonomousLife.setState("solitary")


def _fallen(naoqi: Any, wait_until: Callable) -> None:
    world = naoqi.simulation.world
    with world.locked() as data:
        data.qvel[world.model.joint(naoqi.robot.prefix + "root").dofadr[0] + 4] = 6.0  # a push from behind
    wait_until(lambda: naoqi.robot.snapshot().fallen, "the robot lies on the floor")


def _busy(naoqi: Any, wait_until: Callable) -> None:
    naoqi.ALMotion.move(0.0, 0.0, 0.2)
    naoqi.ALMotion.angleInterpolation("Body", [0.0] * len(JOINTS), BUSY, True, _async=True)
    wait_until(naoqi.ALMotion.getTaskList, "the robot moves")


@pytest.fixture(scope="module")
def simulation() -> Iterator[Simulation]:
    """A robot of its own: nobody could say in what state all those calls leave it."""
    with Simulation(scene="empty", port=0) as running:
        yield running


@pytest.fixture(scope="module")
def session(simulation: Simulation, qi: ModuleType) -> Iterator[Any]:
    with connected(qi, simulation.url) as client:
        yield client


@pytest.fixture(autouse=True)
def _as_before(naoqi):
    life = naoqi.ALAutonomousLife.getState()
    yield
    naoqi.simulation.restart()
    naoqi.ALMotion.killAll()
    if naoqi.ALAutonomousLife.getState() != life:
        naoqi.ALAutonomousLife.setState(life)
        naoqi.ALMotion.wakeUp()


def test_what_takes_no_time_is_answered_with_limp_joints(naoqi, wait_until):
    unanswered = []
    for service in DOCUMENTED:
        _limp(naoqi, wait_until)
        unanswered += _call_all(naoqi, _quick(service))
    assert unanswered == []


def test_what_takes_time_is_answered_with_limp_joints(naoqi, wait_until):
    _limp(naoqi, wait_until)
    assert [_call_all(naoqi, methods) for methods in _slow(DOCUMENTED)] == [[], []]


@pytest.mark.parametrize("enter", [_asleep, _alive, _fallen, _busy])
def test_motions_are_answered_in_every_state(naoqi, wait_until, enter):
    enter(naoqi, wait_until)
    assert [_call_all(naoqi, methods, BUSY) for methods in _slow(MOVING)] == [[], []]


def test_calls_that_wait_keep_no_others_waiting(naoqi, connect, wait_until):
    """Far more of them than the robot has threads, of several clients."""
    _busy(naoqi, wait_until)
    waiting = []
    for client in [connect() for _ in range(3)]:
        motion, posture = client.service("ALMotion"), client.service("ALRobotPosture")
        for _ in range(40):
            waiting.append(motion.angleInterpolation("HeadYaw", 0.1, 60.0, True, _async=True))
            waiting.append(posture.goToPosture("Stand", 0.5, _async=True))
            waiting.append(motion.waitUntilMoveIsFinished(_async=True))
    calls = Calls(naoqi)
    for method in ("getAngles", "rest", "wakeUp", "stopMove", "killAll"):
        calls.start("ALMotion", method, ("Body", True) if method == "getAngles" else (), 4.0)
        calls.wait()
    assert calls.unanswered == []
    for call in waiting:
        call.wait(5000)
        assert call.isFinished()
