"""What the buttons do and the indicators show: connects one robot's page with its ROS link and its terminal."""

from __future__ import annotations

import enum
from typing import TYPE_CHECKING

from PyQt5.QtCore import QObject

from gui.app.views import Views
from gui.driving.access_bar import AccessBar
from gui.driving.drive_access import DriveAccess
from gui.driving.drive_controls import DriveControls
from gui.driving.drive_coordinator import DriveCoordinator
from gui.driving.gamepad import Gamepad
from gui.driving.gamepad_view import DIRECT_KEYS, GamepadView
from gui.driving.lease_client import LeaseClient
from gui.driving.movement_access import MovementAccess
from gui.ros.link_state import LinkState
from gui.ros.picture import Picture
from gui.styling import set_property
from gui.terminal import commands
from telepresence.teleop.drive_lease import Account

if TYPE_CHECKING:
    from gui.ros.link import RosLink
    from gui.terminal.terminal_view import TerminalView
    from gui.window import OperatorWindow


class Attach(enum.Enum):
    """Whether to attach to programs that run already: show the camera, and start the keyboard in the terminal."""

    AUTO = "auto"
    """Attach when a driver is found before any button is pressed."""
    ALWAYS = "always"
    """Attach as soon as there is a ROS master."""
    NEVER = "never"


