"""One behaviour at a time drives: the next one begins when the one before has halted."""

import threading

import pytest

from pepper_sim.models import pepper_model
from pepper_sim.naoqi.motion.base import MotionBase
from pepper_sim.naoqi.motion_tasks import MotionTasks
from pepper_sim.naoqi.navigation import navigator as module
from pepper_sim.naoqi.navigation.navigator import Navigator
from pepper_sim.naoqi.tasks import Watch, Workers
from pepper_sim.robot import Pepper
from telepresence.sim.scene import build_world


@pytest.fixture
def navigator(monkeypatch):
    monkeypatch.setattr(module, "HALT_TIMEOUT", 60.0)
    robot = Pepper(build_world("empty", [pepper_model()]), None)
    watch, workers = Watch(), Workers()
    navigator = Navigator(robot, MotionBase(robot, watch, MotionTasks()), workers, lambda what, value: None)
    yield navigator
    navigator.close()
    watch.close()
    workers.close()


class Slow:
    """A behaviour that drives until it is closed, and needs a while to halt."""

    def __init__(self):
        self.drives, self.halts, self.may_end = threading.Event(), threading.Event(), threading.Event()

    def run(self):
        try:
            while True:
                self.drives.set()
                yield
        finally:
            self.halts.set()
            assert self.may_end.wait(10.0)


def test_a_behaviour_begins_when_the_one_it_replaces_has_halted(navigator):
    slow, following = Slow(), Slow()
    slow.may_end.set()
    answer = navigator.run(slow.run(), "stopped")
    assert slow.drives.wait(10.0)
    slow.may_end.clear()
    navigator.run(following.run())
    assert slow.halts.wait(10.0)
    assert not following.drives.wait(0.2), "the one before has not halted yet"
    slow.may_end.set()
    assert following.drives.wait(10.0) and answer.result(10.0) == "stopped"
    following.may_end.set()


def test_a_stop_is_over_when_the_robot_has_halted(navigator):
    assert navigator.stop().done(), "nothing runs"
    slow = Slow()
    navigator.run(slow.run())
    assert slow.drives.wait(10.0)
    stop, cancelled = navigator.stop(), navigator.stop()
    assert slow.halts.wait(10.0) and not stop.done()
    assert cancelled.cancel()
    following = Slow()
    navigator.run(following.run())
    assert not following.drives.wait(0.2), "what was stopped before halts, too"
    slow.may_end.set()
    assert stop.result(10.0) and following.drives.wait(10.0)
    following.may_end.set()


def test_a_behaviour_does_not_wait_for_ever(navigator, monkeypatch):
    monkeypatch.setattr(module, "HALT_TIMEOUT", 0.1)
    slow, following = Slow(), Slow()
    navigator.run(slow.run())
    assert slow.drives.wait(10.0)
    navigator.run(following.run())
    assert following.drives.wait(10.0)
    for behaviour in (slow, following):
        behaviour.may_end.set()


class Turnstile:
    """A lock; whoever leaves it first lets another caller pass before it goes on."""

    def __init__(self, another):
        self._lock, self._another = threading.Lock(), another

    def __enter__(self):
        self._lock.acquire()

    def __exit__(self, *_):
        self._lock.release()
        another, self._another = self._another, lambda: None
        another()


def test_of_two_callers_at_once_only_one_drives(navigator):
    first, second = Slow(), Slow()
    for behaviour in (first, second):
        behaviour.may_end.set()
    navigator._lock = Turnstile(lambda: navigator.run(second.run()))
    navigator.run(first.run())
    assert first.halts.wait(10.0) and second.drives.wait(10.0)
    assert not second.halts.is_set() and navigator.busy
    assert navigator.stop().result(10.0) and second.halts.wait(10.0)
