"""Pepper's drive server: the one file that is copied to the robot, against an ALMotion that notes what it is asked."""

from __future__ import annotations

import importlib.util
import os
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
import qi
from naoqi_driver.onboard.last_stop import LastStop
from naoqi_driver.onboard.naoqi_link import is_near
from naoqi_driver.onboard.pepper_base import FAR_SPEED, far_motion, far_velocity
from python2_syntax import assert_python_2

from telepresence.drive.link import DriveLink
from telepresence.security.robot_key import RobotKey

ROBOT = Path(__file__).resolve().parents[4] / "catkin_ws" / "src" / "naoqi_driver_py" / "robot"


class Motion:
    """The part of ALMotion that drives, without physics: a motion or a stop ends when the test says so."""

    def __init__(self) -> None:
        self.calls: list[tuple] = []
        self.hangs = self.stands = False
        self._waiting: list[qi.Promise] = []

    def move(self, x: float, y: float, theta: float) -> qi.Future:
        self.calls.append(("move", round(x, 3), round(y, 3), round(theta, 3)))
        return self._later(not self.hangs)

    def moveTo(self, *arguments: object) -> qi.Future:
        self.calls.append(("moveTo", *arguments))
        return self._later(False)

    def stopMove(self) -> qi.Future:
        self.calls.append(("stopMove",))
        return self._later(self.stands)

    def killMove(self) -> None:
        self.calls.append(("killMove",))
        self.arrive(True)

    def moveIsActive(self) -> bool:
        return False

    def arrive(self, reached: bool) -> None:
        waiting, self._waiting = self._waiting, []
        for promise in waiting:
            promise.setValue(reached)

    def names(self) -> list[str]:
        """What was called, repetitions left out."""
        names = [call[0] for call in self.calls]
        return [name for name, before in zip(names, [None, *names], strict=False) if name != before]

    def _later(self, at_once: bool) -> qi.Future:
        promise = qi.Promise()
        if at_once:
            promise.setValue(True)
        else:
            self._waiting.append(promise)
        return promise.future()


