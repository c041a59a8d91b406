"""Where keys go, and that nobody can mistake it: one keypress, one meaning."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PyQt5 import sip
from PyQt5.QtCore import QObject, pyqtSignal
from PyQt5.QtWidgets import QApplication

from gui.driving.drive_pad import wants_arrows, wants_letters
from gui.styling import set_property
from gui.theme import application

if TYPE_CHECKING:
    from gui.terminal.terminal_view import TerminalView
    from gui.window import OperatorWindow

TERMINAL_KEYS = "Keys go to the terminal: i j l ,  drive, k stops.  F6 or a click on the picture: W A S D drive."
IDLE = "Click here or press F6 to type here."
NO_PROGRAM = "Keys go to the terminal, where no program drives.  F6 or a click on the picture: W and S walk."
TIP = "Keys go where the last click was; F6 switches"


class KeyboardFocus(QObject):
    """Shows whether keys drive, are typed into the terminal, or go elsewhere: on the pad, in the legends of the keys,
    below the terminal and in the status bar.

    Args:
        window, terminal: The two that may have the keyboard.
        by_movement: The robot only walks forward and backward, and no keyboard program drives it.
    """

    elsewhere = pyqtSignal(bool)
    """Whether another window has the keyboard, so that nobody may be looking at this one."""

    def __init__(self, window: OperatorWindow, terminal: TerminalView, by_movement: bool = False) -> None:
        super().__init__(window)
        self._typing = NO_PROGRAM if by_movement else TERMINAL_KEYS
        self._window, self._terminal = window, terminal
        terminal.focus_changed.connect(self._on_terminal_focus)
        window.activation_changed.connect(self.show)
        application().focusChanged.connect(self.show)
        self.show()

    def give_to_window(self) -> None:
        """Let keys drive: whoever presses a button of the window looks at the window."""
        self._terminal.give_keyboard_back()
        self._window.pad.setFocus()

    def show(self, *_changed: object) -> None:
        """Show where keys go now."""
        if sip.isdeleted(self._window):
            return  # a window that is destroyed loses the focus, too
        typing = self._terminal.has_keyboard
        if typing:
            chip, note = ("Keys: terminal", "warn"), "Keys go to the terminal.\nF6 or a click on the picture: drive"
        elif not self._window.isActiveWindow():
            chip, note = ("Keys: elsewhere", "off"), "Keys go to another window.\nClick here: drive"
        elif wants_letters(QApplication.focusWidget()):
            chip, note = ("Keys: text field", "warn"), "Keys go into a text field.\nClick here: drive"
        elif wants_arrows(QApplication.focusWidget()):
            chip, note = ("Arrows: choose", "warn"), ""
        else:
            chip, note = ("Keys: drive pad", "good"), ""
        window = self._window
        self.elsewhere.emit(not typing and not window.isActiveWindow())
        window.status.set_chip("keys", *chip, TIP)
        window.pad.set_keys_note(note)
        window.padLabel.setVisible(not note)
        window.keys.window_keys.show_rows(window.pad.key_rows)
        window.keys.window_keys.set_used(not note)
        window.keys.terminal_keys.set_used(typing)
        window.terminalLabel.setText(self._typing if typing else IDLE)
        set_property(window.terminalLabel, "level", "warn" if typing else "off")
        set_property(window.terminalFrame, "active", typing)

    def _on_terminal_focus(self, has_keyboard: bool) -> None:
        if has_keyboard:
            self._window.pad.release_all()
        self.show()
