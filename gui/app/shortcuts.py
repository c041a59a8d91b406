"""Keys of the whole window besides those that drive. Keys typed into the terminal stay there, except F6 and Pause."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from PyQt5.QtCore import Qt
from PyQt5.QtGui import QKeySequence
from PyQt5.QtWidgets import QMainWindow, QShortcut

from gui.driving.help_overlay import HelpOverlay, Section, sections

if TYPE_CHECKING:
    from gui.app.robot_tab import RobotTab

REPEATED = ("PgUp", "PgDown")
COVERED = "The list of keys covers the picture. Any key closes it."


def add_shortcuts(window: QMainWindow, tabs: list[RobotTab], front: Callable[[], RobotTab]) -> HelpOverlay:
    """Bind the keys, and return the page that lists them.

    Args:
        tabs: The robots; the red stop stops all of them.
        front: Returns the one that is driven.
    """

    def stop_all() -> None:
        help_overlay.shut()
        for tab in tabs:
            tab.controller.driving.red_stop()

    def type_in_terminal() -> None:
        # The terminal returns the keyboard on its own: Qt gets no keys meanwhile.
        front().window.show_terminal()
        front().terminal.take_keyboard()

    def help_contents() -> tuple[tuple[Section, ...], bool]:
        robot = front().link.robot
        return sections(robot.by_movement, front().controller.bar.guide_keys), bool(robot.keyboard)

    def cover(tab: RobotTab, covered: bool) -> None:
        tab.controller.driving.set_away("help", COVERED if covered else "")

    help_overlay = HelpOverlay(window, help_contents)
    for keys, action in (
        ("Esc", stop_all),
        ("Pause", stop_all),
        ("Shift+Esc", lambda: front().controller.driving.reset_red_stop()),
        ("PgUp", lambda: front().controller.controls.step_speed(1)),
        ("PgDown", lambda: front().controller.controls.step_speed(-1)),
        ("F1", help_overlay.toggle),
        ("F6", type_in_terminal),
    ):
        shortcut = QShortcut(QKeySequence(keys), window)
        shortcut.setContext(Qt.ShortcutContext.WindowShortcut)
        # A key that is held asks once: of twenty stops a second the answers overtake each other.
        shortcut.setAutoRepeat(keys in REPEATED)
        shortcut.activated.connect(action)
    for tab in tabs:
        help_overlay.shown.connect(partial(cover, tab))
        tab.terminal.stop_typed.connect(stop_all)
        tab.controller.bar.help_wanted.connect(help_overlay.open)
    return help_overlay
