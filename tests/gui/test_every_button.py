"""The way of the original window, by mouse: only the robot is there. The window's own buttons bring the ROS master and
the robot's programs, and every other button is pressed while all of that runs.

One window serves the tests of this file, and each brings it to where it needs it: signed in, with a master, with a
session, with a picture. So each can run alone, and in any order.
"""

from __future__ import annotations

import functools
import math
import time
from collections import Counter

import pytest
from window_session import FEED, PROGRAMS, Session
from window_station import ROWS, SPEED, Desk, Station

from gui.widgets.robot_panel import SENTENCES
from telepresence.station import processes
from telepresence.station.ros_master import master_answers
from telepresence.teleop.invitations import Invitations, beside

pytestmark = [pytest.mark.ros, pytest.mark.x11, pytest.mark.station]

LINE = "roslaunch pepper_bringup tele_pepper.launch nao_ip:=127.0.0.1 roscore_ip:=127.0.0.1"
CAPS = {
    "pad_forward": (1, 0, 0), "pad_backward": (-1, 0, 0), "pad_left": (0, 1, 0), "pad_right": (0, -1, 0),
    "pad_turn_left": (0, 0, 1), "pad_turn_right": (0, 0, -1),
}  # fmt: skip
"""Directions of vx, vy and wz (REP 103)."""
POSTURES = (
    ("posture_zero", "LShoulderPitch", True),
    ("posture_stand", "LShoulderPitch", False),
    ("posture_crouch", "KneePitch", True),
    ("posture_stand", "KneePitch", False),
    ("posture_rest", "KneePitch", True),
    ("posture_wakeup", "KneePitch", False),
)
"""Button, joint, and whether the joint is then elsewhere than in the posture Stand."""
SLIDER_HALF = 90
"""Pixels from the slider's middle to beyond its end."""
USUAL_TURN = 2.5 * SPEED
"""[rad/s]"""
GROUND = (4, 400)
"""A point outside all cards."""
TAB = 20
"""Pixels from the middle of a tab to below its underline, or to beside the mouse."""
FASTEST = 0.35
"""[m/s] of Pepper (NAOqi documentation, ALMotion)."""


@pytest.fixture(scope="module")
def station(tmp_path_factory, free_port, wait_until):
    station = Station(tmp_path_factory.mktemp("buttons"), {"anna": ("pilot", 0)}, free_port, wait_until)
    station.port, station.robot = free_port(), None
    station.environment["PULSE_SERVER"] = "unix:/nonexistent/socket"
    for port in ("DRIVE_PORT", "PAGE_PORT", "RTP_PORT"):
        station.environment[port] = str(free_port())
    station.environment["PILOT_CAMERA"] = "test"
    station.told = ("/truth", "/safety", "/drive/state", "/cmd_vel", "/speech")
    yield station
    station.close()


@pytest.fixture(scope="module")
def desk(make_screen, station, place):
    desk = Desk(make_screen(station.environment, ROWS), place, "--gamepad", "none", "--folder", str(station.folder))
    yield desk
    desk.close()


@pytest.fixture
def session(desk, station, wait_until):
    """The window as the test before has left it; afterwards nothing is held."""
    desk.pressed.clear()
    yield Session(desk, station, wait_until)
    desk.screen.let_go()


@pytest.fixture
def driving(session):
    """The session with a picture: the pad drives."""
    session.show_picture()
    session.desk.show_page("terminalPage")
    return session


@pytest.fixture
def given(station):
    """The newest command that the window has given: vx, vy [m/s], wz [rad/s]."""

    def newest():
        found = station.probe("newest", "/cmd_vel")
        return tuple(found[1]) if found else (0.0, 0.0, 0.0)

    return newest


def presses(*names):
    """Say which buttons a test presses, and let it fail if it does not."""

    def declare(test):
        @functools.wraps(test)
        def checked(**fixtures):
            test(**fixtures)
            session = fixtures.get("session") or fixtures["driving"]
            assert {*names} <= session.desk.pressed

        checked.presses = names
        return checked

    return declare


def choose(desk, name, page, *keys):
    """Take an entry of a list or menu that opens on a click."""
    desk.click(name, page)
    desk.screen.do("sleep", 0.3, "key", *keys, "Return")


