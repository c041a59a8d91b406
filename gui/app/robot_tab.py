"""One robot's part of the window: link, page, terminal, input devices, snapshots and recordings."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from functools import partial

from PyQt5.QtCore import QObject

from gui.app.capture import Capture
from gui.app.controller import Controller
from gui.driving.gamepad import Gamepad
from gui.driving.movement_access import MovementAccess
from gui.robots import Robot
from gui.ros.link import RosLink
from gui.ros.node import RosNode
from gui.settings import Settings
from gui.terminal.terminal_view import TerminalView
from gui.window import OperatorWindow
from telepresence.security.outside_text import clean_name

GUIDE_KEYS = "guide"
"""Value of the setting `keys`: keys and speeds as in the Robotino guide."""
AWAY = "Another robot is in front. Choose this one's tab to drive it."
ENDS_WITHIN = 1.0
"""[s] that the robot's programs may take to hear that the conversation is over, before the window ends."""
CHOICES = {"on": True, "off": False}
"""How the choice of the careful scan is written in the settings."""


class RobotTab(QObject):
    """One robot's part of the window.

    Args:
        node: The window's node, shared by all robots.
        robot: What it is.
        address: Where it is.
        arguments: The command line's, see gui/__main__.py.
        alone: There is no other robot.
    """

    def __init__(
        self, node: RosNode, robot: Robot, address: str, arguments: argparse.Namespace, alone: bool = True
    ) -> None:
        super().__init__()
        self.title = robot.title
        self.terminal = TerminalView("" if alone else robot.name)
        self.window = OperatorWindow(self.terminal)
        self.window.setObjectName(robot.name)  # sets the settings of its splitters apart from another robot's
        self.window.address.setText(address)
        self.link = RosLink(node, robot)
        self.gamepad = Gamepad(None if arguments.gamepad in ("joy", "none") else arguments.gamepad)
        self.controller = Controller(
            self.window, self.link, self.terminal, arguments.attach, arguments.sign_in, self.gamepad
        )
        self.controller.begins_conversation = arguments.converse
        if arguments.gamepad == "joy":
            self.link.channel("joy").arrived.connect(lambda joy: self.gamepad.receive(*joy))
            self.link.watch("joy", True)
        self.capture = Capture(self.window, self.link, arguments.folder)
        self.capture.said.connect(self.window.status.say)
        node.trouble.connect(self.link.trouble)
        self.in_front, self._had_feed = True, False
        self.window.feedButton.toggled.connect(self._on_feed)

    def set_in_front(self, in_front: bool) -> None:
        """Drive this robot, show it and talk there, or stop doing so: only the one in front is driven, seen and heard.
        Its programs and its terminal keep running."""
        self.in_front = in_front
        self.controller.conversation.set_in_front(in_front)
        self.controller.driving.set_away("tab", "" if in_front else AWAY)
        feed = self.window.feedButton
        if in_front:
            feed.setChecked(feed.isChecked() or self._had_feed)
        else:
            self._had_feed = self._had_feed or feed.isChecked()
            feed.setChecked(False)

    def _on_feed(self, wanted: bool) -> None:
        """Ask for no pictures that nobody sees, even when the robot's programs are found while it is not in front."""
        if wanted and not self.in_front:
            self._had_feed = True
            self.window.feedButton.setChecked(False)

    def restore(self, settings: Settings) -> None:
        """Restore the settings of the last session."""
        controls = self.controller.controls
        self.controller.bar.set_guide_keys(settings.text("keys") == GUIDE_KEYS)
        controls.set_speed(settings.number(f"{self.link.robot.name}/speed", controls.speed))
        self.window.gate.careful_choice = CHOICES.get(settings.text(f"{self.link.robot.name}/careful"))
        access = self.controller.access
        if isinstance(access, MovementAccess):
            access.keep_stop(clean_name(settings.text(f"{self.link.robot.name}/stopped_by")))

    def save(self, settings: Settings) -> None:
        """Save the settings for the next session."""
        settings.save(f"{self.link.robot.name}/speed", self.controller.controls.speed)
        if self.controller.access.shared:
            settings.save("keys", GUIDE_KEYS if self.controller.bar.guide_keys else "")
        settings.save(f"{self.link.robot.name}/address", self.window.address.text())
        access = self.controller.access
        if isinstance(access, MovementAccess):
            settings.save(f"{self.link.robot.name}/stopped_by", access.stopped_by)
        for word, choice in CHOICES.items():
            if self.window.gate.careful_choice is choice:
                settings.save(f"{self.link.robot.name}/careful", word)

    def start(self) -> None:
        """Look for the gamepad from now on; to be called when the window is on the screen."""
        self.gamepad.start()

    def close(self) -> None:
        """Stop the robot, and end what belongs to this window."""
        self.controller.dismiss()
        self.link.finish(ENDS_WITHIN)
        self.capture.recorder.close()


def bring_to_front(tabs: Sequence[RobotTab], chosen: int) -> None:
    """Drive, show and talk through one of the robots only."""
    tabs[chosen].set_in_front(True)  # first: conversations are handed on to it
    for tab in tabs:
        if tab is not tabs[chosen]:
            tab.set_in_front(False)


def hand_on_conversations(tabs: Sequence[RobotTab]) -> None:
    """Let a conversation go on with the robot that comes to the front, which is seen as well. Who was not heard before
    is not heard there. What does not end at a robot in the back is said in front."""

    def front() -> RobotTab:
        return next(tab for tab in tabs if tab.in_front)

    def go_on(left: RobotTab) -> None:
        front().window.feedButton.setChecked(True)
        front().controller.conversation.want(True, muted=left.window.sound.muted)

    def say(tab: RobotTab) -> None:
        if not tab.in_front and (problem := tab.controller.conversation.problem):
            front().window.status.say(f"{tab.title}: {problem}", "warn")

    for tab in tabs:
        tab.controller.conversation.handed_on.connect(partial(go_on, tab))
        tab.controller.conversation.changed.connect(partial(say, tab))


class Terminals:
    """The terminals of all robots, which are opened and denied together (`gui.app.authorization.Lockable`)."""

    def __init__(self, tabs: list[RobotTab]) -> None:
        self._terminals = [tab.terminal for tab in tabs]

    def start(self) -> None:
        for terminal in self._terminals:
            terminal.start()

    def deny(self, reason: str) -> None:
        for terminal in self._terminals:
            terminal.deny(reason)
