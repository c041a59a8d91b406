"""Pepper's drive server and its second process: whatever befalls one of them, the robot stops."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest
import qi
from naoqi_driver.onboard import drive_program
from naoqi_driver.onboard.last_stop import KILL_TIME, RESTART_PERIOD, START_TIME, LastStop
from onboard_pepper import Motion, OnboardServer, children, connections, drive


@pytest.mark.parametrize("end", [signal.SIGSTOP, signal.SIGKILL])
def test_a_server_that_freezes_or_dies_leaves_no_velocity_behind(folder, naoqi, motion, key, wait_until, end):
    server = OnboardServer(folder, f"tcp://127.0.0.1:{naoqi.port}")
    pilot = server.link(key)
    try:
        wait_until(lambda: motion.names() == ["stopMove", "killMove"], "the server has found NAOqi")
        drive(pilot, motion, wait_until)
        wait_until(lambda: connections(naoqi.port) == 2, "both are connected")
        drive(pilot, motion, wait_until)
        server.process.send_signal(end)
        wait_until(lambda: motion.names()[-2:] == ["stopMove", "killMove"], "the second process stops the robot")
    finally:
        pilot.close()
        server.kill()
    wait_until(lambda: connections(naoqi.port) == 0, "the second process ends with the first")


@pytest.mark.parametrize(("end", "befallen"), [(signal.SIGSTOP, "froze"), (signal.SIGKILL, "died")])
def test_a_second_process_that_freezes_or_dies_is_told_of_and_replaced(
    folder, naoqi, motion, key, wait_until, end, befallen
):
    server = OnboardServer(folder, f"tcp://127.0.0.1:{naoqi.port}")
    pilot = server.link(key)
    try:
        wait_until(lambda: motion.names() == ["stopMove", "killMove"], "the server has found NAOqi")
        wait_until(lambda: connections(naoqi.port) == 2, "both are connected")
        drive(pilot, motion, wait_until)
        (first,) = children(server.process.pid)
        os.kill(first, end)

        def told() -> bool:
            pilot.drive(0.2, 0.0, 0.1)
            report = pilot.report()[0]
            return report.state == "fault" and befallen in report.reason and report.given[0] == pytest.approx(0.2)

        wait_until(told, "the pilot is told, and drives on")
        wait_until(lambda: children(server.process.pid) not in ([], [first]), "another one is there")
        wait_until(lambda: connections(naoqi.port) == 2, "it is connected")
        motion.calls.clear()
        drive(pilot, motion, wait_until)
        server.process.send_signal(signal.SIGSTOP)
        wait_until(lambda: motion.names()[-2:] == ["stopMove", "killMove"], "it stops the robot")
    finally:
        pilot.close()
        server.kill()


def test_the_second_process_stops_the_robot_for_a_server_that_has_lost_naoqi(folder, naoqi, motion, wait_until):
    program = [sys.executable, "-S", str(folder / "drive_server.py"), "--qi-url", f"tcp://127.0.0.1:{naoqi.port}"]
    second, begun = LastStop([*program, "--last-stop"]), time.monotonic()

    def ready() -> bool:
        # While it moves, a test that is held up would stop it, too.
        assert not second.note(False, time.monotonic())
        return second._heard < time.monotonic() and second._ready > begun

    try:
        wait_until(ready, "the second process runs")
        second.stop()
        second.note(False, time.monotonic())
        wait_until(lambda: motion.names() == ["stopMove", "killMove"], "the robot is stopped")
    finally:
        second.close()


def test_a_server_ends_also_when_its_second_process_is_frozen(folder, naoqi, motion, wait_until):
    server = OnboardServer(folder, f"tcp://127.0.0.1:{naoqi.port}")
    wait_until(lambda: connections(naoqi.port) == 2, "both are connected")
    (second,) = children(server.process.pid)
    os.kill(second, signal.SIGSTOP)
    assert server.end() == 0
    assert not Path(f"/proc/{second}").exists()


@pytest.fixture
def held_up(folder, free_port, tmp_path, wait_until):
    """A second process that owes a stop: its server was held up, and NAOqi is not there until `begin_naoqi`."""
    port, session, said = free_port(), qi.Session(), tmp_path / "said"
    program = [sys.executable, "-S", str(folder / "drive_server.py"), "--qi-url", f"tcp://127.0.0.1:{port}"]
    said.touch()
    second = LastStop(["sh", "-c", f"exec {' '.join(program)} --last-stop >{said}"])

    def begin_naoqi() -> Motion:
        motion = Motion()
        session.listenStandalone(f"tcp://127.0.0.1:{port}")
        session.registerService("ALMotion", motion)
        return motion

    try:
        second.note(True, time.monotonic())  # and nothing more
        wait_until(lambda: "trying again" in said.read_text(), "there is no link")
        yield second, begin_naoqi
    finally:
        second.close()
        session.close()


def test_what_could_not_be_called_is_called_when_naoqi_is_there(held_up, wait_until):
    _, begin_naoqi = held_up
    motion = begin_naoqi()
    wait_until(lambda: motion.names() == ["stopMove", "killMove"], "the robot is stopped")


def test_a_stop_that_came_to_nothing_stops_nobody_who_drives_again(held_up, wait_until):
    """The server is back before the link."""
    second, begin_naoqi = held_up
    second.note(False, time.monotonic())
    motion = begin_naoqi()

    def ready_after(moment: float) -> bool:
        second.note(False, time.monotonic())
        return second._ready > moment

    begun = time.monotonic()
    wait_until(lambda: ready_after(begun), "it has a link")
    connected = time.monotonic()
    wait_until(lambda: ready_after(connected + 3.0 * KILL_TIME), "for longer than between two tries")
    assert motion.names() == []


def test_a_second_process_without_naoqi_is_no_safety(folder, free_port, wait_until):
    program = [sys.executable, "-S", str(folder / "drive_server.py"), "--qi-url", f"tcp://127.0.0.1:{free_port()}"]
    second = LastStop([*program, "--last-stop"])
    try:
        wait_until(lambda: not second.note(False, time.monotonic()) and second._heard < time.monotonic(), "it answers")
        now = time.monotonic()
        assert second.is_blind(now + START_TIME + 0.1, now) and not second.is_blind(now, now)
    finally:
        second.close()


def test_a_second_process_that_cannot_be_started_is_told_of_and_tried_again():
    second = LastStop(["/there is no such program"])
    assert second.note(False, 0.0) == "cannot be started (No such file or directory)"
    assert second.note(True, RESTART_PERIOD / 2.0) == "", "nothing new"
    second._command = ["sleep", "60"]
    assert second.note(True, RESTART_PERIOD) == "" and second._process.poll() is None
    second.close()


@pytest.fixture
def driving(folder, naoqi, motion, key, wait_until):
    """A server whose robot drives, with its second process connected; the pilot goes on with `drive`."""
    server = OnboardServer(folder, f"tcp://127.0.0.1:{naoqi.port}")
    pilot = server.link(key)
    try:
        wait_until(lambda: connections(naoqi.port) == 2, "both are connected")
        drive(pilot, motion, wait_until)
        yield server, pilot
    finally:
        pilot.close()
        server.kill()


def refused(port: int) -> None:
    """A stranger's datagram, of which the server says something."""
    with socket.socket(type=socket.SOCK_DGRAM) as stranger:
        stranger.sendto(b"?", ("127.0.0.1", port))