def press_cap(session, cap):
    """Press a button of the pad for half a second, and return what the window gave meanwhile."""
    session.station.probe("forget", "/cmd_vel")
    session.desk.point_at(cap)
    session.desk.screen.do("mousedown", 1, "sleep", 0.5, "mouseup", 1)
    return [tuple(fields) for _, fields in session.station.probe("seen", "/cmd_vel") if any(fields)]


def driver(session):
    """Who drives, and who has stopped the robot."""
    found = session.station.probe("newest", "/drive/state")
    return found and found[1]


def take_the_robot(session):
    """Press F3 until the pilot drives: a press is lost on a window that is just closing a menu."""
    for _ in range(4):
        deadline = time.monotonic() + 8.0
        if driver(session) != ["anna", ""]:
            session.desk.key("F3")
        while time.monotonic() < deadline:
            if driver(session) == ["anna", ""]:
                return
            time.sleep(0.05)
    pytest.fail(f"F3 was pressed and {driver(session)} drives")


def test_signing_in_opens_the_terminal(session):
    session.sign_in()
    assert session.desk.window.terminal_text().strip()


@presses("roscoreButton")
def test_roscore_start_brings_the_original_programs(session, wait_until):
    session.sign_in()
    desk, station = session.desk, session.station
    if not master_answers(station.master_uri):
        session.start_master()
        wait_until(lambda: "started core service" in desk.window.terminal_text("roscore"), "the terminal shows roscore")
        wait_until(lambda: LINE in desk.window.output, "the report's line is typed")
        wait_until(lambda: "then press Session start" in desk.window.output, "the window says what to do next")
    session.start()
    desk.click("roscoreButton")
    wait_until(lambda: "run already" in desk.window.output, "pressed again, it leaves everything alone")
    assert {*station.probe("nodes")} >= PROGRAMS


@presses("sessionButton")
def test_session_start_connects_and_says_with_what(session, wait_until, album):
    session.start()
    desk, station = session.desk, session.station
    wait_until(lambda: station.probe("newest", "/com_cam/status"), "the page is served")
    desk.click("sessionButton")
    wait_until(lambda: "Connected to Pepper: camera, " in desk.window.output, "it says what it has found")
    if "first picture" not in desk.window.output:
        status = lambda: station.probe("newest", "/com_cam/status")[1][0]  # noqa: E731
        wait_until(lambda: status().endswith("; not on the tablet: switched off"), f"not before Robot feed: {status()}")
        desk.click("terminalFrame")
        wait_until(desk.window.terminal_has_keyboard, "the terminal has the keyboard")
        desk.screen.photograph(album / "window_keys.png", desk.window.id)
        desk.key("F6")


@presses("sessionButton")
def test_session_start_alone_brings_the_programs_up(session):
    session.start_robot()
    session.stop()
    before = session.desk.window.output.count(LINE)
    session.start()
    assert session.desk.window.output.count(LINE) == before + 1
    assert {*session.station.probe("nodes")} >= PROGRAMS


@presses("feedButton")
def test_robot_feed_shows_the_camera_and_begins_the_conversation(driving, wait_until):
    desk, station = driving.desk, driving.station

    def shown_and_heard():
        page, sound = (station.probe("newest", topic)[1][0] for topic in ("/com_cam/status", "/voice/state"))
        return page.startswith("Live; on the tablet"), sound != "no conversation"

    wait_until(lambda: shown_and_heard() == (True, True), "it has begun the conversation")
    desk.click("feedButton")
    wait_until(lambda: FEED not in station.subscriptions("/gui_ros_node"), "nobody asks for pictures")
    wait_until(lambda: shown_and_heard() == (False, False), "the conversation has ended, too")
    desk.click("feedButton")
    wait_until(lambda: FEED in station.subscriptions("/gui_ros_node"), "it is shown again")
    wait_until(lambda: shown_and_heard() == (True, True), "and the conversation goes on")
    for keys, other in ((("Down",), "bottom"), (("Down",), "depth"), (("Up", "Up"), "front")):
        choose(desk, "cameraChoice", "terminalPage", *keys)
        wait_until(
            lambda other=other: f"/pepper_robot/camera/{other}/image_raw" in station.subscriptions("/gui_ros_node"),
            f"the camera {other}",
        )


