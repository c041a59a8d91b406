"""The operator's window:  python -m gui [--profile pepper|robotino|walker|both] [--robot ADDRESS]"""

from __future__ import annotations

import argparse
import contextlib
import logging
import os
import signal
import socket
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from datetime import datetime
from functools import partial
from pathlib import Path
from types import FrameType
from typing import NoReturn

from PyQt5.QtCore import QObject, QSocketNotifier, QTimer
from PyQt5.QtWidgets import QApplication, QMainWindow, QWidget

from gui import theme
from gui.app.authorization import Authorization
from gui.app.capture import default_folder
from gui.app.controller import Attach
from gui.app.gc_on_qt_thread import GcOnQtThread
from gui.app.robot_tab import RobotTab, Terminals, bring_to_front, hand_on_conversations
from gui.app.shortcuts import add_shortcuts
from gui.app.tabs import RobotTabs
from gui.app.unexpected import UnexpectedErrors
from gui.driving.movement_access import MovementAccess
from gui.periodic_timer import PeriodicTimer
from gui.recording.folder import save_picture
from gui.robots import BOTH as BOTH_ROBOTS
from gui.robots import ROBOTS
from gui.ros.node import RosNode, without_remappings
from gui.settings import Settings, default_file
from gui.terminal.x11 import hold_display, screen_size
from gui.window import OperatorWindow, themes
from telepresence.security.outside_text import keep_logs_plain
from telepresence.security.private_files import restrict_new_files
from telepresence.station import heartbeat
from telepresence.station.ros_master import end_code
from telepresence.teleop.accounts import Users
from telepresence.teleop.robot_kinds import PEPPER
from telepresence.temporary_folder import TemporaryFolder

BOTH = "both"
SCALES = ((2000, 2.0), (1400, 1.25))
"""(height of the screen [px], scale of the window from that height on)."""
TALLEST = 10.0 / 16.0
"""Height to width of a monitor: what is taller is two of them, one above the other, or stands upright."""
REMEMBER_PERIOD = 5000
"""[ms] between two looks whether there is something new to remember: a window that is killed saves nothing any more."""
BEAT_PERIOD = 100
"""[ms] between two signs of life."""
FROZEN_AFTER = 2.0
"""Seconds after which a window whose loop does not turn counts as frozen: files are written there, too."""
ENDING_TIMEOUT = 10.0
"""Seconds in which a closed window's terminals and nodes end."""
SCREENSHOT_DELAY = 1000
"""[ms] after the first picture: time for the terminal to show what it runs."""


def main(argv: list[str] | None = None) -> int:
    """Open the window, and end the process when it is closed; return the exit code if no window can be opened."""
    arguments = parse(without_remappings(sys.argv)[1:] if argv is None else argv)
    problem = display_problem(os.environ)
    if problem:
        print(f"gui: {problem}", file=sys.stderr)
        return 2
    log_to_terminal()
    restrict_new_files()
    application = start_qt(arguments.scale)
    _gc = GcOnQtThread()  # collects for as long as this variable refers to it
    settings = Settings(default_file())
    remembered = settings.text("theme", theme.DEFAULT)
    theme.apply(arguments.theme or (remembered if remembered in themes() else theme.DEFAULT))

    node = RosNode()
    tabs = make_tabs(node, arguments, settings)
    window, front = one_window(tabs, settings)
    node.ended.connect(lambda reason: _end_by_ros(window, application, reason))
    report(tabs, window, arguments)
    signals = _close_on_signals(window)
    window.show_on_screen()
    settings.restore_window(window)
    add_shortcuts(window, tabs, front)
    # The window has to be on the screen by now: the terminal opens its own inside it.
    users = Users(arguments.users) if arguments.sign_in else None
    authorization = authorize(tabs, window, users)
    if authorization.page is not None:
        authorization.page.nameField.setText(settings.text("name"))
    remember = partial(save, settings, tabs, window, authorization)
    remembers = PeriodicTimer(REMEMBER_PERIOD, remember, window)
    remembers.start()
    remember_driving(tabs, window, remember)
    for tab in tabs:
        tab.start()
    node.start()
    beats = QTimer()
    beats.timeout.connect(lambda: heartbeat.beat(FROZEN_AFTER))
    beats.start(BEAT_PERIOD)
    try:
        code = application.exec_()
        if code == 0:
            heartbeat.notify("STOPPING=1")
    finally:
        heartbeat.beat(ENDING_TIMEOUT)
        signals.setEnabled(False)
        remembers.stop()
        remember()
        for tab in tabs:
            tab.close()
        node.close()
        for tab in tabs:
            tab.terminal.close_terminal()
        settings.close()
    leave(code)


