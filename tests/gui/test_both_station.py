"""Both simulated robots in one world and the window with a tab for each: driving to a place in the picture, a frozen
camera, recording. One station and one window serve the tests of this file; each brings its robot to the front first, so
that it can run alone.

Every state of the window is photographed on the way. With SCREENSHOTS=docs ./stack test tests/gui/test_both_station.py
the pictures go to docs/, else to a temporary folder.
"""

import json
import math
import os
import signal
import subprocess
import sys
import textwrap
import time
from functools import partial
from pathlib import Path

import av
import pytest
import socket_table
from repeated_presses import press_until
from window_station import PASSWORD, ROOT, Station

from gui.terminal.terminal_parts import listener
from gui.terminal.tmux import Tmux
from telepresence.station import processes

pytestmark = [pytest.mark.ros, pytest.mark.x11, pytest.mark.station]

NEAR = 0.25
"""[m] from the floor point at which the robot must end."""
HEADER_CLICK = {"pepper": (50, 27), "robotino": (125, 27)}
"""Tabs of the robots."""
SLOWEST, USUAL, FAST = 0.05, 0.2, 0.35
"""[m/s] on the slider; the slowest is one of its steps."""
TOLD = ("/truth", "/rto3/truth", "/safety", "/rto3/safety")
GROUND = (4, 400)
"""A point outside all cards."""
FOCAL_LENGTH, CAMERA_AHEAD, CAMERA_HEIGHT = 526.4, 0.11, 0.303
"""Robotino's camera at 640x480 [px], and where it stands level in base_link [m] (robotino.urdf)."""


class BothStation(Station):
    """Both robots and all their programs."""

    told = TOLD

    def start_everything(self, free_port):
        self.start_master()
        names = (
            "nao_port",
            "page_port",
            "robot_page_port",
            "robotino_port",
            "pepper_drive_port",
            "drive_port",
            "camera_port",
            "sound_port",
        )
        self.ports = {name: free_port() for name in names}
        ports = [f"{name}:={port}" for name, port in self.ports.items()]
        self.launch = self.start(
            "roslaunch", str(ROOT / "launch" / "both.launch"), "gui:=false", "teleop:=false", "source:=test",
            "front_frame_rate:=8", "sign_in:=true", "voice:=false", "page:=false", *ports,
        )  # fmt: skip

    def watch(self):
        pose = ["pose.pose.position.x", "pose.pose.position.y", "pose.pose.orientation.z", "pose.pose.orientation.w"]
        for topic in TOLD[:2]:
            self.probe("watch", topic, "nav_msgs/Odometry", pose)
        for topic in TOLD[2:]:
            self.probe("watch", topic, "telepresence_msgs/SafetyState", ["state", "reason"])
        for topic in TOLD:
            self.wait_until(lambda topic=topic: self.newest(topic), f"{topic} is told", timeout=90.0)

    def newest(self, topic):
        """Fields of the last message; None before the first."""
        found = self.probe("newest", topic)
        return found and found[1]

    def pose(self, topic):
        """x, y [m], heading [rad] in the world."""
        x, y, z, w = self.newest(topic)
        return x, y, 2.0 * math.atan2(z, w)

    def camera_node(self):
        """Process of Pepper's front camera."""
        for pid in processes.descendants(self.launch.pid):
            command = Path(f"/proc/{pid}/cmdline").read_bytes().decode().replace("\0", " ").split()
            if "__name:=front" in command:
                return pid
        pytest.fail("Pepper's front camera does not run")


@pytest.fixture(scope="module")
def station(tmp_path_factory, free_port, wait_until):
    folder = tmp_path_factory.mktemp("both")
    station = BothStation(folder, {"anna": ("pilot", 0)}, free_port, wait_until)
    station.environment["XDG_CONFIG_HOME"] = str(folder / "config")
    station.kept = folder / "kept"
    try:
        station.start_everything(free_port)
        station.start_tracking()
        yield station
    finally:
        station.close()


@pytest.fixture(scope="module")
def screen(make_screen, station):
    return make_screen(station.environment)