@presses("menuButton", "takeButton")
def test_leaving_the_robot_and_taking_it(driving, wait_until):
    desk = driving.desk
    take_the_robot(driving)
    choose(desk, "menuButton", "terminalPage", "Down")
    wait_until(lambda: driver(driving) == ["", ""], "nobody drives")
    assert press_cap(driving, "pad_turn_left") == []
    desk.click("takeButton")
    wait_until(lambda: driver(driving) == ["anna", ""], "the robot is taken")
    desk.screen.do("key", "F2", "sleep", 0.3, "key", "Down", "Return")
    wait_until(lambda: driver(driving) == ["", ""], "the menu has a key, too")
    take_the_robot(driving)


@presses("inviteButton")
def test_inviting(driving, wait_until):
    desk = driving.desk
    take_the_robot(driving)
    invitations = Invitations(beside(driving.station.users.path))
    invitations.set_page("https://127.0.0.1:8443/")
    desk.click("inviteButton")
    wait_until(lambda: desk.screen.do("search", "--onlyvisible", "--name", "^Invite somebody$"), "the links' window")
    desk.screen.do("search", "--sync", "--onlyvisible", "--name", "^Invite somebody$", "windowfocus", "--sync")
    desk.screen.do("key", "Return")
    wait_until(lambda: [(one.role, one.maker) for one in invitations.all()] == [("watcher", "anna")], "a link")
    desk.screen.do("key", "Escape")
    desk.click("video")  # the keys come back to the window


@presses(*CAPS)
def test_the_pads_caps_drive_while_they_are_pressed(driving, wait_until, given):
    take_the_robot(driving)
    driving.desk.set_speed(SPEED)
    for cap, direction in CAPS.items():
        driving.desk.point_at(cap)
        driving.desk.screen.do("mousedown", 1)
        wanted = tuple(sign * size for sign, size in zip(direction, (SPEED, SPEED, USUAL_TURN), strict=True))
        wait_until(lambda wanted=wanted: given() == pytest.approx(wanted), f"{cap} gives {wanted}")
        driving.desk.screen.do("mouseup", 1)
        wait_until(lambda: not any(given()), "the release stops")


@presses("padStop")
def test_the_slider_and_the_pads_stop(driving, wait_until, given):
    desk = driving.desk
    take_the_robot(driving)
    fastest = pytest.approx((FASTEST, 0.0, 0.0))

    def drag():
        desk.set_speed(SPEED)
        desk.point_at("speedSlider")
        desk.screen.do("mousedown", 1, "sleep", 0.1, "mousemove_relative", SLIDER_HALF, 0, "sleep", 0.1, "mouseup", 1)
        return fastest in press_cap(driving, "pad_forward")

    wait_until(drag, "the slider is at its end")
    desk.point_at("pad_turn_left")
    desk.screen.do("keydown", "q")
    wait_until(lambda: given()[2] > 0.0, "the robot turns")
    desk.click("padStop")
    wait_until(lambda: not any(given()), "the pad's stop stops")
    desk.screen.do("keyup", "q")
    desk.set_speed(SPEED)


@presses("redStop")
def test_the_red_stop_is_pressed_and_let_go(driving, wait_until):
    take_the_robot(driving)
    driving.desk.click("redStop")
    wait_until(lambda: driver(driving) == ["anna", "anna"], "the robot is stopped")
    assert press_cap(driving, "pad_forward") == []
    driving.desk.screen.do("sleep", 1.0)  # a second press within a second is fear, not intent
    driving.desk.click("redStop")
    wait_until(lambda: driver(driving) == ["anna", ""], "it is let go")
    wait_until(lambda: press_cap(driving, "pad_forward"), "and driven")