@pytest.fixture(scope="module")
def maker():
    spec = importlib.util.spec_from_file_location("make_drive_server", ROBOT / "make_drive_server.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def folder(maker, tmp_path_factory) -> Path:
    made = tmp_path_factory.mktemp("pepper") / "onboard"
    assert maker.main([str(made)]) == 0
    return made


@pytest.fixture
def motion(naoqi) -> Motion:
    made = Motion()
    naoqi.register("ALMotion", made)
    return made


class Server:
    def __init__(self, folder: Path, url: str, *options: str, **environment: str) -> None:
        program = [sys.executable, "-S", str(folder / "drive_server.py"), "--qi-url", url, "--port", "0", *options]
        # Neither the vendor's packages nor ours beside it: all that it needs is in the file.
        self.process = subprocess.Popen(
            program, env={**os.environ, "PYTHONPATH": "", **environment}, stdout=subprocess.PIPE, text=True
        )
        self.port = int(self.process.stdout.readline().rpartition(":")[2])

    def link(self, key: RobotKey | None) -> DriveLink:
        return DriveLink(f"127.0.0.1:{self.port}", key)

    def kill(self) -> None:
        self.process.kill()
        self.process.wait(10)
        self.process.stdout.close()

    def end(self) -> int:
        self.process.send_signal(signal.SIGTERM)
        status = self.process.wait(10)
        self.process.stdout.close()
        return status


@pytest.fixture
def start(folder) -> Iterator:
    started: list[Server] = []

    def run(url: str, *options: str, **environment: str) -> Server:
        started.append(Server(folder, url, *options, **environment))
        return started[-1]

    yield run
    assert [each.end() for each in started] == [0] * len(started)


@pytest.fixture
def key(folder) -> RobotKey:
    return RobotKey.read(folder / "robot.key")


@pytest.fixture
def make_pilot(start, key, naoqi, motion, until_true) -> Iterator:
    made: list[DriveLink] = []

    def make(*options: str, **environment: str) -> DriveLink:
        made.append(start(f"tcp://127.0.0.1:{naoqi.port}", *options, **environment).link(key))
        until_true(lambda: state(made[-1]) == "no command", "the server has found NAOqi")
        until_true(lambda: motion.names() == ["stopMove", "killMove"], "what was left behind does not go on")
        motion.calls.clear()
        return made[-1]

    yield make
    for each in made:
        each.close()


def state(pilot: DriveLink) -> str:
    report = pilot.report()[0]
    return report.state if report else ""


def drive(pilot: DriveLink, motion: Motion, until_true, name: str = "move") -> None:
    def driven() -> bool:
        pilot.drive(0.2, 0.0, 0.1)
        return motion.calls[-1:] != [] and motion.calls[-1][0] == name

    until_true(driven, "the robot drives")


def test_what_runs_on_the_robot_is_also_python_2(maker):
    found = maker.modules([maker.PROGRAM], maker.SOURCES)
    assert {"telepresence.drive.pilots", "telepresence.security.signing", maker.PROGRAM} < set(found)
    for path in found.values():
        assert_python_2(path)
    compile(maker.one_file(), "drive_server.py", "exec")


def test_drives_brakes_hard_in_silence_and_gently_when_let_go(make_pilot, motion, until_true):
    pilot = make_pilot()
    drive(pilot, motion, until_true)
    assert motion.calls[-1] == ("move", 0.2, 0.0, 0.1)
    assert pilot.report()[0].allowed == ()
    pilot.release(hard=True)
    until_true(lambda: motion.names() == ["move", "stopMove", "killMove"], "not standing, it is stopped at once")
    motion.calls.clear()
    drive(pilot, motion, until_true)
    motion.stands = True
    pilot.release()
    until_true(lambda: motion.names() == ["move", "stopMove"], "it is let go")
    motion.calls.clear()
    drive(pilot, motion, until_true)
    motion.stands, pilot._session = False, None  # the pilot dies: no word more
    until_true(lambda: motion.names() == ["move", "stopMove", "killMove"], "nothing is heard from the pilot")


@pytest.mark.parametrize("end", [signal.SIGSTOP, signal.SIGKILL])
def test_a_server_that_freezes_or_dies_leaves_no_velocity_behind(folder, naoqi, motion, key, until_true, end):
    server = Server(folder, f"tcp://127.0.0.1:{naoqi.port}")
    pilot = server.link(key)
    try:
        until_true(lambda: motion.names() == ["stopMove", "killMove"], "the server has found NAOqi")
        drive(pilot, motion, until_true)
        until_true(lambda: connections(naoqi.port) == 2, "both are connected")
        drive(pilot, motion, until_true)
        server.process.send_signal(end)
        until_true(lambda: motion.names()[-2:] == ["stopMove", "killMove"], "the second process stops the robot")
    finally:
        pilot.close()
        server.kill()
    until_true(lambda: connections(naoqi.port) == 0, "the second process ends with the first")


@pytest.mark.parametrize(("end", "befallen"), [(signal.SIGSTOP, "froze"), (signal.SIGKILL, "died")])
def test_a_second_process_that_freezes_or_dies_is_told_of_and_replaced(
    folder, naoqi, motion, key, until_true, end, befallen
):
    server = Server(folder, f"tcp://127.0.0.1:{naoqi.port}")
    pilot = server.link(key)
    try:
        until_true(lambda: motion.names() == ["stopMove", "killMove"], "the server has found NAOqi")
        until_true(lambda: connections(naoqi.port) == 2, "both are connected")
        drive(pilot, motion, until_true)
        (first,) = children(server.process.pid)
        os.kill(first, end)

        def told() -> bool:
            pilot.drive(0.2, 0.0, 0.1)
            report = pilot.report()[0]
            return report.state == "fault" and befallen in report.reason and report.given[0] == pytest.approx(0.2)

        until_true(told, "the pilot is told, and drives on")
        until_true(lambda: children(server.process.pid) not in ([], [first]), "another one is there")
        until_true(lambda: connections(naoqi.port) == 2, "it is connected")
        motion.calls.clear()
        drive(pilot, motion, until_true)
        server.process.send_signal(signal.SIGSTOP)
        until_true(lambda: motion.names()[-2:] == ["stopMove", "killMove"], "it stops the robot")
    finally:
        pilot.close()
        server.kill()


def test_the_second_process_stops_the_robot_for_a_server_that_has_lost_naoqi(folder, naoqi, motion, until_true):
    program = [sys.executable, "-S", str(folder / "drive_server.py"), "--qi-url", f"tcp://127.0.0.1:{naoqi.port}"]
    second = LastStop([*program, "--last-stop"])

    def answers() -> bool:
        assert not second.note(False, time.monotonic())  # while it moves, a test that is held up would stop it, too
        return select.select([second._ours], [], [], 0)[0]

    try:
        until_true(answers, "the second process runs")
        second.stop()
        second.note(False, time.monotonic())
        until_true(lambda: motion.names() == ["stopMove", "killMove"], "the robot is stopped")
    finally:
        second.close()


def test_a_server_ends_also_when_its_second_process_is_frozen(folder, naoqi, motion, until_true):
    server = Server(folder, f"tcp://127.0.0.1:{naoqi.port}")
    until_true(lambda: connections(naoqi.port) == 2, "both are connected")
    (second,) = children(server.process.pid)
    os.kill(second, signal.SIGSTOP)
    assert server.end() == 0
    assert not Path(f"/proc/{second}").exists()


def children(pid: int) -> list[int]:
    return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def connections(port: int) -> int:
    """How many clients have a connection to a port of this machine, by /proc/net/tcp."""
    lines = Path("/proc/net/tcp").read_text().splitlines()[1:]
    return sum(line.split()[2].endswith(f":{port:04X}") and line.split()[3] == "01" for line in lines)


def test_an_almotion_that_hangs_gets_no_second_velocity_and_the_reports_go_on(make_pilot, motion, until_true):
    pilot = make_pilot()
    motion.hangs = True
    drive(pilot, motion, until_true)

    def reported() -> bool:
        pilot.drive(-0.2, 0.0, 0.0)
        return state(pilot) == "fault" and "has not answered move" in pilot.report()[0].reason

    until_true(reported, "the fault is reported")
    assert len(motion.calls) == 1
    pilot.release(hard=True)
    until_true(lambda: motion.names() == ["move", "stopMove", "killMove"], "silence brakes all the same")


def test_a_goal_is_reached_or_ended(make_pilot, motion, until_true):
    pilot = make_pilot()
    motion.stands = True
    pilot.go_to(0.5, 0.0, 1.0)
    until_true(lambda: pilot.goal_state() == "driving", "it drives there")
    until_true(lambda: motion.calls == [("moveTo", 0.5, 0.0, 1.0)], "once")
    motion.arrive(True)
    until_true(lambda: pilot.goal_state() == "reached", "it is reached")
    pilot.go_to(0.5, 0.0, 1.0)
    until_true(lambda: motion.names()[-1] == "moveTo" and pilot.goal_state() == "driving", "the next one")
    pilot.end_goal()
    until_true(lambda: motion.names()[-1] == "stopMove", "nobody wants it any more")


def test_stop_latches_until_it_is_reset_and_the_controls_are_let_go(make_pilot, motion, until_true):
    pilot = make_pilot()
    drive(pilot, motion, until_true)
    assert pilot.ask("stop").ok
    until_true(lambda: state(pilot) == "stopped" and motion.names()[-1] != "move", "it stops")
    assert pilot.ask("reset stop").ok
    pilot.drive(0.2, 0.0, 0.1)
    assert motion.names()[-1] != "move", "the key is still held"
    pilot.release()
    until_true(lambda: state(pilot) == "no command", "the key is let go")
    drive(pilot, motion, until_true)


def test_over_a_network_every_motion_ends_by_itself(make_pilot, motion, until_true):
    pilot = make_pilot("--far")
    drive(pilot, motion, until_true, "moveTo")
    x, y, theta, duration, _limits = [call for call in motion.calls if call[0] == "moveTo"][-1][1:]
    assert 0.0 < x < 0.1 and y == 0.0 and 0.0 < theta < 0.05 and 0.0 < duration < 1.0
    pilot.release()
    until_true(lambda: motion.names()[-1] in ("stopMove", "killMove"), "it is let go")
    assert "move" not in motion.names()
    pilot.go_to(1.0, 0.0, 0.0)
    until_true(lambda: "the goal" in pilot.report()[0].reason, "a long motion is refused")
    assert not any(call[1:2] == (1.0,) for call in motion.calls)


def test_a_far_velocity_keeps_its_direction_and_its_limit():
    assert far_velocity((0.4, 0.0, 0.2)) == pytest.approx((FAR_SPEED, 0.0, 0.2 * FAR_SPEED / 0.4))
    assert far_velocity((0.0, 0.0, 1.0)) == (0.0, 0.0, 1.0)
    x, _, _, duration, limits = far_motion((FAR_SPEED, 0.0, 0.0))
    assert x < FAR_SPEED * duration, "it is not driven at that speed to the end"
    assert dict(limits)["MaxVelXY"] == FAR_SPEED


def test_without_naoqi_it_says_so_and_gives_signs_of_life(start, key, free_port, tmp_path, until_true):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as station:
        station.bind(str(tmp_path / "notify"))
        station.settimeout(10)
        server = start(f"tcp://127.0.0.1:{free_port()}", NOTIFY_SOCKET=str(tmp_path / "notify"))
        assert station.recv(100) == b"WATCHDOG=1"
    stranger, pilot = server.link(None), server.link(key)
    try:
        until_true(lambda: state(pilot) == "fault" and "NAOqi is not reachable" in pilot.report()[0].reason, "a fault")
        until_true(lambda: "wants the robot's key" in stranger.problem, "nobody else gets in")
    finally:
        stranger.close()
        pilot.close()


def test_without_a_key_it_listens_on_loopback_only(folder, tmp_path):
    alone = tmp_path / "drive_server.py"
    alone.write_text((folder / "drive_server.py").read_text())
    refused = subprocess.run(
        [sys.executable, alone, "--address", "0.0.0.0"], capture_output=True, text=True, timeout=20
    )
    assert refused.returncode == 1
    assert "without a key nothing listens on 0.0.0.0" in refused.stderr


@pytest.mark.parametrize(("url", "near"), [("tcp://127.0.0.1:9559", True), ("tcp://10.0.0.7:9559", False)])
def test_what_is_near(url, near):
    assert is_near(url) is near


def test_an_address_that_is_none_is_refused():
    with pytest.raises(ValueError, match="tcp://HOST:9559"):
        is_near("pepper")
