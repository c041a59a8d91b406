"""Connects one robot's page with its ROS link and its terminal, and shows how they are."""

from __future__ import annotations

import enum
import time
from typing import TYPE_CHECKING

from PyQt5.QtCore import QObject

from gui.app.conversation import Conversation
from gui.app.fault_watch import FaultWatch
from gui.app.keyboard_focus import KeyboardFocus
from gui.app.last_values import LastValues
from gui.app.session import RobotSession
from gui.app.views import Views
from gui.driving.access_bar import AccessBar
from gui.driving.drive_access import DriveAccess
from gui.driving.drive_controls import DriveControls
from gui.driving.drive_coordinator import DriveCoordinator
from gui.driving.gamepad import Gamepad
from gui.driving.gamepad_view import DIRECT_KEYS, GamepadView
from gui.driving.lease_access import LeaseAccess
from gui.driving.look_around import LookAround
from gui.driving.movement_access import MovementAccess
from gui.ros.link_state import LinkState
from gui.ros.picture import Picture
from telepresence.teleop.lease_messages import Account

if TYPE_CHECKING:
    from gui.ros.link import RosLink
    from gui.terminal.terminal_view import TerminalView
    from gui.window import OperatorWindow

WAYS = "W A S D Q E and the pad drive"


class Attach(enum.Enum):
    """Whether to attach to programs that run already: show the camera, and start the keyboard in the terminal."""

    AUTO = "auto"
    """Attach when a driver is found before any button is pressed."""
    ALWAYS = "always"
    """Attach as soon as there is a ROS master."""
    NEVER = "never"