def fill(pipe: int) -> None:
    """Write into a pipe until it takes nothing more."""
    writer = os.open(f"/proc/self/fd/{pipe}", os.O_WRONLY | os.O_NONBLOCK)
    try:
        while True:
            os.write(writer, b"." * 512)
    except BlockingIOError:
        os.close(writer)


@pytest.mark.parametrize("nobody", ["closed", "full"])
@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGSTOP, signal.SIGTERM])
def test_an_output_that_nobody_reads_holds_up_no_stop(driving, motion, wait_until, nobody, end):
    server, pilot = driving
    if nobody == "closed":
        server.process.stdout.close()
    else:
        fill(server.process.stdout.fileno())

    def drives_on() -> bool:
        refused(server.port)
        motion.calls.clear()
        drive(pilot, motion, wait_until)
        return server.process.poll() is None

    deadline = time.monotonic() + 2.5  # two lines, a second apart
    wait_until(lambda: drives_on() and time.monotonic() > deadline, "it serves")
    server.process.send_signal(end)
    stops = ["stopMove"] if end is signal.SIGTERM else ["stopMove", "killMove"]
    wait_until(lambda: motion.names()[-len(stops) :] == stops, "the robot is stopped")
    if end is signal.SIGTERM:
        assert server.process.wait(10) == 0


def test_a_terminal_that_is_closed_ends_the_server_as_ctrl_c_does(driving, motion):
    server, _ = driving
    server.process.send_signal(signal.SIGHUP)
    assert server.process.wait(10) == 0
    assert motion.names()[-1] in ("stopMove", "killMove")


def test_nohup_keeps_it(folder, naoqi):
    with subprocess.Popen(
        ["nohup", sys.executable, "-S", str(folder / "drive_server.py"), "--port", "0",
         "--qi-url", f"tcp://127.0.0.1:{naoqi.port}"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
    ) as server:  # fmt: skip
        next(line for line in server.stdout if "listens" in line)
        server.send_signal(signal.SIGHUP)
        server.send_signal(signal.SIGTERM)
        assert server.wait(10) == 0


def test_a_server_that_breaks_stops_the_robot_first(monkeypatch, folder):
    ended: list[str] = []

    class Base:
        def __init__(self, *_parts: object) -> None:
            pass

        def end(self) -> None:
            ended.append("stopped")

    class Broken:
        address, port = "127.0.0.1", 1

        def __init__(self, *_parts: object) -> None:
            pass

        def run(self) -> int:
            raise OSError("no memory")

        def stop(self) -> None:
            pass

        def close(self) -> None:
            pass

    monkeypatch.setattr(signal, "signal", lambda *_: None)
    monkeypatch.setattr(drive_program, "come_first", lambda: None)
    monkeypatch.setattr(drive_program, "PepperBase", Base)
    monkeypatch.setattr(drive_program, "DriveServer", Broken)
    assert drive_program.main(["--qi-url", "tcp://192.0.2.1:9559"]) == 1
    assert ended == ["stopped"]
