"""Qt without a screen for widgets, a virtual display with input and screenshots for the window, and a fake robot."""

from __future__ import annotations

import gc
import math
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from fake_window_parts import FakeLink, FakeTerminal
from offscreen_qt import application
from PyQt5.QtCore import QEvent, QPoint
from PyQt5.QtWidgets import QAbstractButton, QApplication, QWidget
from window_input import FakeRobot, Screen

from gui.app.controller import Controller
from gui.app.sign_in import SignInPage
from gui.window import OperatorWindow, style_sheet
from telepresence.station import processes
from telepresence.station.virtual_display import VirtualDisplay
from telepresence.teleop.accounts import Users
from telepresence.teleop.lease_messages import PILOT, Account

ROOT = Path(__file__).resolve().parents[2]


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo) -> Iterator[None]:
    """Add to a failed test's report what its window, its safety gate and its screen showed."""
    report = yield
    if report.failed:
        for name, thing in getattr(item, "funcargs", {}).items():
            if hasattr(thing, "evidence"):
                report.sections.append((f"what {name} shows", thing.evidence()))
    return report


@pytest.fixture(scope="session")
def qt() -> QApplication:
    return application()


@pytest.fixture(autouse=True)
def gc_on_qts_thread(qt: QApplication) -> Iterator[None]:
    """Collect garbage as gui.app.gc_on_qt_thread does: widgets of one test must not die on a thread of a later one,
    whatever file that is in; tests/conftest.py collects from now on."""
    gc.disable()
    # What is there by now stays: late in a whole run, looking through it took most of a second after every test.
    gc.freeze()
    yield
    QApplication.sendPostedEvents(None, QEvent.DeferredDelete)
    gc.collect()
    gc.disable()  # some tests enable it


@pytest.fixture
def spin(qt: QApplication, wait_until: Callable) -> Callable:
    """Let Qt work until a condition is true."""

    def until(condition: Callable[[], object], what: str) -> object:
        def step() -> object:
            qt.processEvents()
            return condition()

        return wait_until(step, what)

    return until


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

    def __init__(self, qt: QApplication, users: Users) -> None:
        self._qt = qt
        self._users = users
        self._sign_in: SignInPage | None = None
        self._window: OperatorWindow | None = None

    def __call__(self, name: str, page: str = "terminalPage") -> tuple[int, int]:
        """The middle of a widget, when this page of the deck is in front; of the sign-in page, if that is the page."""
        if page == "signInPage":
            return self._sign_in_position(name)
        window = self._open()
        window.show_page(window.findChild(QWidget, page))
        self._qt.processEvents()
        widget = window.findChild(QWidget, name)
        anna = self._link.lease
        if not widget.isVisible():
            self._drive(anna | {"pilot": "", "window": ""})
        assert widget.isVisible(), f"{name} is there neither while anna drives nor while nobody does"
        place = self._point(widget, widget.rect().center())
        self._drive(anna)
        return place

    def _drive(self, lease: dict) -> None:
        self._link.lease = lease
        self._link.report_lease()
        self._qt.processEvents()

    def tab(self, page: str) -> tuple[int, int]:
        """The middle of a page's tab."""
        window = self._open()
        bar = window.deck.tabBar()
        return self._point(bar, bar.tabRect(window.deck.indexOf(window.findChild(QWidget, page))).center())

    def buttons(self) -> set[str]:
        """Names of all that can be pressed."""
        window = self._open()
        found = set()
        for index in range(window.deck.count()):
            window.deck.setCurrentIndex(index)
            found |= {button.objectName() for button in window.findChildren(QAbstractButton) if button.isVisible()}
        return found

    def close(self) -> None:
        """Show nothing any more: Python's end takes a widget's attributes before Qt hides what still shows."""
        for window in (self._window, self._sign_in):
            if window is not None:
                window.hide()

    def _sign_in_position(self, name: str) -> tuple[int, int]:
        if self._sign_in is None:
            self._qt.setStyle("Fusion")
            self._sign_in = SignInPage(self._users)
            self._sign_in.setStyleSheet(style_sheet("dark"))
            self._sign_in.resize(1280, 720)
            self._sign_in.show()
            self._qt.processEvents()
        widget = self._sign_in.findChild(QWidget, name)
        point = widget.mapTo(self._sign_in, widget.rect().center())
        return point.x(), point.y()

    def _point(self, widget: QWidget, inside: QPoint) -> tuple[int, int]:
        point = widget.mapTo(self._window, inside)
        return point.x(), point.y()

    def _open(self) -> OperatorWindow:
        if self._window is None:
            self._qt.setStyle("Fusion")
            self._qt.setStyleSheet(style_sheet("dark"))
            self._window, self._link = OperatorWindow(FakeTerminal()), FakeLink()
            Controller(self._window, self._link, FakeTerminal()).admit(Account("anna", PILOT))
            self._link.become(master=True, joined=True, driver=True)
            self._window.resize(1280, 720)
            self._window.show()
            self._qt.processEvents()
            self._window.setStyleSheet(style_sheet("dark"))  # its own: the application is undressed for other tests
            self._qt.setStyleSheet("")
        return self._window