class Controller(QObject):
    """The behaviour of one robot's page.

    Args:
        window, link, terminal: What it connects. The caller starts `link` and `terminal`.
        attach: Whether to attach to programs that run already.
        sign_in: Whether people sign in; otherwise the robot's programs are started for everybody.
        gamepad: An input device besides pad and picture; by default one that never drives.
    """

    def __init__(
        self,
        window: OperatorWindow,
        link: RosLink,
        terminal: TerminalView,
        attach: Attach = Attach.AUTO,
        sign_in: bool = False,
        gamepad: Gamepad | None = None,
    ) -> None:
        super().__init__(window)
        self._window, self._link, self._terminal = window, link, terminal
        self._attach = attach
        self._sign_in = sign_in
        self.access: DriveAccess = MovementAccess(link) if link.robot.by_movement else LeaseClient(link)
        self.gamepad = gamepad or Gamepad(None, self)
        self.controls = DriveControls()
        self.bar = AccessBar(self.access, sign_in)
        self.driving = DriveCoordinator(window, link, self.access, self.gamepad, self.controls)
        self._mount()

        window.roscoreButton.clicked.connect(self.start_roscore)
        window.sessionButton.clicked.connect(self.start_session)
        window.address.returnPressed.connect(self.start_session)
        window.address.textChanged.connect(lambda: self._mark_address(valid=True))
        window.feedButton.toggled.connect(self.show_feed)
        window.stopButton.clicked.connect(self.stop)
        window.activation_changed.connect(self._show_keys)
        self.driving.said.connect(self._say)
        self.views = Views(window, link)
        self.views.said.connect(self._say)
        self.views.share_changed.connect(self.driving.set_share)
        self.driving.mux.add(self.views.floor_drive)
        self.driving.sent.connect(self.views.note_sent)
        window.video.status.connect(window.pictureLabel.setText)
        window.video.stale_changed.connect(self._on_stale)
        link.state_changed.connect(self._on_state)
        link.channel("picture").arrived.connect(self._on_picture)
        self._drove = False
        self.access.changed.connect(self._on_access)
        link.trouble.connect(lambda text: window.status.say(text, "bad"))
        terminal.refused.connect(lambda text: window.status.say(text, "warn"))
        terminal.typed.connect(lambda line: window.status.say(f"Typed into the terminal:  {line}"))
        terminal.focus_changed.connect(self._on_terminal_focus)

        window.feedLabel.setText(link.feed)
        self._show_keys()
        self._clear_video()
        self._show_links()
        self._advise()

    def _mount(self) -> None:
        """Add the widgets for driving to the window."""
        window = self._window
        window.accessSlot.addWidget(self.bar)
        window.driveSlot.addWidget(self.controls)
        self.pad_view = GamepadView()
        window.deck.addTab(self.pad_view, "Gamepad")
        self.gamepad.changed.connect(self.pad_view.show_state)
        self.controls.pad_wanted.connect(lambda: window.show_page(self.pad_view))
        robot = self._link.robot
        self.controls.set_limits(robot.top_speed, robot.top_turn)
        self.gamepad.top_speed = robot.top_speed
        self.bar.guide_keys_wanted.connect(window.pad.set_guide_keys)
        self.bar.guide_keys_wanted.connect(self.controls.set_guide_speeds)
        if robot.by_movement:
            window.pad.limit_to(("forward", "backward"))
            self.controls.offer_restart_only()
            self.gamepad.direct = True
            self.pad_view.keys = DIRECT_KEYS
            for widget in (window.addressLabel, window.address):
                widget.hide()

    def admit(self, account: Account) -> None:
        """Connect to the robot for somebody who has signed in."""
        self._link.set_open(True)
        self.access.sign_in(account)
        for button in (self._window.roscoreButton, self._window.sessionButton, self._window.address):
            button.setEnabled(self.access.is_pilot)
        self._window.gate.set_may_switch(self.access.is_pilot)
        self._on_state(self._link.state)

    def dismiss(self) -> None:
        """Nobody is signed in any more: receive nothing, send nothing."""
        self.driving.mux.release_all()
        self.access.sign_out()
        self._window.feedButton.setChecked(False)
        self._link.set_open(False)

    # --- buttons ---

    def start_roscore(self) -> None:
        """Type roscore into a tmux window of its own."""
        self._attach = Attach.NEVER
        if self._link.state.master:
            self._say(f"A ROS master answers at {self._link.state.master_uri} already. Go on with Session start.")
            return
        self._window.show_terminal()
        self._terminal.type_line(commands.roscore(self._link.state.master_uri), commands.ROSCORE_WINDOW)

    def start_session(self) -> None:
        """Type the command that launches the robot's programs, or only the keyboard when they run already."""
        self._attach = Attach.NEVER
        self._window.show_terminal()
        if self._link.state.driver:
            if not self._link.robot.keyboard:
                self._advise()
                return
            self._start_keyboard(self._link.state)
            self._terminal.take_keyboard()
            return
        try:
            address = commands.parse_address(self._window.address.text())
        except ValueError as error:
            self._mark_address(valid=False)
            self._say(str(error), "bad")
            return
        open_to_all = "" if self._sign_in or self._link.robot.by_movement else f" {commands.OPEN_TO_ALL}"
        self._terminal.type_line(
            lambda: self._link.robot.session(address, commands.own_address_towards(address.host)) + open_to_all
        )
        if self._link.robot.keyboard:
            self._terminal.take_keyboard()

    def _start_keyboard(self, state: LinkState) -> None:
        keyboard = self._link.robot.keyboard
        if not keyboard:
            return
        self._terminal.type_line(f"{keyboard} {commands.SECOND_NAME}" if state.keyboard else keyboard)

    def show_feed(self, wanted: bool) -> None:
        """Show the robot's camera, or stop doing so."""
        self._link.watch("picture", wanted)
        self.views.watch_picture(wanted)
        self._clear_video()
        self._show_links()
        self._advise()

    def stop(self) -> None:
        """Stop the robot, and what runs in the terminal's session."""
        self.driving.stop()
        self._terminal.interrupt()
        self._say("Stopped. Session start brings the programs or the keyboard back.", "warn")

    # --- what the link reports ---

    def _on_state(self, state: LinkState) -> None:
        if self.access.account is not None:
            self._join_running(state)
        if self._window.video.age() == float("inf"):
            self._clear_video()
        self._show_links()
        self._advise()

    def _on_access(self) -> None:
        """Whoever may drive again no longer sees why they could not."""
        if self.access.mine and not self._drove:
            self._advise()
        self._drove = self.access.mine

    def _join_running(self, state: LinkState) -> None:
        if (self._attach is Attach.ALWAYS and state.master) or (self._attach is Attach.AUTO and state.driver):
            self._attach = Attach.NEVER
            self._window.feedButton.setChecked(True)
            if self.access.is_pilot:
                self._start_keyboard(state)

    def _on_picture(self, picture: Picture) -> None:
        first = self._window.video.age() == float("inf")
        try:
            self._window.video.show_picture(picture)
        except ValueError as error:
            self._say(f"{self._link.feed}: {error}.", "bad")
            return
        if first:
            self._show_links()
            self._advise()

    def _on_stale(self, stale: bool) -> None:
        self._show_links()
        if stale:
            self._say(f"No new picture on {self._link.feed}. The drive pad is off until there is one.", "bad")
        elif self._window.feedButton.isChecked():
            self._advise()

    def _clear_video(self) -> None:
        state = self._link.state
        if not self._window.feedButton.isChecked():
            text = ("Robot feed is off", "Press Robot feed to see what the robot sees.")
        elif not state.master:
            text = ("No ROS master", f"None answers at {state.master_uri}. Press Roscore start.")
        elif not state.feed:
            text = ("No camera yet", f"Nobody publishes {self._link.feed}. Press Session start and wait a moment.")
        else:
            text = ("Waiting for the first picture", self._link.feed)
        self._window.video.clear(*text)

    def _advise(self) -> None:
        """Say what to do next."""
        state = self._link.state
        if not state.master:
            self._say(f"No ROS master answers at {state.master_uri}. Press Roscore start.", "warn")
        elif not state.driver:
            press = "Press" if self._link.robot.by_movement else "Type its address and press"
            self._say(f"The robot's programs are not running. {press} Session start.", "warn")
        elif not self._window.feedButton.isChecked():
            self._say("The robot's programs are running. Press Robot feed to see its camera.")
        else:
            ways = "keys typed in the terminal" if self._link.robot.keyboard else "the gamepad's cross"
            self._say(f"Ready. Drive with the pad, or with {ways}.", "good")

    def _show_links(self) -> None:
        state, set_chip = self._link.state, self._window.status.set_chip
        master = ("ROS master", "good") if state.master else ("No ROS master", "bad")
        set_chip("master", *master, state.master_uri)
        robot = ("Robot programs", "good") if state.driver else ("No robot programs", "off")
        set_chip("robot", *robot, "Whether a driver listens to cmd_vel")
        if not self._window.feedButton.isChecked():
            picture = ("Feed off", "off")
        elif self._window.video.stale:
            picture = ("Picture lost", "bad")
        elif self._window.video.age() == float("inf"):
            picture = ("No picture", "warn")
        else:
            picture = ("Picture", "good")
        set_chip("picture", *picture, self._link.feed)

    # --- keyboard ---

    def _on_terminal_focus(self, has_keyboard: bool) -> None:
        if has_keyboard:
            self._window.pad.release_all()
        self._show_keys()

    def _show_keys(self) -> None:
        if self._terminal.has_keyboard:
            chip, label = ("Keys: terminal", "good"), "has the keyboard"
        elif self._window.isActiveWindow():
            chip, label = ("Keys: drive pad", "good"), "click to type here"
        else:
            chip, label = ("Keys: elsewhere", "off"), "click to type here"
        self._window.status.set_chip("keys", *chip, "Click into the terminal, or beside it, to change this")
        self._window.terminalLabel.setText(label)
        set_property(self._window.terminalFrame, "active", self._terminal.has_keyboard)

    def _mark_address(self, valid: bool) -> None:
        set_property(self._window.address, "invalid", not valid)

    def _say(self, text: str, level: str = "info") -> None:
        self._window.status.say(text, level)