@pytest.fixture(autouse=True)
def nothing_held(screen):
    """A test that failed leaves nothing pressed."""
    yield
    screen.let_go()


WHERE = textwrap.dedent("""
    import json, sys
    from PyQt5.QtCore import QPoint
    from PyQt5.QtWidgets import QApplication, QWidget
    application = QApplication(sys.argv)
    application.setStyle("Fusion")
    from gui import theme
    from gui.__main__ import leave, parse, make_tabs
    from gui.settings import Settings
    from gui.ros.node import RosNode
    from gui.ros.readings import Careful
    from gui.app.tabs import RobotTabs
    theme.apply("dark")
    tabs = make_tabs(RosNode(), parse(sys.argv[1:]), Settings(None))
    shell = RobotTabs([(tab.title, tab.window) for tab in tabs])
    shell.show_on_screen()
    page, places = shell.pages[0], {}
    page.health.show_picture(0.1, 15.0)
    def note(name, widget):
        corner = widget.mapTo(shell, QPoint(0, 0))
        places[name] = (corner.x(), corner.y(), widget.width(), widget.height())
    for _ in range(50):
        application.processEvents()
    for widget in page.findChildren(QWidget):
        note(widget.objectName(), widget)
    page.gate.show_reading(Careful(True, True))  # on Robotino's page only; it makes the picture lower
    for _ in range(50):
        application.processEvents()
    note("video of robotino", page.video)
    print(json.dumps(places))
    leave(0)
""")
"""A window of the same kind on the same screen, with the same fonts, prints where its widgets are."""
FEEDS = ("--feed", "/pepper_robot/camera/front/image_raw", "image_raw")


