"""The whole station with hands on it: the simulated Pepper and all its programs, a window manager, the window, and
other windows that want to drive, too. One station and one window serve all tests of this file, in its order."""

from __future__ import annotations

import contextlib
import itertools
import json
import math
import os
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

import pytest

from gui.users import Users
from telepresence import processes
from telepresence.pad_device import AXIS, BUTTON, EVENT
from telepresence.ros_master import master_answers, master_proxy

pytestmark = [pytest.mark.ros, pytest.mark.x11, pytest.mark.alone]

ROOT = Path(__file__).resolve().parents[2]
QUIET = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
PASSWORD = "correct horse"
SPEED = 0.2
PEOPLE = {"anna": ("pilot", 0), "ben": ("pilot", 0), "chief": ("pilot", 5), "will": ("watcher", 0)}
STOPPED = 0.01
"""[m/s]"""
BACK = 0.4
"""Share of SPEED at which Pepper surely drives back: the gate allows half of it where only a sonar looks."""
STEP, SLOW = 0.05, 0.05
"""[m/s]"""
STANDS = 0.002
"""Metres that a standing robot may still move."""


class Talker:
    """A program that answers each line of JSON with one."""

    def __init__(self, environment, *argv):
        self.process = processes.start(
            [sys.executable, *map(str, argv)], env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def ask(self, *words):
        self.process.stdin.write(json.dumps(words) + "\n")
        self.process.stdin.flush()
        return json.loads(self.process.stdout.readline())

    def close(self):
        if self.process.poll() is None:
            self.process.stdin.close()
        processes.end(self.process, patience=5.0)


class Station:
    """The running programs, and where the robot truly is."""

    def __init__(self, folder, free_port, wait_until):
        self.environment = {
            **os.environ,
            "ROS_MASTER_URI": f"http://127.0.0.1:{free_port()}",
            "ROS_HOME": str(folder / "ros"),
            "ROS_IP": "127.0.0.1",
            "TELEPRESENCE_USERS": str(folder / "users.db"),
        }
        self.users = Users(folder / "users.db")
        for name, (role, rank) in PEOPLE.items():
            self.users.add(name, PASSWORD, role, rank)
        uri = self.environment["ROS_MASTER_URI"]
        self._wait_until = wait_until
        self._running = [self._start("rosmaster", "--core", "-p", uri.rpartition(":")[2])]
        wait_until(lambda: master_answers(uri), "the ROS master answers")
        ports = [f"{name}:={free_port()}" for name in ("nao_port", "page_port")]
        launch = str(ROOT / "launch" / "pepper.launch")
        self._running.append(
            self._start("roslaunch", launch, "gui:=false", "terrain:=flat", "source:=test", "sign_in:=true", *ports)
        )
        self._probe = Talker(self.environment, ROOT / "tests" / "catkin_ws" / "ros_probe.py")
        self._remotes = []
        self.probe("watch", "/truth", "nav_msgs/Odometry", ["pose.pose.position.x", "pose.pose.position.y"])
        self.probe("watch", "/safety", "telepresence_1/SafetyState", ["state", "reason"])

    def _start(self, *argv):
        return processes.start(list(argv), env=self.environment, **QUIET)

    def probe(self, name, *arguments):
        return self._probe.ask(name, arguments)

    def wrong_tries(self):
        with contextlib.closing(sqlite3.connect(self.users.path)) as database:
            return database.execute("SELECT coalesce(sum(failed), 0) FROM tries").fetchone()[0]

    def heard_by(self, node):
        """Topics that a node has subscribed to."""
        _, _, (_, subscribers, _) = master_proxy(self.environment["ROS_MASTER_URI"], 5.0).getSystemState("/test")
        return [topic for topic, nodes in subscribers if node in nodes]

    def remote(self, name):
        """Another window, see remote_window.py."""
        talker = Talker(self.environment, Path(__file__).with_name("remote_window.py"), self.users.path, name)
        self._remotes.append(talker)
        return talker

    def dismiss(self):
        """End the other windows."""
        while self._remotes:
            self._remotes.pop().close()

    def track(self):
        """(time [s], x, y [m]) since the last `forget`."""
        return [(when, *place) for when, place in self.probe("seen", "/truth")]

    def forget(self):
        self.probe("forget", "/truth")

    def place(self):
        self.forget()
        return self._wait_until(self.track, "a pose")[-1][1:]

    def speed(self):
        """Over the next 0.2 s [m/s]."""
        self.forget()
        track = self._wait_until(
            lambda: (t := self.track()) and t[-1][0] - t[0][0] > 0.2 and t, "poses of a fifth of a second"
        )
        return math.dist(track[0][1:], track[-1][1:]) / (track[-1][0] - track[0][0])

    def stands(self):
        return self.speed() < STOPPED

    def drives(self, share=0.5):
        return self.speed() > SPEED * share

    def evidence(self):
        """For the report of a test that failed."""
        return "\n".join(f"{topic}: {self.probe('newest', topic)}" for topic in ("/truth", "/safety"))

    def close(self):
        self.dismiss()
        self._probe.close()
        for process in reversed(self._running):
            processes.end(process, patience=15.0)


@pytest.fixture(scope="module")
def station(tmp_path_factory, free_port, wait_until):
    station = Station(tmp_path_factory.mktemp("station"), free_port, wait_until)
    try:
        wait_until(station.track, "the simulated robot stands somewhere", timeout=60.0)
        station.origin = station.place()
        yield station
    finally:
        station.close()


@pytest.fixture(scope="module")
def pad(tmp_path_factory):
    """A pipe in place of /dev/input/js0: the kernel's events are plain bytes."""
    path = tmp_path_factory.mktemp("pad") / "js0"
    os.mkfifo(path)
    return path


@pytest.fixture(scope="module")
def desk(make_screen, station, pad, place):
    """A display with a window manager, and one window."""
    screen = make_screen(station.environment)
    manager = processes.start(["openbox", "--sm-disable"], env=screen.environment, **QUIET)
    desk = Desk(screen, pad, place)
    yield desk
    desk.screen.close()
    processes.end(manager, patience=5.0)


class Desk:
    def __init__(self, screen, pad, place):
        self.screen, self._pad, self._place = screen, pad, place
        self.open()

    def open(self):
        self.window = self.screen.open_window(
            "--tell", "--gamepad", str(self._pad), program=(sys.executable, "-m", "gui"), signed_in=False
        )

    def sign_in(self, name, password=PASSWORD):
        self.screen.do("key", "ctrl+a")
        self.screen.do("type", name)
        self.screen.do("key", "Return")
        self.screen.do("type", password)
        self.screen.do("key", "Return")

    def click(self, name, page="terminalPage"):
        self._click_at(self._place(name, page))

    def press_until(self, name, page, condition):
        """Press a button, and again after a while: a program that starts late has missed the first press."""
        for _ in range(4):
            self.click(name, page)
            deadline = time.monotonic() + 10.0
            while time.monotonic() < deadline:
                if condition():
                    return
                time.sleep(0.05)
        pytest.fail(f"{name} was pressed and has no effect")

    def show_page(self, page):
        self._click_at(self._place.tab(page))

    def _click_at(self, point):
        self.screen.do("mousemove", "--window", self.window.id, *point, "click", 1)

    def set_speed(self, speed):
        """By the keys, whatever it was before [m/s]."""
        self.key(*["Next"] * 8, *["Prior"] * (round(speed / STEP) - 1))

    def key(self, *keys):
        self.screen.do("key", *keys)

    def evidence(self):
        """For the report of a test that failed."""
        return self.screen.evidence()


@pytest.fixture(autouse=True)
def hands_off(desk, station):
    """A test that failed leaves nothing pressed, and nobody else at the robot."""
    yield
    desk.screen.let_go()
    station.dismiss()


def test_signed_out_shows_and_hears_nothing(desk, station, wait_until):
    wait_until(lambda: "/gui_ros_node" in station.probe("nodes"), "the window has joined the graph")
    desk.sign_in("anna", "wrong password")
    wait_until(lambda: station.wrong_tries() == 1, "the wrong password is counted")
    desk.key("w")
    assert station.heard_by("/gui_ros_node") == []
    assert len(desk.window.family()) == 1, "no terminal"


def test_signing_in_brings_the_picture_and_the_terminal(desk, station, wait_until):
    desk.key("ctrl+a")
    desk.screen.do("type", PASSWORD)
    desk.key("Return")
    wait_until(lambda: "first picture" in desk.window.output, "the picture is shown")
    wait_until(lambda: "a key holds until the next one" in desk.window.terminal_text(), "the keyboard program runs")
    desk.click("video")


def test_a_held_key_drives_for_as_long_as_it_is_held_and_then_the_robot_stands(
    desk, station, wait_until, assert_held_key_drives
):
    """At a speed from which Pepper's brakes, 0.3 m/s each second, need less time than the 0.3 s."""
    desk.set_speed(SLOW)
    wait_until(station.stands, "the robot stands")
    assert_held_key_drives(desk.screen, station.probe, "/truth", SLOW)
    desk.set_speed(SPEED)


def test_two_keys_drive_diagonally(desk, station, wait_until):
    station.probe("watch", "/cmd_vel", "geometry_msgs/Twist", ["linear.x", "linear.y"])
    begin = station.place()
    desk.screen.do("keydown", "w", "keydown", "a")

    def both_ways():
        x, y = station.place()
        return x - begin[0] > 0.05 and y - begin[1] > 0.05

    wait_until(both_ways, "the robot drives ahead and to the left")
    desk.screen.let_go()
    wait_until(station.stands, "the robot stands")
    given = [fields for _, fields in station.probe("seen", "/cmd_vel")]
    assert any(x == pytest.approx(y) and math.hypot(x, y) == pytest.approx(SPEED) for x, y in given), "45 degrees"
    assert all(math.hypot(x, y) <= SPEED + 1e-6 for x, y in given), "no faster than straight on"


def test_said_sentences_postures_and_muting_reach_the_robot(desk, station, wait_until):
    station.probe("watch", "/speech", "std_msgs/String", ["data"])
    station.probe("watch", "/joint_states", "sensor_msgs/JointState", ["name", "position"])
    station.probe("watch", "/voice/state", "std_msgs/String", ["data"])

    def shoulder():
        _, (names, positions) = wait_until(lambda: station.probe("newest", "/joint_states"), "joints are told")
        return positions[names.index("LShoulderPitch")]

    desk.show_page("robotPage")
    desk.click("sentence", "robotPage")
    desk.screen.do("type", "How do you do?")
    desk.click("sayButton", "robotPage")
    wait_until(lambda: (s := station.probe("newest", "/speech")) and s[1] == ["How do you do?"], "it is said")
    hanging = shoulder()
    desk.press_until("posture_zero", "robotPage", lambda: abs(shoulder() - hanging) > 0.5)
    desk.press_until("posture_stand", "robotPage", lambda: abs(shoulder() - hanging) < 0.1)

    desk.show_page("soundPage")
    wait_until(lambda: station.probe("seen", "/voice/state"), "sound runs, with a sound server or without")
    for button in ("muteSpeaker", "muteMicrophone"):
        for _ in range(2):
            station.probe("forget", "/voice/state")
            desk.click(button, "soundPage")
            wait_until(lambda: station.probe("seen", "/voice/state"), f"{button} is answered")
    desk.show_page("terminalPage")
    desk.click("video")


def test_losing_the_focus_stops(desk, station, wait_until):
    desk.show_page("terminalPage")
    desk.click("video")
    desk.screen.do("keydown", "s")
    wait_until(lambda: station.drives(BACK), "the robot drives back")
    other = processes.start(["xterm", "-name", "other"], env=desk.screen.environment, **QUIET)
    wait_until(station.stands, "the robot stands")
    desk.screen.do("keyup", "s")
    processes.end(other, patience=5.0)
    desk.click("video")


def test_the_red_stop_holds_against_every_input_until_it_is_let_go(desk, station, wait_until, pad):
    desk.click("video")
    desk.screen.do("keydown", "w")
    wait_until(station.drives, "the robot drives")
    desk.key("Escape")
    wait_until(station.stands, "the robot stands")
    desk.screen.do("keyup", "w")
    begin = station.place()
    station.probe("drive", SPEED, 0.0, 0.0)
    desk.screen.do("keydown", "w", "sleep", 0.5, "keyup", "w")
    station.probe("silence")
    assert math.dist(begin, station.place()) < 0.03
    desk.key("shift+Escape")
    wait_until(lambda: _drives_by_key(desk, station), "the robot drives again")


def _drives_by_key(desk, station):
    begin = station.place()
    desk.screen.do("keydown", "w", "sleep", 0.8, "keyup", "w")
    return math.dist(begin, station.place()) > 0.03


def test_a_gamepad_drives_while_lb_is_held_and_stops_when_unplugged(desk, station, wait_until, pad):
    writer = os.open(pad, os.O_WRONLY)

    def send(*events):
        os.write(writer, b"".join(EVENT.pack(0, value, kind, number) for kind, number, value in events))

    back = itertools.count(32767, -50)

    def pressing_drives():
        """A picture that came late lets go of the pad, which then wants a new press; a stick that never changes by a
        count is not believed to be in a hand."""
        send((BUTTON, 4, 0))
        time.sleep(0.1)  # a press is a change
        send((BUTTON, 4, 1), (AXIS, 1, next(back)))
        ends = time.monotonic() + 3.0
        while time.monotonic() < ends and not station.drives(BACK):
            time.sleep(0.05)
        return station.drives(BACK)

    send(*((BUTTON, button, 0) for button in range(11)), *((AXIS, axis, 0) for axis in range(8)))
    wait_until(station.stands, "the robot stands")
    send((AXIS, 1, next(back)))
    assert station.stands(), "nothing without LB"
    wait_until(pressing_drives, "LB and the stick drive")
    send((BUTTON, 4, 0))
    wait_until(station.stands, "the robot stands")
    wait_until(pressing_drives, "LB and the stick drive again")
    os.close(writer)
    wait_until(station.stands, "an unplugged pad stops")


def test_button_0_held_restarts_the_simulation(desk, station, wait_until, pad):
    assert math.dist(station.place(), station.origin) > 0.05
    writer = os.open(pad, os.O_WRONLY)
    os.write(writer, EVENT.pack(0, 0, BUTTON, 0))
    time.sleep(0.1)  # a press is a change
    os.write(writer, EVENT.pack(0, 1, BUTTON, 0))
    wait_until(lambda: math.dist(station.place(), station.origin) < 0.02, "the robot is back at its start")
    os.close(writer)


def test_another_pilot_sees_who_drives_and_a_watcher_cannot(desk, station, wait_until):
    ben, will = station.remote("ben"), station.remote("will")
    wait_until(lambda: ben.ask("state")["pilot"] == "anna", "the second pilot sees who drives")
    assert "anna drives" in ben.ask("state")["obstacle"]
    wait_until(lambda: ben.ask("state")["session"] and will.ask("state")["session"], "both have joined")
    ben.ask("ask", "take", "")
    wait_until(lambda: "asked to hand over" in str(ben.ask("state")["refused"]), "who drives is asked")

    begin = station.place()
    for window in (ben, will):
        window.ask("drive", SPEED, 0.0, 0.0)
    will.ask("ask", "take", "")
    wait_until(lambda: "may watch" in str(will.ask("state")["refused"]), "a watcher is refused")
    will.ask("steal", ben.ask("state")["session"])
    time.sleep(0.3)  # and all that it sends meanwhile moves nothing
    assert math.dist(begin, station.place()) < 0.01

    desk.key("F3")
    wait_until(lambda: ben.ask("state")["mine"], "the pilot has handed over")
    wait_until(station.drives, "and the other drives")
    ben.close()
    wait_until(station.stands, "who is gone drives no more")


def test_a_higher_rank_takes_over_and_gives_back(desk, station, wait_until):
    desk.key("F3")
    chief = station.remote("chief")
    wait_until(lambda: chief.ask("state")["pilot"] == "anna" and chief.ask("state")["session"], "anna drives")
    chief.ask("ask", "take", "")
    wait_until(lambda: chief.ask("state")["mine"], "the higher rank has the robot")
    chief.ask("ask", "give", "/gui_ros_node")
    wait_until(lambda: chief.ask("state")["pilot"] == "anna", "and gives it back")
    chief.close()


def test_a_killed_window_stops_the_robot_and_another_goes_on(desk, station, wait_until):
    """Of the second, Pepper's brakes need 0.7 s; the best of a few tries, as other programs hold up a busy machine."""
    stood = [math.inf]
    while min(stood) >= 1.0:
        assert len(stood) < 4, f"stands {stood[1:]} s after the kill"
        desk.click("video")
        key, share = ("w", 0.95) if len(stood) % 2 else ("s", BACK)
        desk.screen.do("keydown", key)
        wait_until(lambda share=share: station.drives(share), "the robot drives at full speed")
        family = desk.window.family()
        processes.send(desk.window.process.pid, signal.SIGKILL)
        killed = time.time()
        desk.window.process.wait(10)
        desk.screen.let_go()
        station.forget()
        wait_until(lambda end=killed + 2.0: (t := station.track()) and t[-1][0] > end, "a while later")
        track = station.track()
        stood.append(next(when for when, *place in track if math.dist(place, track[-1][1:]) < STANDS) - killed)
        wait_until(lambda family=family: not {*family} & {*processes.descendants()}, "its processes have ended")

        desk.open()
        desk.sign_in("anna")
        wait_until(lambda: "first picture" in desk.window.output, "the new window picks up the running robot")
    print(f"stands {stood[1:]} s after the kill")
    desk.click("video")
    wait_until(lambda: _drives_by_key(desk, station), "and drives it")
