"""Qt without a screen for widgets, a virtual display with hands and eyes for the whole window, and a fake robot."""

from __future__ import annotations

import gc
import itertools
import math
import os
import subprocess
import sys
import tempfile
import textwrap
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from PyQt5.QtCore import QEvent, QObject, QPoint, pyqtSignal
from PyQt5.QtWidgets import QApplication, QFrame, QWidget

from gui.channels import Answer, Channel
from gui.controller import Controller
from gui.drive_topics import LeaseState
from gui.link_state import LinkState
from gui.profiles import PROFILES
from gui.tmux import Tmux
from gui.window import OperatorWindow, style_sheet
from telepresence import processes
from telepresence.drive_lease import NONCE, PILOT, Account, Velocity
from telepresence.virtual_display import VirtualDisplay, grab


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo) -> Iterator[None]:
    """With a failed test goes what its window, its safety layer and its screen showed."""
    report = yield
    if report.failed:
        for name, thing in getattr(item, "funcargs", {}).items():
            if hasattr(thing, "evidence"):
                report.sections.append((f"what {name} shows", thing.evidence()))
    return report


@pytest.fixture(scope="session")
def qt() -> QApplication:
    # Not by QT_QPA_PLATFORM: programs that other tests start would inherit it.
    return QApplication.instance() or QApplication(["tests", "-platform", "offscreen"])


@pytest.fixture(autouse=True)
def collect_cycles_on_qts_thread(qt: QApplication) -> Iterator[None]:
    """As the window's program does (gui.cycles): widgets of one test must not die on a thread of the next one."""
    gc.disable()
    yield
    QApplication.sendPostedEvents(None, QEvent.DeferredDelete)
    gc.collect()
    gc.enable()


@pytest.fixture
def spin(qt: QApplication, wait_until: Callable) -> Callable:
    """Let Qt work until a condition is true."""

    def until(condition: Callable[[], object], what: str) -> object:
        def step() -> object:
            qt.processEvents()
            return condition()

        return wait_until(step, what)

    return until


class FakeLink(QObject):
    """The signals of RosLink, and what was asked of it."""

    state_changed = pyqtSignal(object)
    trouble = pyqtSignal(str)

    def __init__(self) -> None:
        super().__init__()
        self.profile = PROFILES["pepper"]
        self.feed = "/robot/image"
        self.state = LinkState("http://127.0.0.1:11311")
        self.channels = {row.channel: Channel(row) for row in self.profile.incoming}
        self.node_name = "/gui_ros_node"
        self.open = True
        self.lease = {
            "epoch": "1", "sign_in": False, "pilot": "anna", "window": self.node_name, "asking": "", "stopped_by": "",
            "hold": "", "other": "", "velocity": Velocity(0.0, 0.0, 0.0),
            "present": (("anna (pilot)", self.node_name),),
        }  # fmt: skip
        self.sent: list[tuple] = []
        self.called: list[tuple] = []

    def become(self, **changes: bool) -> None:
        self.state = LinkState(self.state.master_uri, **changes)
        self.state_changed.emit(self.state)
        if self.state.joined and self.state.driver:
            self.tell_lease()

    @property
    def picture(self) -> object:
        """Emit here what the camera shows."""
        return self.channels["picture"].arrived

    @property
    def watching(self) -> bool:
        return self.channels["picture"].wanted

    @property
    def driven(self) -> list[tuple[float, float, float]]:
        """Velocities that were sent, zeros past the lease among them."""
        velocities = []
        for name, *values in self.sent:
            if name == "zero":
                velocities.append((0.0, 0.0, 0.0))
            elif name == "command" and values[1].velocity is not None:
                velocities.append(tuple(values[1].velocity))
        return velocities

    @property
    def asked(self) -> list[str]:
        """What was asked of drive_lease."""
        return [values[2] for name, *values in self.called if name == "ask"]

    def tell_lease(self, **changes: object) -> None:
        """drive_lease says who drives: this window, unless changed."""
        self.lease.update(changes)
        self.channels["lease"].arrived.emit(LeaseState(**self.lease, arrived=time.monotonic()))

    def channel(self, name: str) -> Channel:
        return self.channels[name]

    def has(self, name: str) -> bool:
        outgoing = {row.channel for row in self.profile.outgoing}
        return name in self.channels or name in outgoing or name in {row.name for row in self.profile.services}

    def place_of(self, frame: str, seen_from: str, stamp: float) -> tuple:
        """A level camera one metre above the origin, looking along x."""
        return np.array(((0.0, 0.0, 1.0), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0))), np.array((0.0, 0.0, 1.0))

    def resolve(self, name: str) -> str:
        return name if name.startswith("/") else f"/{name}"

    def watch(self, name: str, wanted: bool) -> None:
        self.channels[name].wanted = wanted

    def send(self, name: str, *values: object) -> bool:
        self.sent.append((name, *values))
        return True

    def call(self, name: str, *values: object, then: Callable[[Answer], None] = lambda answer: None) -> None:
        self.called.append((name, *values))
        then(Answer(True, "", ("session", bytes(NONCE)) if name == "join" else None))

    def set_open(self, wanted: bool) -> None:
        self.open = wanted