@pytest.fixture(scope="session")
def place(qt: QApplication, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Places]:
    users = Users(tmp_path_factory.mktemp("users") / "users.db")
    users.add("somebody", "a password of somebody", PILOT, 0)
    places = Places(qt, users)
    yield places
    places.close()


@pytest.fixture(scope="session")
def album(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where photographs of the window go: SCREENSHOTS, relative to the project, else a temporary folder."""
    wanted = os.environ.get("SCREENSHOTS")
    return ROOT / wanted if wanted else tmp_path_factory.mktemp("screenshots")


@pytest.fixture(scope="module")
def make_screen(wait_until: Callable) -> Iterator[Callable[..., Screen]]:
    """Displays for all tests of a file; their windows find ROS by the given environment."""
    opened: list[tuple[VirtualDisplay, Screen]] = []

    def make(environment: dict[str, str], rows: int = 720) -> Screen:
        display = VirtualDisplay(height=rows)
        screen = Screen(display, lambda *argv, **options: processes.start(list(argv), **options), wait_until)
        screen.environment.update({**environment, **display.environment})
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


DRIVE_LEASE = ROOT / "catkin_ws" / "devel" / "lib" / "avatar_gui" / "drive_lease"


@pytest.fixture
def start_robot(ros_environment: dict[str, str], run_program: Callable) -> Callable[[], FakeRobot]:
    """A robot and the node that decides who drives it."""

    def start() -> FakeRobot:
        run_program(str(DRIVE_LEASE), "_sign_in:=false", stdout=subprocess.DEVNULL)
        return FakeRobot(run_program)

    return start


ROSRUN = """\
#!/bin/sh
# Stands in for rosbag and record_film: makes the file, and ends when it is interrupted and nobody holds it.
for file; do case $file in *.bag | *.mp4) break;; esac; done
trap ended=1 INT
: > "$file"
while [ -z "$ended" ] || [ -e "$file.held" ]; do
  [ -e "$file.says" ] && cat "$file.says" >&2 && rm "$file.says"
  sleep 0.02
done
"""


@pytest.fixture
def fake_ros(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder for recordings. A file in it that is called like a bag or film, and `.held`, keeps its program from
    ending; what is in one with `.says` is what that program says."""
    programs = tmp_path / "programs"
    programs.mkdir()
    for name, text in (("rosrun", ROSRUN), ("report", "#!/bin/sh\n")):
        (programs / name).write_text(text)
        (programs / name).chmod(0o755)
    monkeypatch.setenv("PATH", f"{programs}:{os.environ['PATH']}")
    monkeypatch.setattr(sys, "executable", str(programs / "report"))
    folder = tmp_path / "kept"
    folder.mkdir()
    return folder
