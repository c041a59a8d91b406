"""The buttons of the report that bring the robot up: Roscore start, Session start and Stop.

*Roscore start* brings the programs of the robot up in the terminal, *Session start* connects this window with them, and
*Stop* ends what runs in the terminal. Each does what is still missing, so that any order works: Session start brings
the programs up, too, and both start a ROS master if there is none. What runs elsewhere (`./stack up`) is used as it is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from PyQt5.QtCore import QObject, pyqtSignal

from gui.ros.link_state import LinkState
from gui.ros.readings import DriveState
from gui.styling import set_property
from gui.terminal import commands
from gui.terminal.terminal_view import TERMINAL
from telepresence.station.fault_sentences import UNREACHABLE

if TYPE_CHECKING:
    from gui.app.keyboard_focus import KeyboardFocus
    from gui.ros.link import RosLink
    from gui.terminal.terminal_view import TerminalView
    from gui.window import OperatorWindow

FOUND = {
    "picture": "camera", "laser": "laser", "sonar_front": "sonar", "infrared": "infrared", "bumper": "bumpers",
    "battery": "battery", "safety": "safety gate", "page": "tablet page", "voice_state": "sound",
    "true_pose": "body state",
}  # fmt: skip
"""Channels that a person misses when they are not there, and what they are called."""
TIDY_TIME = 40.0
"""[s] after Stop during which the master is tidied: longer than the terminal has for ending."""
LOOKS = 2
"""How often the master is asked after the end of what ran in the terminal: the first answer may be older than that.
Programs that still run then were started elsewhere."""
STILL_STOPPING = "What runs in the terminal is still ending. Press it again when the window says Stopped."


class RobotSession(QObject):
    """Brings one robot's programs up, connects, and ends them.

    Args:
        window, link, terminal: Where the buttons are, what they connect with, and where lines are typed.
        keys: Whoever presses a button drives with the keys of the window afterwards.
        sign_in: Whether people sign in; otherwise the robot's programs are started for everybody.
    """

    said = pyqtSignal(str, str)
    """A message for the pilot, and its level."""
    changed = pyqtSignal()
    """What `advice` returns may have changed."""

    def __init__(
        self, window: OperatorWindow, link: RosLink, terminal: TerminalView, keys: KeyboardFocus, sign_in: bool
    ) -> None:
        super().__init__(window)
        self._window, self._link, self._terminal, self._keys = window, link, terminal, keys
        self._sign_in = sign_in
        self._waits_for_master = self._starting = self._connecting = self._stopping = False
        self._stopped = self._connected = False
        self._robot_state = ""
        self._used: str | None = None
        """The address for which the running programs were started here; else the one that was there when they were
        found, because programs do not say for which robot they run. None while there are none."""
        self._looks_left: int | None = None
        """None until what runs in the terminal has ended after Stop."""
        link.state_changed.connect(self._on_state)
        link.looked.connect(self._on_look)
        if link.has("drive_state"):
            link.channel("drive_state").arrived.connect(self._on_drive_state)
        self._keyboard_line = ""
        """What started the keyboard program that runs in the terminal, if that was typed last."""
        self._terminal_failed = False
        terminal.ended.connect(self._on_ended)
        terminal.typed.connect(self._on_typed)
        terminal.failed.connect(self._on_terminal_failed)
        terminal.ready.connect(self._on_terminal_ready)
        terminal.refused.connect(self._on_refused)
        window.address.textChanged.connect(lambda: self._mark_address(valid=True))

    # --- buttons ---

    def start_programs(self) -> None:
        """Bring the robot's programs up: type their command line, below a ROS master of its own."""
        self._show_terminal()
        if self._stopping:
            self._say(STILL_STOPPING, "warn")
        elif self._link.state.driver and not self._is_address_used():
            self._say_unused()
        elif self._link.state.driver:
            where = self._link.state.master_uri
            self._say(f"The robot's programs run already at {where}. Press Session start to connect.")
        else:
            self._bring_up()

    def start_session(self) -> None:
        """Connect with the robot's programs; bring them up first if they do not run."""
        self._show_terminal()
        if self._stopping:
            self._say(STILL_STOPPING, "warn")
        elif self._link.state.driver and not self._is_address_used():
            self._say_unused()
        elif self._link.state.driver:
            self._connect()
        else:
            self._connecting = True
            self._bring_up()

    def stop(self) -> None:
        """End what runs in the terminal's session, and have the master forget what had to be killed."""
        self._waits_for_master = self._starting = self._connecting = self._connected = False
        self._stopping = True
        self._looks_left = None
        self._link.tidy_master(TIDY_TIME)
        self._terminal.end_program()
        self._say("Stopping the robot and what runs in the terminal.", "warn")

    def join(self, start_keyboard: bool) -> None:
        """Use programs that run already without a button having been pressed."""
        self._connected = True
        if start_keyboard:
            self._start_keyboard()

    @property
    def ending(self) -> bool:
        """Whether the robot's programs end, or have ended, because the pilot wanted it."""
        return self._stopping or (self._stopped and not self._link.state.driver)

    # --- for the message ---

    def advice(self) -> tuple[str, str] | None:
        """Return what the pilot should know or do next and its level; None when the session is complete."""
        state = self._link.state
        then = "this window connects when they answer." if self._connecting else "then press Session start."
        if self._stopping:
            return "Stopping the robot and what runs in the terminal.", "warn"
        if not state.master:
            if self._waits_for_master:
                return f"A ROS master is being started, then the robot's programs; {then}", "info"
            return f"No ROS master answers at {state.master_uri}. Press Roscore start.", "warn"
        if not state.driver:
            if self._starting:
                return f"The robot's programs are starting, see the terminal; {then}", "info"
            if self._stopped:
                return "Stopped: the robot's programs have ended. Roscore start brings them back.", "warn"
            press = "Press" if self._window.address.isHidden() else "Type its address and press"
            return f"The robot's programs are not running. {press} Roscore start.", "warn"
        if not self._connected:
            return "The robot's programs are running. Press Session start to connect.", "info"
        return None

    def findings(self) -> tuple[str, str]:
        """Return what this window is connected with, and the level of the message."""
        title = self._link.robot.title
        if self._robot_state.startswith(UNREACHABLE):
            return f"The driver runs, but {title} does not answer ({self._robot_state}).", "bad"
        wanted = {name: text for name, text in FOUND.items() if self._link.has(name)}
        found = ", ".join(text for name, text in wanted.items() if name in self._link.found)
        return f"Connected to {title}: {found or 'nothing is published yet'}.", "good"

    # --- the steps ---

    def _show_terminal(self) -> None:
        self._window.show_terminal()
        self._keys.give_to_window()

    def _bring_up(self) -> None:
        """Type what is still missing."""
        try:
            address = commands.parse_address(self._window.address.text())
        except ValueError as error:
            self._mark_address(valid=False)
            self._connecting = False
            self._say(str(error), "bad")
            return
        self._stopped = False
        if self._link.state.master:
            self._launch(address)
        else:
            self._waits_for_master = True
            line = commands.roscore(self._link.state.master_uri)
            self._terminal.type_line(line, commands.ROSCORE_WINDOW, otherwise="roscore is being started.")
        self.changed.emit()

    def _launch(self, address: commands.Address) -> None:
        again = "The robot's programs are being started in the terminal already." if self._starting else None
        if not self._starting:
            self._used = self._typed()
        self._starting = True
        options = [commands.QUIET] if self._link.has("conversation") else []
        if self._link.has("lease") and not self._sign_in:
            options.append(commands.OPEN_TO_ALL)
        self._terminal.type_line(
            lambda: " ".join([self._link.robot.session(address, commands.own_address_towards(address.host)), *options]),
            otherwise=again,
        )

    def _typed(self) -> str:
        return self._window.address.text().strip()

    def _is_address_used(self) -> bool:
        return self._window.address.isHidden() or self._used in (None, self._typed())

    def _say_unused(self) -> None:
        """Whoever types another address would think that the keys drive that robot now."""
        self._mark_address(valid=False)
        typed = self._typed() or "What is typed now"
        self._say(
            f"The robot's programs run already, for {self._used}. {typed} is not used: press Stop, then Roscore start.",
            "warn",
        )

    def _connect(self) -> None:
        self._connecting = self._stopped = False
        self._connected = True
        self._start_keyboard()
        self._say(*self.findings())
        self.changed.emit()

    def _start_keyboard(self) -> None:
        """Start the keyboard program, unless the terminal is in use: by the robot's programs, which include it."""
        robot = self._link.robot
        if robot.keyboard:
            line = commands.keyboard(robot.keyboard, robot.keyboard_name, self._link.state.keyboards)
            self._terminal.type_line(line, otherwise="")

    # --- what happens ---

    def _on_typed(self, line: str) -> None:
        keyboard = self._link.robot.keyboard
        self._keyboard_line = line if keyboard and line.startswith(keyboard) else ""

    def _on_terminal_failed(self, part: str) -> None:
        self._terminal_failed = self._terminal_failed or part == TERMINAL

    def _on_terminal_ready(self) -> None:
        """A terminal that has taken the place of one that died gets the keyboard program that had run there."""
        if self._terminal_failed and self._keyboard_line and self._connected:
            self._terminal.type_line(self._keyboard_line)
        self._terminal_failed = False

    def _on_state(self, state: LinkState) -> None:
        if self._waits_for_master and state.master:
            self._waits_for_master = False
            self._bring_up()
        if state.driver and not self._stopping:
            self._starting = False
            if self._used is None:
                self._used = self._typed()
            if self._connecting:
                self._connect()

    def _on_drive_state(self, state: DriveState) -> None:
        before = self._robot_state.startswith(UNREACHABLE)
        self._robot_state = state.text
        if before != state.text.startswith(UNREACHABLE):
            self.changed.emit()

    def _on_refused(self, _why: str) -> None:
        self._waits_for_master = self._starting = self._connecting = False
        self._used = self._used if self._link.state.driver else None

    def _on_ended(self, left: str) -> None:
        if not self._stopping:
            return
        if left:
            self._stopping = False
            self._say(f"{left} still runs in the terminal: click there and press Ctrl-C, or Ctrl-\\ .", "bad")
            return
        self._link.tidy_master(TIDY_TIME)
        self._looks_left = LOOKS

    def _on_look(self) -> None:
        """Say what still runs after Stop."""
        if not self._stopping or self._looks_left is None:
            return
        self._looks_left -= 1
        if not self._link.state.driver:
            self._stopping, self._stopped = False, True
            self._used = None
            self._mark_address(valid=True)
            self.changed.emit()
        elif self._looks_left <= 0:
            self._stopping = False
            text = "Stopped. The robot's programs run elsewhere and go on; Session start brings the keyboard back."
            self._say(text, "warn")

    def _mark_address(self, valid: bool) -> None:
        set_property(self._window.address, "invalid", not valid)

    def _say(self, text: str, level: str = "info") -> None:
        self.said.emit(text, level)
