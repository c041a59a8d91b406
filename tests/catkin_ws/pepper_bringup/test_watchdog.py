from __future__ import annotations

import importlib.util
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest
import qi
from naoqi_driver.base import HEARTBEAT_KEY
from python2_syntax import assert_python_2

PATH = Path(__file__).resolve().parents[3] / "catkin_ws" / "src" / "pepper_bringup" / "robot" / "watchdog.py"


@pytest.fixture(scope="module")
def watchdog():
    spec = importlib.util.spec_from_file_location("watchdog", PATH)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_key_is_the_one_the_driver_writes(watchdog):
    assert watchdog.KEY == HEARTBEAT_KEY


def test_patience_is_longer_than_a_cycle_of_the_driver_and_leaves_time_to_brake(watchdog):
    assert watchdog.PATIENCE == 0.6
    assert watchdog.PATIENCE + watchdog.PERIOD + watchdog.BRAKING_TIME < 1.0


def test_a_beating_heart_is_left_alone(watchdog):
    heart = watchdog.Heartbeat()
    assert not any(heart.has_stopped(beat, beat * 0.05) for beat in range(1, 100))


def test_a_silent_heart_is_noticed_after_the_patience(watchdog):
    heart = watchdog.Heartbeat()
    assert not heart.has_stopped(7, 10.0)
    assert not heart.has_stopped(7, 10.6)
    assert heart.has_stopped(7, 10.61)


@pytest.mark.parametrize("beat", [0, None])
def test_a_robot_that_nobody_holds_is_left_alone(watchdog, beat):
    heart = watchdog.Heartbeat()
    assert not any(heart.has_stopped(beat, float(now)) for now in range(100))


def test_a_new_driver_starts_a_new_life(watchdog):
    heart = watchdog.Heartbeat()
    heart.has_stopped(900, 0.0)
    assert heart.has_stopped(900, 2.0)
    assert not heart.has_stopped(1, 2.05)


def test_syntax_is_also_python_2():
    assert_python_2(PATH)


class Motion:
    def __init__(self, stands_at_once: bool) -> None:
        self.calls: list[str] = []
        self.called = threading.Event()
        self._stands_at_once = stands_at_once

    def stopMove(self) -> qi.Future:
        self.calls.append("stopMove")
        self._promise = qi.Promise()
        if self._stands_at_once:
            self._promise.setValue(True)
            self.called.set()
        return self._promise.future()

    def killMove(self) -> None:
        self.calls.append("killMove")
        self._promise.setValue(True)
        self.called.set()


class Memory:
    def __init__(self) -> None:
        self.beat: object = None

    def getListData(self, keys: list[str]) -> list:
        assert keys == [HEARTBEAT_KEY]
        return [self.beat]

    def insertData(self, key: str, value: object) -> None:
        assert key == HEARTBEAT_KEY
        self.beat = value


@pytest.fixture
def dog(naoqi, run_program):
    def start() -> subprocess.Popen:
        url = f"tcp://127.0.0.1:{naoqi.port}"
        return run_program(sys.executable, PATH, "--qi-url", url, "__name:=watchdog", stderr=subprocess.PIPE, text=True)

    return start


@pytest.mark.parametrize(("stands_at_once", "calls"), [(True, ["stopMove"]), (False, ["stopMove", "killMove"])])
def test_stops_once_and_lets_go(naoqi, dog, wait_until, stands_at_once, calls):
    motion, memory = Motion(stands_at_once), Memory()
    naoqi.register("ALMotion", motion)
    naoqi.register("ALMemory", memory)
    memory.beat = 41
    dog()
    assert motion.called.wait(20)
    wait_until(lambda: memory.beat == 0, "the watchdog lets go")
    assert motion.calls == calls


def test_waits_for_the_robot_and_says_so_once(naoqi, run_program, free_port, wait_until):
    port = free_port()
    process = run_program(sys.executable, PATH, f"--qi-url=tcp://127.0.0.1:{port}", stderr=subprocess.PIPE, text=True)
    line = next(line for line in process.stderr if "watchdog" in line)
    assert f"no link to the robot at tcp://127.0.0.1:{port}: Connect error: 111: Connection refused" in line
    process.send_signal(signal.SIGINT)
    assert process.wait(10) == 0
