"""The whole station in use: the simulated Pepper and all its programs, a window manager, the window, and other windows
that want to drive, too. One station and one window serve the tests of this file; each can run alone."""

from __future__ import annotations

import itertools
import math
import os
import signal
import time
from pathlib import Path

import pytest
from window_station import PASSWORD, QUIET, ROOT, ROWS, SPEED, Desk, Station

from telepresence.station import processes
from telepresence.teleop.joystick import AXIS, BUTTON, EVENT

pytestmark = [pytest.mark.ros, pytest.mark.x11, pytest.mark.station]

PEOPLE = {"anna": ("pilot", 0), "ben": ("pilot", 0), "chief": ("pilot", 5), "will": ("watcher", 0)}
BACK = 0.4
"""Share of SPEED at which Pepper surely drives back: the gate allows half of it where only a sonar points."""
SLOW = 0.05
"""[m/s]"""
STANDS = 0.002
"""Metres that a standing robot may still move."""


@pytest.fixture(scope="module")
def station(tmp_path_factory, free_port, wait_until):
    station = Station(tmp_path_factory.mktemp("station"), PEOPLE, free_port, wait_until)
    try:
        station.start_master()
        ports = [f"{name}:={free_port()}" for name in ("nao_port", "drive_port", "page_port", "robot_page_port")]
        launch = str(ROOT / "launch" / "pepper.launch")
        station.start(
            "roslaunch",
            launch,
            "gui:=false",
            "terrain:=flat",
            "source:=test",
            "front_frame_rate:=8",
            "sign_in:=true",
            "page:=false",
            *ports,
        )
        station.start_tracking()
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
    desk = Desk(make_screen(station.environment, ROWS), place, "--gamepad", str(pad))
    yield desk
    desk.close()


@pytest.fixture(autouse=True)
def nothing_held(desk, station):
    """A test that failed leaves nothing pressed, and nobody else at the robot."""
    yield
    desk.screen.let_go()
    station.dismiss()


@pytest.fixture
def signed_in(desk, station, wait_until):
    """Sign in if nobody is, and wait for picture and terminal; the pad has the keyboard and the robot stands."""
    if desk.window.process.poll() is not None:
        desk.open()
    if "first picture" not in desk.window.output:
        wait_until(lambda: "/gui_ros_node" in station.probe("nodes"), "the window has joined the graph")
        desk.sign_in("anna")
    wait_until(lambda: "first picture" in desk.window.output, "the picture is shown")
    wait_until(lambda: "a key holds until the next one" in desk.window.terminal_text(), "the keyboard program runs")
    desk.show_page("terminalPage")
    desk.click("video")
    desk.set_speed(SPEED)
    wait_until(station.stands, "the robot stands")


def test_a_wrong_password_shows_nothing_and_the_right_one_everything(desk, station, wait_until):
    """A fresh window: whoever may have signed in before has ended theirs."""
    if desk.window.process.poll() is not None or "first picture" in desk.window.output:
        processes.end(desk.window.process, patience=10.0)
        desk.open()
    wait_until(lambda: "/gui_ros_node" in station.probe("nodes"), "the window has joined the graph")
    before = station.wrong_tries()
    desk.sign_in("anna", "wrong password")
    wait_until(lambda: station.wrong_tries() == before + 1, "the wrong password is counted")
    desk.key("w")
    assert station.subscriptions("/gui_ros_node") == []
    assert len(desk.window.family()) == 1, "no terminal"
    desk.key("ctrl+a")
    desk.screen.do("type", PASSWORD)
    desk.key("Return")
    wait_until(lambda: "first picture" in desk.window.output, "the picture is shown")
    wait_until(lambda: "a key holds until the next one" in desk.window.terminal_text(), "the keyboard program runs")


def test_the_window_does_without_opengl_and_keeps_no_program_of_its_terminal_from_it(signed_in, desk):
    """Qt loads it with the first window unless told otherwise, and with it a compiler of 40 MB."""
    window = desk.window.process.pid
    terminal = {*desk.window.family()} - {window}
    loaded = Path(f"/proc/{window}/maps").read_text()
    assert "libQt5Gui" in loaded and not [name for name in ("libGLX_mesa", "libLLVM", "_dri.so") if name in loaded]
    assert terminal and not [pid for pid in terminal if b"QT_XCB_GL" in Path(f"/proc/{pid}/environ").read_bytes()]


def test_a_held_key_drives_for_as_long_as_it_is_held_and_then_the_robot_stands(
    signed_in, desk, station, assert_held_key_drives
):
    """The pilot drives at a speed from which Pepper's brakes, 0.3 m/s each second, need less time than the 0.3 s."""
    desk.set_speed(SLOW)
    assert_held_key_drives(desk.screen, station.probe, "/truth", SLOW)


def test_two_keys_drive_diagonally(signed_in, desk, station, wait_until):
    station.probe("watch", "/cmd_vel", "geometry_msgs/Twist", ["linear.x", "linear.y"])
    station.probe("watch", "/movement_command", "std_msgs/Int32", ["data"])
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
    reported = [fields[0] for _, fields in station.probe("seen", "/movement_command")]
    assert set(reported) == {1, 0} and reported[-1] == 0, "the simulation guide's check shows it"


def test_said_sentences_postures_and_muting_reach_the_robot(signed_in, desk, station, wait_until):
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


def test_losing_the_focus_stops(signed_in, desk, station, wait_until):
    desk.screen.do("keydown", "s")
    wait_until(lambda: station.drives(BACK), "the robot drives back")
    other = processes.start(["xterm", "-name", "other"], env=desk.screen.environment, **QUIET)
    wait_until(station.stands, "the robot stands")
    desk.screen.do("keyup", "s")
    processes.end(other, patience=5.0)


def test_the_red_stop_holds_against_every_input_until_it_is_let_go(signed_in, desk, station, wait_until, pad):
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


def test_a_gamepad_drives_while_lb_is_held_and_stops_when_unplugged(signed_in, desk, station, wait_until, pad):
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


def test_button_0_held_restarts_the_simulation(signed_in, desk, station, wait_until, pad):
    wait_until(lambda: _drives_by_key(desk, station), "the robot is away from its start")
    writer = os.open(pad, os.O_WRONLY)
    os.write(writer, EVENT.pack(0, 0, BUTTON, 0))
    time.sleep(0.1)  # a press is a change
    os.write(writer, EVENT.pack(0, 1, BUTTON, 0))
    wait_until(lambda: math.dist(station.place(), station.origin) < 0.02, "the robot is back at its start")
    os.close(writer)


def test_another_pilot_sees_who_drives_and_a_watcher_cannot(signed_in, desk, station, wait_until):
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


def test_a_higher_rank_takes_over_and_gives_back(signed_in, desk, station, wait_until):
    desk.key("F3")
    chief = station.remote("chief")
    wait_until(lambda: chief.ask("state")["pilot"] == "anna" and chief.ask("state")["session"], "anna drives")
    chief.ask("ask", "take", "")
    wait_until(lambda: chief.ask("state")["mine"], "the higher rank has the robot")
    chief.ask("ask", "give", "/gui_ros_node")
    wait_until(lambda: chief.ask("state")["pilot"] == "anna", "and gives it back")
    chief.close()


def test_a_killed_window_stops_the_robot_and_another_goes_on(signed_in, desk, station, wait_until):
    """Pepper's brakes need 0.7 s of the second; the best of a few tries, as other programs hold up a busy machine."""
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