PRESS_AGAIN = "You may drive again: let go, and press again."


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
        self._attach = self._attach_first = attach
        self.begins_conversation = False
        """Whether attaching begins the conversation, too, when it is a pilot who has come, each time somebody signs in;
        and there is none while nobody is signed in, whoever has begun it."""
        self.access: DriveAccess = MovementAccess(link) if link.robot.by_movement else LeaseAccess(link)
        self.gamepad = gamepad or Gamepad(None, self)
        self.controls = DriveControls()
        self.bar = AccessBar(self.access, sign_in)
        self.driving = DriveCoordinator(window, link, self.access, self.gamepad, self.controls)
        self._mount()

        self.keys = KeyboardFocus(window, terminal, link.robot.by_movement)
        self.session = RobotSession(window, link, terminal, self.keys, sign_in)
        self.conversation = Conversation(link, self.access)
        self.views = Views(window, link, self.access)
        self.driving.mux.add(self.views.floor_drive)
        self.looking = LookAround(
            window, link, self.access, self.views.floor_drive, lambda: self.driving.mux.block, lambda: self.views.lens
        )
        self.views.paint_more(self.looking.paint)
        self.faults = FaultWatch(link, self.access, window.video)
        self.last_values = LastValues(window, link)
        self._drove = False
        self._blocks: set[str] = set()
        """What has forbidden driving since it was last allowed."""
        self._connect_parts()
        self._connect_buttons()
        self._connect_terminal()

        window.feedLabel.setText(link.feed)
        self._clear_video()
        self._show_links()
        self._advise()

    def _connect_parts(self) -> None:
        for part in (self.session, self.driving, self.views, self.looking):
            part.said.connect(self._say)
        self.session.changed.connect(self._advise)
        self.conversation.changed.connect(self._advise)
        self.bar.guide_keys_wanted.connect(self.keys.show)
        self.views.share_changed.connect(self.driving.set_share)
        self.gamepad.looked.connect(self.looking.tilt)
        self.keys.elsewhere.connect(self.gamepad.set_elsewhere)
        self.keys.show()
        self.driving.sent.connect(self.views.note_sent)
        self._window.pad.dropped_changed.connect(self._on_dropped)
        self.driving.mux.block_changed.connect(self._on_block)
        self.driving.blocked.connect(self.views.forget_sent)
        self.faults.changed.connect(self._show_fault)
        self.access.changed.connect(self._on_access)
        self._window.video.stale_changed.connect(self._on_stale)
        self._link.state_changed.connect(self._on_state)
        self._link.channel("picture").arrived.connect(self._on_picture)

    def _connect_buttons(self) -> None:
        window = self._window
        window.roscoreButton.clicked.connect(self.start_programs)
        window.sessionButton.clicked.connect(self.start_session)
        window.address.returnPressed.connect(self.start_session)
        window.feedButton.toggled.connect(self.show_feed)
        window.feedButton.clicked.connect(self._on_feed_click)
        window.stopButton.clicked.connect(self.stop)

    def _connect_terminal(self) -> None:
        status, terminal = self._window.status, self._terminal
        self._window.video.status.connect(self._window.pictureLabel.setText)
        self._link.trouble.connect(lambda text: status.say(text, "bad"))
        terminal.failed.connect(self.faults.report)
        terminal.refused.connect(lambda text: status.say(text, "warn"))
        terminal.typed.connect(lambda line: status.say(f"Typed into the terminal:  {line}"))
        terminal.busy.connect(lambda text: status.say(text) if text else None)

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
            for widget in (window.addressLabel, window.address, window.keys.terminal_keys):
                widget.hide()

    def admit(self, account: Account) -> None:
        """Connect to the robot for somebody who has signed in."""
        self.last_values.clear()  # what was on its way when the last person left is not for this one
        self._link.set_open(True)
        self.access.sign_in(account)
        for button in (self._window.roscoreButton, self._window.sessionButton, self._window.address):
            button.setEnabled(self.access.is_pilot)
        self._pause_faults()
        self._on_state(self._link.state)

    def dismiss(self) -> None:
        """Nobody is signed in any more: receive nothing, send nothing."""
        self.driving.mux.release_all()
        self.conversation.leave()
        if self.begins_conversation:
            self._attach = self._attach_first
            self.conversation.end_earlier()
        self.access.sign_out()
        self._window.feedButton.setChecked(False)
        self._link.set_open(False)
        self.last_values.clear()
        self._pause_faults()

    # --- buttons ---

    def start_programs(self) -> None:
        """Bring the robot's programs up in the terminal."""
        self._attach = Attach.NEVER
        self.session.start_programs()

    def start_session(self) -> None:
        """Connect with the robot's programs, which are brought up first if they do not run."""
        self._attach = Attach.NEVER
        self.session.start_session()

    def show_feed(self, wanted: bool) -> None:
        """Show the robot's camera, or stop doing so."""
        self._link.watch("picture", wanted)
        self.views.watch_picture(wanted)
        self._clear_video()
        self._show_links()
        self._advise()

    def _on_feed_click(self, wanted: bool) -> None:
        """Begin or end the conversation. Only a click does: a tab that comes to the front shows its picture, and goes
        on with a conversation that there was with another robot."""
        self.keys.give_to_window()
        self.conversation.want(wanted)
        if wanted:
            self.session.join(start_keyboard=False)
        self._advise()

    def stop(self) -> None:
        """Stop the robot, and what runs in the terminal's session if that is this pilot's to end."""
        self.driving.stop()
        if self.access.is_pilot:
            self.session.stop()
        self._pause_faults()

    # --- what the link reports ---

    def _on_state(self, state: LinkState) -> None:
        if self.access.account is not None:
            self._join_running(state)
        if self._window.video.age() == float("inf"):
            self._clear_video()
        self._show_links()
        self._advise()

    def _on_access(self) -> None:
        """Say it when this window gets the robot, or nobody has it any more; who takes it is said elsewhere."""
        lease = self.access.state
        self._window.gate.set_may_switch(self.access.mine)
        if self.access.mine != self._drove and (self.access.mine or lease is None or not lease.pilot):
            self._advise()
        self._drove = self.access.mine

    def _on_block(self, before: str) -> None:
        """Say what forbids driving to somebody whose key it has let go of, and that it has passed where it was said."""
        block, held = self.driving.mux.block, self._window.pad.dropped
        self._blocks.add(before)
        if block and held:
            self._say(block, "warn")
        elif not block:
            if held or any(reason and self._window.status.message.startswith(reason) for reason in self._blocks):
                self._advise()
            self._blocks.clear()

    def _on_dropped(self) -> None:
        if self._window.status.message == PRESS_AGAIN:
            self._advise()

    def _join_running(self, state: LinkState) -> None:
        if (self._attach is Attach.ALWAYS and state.master) or (self._attach is Attach.AUTO and state.driver):
            self._attach = Attach.NEVER
            self._window.feedButton.setChecked(True)
            self.session.join(start_keyboard=self.access.is_pilot)
            if self.begins_conversation and self.access.is_pilot:
                self.conversation.greet()

    def _on_picture(self, picture: Picture) -> None:
        first = self._window.video.age() == float("inf")
        try:
            self._window.video.show_picture(picture)
        except ValueError as error:
            self._say(f"{self._link.feed}: {error}.", "bad")
            return
        if first:
            self._window.keys.set_wanted(False)
            self._show_links()
            self._advise()

    def _on_stale(self, stale: bool) -> None:
        self._show_links()
        if not stale and self._window.feedButton.isChecked():
            self._advise()

    def _clear_video(self) -> None:
        self._window.keys.set_wanted(True)
        state = self._link.state
        if not self._window.feedButton.isChecked():
            text = ("Robot feed is off", "Press Robot feed to see what the robot sees.")
        elif not state.master:
            text = ("No ROS master", f"None answers at {state.master_uri}. Press Roscore start.")
        elif not state.feed:
            text = ("No camera yet", f"Nobody publishes {self._link.feed}. Press Roscore start and wait a moment.")
        else:
            text = ("Waiting for the first picture", self._link.feed)
        self._window.video.clear(*text)

    def _advise(self) -> None:
        """Say what has failed; else what the buttons have done, and what to do next."""
        self._pause_faults()
        fault, advice = self.faults.fault, self.session.advice()
        if fault is not None:
            self._say(fault.sentence, "bad" if fault.cause.stops else "warn")
        elif advice is not None:
            feed_waits = self._window.feedButton.isChecked() and self.conversation.text and not self._link.state.driver
            waits = "Robot feed waits for the robot. " if feed_waits else ""
            self._say(f"{waits}{advice[0]}", advice[1])
        elif not self._window.feedButton.isChecked():
            text, level = self.session.findings()
            still_on = self.conversation.text
            self._say(f"{still_on} {text} Next: Robot feed.".lstrip(), "warn" if still_on else level)
        elif self.driving.mux.block:
            self._say(f"{self.driving.mux.block} {self.conversation.text}".rstrip(), "warn")
        elif self._window.pad.dropped:
            self._say(PRESS_AGAIN, "warn")
        else:
            ways = "W and S, the pad and the gamepad's cross walk" if self._link.robot.by_movement else WAYS
            self._say(f"Ready: {ways}. {self.conversation.text}".rstrip(), "good")

    def _pause_faults(self) -> None:
        self.faults.set_paused(self.access.account is None or self.session.ending)

    def _show_fault(self) -> None:
        """Say it below the picture and at the bottom; and show all that there were."""
        fault, now = self.faults.fault, time.monotonic()
        stops = fault is not None and fault.cause.stops
        word = "" if fault is None else "Fault" if stops else "Note"
        self._window.gate.show_fault(word, fault.sentence if fault else "", "bad" if stops else "warn")
        if self._link.robot.by_movement:
            self._window.gate.setVisible(fault is not None)
        times = (time.localtime(time.time() - now + fault.since) for fault in self.faults.recent)
        lines = [
            f"{time.strftime('%H:%M:%S', when)}  {fault.sentence}"
            for when, fault in zip(times, self.faults.recent, strict=True)
        ]
        count = f"{len(lines)} fault{'s' if len(lines) != 1 else ''}" if lines else ""
        self._window.status.set_chip(
            "faults", count, "off" if fault is None else "bad" if stops else "warn", "\n".join(lines)
        )
        self._advise()

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

    def _say(self, text: str, level: str = "info") -> None:
        self._window.status.say(text, level)