class FakeTerminal(QFrame):
    """The signals of TerminalView, and what was typed."""

    ready = pyqtSignal()
    refused = pyqtSignal(str)
    typed = pyqtSignal(str)
    focus_changed = pyqtSignal(bool)
    stop_typed = pyqtSignal()

    def __init__(self) -> None:
        super().__init__()
        self.has_keyboard = False
        self.lines: list[tuple[str, str]] = []
        self.interrupted: list[str] = []
        self.denied, self.started = "", False

    def start(self) -> None:
        self.started = True

    def deny(self, reason: str) -> None:
        self.denied = reason

    def type_line(self, line: str | Callable[[], str], window: str = "session") -> None:
        try:
            self.lines.append((window, line if isinstance(line, str) else line()))
        except ValueError as error:
            self.refused.emit(str(error))

    def interrupt(self, window: str = "session") -> None:
        self.interrupted.append(window)

    def take_keyboard(self) -> None:
        self.has_keyboard = True
        self.focus_changed.emit(True)


@pytest.fixture
def link(qt: QApplication) -> FakeLink:
    return FakeLink()


@pytest.fixture
def terminal(qt: QApplication) -> FakeTerminal:
    return FakeTerminal()


@pytest.fixture
def make_link(qt: QApplication) -> type[FakeLink]:
    return FakeLink


@pytest.fixture
def make_terminal(qt: QApplication) -> type[FakeTerminal]:
    return FakeTerminal


class Places:
    """Where the widgets of a 1280x720 window are [px]: of one like it that is never on a screen."""

    def __init__(self, qt: QApplication) -> None:
        self._qt = qt
        self._window: OperatorWindow | None = None

    def __call__(self, name: str, page: str = "terminalPage") -> tuple[int, int]:
        """The middle of a widget, when this page of the deck is in front."""
        window = self._open()
        window.show_page(window.findChild(QWidget, page))
        self._qt.processEvents()
        widget = window.findChild(QWidget, name)
        return self._point(widget, widget.rect().center())

    def tab(self, page: str) -> tuple[int, int]:
        """The middle of a page's tab."""
        window = self._open()
        bar = window.deck.tabBar()
        return self._point(bar, bar.tabRect(window.deck.indexOf(window.findChild(QWidget, page))).center())

    def _point(self, widget: QWidget, inside: QPoint) -> tuple[int, int]:
        point = widget.mapTo(self._window, inside)
        return point.x(), point.y()

    def _open(self) -> OperatorWindow:
        if self._window is None:
            self._qt.setStyle("Fusion")
            self._qt.setStyleSheet(style_sheet("dark"))
            self._window, link = OperatorWindow(FakeTerminal()), FakeLink()
            Controller(self._window, link, FakeTerminal()).admit(Account("anna", PILOT))
            link.become(master=True, joined=True, driver=True)
            self._window.resize(1280, 720)
            self._window.show()
            self._qt.processEvents()
            self._window.setStyleSheet(style_sheet("dark"))  # its own: the application is undressed for other tests
            self._qt.setStyleSheet("")
        return self._window


@pytest.fixture(scope="session")
def place(qt: QApplication) -> Places:
    return Places(qt)


