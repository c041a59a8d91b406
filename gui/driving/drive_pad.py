"""Driving by held keys and buttons, for mouse and keyboard.

While anything is held the velocity is sent twenty times a second; on the last release zero is sent once, and then
nothing, so that another input device can drive. Losing the keyboard focus counts as releasing everything.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import NamedTuple

from PyQt5.QtCore import QEvent, QObject, Qt, QTimer, pyqtSignal
from PyQt5.QtGui import QKeyEvent, QResizeEvent
from PyQt5.QtWidgets import (
    QAbstractButton,
    QAbstractSpinBox,
    QApplication,
    QComboBox,
    QFrame,
    QGridLayout,
    QLineEdit,
    QPlainTextEdit,
    QPushButton,
    QTabBar,
    QTextEdit,
    QWidget,
)

from gui.application_events import filter_events
from gui.driving.physical_keys import command_key, physical_key
from gui.periodic_timer import PeriodicTimer
from gui.styling import set_property
from gui.theme import application
from gui.widgets.label import Label
from telepresence.teleop.command_timeout import SEND_PERIOD
from telepresence.teleop.hand_speeds import USUAL_SPEED, USUAL_TURN

_TEXTS = (QLineEdit, QTextEdit, QPlainTextEdit, QAbstractSpinBox)
_ARROWS = (Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.Key.Key_Left, Qt.Key.Key_Right)
WANTS_LETTERS = "wantsLetters"
"""Property of a widget that needs letters itself while it has the focus, so that they do not drive."""
BOUNCE = 30
"""[ms]. X11 repeats a held key as pairs of release and press; a pair whose halves arrive apart looks like a release."""


class Move(NamedTuple):
    """A key of the pad: its position, its label, and the direction it drives in."""

    row: int
    column: int
    symbol: str
    letter: str
    what: str
    x: int = 0
    y: int = 0
    theta: int = 0


# Letters as in Boston Dynamics' Spot SDK, example wasd: WASD drive without turning, Q and E turn.
MOVES: dict[str, Move] = {
    "turn_left": Move(0, 0, "↶", "Q", "Turn left", theta=1),
    "forward": Move(0, 1, "↑", "W", "Forward", x=1),
    "turn_right": Move(0, 2, "↷", "E", "Turn right", theta=-1),
    "left": Move(1, 0, "←", "A", "Left, without turning", y=1),
    "backward": Move(1, 1, "↓", "S", "Backward", x=-1),
    "right": Move(1, 2, "→", "D", "Right, without turning", y=-1),
}

KEYS: dict[int, str] = {
    Qt.Key.Key_Q: "turn_left",
    Qt.Key.Key_W: "forward",
    Qt.Key.Key_E: "turn_right",
    Qt.Key.Key_A: "left",
    Qt.Key.Key_S: "backward",
    Qt.Key.Key_D: "right",
    Qt.Key.Key_Up: "forward",
    Qt.Key.Key_Down: "backward",
    Qt.Key.Key_Left: "turn_left",
    Qt.Key.Key_Right: "turn_right",
}


GUIDE_KEYS: dict[int, str] = {Qt.Key.Key_Q: "turn_right", Qt.Key.Key_E: "turn_left"}
"""What differs with keys as in the Robotino guide: there Q turns right."""
_MODIFIERS = Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.AltModifier | Qt.KeyboardModifier.MetaModifier


def velocity_of(held: set[str], speed: float = USUAL_SPEED, turn: float = USUAL_TURN) -> tuple[float, float, float]:
    """Return forward, left [m/s] and counter-clockwise [rad/s] of all held moves together: opposites cancel, and a
    diagonal is no faster than a straight line."""
    x = sum(MOVES[name].x for name in held)
    y = sum(MOVES[name].y for name in held)
    theta = sum(MOVES[name].theta for name in held)
    length = math.hypot(x, y)
    scale = speed / length if length else 0.0
    return x * scale, y * scale, theta * turn


class DrivePad(QFrame):
    """The drive pad. The keys of the whole window drive, except while text is edited."""

    velocity = pyqtSignal(float, float, float)
    """Forward, left [m/s], counter-clockwise [rad/s]; repeated while held."""
    blocked = pyqtSignal(str)
    """Somebody tried to drive while it is blocked; the reason."""
    stop_pressed = pyqtSignal()
    """The space bar, or the pad's stop button, was pressed."""
    dropped_changed = pyqtSignal()
    """`dropped` has changed."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.speed, self.turn = USUAL_SPEED, USUAL_TURN
        self._pressed: dict[object, str] = {}
        self._dropped: set[object] = set()
        self._lifted: set[int] = set()
        self._block = ""
        self._keys = dict(KEYS)
        self._moves = frozenset(MOVES)
        self._caps: dict[str, QPushButton] = {}
        layout = QGridLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(6)
        for name, move in MOVES.items():
            cap = self._make_cap()
            cap.setObjectName(f"pad_{name}")
            cap.pressed.connect(self.setFocus)
            cap.pressed.connect(lambda name=name: self._press(("mouse", name), name))
            cap.released.connect(lambda name=name: self._release(("mouse", name)))
            layout.addWidget(cap, move.row, move.column)
            self._caps[name] = cap
        self.set_guide_keys(False)
        stop = self._make_cap()
        stop.setText("Stop   Space")
        stop.setToolTip("Stop (space bar)")
        stop.setAccessibleName("Stop")
        stop.setObjectName("padStop")
        stop.pressed.connect(self._press_stop)
        layout.addWidget(stop, 2, 0, 1, 3)
        self._stop_cap = stop
        # Covers the moves: a click on it brings the keys back and must not drive at once.
        self._note = Label(self)
        self._note.setObjectName("padNote")
        self._note.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self._note.setWordWrap(True)
        self._note.hide()
        self._timer = PeriodicTimer(round(1000 * SEND_PERIOD), self._send, self, precise=True)
        self._bounce = QTimer(self)
        self._bounce.setInterval(BOUNCE)
        self._bounce.setSingleShot(True)
        self._bounce.timeout.connect(self._release_lifted)
        keys = (QEvent.Type.KeyPress, QEvent.Type.KeyRelease)
        leaving = (QEvent.Type.WindowDeactivate, QEvent.Type.WindowBlocked, QEvent.Type.Hide)
        filter_events(self, *keys, *leaving)
        application().focusChanged.connect(self._on_focus)

    def set_guide_keys(self, wanted: bool) -> None:
        """Let Q turn right and E left, as in the Robotino guide; or Q left and E right."""
        self.release_all()
        self._keys = {**KEYS, **GUIDE_KEYS} if wanted else dict(KEYS)
        letters = {"turn_left": "E", "turn_right": "Q"} if wanted else {}
        for name, cap in self._caps.items():
            move = MOVES[name]
            letter = letters.get(name, move.letter)
            cap.setText(f"{move.symbol}\n{letter}")
            cap.setToolTip(f"{move.what} ({letter})")
            cap.setAccessibleName(move.what)

    def limit_to(self, names: Collection[str]) -> None:
        """Offer only these moves, to a robot that cannot do the others."""
        self._moves = frozenset(names)
        for name, cap in self._caps.items():
            cap.setVisible(name in self._moves)

    @property
    def held(self) -> set[str]:
        """The names of the moves that are held now."""
        return set(self._pressed.values())

    def stop(self) -> None:
        """Release everything and send zero, whether anything was held or not."""
        self._pressed.clear()
        self._lifted.clear()
        self._timer.stop()
        self._show_held()
        self.velocity.emit(0.0, 0.0, 0.0)

    def release_all(self) -> None:
        """Act as if everything that is held had been released."""
        self._set_dropped(set())
        if self._pressed:
            self.stop()

    @property
    def keeps_control(self) -> bool:
        """Whether anything is held: opposite moves together give zero."""
        return bool(self._pressed)

    def set_block(self, reason: str, passing: bool = False) -> None:
        """Do not drive until the reason is an empty string again, and then only when pressed again."""
        self._block = reason
        if reason and self._pressed:
            self._set_dropped(self._dropped | (self._pressed.keys() - self._lifted))
            self.stop()
        for cap in self._caps.values():
            set_property(cap, "blocked", bool(reason))

    @property
    def dropped(self) -> bool:
        """Whether something is held that does not drive, and will when it is pressed again: it was forbidden."""
        return bool(self._dropped)

    def _set_dropped(self, sources: set[object]) -> None:
        before, self._dropped = self.dropped, sources
        if self.dropped != before:
            self.dropped_changed.emit()

    @property
    def key_rows(self) -> tuple[tuple[tuple[str, str], ...], ...]:
        """Rows of (letter, symbol) as on the buttons of the moves; empty strings for one that is not offered."""
        rows: tuple[list[tuple[str, str]], ...] = ([], [])
        for name, cap in self._caps.items():
            symbol, _, letter = cap.text().partition("\n")
            rows[MOVES[name].row].append(("", "") if cap.isHidden() else (letter, symbol))
        return tuple(map(tuple, rows))

    @property
    def keys_note(self) -> str:
        """What the pad says instead of showing its keys; empty while they drive."""
        return self._note.text()

    def set_keys_note(self, note: str) -> None:
        """Cover the moves and their keys with this sentence, because keys go elsewhere; show them again when it is
        empty. The stop stays."""
        if note == self._note.text():
            return
        self._note.setText(note)
        self._note.setVisible(bool(note))
        self._stop_cap.setText("Stop" if note else "Stop   Space")
        self._place_note()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._place_note()

    def _place_note(self) -> None:
        first, last = self._caps["turn_left"].geometry(), self._caps["right"].geometry()
        self._note.setGeometry(first.united(last))
        self._note.raise_()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        kind = event.type()
        if isinstance(event, QKeyEvent) and kind in (QEvent.Type.KeyPress, QEvent.Type.KeyRelease):
            # The release of a held key counts wherever the keyboard focus is by then.
            ends = kind == QEvent.Type.KeyRelease and self._holds(physical_key(event))
            return (self._is_for_us(watched) or ends) and self._take_key(event)
        if (
            kind in (QEvent.Type.WindowDeactivate, QEvent.Type.WindowBlocked, QEvent.Type.Hide)
            and watched is self.window()
        ):
            self.release_all()
        return False

    def _on_focus(self, _before: QWidget | None, now: QWidget | None) -> None:
        if wants_letters(now):
            self.release_all()

    def _is_for_us(self, watched: QObject) -> bool:
        """Whether a key event is for the pad. Qt filters it for the native window first, then for the widget: here."""
        if not isinstance(watched, QWidget) or watched.window() is not self.window() or not self.isVisible():
            return False
        return not wants_letters(QApplication.focusWidget())

    def _holds(self, source: object) -> bool:
        return source in self._pressed or source in self._dropped

    def _take_key(self, event: QKeyEvent) -> bool:
        """Return True when the key is used here, so that no other widget gets it."""
        letter, key = command_key(event), physical_key(event)
        pressed, held = event.type() == QEvent.Type.KeyPress, self._holds(key)
        if not held and wants(QApplication.focusWidget(), letter):
            return False
        if letter == Qt.Key.Key_Space:
            if pressed and not event.isAutoRepeat():
                self._press_stop()
            return True
        name = self._keys.get(letter)
        # A key that is held counts until it comes up, whatever it types by then.
        if not held and (name not in self._moves or event.modifiers() & _MODIFIERS):
            return False
        if event.isAutoRepeat():
            return True
        if not pressed:
            if held:
                self._lifted.add(key)
                self._bounce.start()
        elif key in self._lifted:
            self._lifted.remove(key)
        elif name in self._moves:
            self._press(key, name)
        return True

    def _press_stop(self) -> None:
        self.stop()
        self.stop_pressed.emit()

    def _press(self, source: object, name: str) -> None:
        if self._block:
            self._set_dropped(self._dropped | {source})
            self.blocked.emit(self._block)
            return
        self._set_dropped(self._dropped - {source})
        self._pressed[source] = name
        self._show_held()
        self._send()
        self._timer.start()

    def _release(self, source: object) -> None:
        self._set_dropped(self._dropped - {source})
        if self._pressed.pop(source, None) is None:
            return
        if not self._pressed:
            self.stop()
            return
        self._show_held()
        self._send()

    def _release_lifted(self) -> None:
        while self._lifted:
            self._release(self._lifted.pop())

    def _send(self) -> None:
        self.velocity.emit(*velocity_of(self.held, self.speed, self.turn))

    def _show_held(self) -> None:
        held = self.held
        for name, cap in self._caps.items():
            set_property(cap, "held", name in held)

    def _make_cap(self) -> QPushButton:
        cap = QPushButton(self)
        cap.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        cap.setProperty("kind", "cap")
        return cap


def wants_letters(widget: QWidget | None) -> bool:
    """Whether this widget needs letters itself."""
    return isinstance(widget, _TEXTS) or (widget is not None and bool(widget.property(WANTS_LETTERS)))


def wants_arrows(widget: QWidget | None) -> bool:
    """Whether this widget needs arrows itself: tabs or a list of choices, which only Tab brings the keyboard to."""
    return isinstance(widget, (QTabBar, QComboBox))


def wants(widget: QWidget | None, key: int) -> bool:
    """Whether this widget, which does not want all letters, needs this key itself."""
    if key == Qt.Key.Key_Space:
        return isinstance(widget, (QAbstractButton, QComboBox))
    return key in _ARROWS and wants_arrows(widget)