@presses("lookCentre", "lookWay")
def test_looking_around(driving, wait_until):
    desk, station = driving.desk, driving.station
    take_the_robot(driving)
    station.probe("watch", "/head/state", "telepresence_msgs/HeadState", ["yaw"])

    def yaw():
        found = station.probe("newest", "/head/state")
        return found[1][0] if found else math.nan

    def drag():
        desk.screen.do("mousemove", "--window", desk.window.id, *desk.find("video"), "mousedown", 1)
        for _ in range(5):
            desk.screen.do("mousemove_relative", 20, 0)
        desk.screen.do("mouseup", 1, "sleep", 0.5)
        return yaw() > 0.1

    wait_until(drag, "dragging the picture to the right turns the head left")
    desk.click("lookCentre")
    wait_until(lambda: abs(yaw()) < 0.05, "straight ahead again")
    desk.click("lookWay")
    press_cap(driving, "pad_turn_right")
    wait_until(lambda: yaw() < -0.1 or not press_cap(driving, "pad_turn_right"), "the head looks into the turn")
    desk.click("lookWay")
    desk.screen.do("keydown", "l", "sleep", 0.3, "keyup", "l")
    wait_until(lambda: yaw() < -0.1, "a key turns it")
    desk.key("h")
    wait_until(lambda: abs(yaw()) < 0.05, "and another one back")


@presses("snapshotButton", "recordButton")
def test_snapshot_and_record(driving, wait_until):
    desk, station = driving.desk, driving.station
    take_the_robot(driving)
    before = {*station.folder.iterdir()}

    def new(pattern):
        return {*station.folder.glob(pattern)} - before

    desk.click("snapshotButton")
    wait_until(lambda: new("*.png"), "the picture is saved")
    desk.click("recordButton")
    wait_until(lambda: any(node.startswith("/record") for node in station.probe("nodes")), "the recording runs")
    for cap in ("pad_turn_left", "pad_turn_right"):
        # On a busy machine the start of a recording delays a picture, and nothing drives until it has come.
        wait_until(functools.partial(press_cap, driving, cap), "the robot is driven")
    desk.click("recordButton")
    wait_until(lambda: new("*.bag") and new("*.html"), "the report is written")


@presses("sayButton", *(f"say_{index}" for index in range(len(SENTENCES))))
def test_sentences(driving):
    desk, station = driving.desk, driving.station
    desk.show_page("robotPage")

    def write():
        desk.click("sentence", "robotPage")
        desk.key("ctrl+a")
        desk.screen.do("type", "How do you do?")

    def said(sentence):
        heard = station.probe("newest", "/speech")
        return heard and heard[1] == [sentence]

    desk.press_until("sayButton", "robotPage", lambda: said("How do you do?"), prepare=write)
    for index, sentence in enumerate(SENTENCES):
        desk.press_until(f"say_{index}", "robotPage", lambda sentence=sentence: said(sentence))


@presses(*(button for button, *_ in POSTURES))
def test_postures(driving, wait_until):
    desk, station = driving.desk, driving.station
    desk.show_page("robotPage")

    def joints():
        _, (names, positions) = wait_until(lambda: station.probe("newest", "/joint_states"), "joints are known")
        return dict(zip(names, positions, strict=True))

    standing = joints()
    for button, joint, moved in POSTURES:
        desk.press_until(
            button,
            "robotPage",
            lambda joint=joint, moved=moved: (abs(joints()[joint] - standing[joint]) > math.radians(20)) is moved,
        )


@presses("muteMicrophone", "muteSpeaker", "talkButton")
def test_sound(driving, wait_until):
    desk, station = driving.desk, driving.station
    desk.show_page("soundPage")

    def settings(index):
        return wait_until(lambda: station.probe("newest", "/voice/settings"), "the settings are known")[1][index]

    for index, button in enumerate(("muteMicrophone", "muteSpeaker")):
        for muted in (not settings(index), settings(index)):
            desk.press_until(button, "soundPage", lambda index=index, muted=muted: settings(index) is muted)
    for index, choice in ((2, "microphoneChoice"), (3, "speakerChoice")):
        for key, device in (("Down", "none"), ("Up", "auto")):
            choose(desk, choice, "soundPage", key)
            wait_until(lambda index=index, device=device: settings(index) == device, f"{choice}: {device}")
    station.probe("forget", "/voice/state")
    desk.point_at("talkButton", "soundPage")
    desk.screen.do("mousedown", 1)
    wait_until(lambda: station.probe("seen", "/voice/state"), "holding it is answered")
    station.probe("forget", "/voice/state")
    desk.screen.do("mouseup", 1)
    wait_until(lambda: station.probe("seen", "/voice/state"), "letting go is answered")