class Screen:
    """A virtual display with a keyboard and a mouse, and the window that runs on it."""

    def __init__(self, display: VirtualDisplay, run_program: Callable, wait_until: Callable) -> None:
        self.environment = dict(os.environ, DISPLAY=display.name)
        self._folder = display.folder
        self._windows: list[Window] = []
        self._held: set[tuple[str, str]] = set()
        self._run_program, self._wait_until = run_program, wait_until

    def open_window(
        self,
        *arguments: str,
        program: tuple[str, ...] = (sys.executable, "-m", "gui", "--no-sign-in"),
        signed_in: bool = True,
    ) -> Window:
        process = self._run_program(
            *program, *arguments, env=self.environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        window = Window(process, self, self._wait_until, signed_in)
        self._windows.append(window)
        return window

    def close(self) -> None:
        """End the windows and wait until all that ran in their terminals has ended, too."""
        for window in self._windows:
            family = window.family()
            processes.end(window.process, patience=10.0)
            self._wait_until(
                lambda family=family: not {*family} & {*processes.descendants()}, "the programs have ended"
            )

    def colour(self, x: int, y: int) -> tuple[int, int, int]:
        """Eyes: red, green and blue of a point."""
        blue, green, red = grab(self._folder)[y, x]
        return int(red), int(green), int(blue)

    def do(self, *words: object) -> str:
        """Hands: xdotool."""
        self._note_held([str(word) for word in words])
        done = subprocess.run(
            ["xdotool", *map(str, words)], env=self.environment, capture_output=True, text=True, timeout=20
        )
        assert done.returncode == 0, done.stderr
        return done.stdout.strip()

    def hold(self, key: str, seconds: float) -> tuple[float, float]:
        """When the key went down and up [s since 1970]."""
        clock = ("exec", "--sync", "--args", 2, "date", "+%s.%N")
        told = self.do(*clock, "keydown", key, "sleep", seconds, *clock, "keyup", key)
        pressed, released = map(float, told.split())
        return pressed, released

    def let_go(self) -> None:
        """Release every key and button that is still held: a test that failed must not drive into the next one."""
        for release, what in sorted(self._held):
            self.do(release, what)

    def evidence(self) -> str:
        """What is on the screen, as a file, and what the windows told the pilot."""
        shot = tempfile.NamedTemporaryFile(prefix="screen-", suffix=".png", delete=False)
        subprocess.run(["import", "-window", "root", shot.name], env=self.environment, timeout=20)
        told = ("\n".join(window.output.splitlines()[-40:]) for window in self._windows)
        return "\n".join((f"picture: {shot.name}", *told))

    def _note_held(self, words: list[str]) -> None:
        for word, what in itertools.pairwise(words):
            if word in ("keydown", "mousedown"):
                self._held.add((word.replace("down", "up"), what))
            elif word in ("keyup", "mouseup"):
                self._held.discard((word, what))


class Window:
    """The operator's window as a process of its own."""

    def __init__(self, process: subprocess.Popen, screen: Screen, wait_until: Callable, signed_in: bool) -> None:
        self.process, self.screen = process, screen
        self.tmux = Tmux(f"telepresence-{process.pid}")
        self.output = ""
        threading.Thread(target=self._read, name="window-output", daemon=True).start()
        self.id = wait_until(self._find, "the window is on the screen")
        if not signed_in:
            return
        wait_until(lambda: "$" in self.terminal_text(), "the terminal shows a prompt")
        wait_until(self.terminal_has_keyboard, "the terminal has the keyboard")

    def terminal_text(self, window: str = "session") -> str:
        try:
            return self.tmux.text(window)
        except RuntimeError:
            return ""

    def terminal_has_keyboard(self) -> bool:
        """Whether the X server sends keys to a window inside ours; 0 and 1 stand for none and for the pointer's."""
        return self.screen.do("getwindowfocus", "-f") not in ("0", "1", self.id)

    def terminal_size(self) -> str:
        return self.tmux._call("display-message", "-p", "-t", "telepresence", "#{window_width}x#{window_height}")

    def family(self) -> list[int]:
        """Processes of this window: its descendants, and those of tmux, which leaves the family."""
        name = f"telepresence-{self.process.pid}"
        roots = [self.process.pid, *(pid for pid in processes.descendants() if name in _command(pid))]
        return sorted({*roots, *(pid for root in roots for pid in processes.descendants(root))})

    def click(self, point: tuple[int, int]) -> None:
        self.screen.do("mousemove", *point, "click", 1)

    def type(self, *keys: str) -> None:
        self.screen.do("key", *keys)

    def _read(self) -> None:
        for line in self.process.stdout:
            self.output += line

    def _find(self) -> str | None:
        if self.process.poll() is not None:
            pytest.fail(f"the window ended: {self.output}")
        found = subprocess.run(
            ["xdotool", "search", "--onlyvisible", "--name", "^Telepresence"],
            env=self.screen.environment, capture_output=True, text=True, timeout=20,
        )  # fmt: skip
        return found.stdout.split("\n")[0]


def _command(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().decode(errors="replace")
    except OSError:
        return ""


@pytest.fixture(scope="module")
def make_screen(wait_until: Callable) -> Iterator[Callable[[dict[str, str]], Screen]]:
    """Displays for all tests of a file; their windows find ROS by the given environment."""
    opened: list[tuple[VirtualDisplay, Screen]] = []

    def make(environment: dict[str, str]) -> Screen:
        display = VirtualDisplay()
        screen = Screen(display, lambda *argv, **options: processes.start(list(argv), **options), wait_until)
        screen.environment = {**environment, "DISPLAY": display.name}
        opened.append((display, screen))
        return screen

    yield make
    for display, screen in opened:
        screen.close()
        display.close()


SETTLED, STANDS = 0.3, 0.002
"""Seconds after the release, and metres that a standing robot may still move."""
BRAKING = 1.2
"""Seconds that braking takes at most."""


@pytest.fixture(scope="session")
def assert_held_key_drives(wait_until: Callable) -> Callable:
    """W and S held for a second in turn: the robot goes a second times its speed and stands 0.3 s after the release.
    Other programs hold up those of a busy machine now and then: the best of a few tries is what the way from key to
    wheel does."""

    def check(screen: Screen, probe: Callable, topic: str, speed: float) -> None:
        tries = []
        while not any(abs(share - 1.0) < 0.1 and left < STANDS for share, left in tries):
            assert len(tries) < 6, f"(share of the way, metres after {SETTLED} s) {tries}"
            probe("forget", topic)
            pressed, released = screen.hold("ws"[len(tries) % 2], 1.0)
            wait_until(
                lambda end=released + BRAKING: (newest := probe("newest", topic)) and newest[0] > end, "it has braked"
            )
            track = probe("seen", topic)
            start, end = track[0][1][:2], track[-1][1][:2]
            settled = next(fields[:2] for when, fields in track if when >= released + SETTLED)
            tries.append((math.dist(start, end) / (speed * (released - pressed)), math.dist(settled, end)))
        print(f"{topic}: share of the way, metres {SETTLED} s after the release: {tries}")

    return check


@pytest.fixture
def screen(run_program: Callable, wait_until: Callable, ros_environment: dict[str, str]) -> Iterator[Screen]:
    display = VirtualDisplay()
    screen = Screen(display, run_program, wait_until)
    yield screen
    screen.close()
    display.close()


DRIVE_LEASE = Path(__file__).resolve().parents[2] / "catkin_ws" / "devel" / "lib" / "avatar_gui" / "drive_lease"
FAKE_ROBOT = textwrap.dedent("""
    import sys, time, numpy as np, rospy
    from geometry_msgs.msg import Twist
    from sensor_msgs.msg import Image
    from telepresence.images import fill_image_message
    from telepresence.ros_master import MasterWatch
    rospy.init_node("fake_robot")
    images = rospy.Publisher("/pepper_robot/camera/front/image_raw", Image, queue_size=1)
    def hear(twist):
        print(time.monotonic(), twist.linear.x, twist.linear.y, twist.angular.z, flush=True)
    rospy.Subscriber("cmd_vel", Twist, hear, tcp_nodelay=True)
    MasterWatch(rospy).start()
    pixels = np.zeros((48, 64, 3), np.uint8)
    pixels[:, :32], pixels[:, 32:] = (250, 30, 20), (20, 30, 250)
    print("ready", flush=True)
    while not rospy.is_shutdown():
        images.publish(fill_image_message(Image(), pixels, "rgb8"))
        time.sleep(0.05)
""")


class FakeRobot:
    """Publishes a picture, left half red, right half blue, and hears cmd_vel: (time [s], vx, vy, wz)."""

    def __init__(self, run_program: Callable) -> None:
        self.heard: list[tuple[float, ...]] = []
        self.process = run_program(sys.executable, "-c", FAKE_ROBOT, stdout=subprocess.PIPE, text=True)
        assert self.process.stdout.readline() == "ready\n"
        threading.Thread(target=self._read, name="robot-ear", daemon=True).start()

    def _read(self) -> None:
        for line in self.process.stdout:
            self.heard.append(tuple(map(float, line.split())))

    def velocity(self) -> tuple[float, ...] | None:
        """The last command: vx, vy [m/s], wz [rad/s]."""
        return self.heard[-1][1:] if self.heard else None


@pytest.fixture
def start_robot(ros_environment: dict[str, str], run_program: Callable) -> Callable[[], FakeRobot]:
    """A robot and the node that decides who drives it."""

    def start() -> FakeRobot:
        run_program(str(DRIVE_LEASE), "_sign_in:=false", stdout=subprocess.DEVNULL)
        return FakeRobot(run_program)

    return start