@pytest.fixture(scope="module")
def areas(screen):
    """Name of a widget -> left, top, width, height [px]."""
    told = subprocess.run(
        [sys.executable, "-c", WHERE, "--profile", "both", "--gamepad", "none", *FEEDS],
        env=screen.environment, cwd=ROOT, capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert told.returncode == 0, told.stderr
    return json.loads(told.stdout.splitlines()[-1])


@pytest.fixture(scope="module")
def place(areas):
    """Middle of a widget [px]."""

    def find(name):
        left, top, width, height = areas[name]
        return left + width // 2, top + height // 2

    return find


@pytest.fixture(scope="module")
def window(screen, station, areas):
    return screen.open_window(
        "--profile", "both", "--tell", *FEEDS, "--folder", str(station.kept),
        program=(sys.executable, "-m", "gui"), signed_in=False,
    )  # fmt: skip


@pytest.fixture(scope="module")
def photograph(screen, album):
    """Keep a picture of what the screen shows."""
    return lambda name: screen.photograph(album / f"window_{name}.png")


@pytest.fixture(scope="module")
def video(areas, place):
    """Where pixel (u, v) of a robot's 640x480 picture is on the screen."""

    def find(u, v, name="video"):
        _, _, width, height = areas[name]
        scale = min(width / 640, height / 480)
        x, y = place(name)
        return round(x + (u - 320) * scale), round(y + (v - 240) * scale)

    return find


def terminal_text(window):
    """What Pepper's terminal shows."""
    try:
        return Tmux(f"telepresence-{window.process.pid}-pepper").text("session")
    except RuntimeError:
        return ""


def first_pictures(window):
    return window.output.count("first picture")


def hold_at(screen, point):
    screen.do("mousemove", *point, "mousedown", 1)


def set_speed(screen, speed):
    """Set the speed by the keys, whatever it was before."""
    screen.do("key", *["Next"] * 8, *["Prior"] * (round(speed / SLOWEST) - 1))


def still(station, topic):
    """The robot's pose when it has come to rest: 0.3 s of the robot's own messages without a move."""
    told, before = station.probe("newest", topic)
    deadline = time.monotonic() + 30.0
    while (newest := station.probe("newest", topic))[0] < told + 0.3:
        assert time.monotonic() < deadline, f"{topic} has fallen silent"
        time.sleep(0.02)
    return station.pose(topic) if math.dist(before[:2], newest[1][:2]) < 0.005 else None


def arrive(station, namespace, target):
    """Wait until the robot has come to rest near the target; its safety gate may slow it on the way."""
    deadline = time.monotonic() + 150.0
    while True:
        left = math.dist(station.pose(f"{namespace}/truth")[:2], target)
        if left < NEAR and still(station, f"{namespace}/truth"):
            return
        if time.monotonic() > deadline:
            pytest.fail(f"still {left:.2f} m away; the safety gate says {station.newest(f'{namespace}/safety')}")


@pytest.fixture
def signed_in(window, screen, photograph, wait_until):
    """Sign in if nobody is: then Pepper's picture is shown and the keyboard program runs."""
    if not terminal_text(window):
        photograph("signed_out")
        for word in ("anna", PASSWORD):
            screen.do("type", word)
            screen.do("key", "Return")
    wait_until(lambda: first_pictures(window) >= 1, "Pepper's picture is shown", timeout=60.0)
    wait_until(lambda: "a key holds until the next one" in terminal_text(window), "the keyboard runs", timeout=60.0)


def bring_to_front(screen, robot):
    screen.do("mousemove", *HEADER_CLICK[robot], "click", 1)


@pytest.fixture
def pepper(signed_in, station, screen, wait_until):
    """Pepper's tab is in front, and Pepper stands; its pose."""
    bring_to_front(screen, "pepper")
    set_speed(screen, USUAL)
    return wait_until(lambda: still(station, "/truth"), "Pepper stands")


@pytest.fixture
def robotino(signed_in, station, window, screen, wait_until):
    """Robotino's tab is in front with its picture, and Robotino stands; its pose."""
    bring_to_front(screen, "robotino")
    wait_until(lambda: first_pictures(window) >= 2, "Robotino's picture is shown", timeout=60.0)
    set_speed(screen, USUAL)
    return wait_until(lambda: still(station, "/rto3/truth"), "Robotino stands")


def test_signing_in_brings_picture_and_terminal(signed_in, window):
    assert first_pictures(window) >= 1 and "roslaunch" in window.output


def test_it_listens_where_the_table_of_sockets_says(station, wait_until):
    wait_until(lambda: socket_table.agrees([station.launch.pid], "both", station.ports), "sockets as in the table")


def test_holding_the_button_on_the_floor_drives_pepper_there(pepper, station, screen, video, photograph, wait_until):
    x, y, theta = pepper
    u, v = 400, 470
    camera = wait_until(lambda: station.probe("transform", "odom", "CameraTop_optical_frame"), "the camera's place")
    ahead = wait_until(lambda: station.probe("transform", "CameraTop_optical_frame", "odom"), "and its tilt")
    # The origin of odom, seen from a camera that looks along x: how far down that is tilted.
    pitch = math.atan2(camera[0], camera[2]) + math.atan2(ahead[2], ahead[1])
    right = (u - 320) / 320 * math.tan(math.radians(57.2 / 2))  # NAOqi documentation, video: 57.2 by 44.3 degrees
    down = (v - 240) / 240 * math.tan(math.radians(44.3 / 2))
    reach = camera[2] / (math.sin(pitch) + down * math.cos(pitch))
    forward, aside = camera[0] + reach * (math.cos(pitch) - down * math.sin(pitch)), -reach * right
    target = (
        x + forward * math.cos(theta) - aside * math.sin(theta),
        y + forward * math.sin(theta) + aside * math.cos(theta),
    )
    hold_at(screen, video(u, v))
    wait_until(lambda: math.dist(station.pose("/truth")[:2], (x, y)) > 0.1, "Pepper drives", timeout=60.0)
    photograph("pepper")
    set_speed(screen, FAST)
    arrive(station, "", target)
    screen.do("mouseup", 1)
    set_speed(screen, USUAL)


def test_letting_go_stops_at_once(pepper, station, screen, video, wait_until):
    hold_at(screen, video(200, 470))
    wait_until(lambda: still(station, "/truth") is None, "Pepper drives")
    screen.do("mouseup", 1)
    released = station.pose("/truth")
    end = wait_until(lambda: still(station, "/truth"), "it stands")
    assert math.dist(released[:2], end[:2]) < 0.2


def test_the_sky_is_no_place_to_go(pepper, station, screen, video):
    hold_at(screen, video(320, 60))
    time.sleep(0.5)  # in which Pepper may not drive
    screen.do("mouseup", 1)
    assert math.dist(pepper[:2], station.pose("/truth")[:2]) < 0.02


def test_a_session_is_recorded_while_the_safety_gate_slows_the_robot(
    pepper, station, window, screen, place, photograph, wait_until
):
    window.click(place("recordButton"))
    wait_until(lambda: list(station.kept.glob("*.bag.active")), "the recording has begun")
    wait_until(lambda: list(station.kept.glob("*.mp4")), "the film has begun")
    window.click(place("cameraTitle"))
    set_speed(screen, FAST)
    press_until(
        lambda: screen.do("keydown", "w"),
        lambda: screen.do("keyup", "w"),
        partial(wait_until, timeout=90.0),
        lambda: station.newest("/safety")[0] in ("limited", "blocked"),
        "the safety gate acts",
    )
    time.sleep(0.6)  # until the window shows it
    photograph("gate")
    screen.do("keyup", "w")
    set_speed(screen, USUAL)
    window.click(place("snapshotButton"))
    window.click(place("recordButton"))
    bag = wait_until(lambda: next(iter(station.kept.glob("*.bag")), None), "the bag is closed")
    page = wait_until(lambda: next(iter(station.kept.glob("*.html")), None), "the report is written")
    info = subprocess.run(["rosbag", "info", str(bag)], capture_output=True, text=True, timeout=30)
    assert info.returncode == 0 and "/safety " in info.stdout and "/odom " in info.stdout
    text = page.read_text()
    assert text.count("<svg") == 5 and ("limited" in text or "blocked" in text)
    assert next(iter(station.kept.glob("*.png"))).stat().st_size > 10_000
    film = wait_until(lambda: next(iter(station.kept.glob("*.mp4")), None), "the film is written")
    with av.open(str(film)) as pictures:
        assert sum(1 for _ in pictures.decode(video=0)) >= 5
    replayed = subprocess.run(
        ["rosbag", "play", "--quiet", "--rate=20", "--topics", "/odom", "--bags", str(bag)],
        env=station.environment, capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert replayed.returncode == 0, replayed.stderr


def test_a_frozen_camera_greys_the_picture_within_a_second_and_nothing_drives(
    pepper, station, screen, video, photograph, wait_until
):
    camera = station.camera_node()
    point = video(320, 100)

    def seconds_until_grey() -> float:
        processes.send(camera, signal.SIGSTOP)
        frozen, seen = time.monotonic(), []

        def grey():
            seen.append(time.monotonic())  # before the screen is read, which takes its time on a busy machine
            return max(screen.colour(*point)) - min(screen.colour(*point)) < 12

        try:
            wait_until(grey, "the picture is grey")
            screen.do("keydown", "s", "sleep", 0.6)
            photograph("stale")
            screen.do("keyup", "s")
            assert math.dist(pepper[:2], station.pose("/truth")[:2]) < 0.02
        finally:
            processes.send(camera, signal.SIGCONT)
        wait_until(lambda: max(screen.colour(*point)) - min(screen.colour(*point)) > 20, "the picture is back")
        return seen[-2:][0] - frozen

    tries: list[float] = []
    while not any(seconds < 1.0 + 0.6 for seconds in tries):  # a second, and the picture that was on its way
        assert len(tries) < 4, f"grey {tries} s after the camera was frozen"
        tries.append(seconds_until_grey())


def test_the_other_tab_is_the_other_robot_and_only_that_one_drives(
    pepper, robotino, station, screen, video, photograph, wait_until
):
    x, y, theta = robotino
    u, v = 320, 240 + 90
    forward = CAMERA_AHEAD + CAMERA_HEIGHT * FOCAL_LENGTH / (v - 240)
    target = x + forward * math.cos(theta), y + forward * math.sin(theta)
    hold_at(screen, video(u, v, "video of robotino"))
    wait_until(lambda: math.dist(station.pose("/rto3/truth")[:2], (x, y)) > 0.1, "Robotino drives", timeout=60.0)
    photograph("drive_to_place")
    set_speed(screen, FAST)
    arrive(station, "/rto3", target)
    screen.do("mouseup", 1)
    assert math.dist(pepper[:2], station.pose("/truth")[:2]) < 0.02


def test_a_terminal_behind_the_other_tab_gets_its_keyboard_back(robotino, window, wait_until):
    """Pepper's, while Robotino's is in front."""
    tmux = Tmux(f"telepresence-{window.process.pid}-pepper")
    server = listener(tmux.socket)
    os.kill(server, signal.SIGKILL)
    wait_until(lambda: listener(tmux.socket) not in (0, server), "another terminal opens")
    wait_until(lambda: "a key holds until the next one" in terminal_text(window), "the keyboard runs", timeout=60.0)


def test_a_key_held_for_a_second_drives_robotino_for_a_second(
    robotino, station, screen, photograph, wait_until, assert_held_key_drives
):
    set_speed(screen, SLOWEST)
    assert_held_key_drives(screen, station.probe, "/rto3/truth", SLOWEST)
    station.probe("watch", "/rto3/movement_command", "std_msgs/Int32", ["data"])
    screen.do("keydown", "w")
    wait_until(lambda: still(station, "/rto3/truth") is None, "Robotino drives")
    photograph("robotino")
    wait_until(lambda: station.newest("/rto3/movement_command") == [1], "the window reports it")
    assert {"/rto3/distance_sensors", "/rto3/body_state"} <= {*station.subscriptions("/gui_ros_node")}
    screen.do("keyup", "w")


def test_a_forged_state_with_html_in_it_freezes_no_window(robotino, station, window, screen, wait_until):
    """Markup that names a pipe made Qt wait for ever for somebody to write into it."""
    os.mkfifo(station.folder / "pipe")
    html = f"<img src='{station.folder / 'pipe'}'>\x1b[2J"
    forged = {"state": html, "reason": html, "allowed": [0.3] * 72, "sector": 99}
    pictures = first_pictures(window)
    for fields in (forged, {**forged, "sector": -1}):
        told = ("rostopic", "pub", "-r", "50", "/rto3/safety", "telepresence_msgs/SafetyState", json.dumps(fields))
        stranger = station.start(*told)
        wait_until(lambda: station.newest("/rto3/safety")[0] == html, "the forged state is published")
        bring_to_front(screen, "pepper")
        wait_until(lambda before=pictures: first_pictures(window) > before, "the window shows the other robot")
        bring_to_front(screen, "robotino")
        wait_until(lambda before=pictures: first_pictures(window) > before + 1, "and this one again")
        pictures = first_pictures(window)
        processes.end(stranger)
    assert "\x1b[2J" not in window.output and "Traceback" not in window.output


def test_light_and_dark(robotino, station, window, screen, place, video, photograph, wait_until):
    dark = screen.colour(*GROUND)
    window.click(place("themeButton"))
    wait_until(lambda: sum(screen.colour(*GROUND)) > sum(dark) + 300, "the window is light")
    photograph("both")
    bring_to_front(screen, "pepper")
    points = [video(u, v) for u in (60, 200, 440, 580) for v in (120, 240, 360)]
    wait_until(
        lambda: any(max(c) - min(c) > 40 for c in (screen.colour(*point) for point in points)), "a picture with colours"
    )
    wait_until(lambda: terminal_text(window) and still(station, "/truth"), "Pepper's page")
    photograph("light")
    window.click(place("themeButton"))
    wait_until(lambda: screen.colour(*GROUND) == dark, "the window is dark again")