def test_the_tablets_picture(driving, wait_until, album):
    desk = driving.desk
    desk.show_page("tabletPage")
    wait_until(lambda: "/tablet/image_raw" in driving.station.subscriptions("/gui_ros_node"), "it is subscribed to")
    x, y = desk.find("tablet", "tabletPage")
    wait_until(lambda: len({desk.colour(x + step, y) for step in range(-60, 60, 3)}) > 5, "its picture is seen")
    desk.screen.photograph(album / "window_tablet.png", desk.window.id)


@presses("padChip", "foldButton", "themeButton")
def test_gamepad_page_fold_and_theme(driving, wait_until):
    desk = driving.desk
    desk.show_page("tabletPage")
    x, y = desk.find("terminalFrame")

    def in_front(page):
        """Whether the tab of this page is underlined, in blue, beside the mouse's arrow."""
        across, down = desk.find.tab(page)
        colours = [desk.colour(across - TAB, below) for below in range(down, down + TAB)]
        return any(blue > 2 * red for red, _, blue in colours)

    def ground():
        """What is behind the writing there, whatever programs write meanwhile."""
        ((colour, _),) = Counter(desk.colour(x + 7 * i, y + 7 * j) for i in range(5) for j in range(5)).most_common(1)
        return colour

    wait_until(lambda: in_front("tabletPage") and not in_front("terminalPage"), "the tablet is in front")
    desk.show_page("terminalPage")
    wait_until(lambda: in_front("terminalPage"), "the terminal is in front")
    terminal = ground()
    desk.click("padChip")
    wait_until(lambda: not in_front("terminalPage"), "the gamepad's page is in front")
    desk.show_page("terminalPage")
    wait_until(lambda: in_front("terminalPage"), "the terminal is in front")
    desk.click("foldButton")
    wait_until(lambda: ground() != terminal, "the deck is folded away")
    desk.key("F4")
    wait_until(lambda: ground() == terminal, "and back")
    dark = desk.colour(*GROUND)
    desk.click("themeButton")
    wait_until(lambda: sum(desk.colour(*GROUND)) > sum(dark) + 300, "the window is light")
    desk.click("themeButton")
    wait_until(lambda: desk.colour(*GROUND) == dark, "the window is dark again")


def test_typing_in_the_terminal_drives(driving, wait_until):
    desk = driving.desk
    desk.click("terminalFrame")
    wait_until(desk.window.terminal_has_keyboard, "the terminal has the keyboard")
    desk.window.type_until("i", driving.station.drives, "the robot drives")
    desk.key("k")
    wait_until(driving.station.stands, "the robot stands")


@presses("stopButton")
def test_stop_ends_the_session_and_the_robot_stands(driving, wait_until):
    desk, station = driving.desk, driving.station
    desk.click("terminalFrame")
    wait_until(desk.window.terminal_has_keyboard, "the terminal has the keyboard")
    desk.window.type_until("i", station.drives, "the robot drives")
    driving.stop()
    wait_until(station.stands, "the robot stands")
    wait_until(lambda: desk.window.terminal_text().rstrip().endswith("$"), "the terminal is at the prompt")
    assert master_answers(station.master_uri), "the master is not part of the session"


@presses("exitButton")
def test_exit_takes_along_what_was_started_here(session, wait_until):
    session.start_robot()
    desk, station = session.desk, session.station
    family = desk.window.family()
    station.end_tracking()
    desk.click("exitButton")
    assert desk.window.process.wait(20) == 0
    wait_until(lambda: not {*family} & {*processes.descendants()}, "nothing of the window is left")
    wait_until(lambda: not master_answers(station.master_uri), "the master is gone")


def test_every_button_is_pressed_by_a_test_of_this_file(place):
    pressed = {name for test in globals().values() for name in getattr(test, "presses", ())}
    assert place.buttons() <= pressed