def start_qt(scale: float) -> QApplication:
    """Make the application.

    Args:
        scale: How much larger than usual everything is shown; 0 for what fits this screen.
    """
    # The terminal is an X11 program; on a Wayland desktop both go through XWayland.
    os.environ.setdefault("QT_QPA_PLATFORM", "xcb")
    # Nothing here is drawn by OpenGL, which Qt would load and start all the same: 55 MB.
    ours = {"QT_SCALE_FACTOR": f"{scale or usual_scale(os.environ):g}", "QT_XCB_GL_INTEGRATION": "none"}
    chosen = {name: value for name, value in ours.items() if name not in os.environ}
    os.environ.update(chosen)
    with runtime_folder():
        application = QApplication(sys.argv[:1])
    QWidget().winId()  # Qt starts OpenGL, or does not, with its first window
    for name in chosen:
        del os.environ[name]  # programs that the terminal starts choose their own
    application.setApplicationName("telepresence")
    application.setStyle("Fusion")
    return application


def one_window(tabs: list[RobotTab], settings: Settings) -> tuple[OperatorWindow | RobotTabs, Callable[[], RobotTab]]:
    """Return the window that shows these robots, and who says which of them is in front."""
    if len(tabs) == 1:
        return tabs[0].window, lambda: tabs[0]
    window = RobotTabs([(tab.title, tab.window) for tab in tabs])
    hand_on_conversations(tabs)
    window.changed.connect(lambda chosen: bring_to_front(tabs, chosen))
    bring_to_front(tabs, 0)
    names = [tab.link.robot.name for tab in tabs]
    last = settings.text("tab")
    window.choose(names.index(last) if last in names else 0)
    return window, lambda: tabs[window.current]


def authorize(tabs: list[RobotTab], window: OperatorWindow | RobotTabs, users: Users | None) -> Authorization:
    """Return who shows the robots of these tabs to whom."""
    captures = [tab.capture for tab in tabs]
    return Authorization(window, Terminals(tabs), [tab.controller for tab in tabs], users, captures)


def remember_driving(tabs: list[RobotTab], window: OperatorWindow | RobotTabs, remember: Callable[[], None]) -> None:
    """Remember at once which robot the next key drives, and how, and a red stop that only this window holds: a window
    that dies and comes back must not drive the other one, or faster, or let one go that is stopped."""
    changes = [window.changed] if isinstance(window, RobotTabs) else []
    for tab in tabs:
        changes += [
            tab.controller.controls.speeds_changed,
            tab.controller.bar.guide_keys_wanted,
            tab.window.gate.careful_wanted,
        ]
        if isinstance(tab.controller.access, MovementAccess):
            changes.append(tab.controller.access.stop_changed)
    for change in changes:
        change.connect(lambda *_: remember())


def report(tabs: list[RobotTab], window: QMainWindow, arguments: argparse.Namespace) -> None:
    """Print and save what the command line asks for, as soon as there is something to see."""
    for tab in tabs:
        tab.window.video.first_picture.connect(lambda: print("The window shows the first picture.", flush=True))
        if arguments.tell:
            tab.window.status.said.connect(lambda text, level, tab=tab: _print_message(tab.title, text, level))
    if arguments.screenshot:
        tabs[0].window.video.first_picture.connect(
            lambda: QTimer.singleShot(SCREENSHOT_DELAY, lambda: save_screenshot(window, arguments.screenshot))
        )


def save(
    settings: Settings, tabs: list[RobotTab], window: OperatorWindow | RobotTabs, authorization: Authorization
) -> None:
    """Save what the next window shall begin with."""
    for tab in tabs:
        tab.save(settings)
    if authorization.page is not None:
        settings.save("name", authorization.page.nameField.text())
    if isinstance(window, RobotTabs):
        settings.save("tab", tabs[window.current].link.robot.name)
    settings.save("theme", theme.current())
    settings.save_window(window)
    settings.write()


@contextlib.contextmanager
def runtime_folder() -> Iterator[None]:
    """Where nobody is logged in by systemd, Qt warns that it has no folder for sockets and uses a temporary one: let it
    have an empty one without a warning. Programs that start later find their sound server without."""
    if "XDG_RUNTIME_DIR" in os.environ:
        yield
        return
    with TemporaryFolder("telepresence-runtime-") as folder:
        os.environ["XDG_RUNTIME_DIR"] = str(folder)
        yield
        del os.environ["XDG_RUNTIME_DIR"]


def log_to_terminal() -> None:
    """Print what the window's parts log, as plain lines: such as a joystick that was detected on standard output,
    warnings on standard error."""
    keep_logs_plain()
    UnexpectedErrors().log_all()
    logger = logging.getLogger("gui")
    for stream in (sys.stdout, sys.stderr):
        handler = logging.StreamHandler(stream)
        handler.setFormatter(logging.Formatter("%(message)s"))
        logger.addHandler(handler)
    logger.handlers[-1].setLevel(logging.WARNING)
    logger.handlers[-2].addFilter(lambda record: record.levelno < logging.WARNING)
    logging.getLogger("gui.driving.gamepad").setLevel(logging.INFO)  # others: warnings only
    logger.propagate = False  # rospy's own handlers would print it a second time


def make_tabs(node: RosNode, arguments: argparse.Namespace, settings: Settings) -> list[RobotTab]:
    """Make a tab for each robot that the command line names."""
    names = list(BOTH_ROBOTS) if arguments.profile == BOTH else [arguments.profile]
    tabs = []
    for index, name in enumerate(names):
        robot = ROBOTS[name] if len(names) == 1 else ROBOTS[name].among_others()
        if index < len(arguments.feed):
            robot = robot.with_feed(arguments.feed[index])
        if index:
            robot = replace(robot, keyboard_name=f"keyboard_of_{name}")
        named = os.environ.get("NAO_IP") if robot.name == PEPPER.name else None  # the variable of Pepper's programs
        usual = named or settings.text(f"{name}/address", "127.0.0.1")
        address = arguments.robot[min(index, len(arguments.robot) - 1)] if arguments.robot else usual
        tabs.append(RobotTab(node, robot, address, arguments, alone=len(names) == 1))
        tabs[-1].restore(settings)
    for tab in tabs:
        for other in tabs:
            tab.controller.bar.guide_keys_wanted.connect(other.controller.bar.set_guide_keys)
    return tabs


def parse(argv: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m gui", description="The operator's window.")
    parser.add_argument(
        "--robot", metavar="ADDRESS", nargs="+", default=[],
        help="the robot, or both: Pepper first; default for Pepper NAO_IP, else the address of the last session",
    )  # fmt: skip
    parser.add_argument(
        "--profile", choices=[*ROBOTS, BOTH], default="pepper",
        help="kind of robot, or both in one window with tabs; default %(default)s",
    )  # fmt: skip
    parser.add_argument("--feed", metavar="TOPIC", nargs="+", default=[], help="camera topic; default the robot's own")
    parser.add_argument(
        "--no-sign-in", dest="sign_in", action="store_false",
        help="let everybody in as a pilot: for simulated robots; the robot's programs need sign_in:=false, too",
    )  # fmt: skip
    parser.add_argument(
        "--users", metavar="FILE", type=Path, help="the accounts; default TELEPRESENCE_USERS or gui/users.db"
    )
    parser.add_argument(
        "--gamepad", metavar="DEVICE", default="",
        help="a joystick device, joy for the topic of that name, or none; default the first one that is plugged in",
    )  # fmt: skip
    attach = parser.add_mutually_exclusive_group()
    attach.add_argument(
        "--attach", dest="attach", action="store_const", const=Attach.ALWAYS, default=Attach.AUTO,
        help="show the camera and start the keyboard as soon as there is a ROS master; "
             "default: as soon as the robot's programs run",
    )  # fmt: skip
    attach.add_argument(
        "--no-attach", dest="attach", action="store_const", const=Attach.NEVER, help="wait for the buttons"
    )
    parser.add_argument(
        "--converse", action="store_true",
        help="begin the conversation as soon as a pilot has the robot, as Robot feed does: for whoever has started the "
             "robot's programs with conversation:=false",
    )  # fmt: skip
    parser.add_argument(
        "--scale", metavar="FACTOR", type=float, default=0.0,
        help="show everything this much larger; default by the height of the screen, 2 on 4K",
    )  # fmt: skip
    parser.add_argument("--theme", choices=themes(), help="colours; default those of the last session, at first dark")
    parser.add_argument(
        "--folder", type=Path, default=default_folder(), help="where recordings and snapshots go; default %(default)s"
    )
    parser.add_argument("--screenshot", metavar="FILE", type=Path, help="save a picture of the window there")
    parser.add_argument("--tell", action="store_true", help="print every message that the window shows, with its time")
    return parser.parse_args(argv)


def usual_scale(environment: Mapping[str, str]) -> float:
    """Return how much larger everything should be on this screen than on one of 720 to 1200 rows."""
    width, height = screen_size(environment.get("DISPLAY", ""))
    rows = min(height, TALLEST * width)
    return next((factor for least, factor in SCALES if rows >= least), 1.0)


def display_problem(environment: Mapping[str, str]) -> str | None:
    """Return why no window can be opened and what to do; None when one can."""
    if environment.get("QT_QPA_PLATFORM", "xcb") != "xcb":
        return None
    display = environment.get("DISPLAY")
    if display and hold_display(display):
        return None
    found = f"no X server accepts connections at DISPLAY={display}" if display else "DISPLAY is not set"
    return (
        f"there is no display for a window: {found}.\n"
        "  On a machine without a screen run  ./stack up : it starts a virtual display and shows the window on a web "
        "page.\n  Over ssh connect with  ssh -X . Where an X server runs:  export DISPLAY=:0"
    )


def save_screenshot(window: QMainWindow, path: Path) -> None:
    """Save what the screen shows of the window, terminal included."""
    screen = window.screen()
    assert screen is not None  # the window is shown on it
    picture = screen.grabWindow(int(window.winId()))  # type: ignore[arg-type]
    try:
        save_picture(picture, path)
    except (OSError, ValueError) as error:
        print(f"gui: {path} cannot be written: {error}", file=sys.stderr)
    else:
        print(f"Saved a picture of the window as {path}", flush=True)


def leave(code: int) -> NoReturn:
    """End the process at once, after everything has been closed. Returning would let Python destroy the widgets and the
    application in an arbitrary order while rospy's threads still run, which crashes now and then."""
    logging.shutdown()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


def _print_message(title: str, text: str, level: str) -> None:
    print(f"{datetime.now().isoformat(' ', 'milliseconds')} {title}, {level}: {text}", flush=True)


def _end_by_ros(window: QMainWindow, application: QApplication, reason: str) -> None:
    print(f"gui: ROS ended this window: {reason}", file=sys.stderr)
    window.close()
    application.exit(end_code(reason))  # 0 says that it was closed, and our roslaunch leaves it away


class _SignalNotifier(QSocketNotifier):
    """Lets Python's signal handlers run: Python calls them between its own instructions, which Qt's loop does not
    execute until the byte that every signal writes into a socket wakes it."""

    def __init__(self, parent: QObject) -> None:
        self._reader, self._writer = socket.socketpair()
        for end in (self._reader, self._writer):
            end.setblocking(False)
        super().__init__(self._reader.fileno(), QSocketNotifier.Type.Read, parent)  # type: ignore[arg-type]
        signal.set_wakeup_fd(self._writer.fileno())
        self.activated.connect(self._drain)

    def _drain(self) -> None:
        self._reader.recv(64)


def _close_on_signals(window: QMainWindow) -> QSocketNotifier:
    """Close the window on SIGINT, SIGTERM and SIGHUP."""

    def close(_signal: int, _frame: FrameType | None) -> None:
        # On the event loop: before it runs, closing would be forgotten.
        QTimer.singleShot(0, window.close)  # type: ignore[arg-type]  # PyQt5's stub: a slot returns None

    notifier = _SignalNotifier(window)
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, close)
    return notifier


if __name__ == "__main__":
    sys.exit(main())
