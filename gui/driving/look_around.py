"""Turning the robot's head from the window: drag the picture, hold a key, or tilt the gamepad's right stick with LT.

A hand that stays where it came down on the picture drives to the floor there (`gui.driving.floor_drive`); one that
moves first turns the head. On a robot without a head every hand drives.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from PyQt5.QtCore import QEvent, QObject, QRectF, Qt, QTimer, pyqtSignal
from PyQt5.QtGui import QKeyEvent, QPainter
from PyQt5.QtWidgets import QApplication, QPushButton, QWidget

from gui import theme
from gui.application_events import filter_events
from gui.driving.drive_pad import wants_letters
from gui.driving.physical_keys import command_key, physical_key
from gui.periodic_timer import PeriodicTimer
from telepresence.teleop.command_timeout import SEND_PERIOD
from telepresence.teleop.gaze import TURNS, Gaze
from telepresence.teleop.looking import HEAD_LIFE, HeadState

if TYPE_CHECKING:
    from gui.driving.drive_access import DriveAccess
    from gui.driving.floor_drive import FloorDrive
    from gui.ros.link import RosLink
    from gui.ros.readings import Lens
    from gui.window import OperatorWindow

STILL = 200  # ms for which a hand stays where it came down before it drives
MOVED = 0.02
"""Share of the picture's width that a hand moves before it drags."""
BUTTON_WIDTH = 28
"""[px]; the camera's row has no room for words on a small screen."""
TURNED = 0.12
"""[rad] from which on the window shows that the head is turned."""
KEYS: dict[int, str] = {
    Qt.Key.Key_I: "look_up",
    Qt.Key.Key_K: "look_down",
    Qt.Key.Key_J: "look_left",
    Qt.Key.Key_L: "look_right",
}
_MODIFIERS = Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.AltModifier | Qt.KeyboardModifier.MetaModifier


class LookAround(QObject):
    """The input devices that turn one robot's head.

    Args:
        window, link: Picture and robot.
        access: Whether this window has the robot.
        floor: What a hand does that does not move.
        obstacle: Why this window may not move the robot now; empty when it may.
        lens: Returns the calibration of the camera that is shown, None while it is unknown.
    """

    said = pyqtSignal(str, str)
    """A message for the pilot, and its level."""

    def __init__(
        self,
        window: OperatorWindow,
        link: RosLink,
        access: DriveAccess,
        floor: FloorDrive,
        obstacle: Callable[[], str],
        lens: Callable[[], Lens | None],
    ) -> None:
        super().__init__(window)
        self._window, self._access, self._floor = window, access, floor
        self._obstacle, self._lens = obstacle, lens
        self.gaze = Gaze()
        self._head: HeadState | None = None
        self._pressed: tuple[float, float, float] | None = None
        self._keys: dict[int, str] = {}
        """Which key of the keyboard is held -> where it turns the head."""
        self._still = QTimer(self)
        self._still.setSingleShot(True)
        self._still.setInterval(STILL)
        self._still.setTimerType(Qt.TimerType.PreciseTimer)
        self._still.timeout.connect(self._drive)
        self._timer = PeriodicTimer(round(1000 * SEND_PERIOD), self._send, self, precise=True)
        self._timer.start()
        video = window.video
        video.pressed.connect(self._press)
        video.dragged.connect(self._drag)
        video.released.connect(self._release)
        window.activation_changed.connect(lambda active: None if active else self.let_go())
        self.buttons = self._make_buttons() if link.has("head") else ()
        if link.has("head"):
            link.channel("head").arrived.connect(self._on_head)
            filter_events(self, QEvent.Type.KeyPress, QEvent.Type.KeyRelease)

    @property
    def head(self) -> HeadState | None:
        """Where the head is; None for a robot that says nothing of one."""
        head = self._head
        return head if head is not None and time.monotonic() - head.arrived < HEAD_LIFE else None

    def let_go(self) -> None:
        """Act as if everything that turns the head had been let go."""
        self._keys.clear()
        self.gaze.let_go()
        self._give_up_hand()

    def centre(self) -> None:
        """Look straight ahead."""
        if self._may():
            self.gaze.centre(time.monotonic())
            self._send()

    def follow(self, wanted: bool) -> None:
        """Look where the robot drives, or no more."""
        if not wanted or self._may():
            self.gaze.follow(wanted)
            self._send()
        self._show()

    def tilt(self, left: float, down: float) -> None:
        """Turn as the gamepad's stick is tilted, -1 to 1; zeros once it is let go."""
        if (left or down) and not self._refusal():
            self.gaze.hold("gamepad", left, down)
        else:
            self.gaze.release("gamepad")

    def paint(self, painter: QPainter, width: float, height: float) -> None:
        """Show on the picture where ahead is while the head is turned: nobody must take aside for ahead.

        Args:
            width, height: Of the picture as it is painted [px]; its upper left corner is the painter's origin.
        """
        head, lens = self.head, self._lens()
        if head is None or abs(head.yaw) < TURNED or lens is None:
            return
        share = (lens.cx + lens.fx * math.tan(max(-1.4, min(1.4, head.yaw)))) / lens.width
        text = "◀ ahead" if share < 0.0 else "ahead ▶" if share > 1.0 else "▲ ahead"
        box = QRectF(0.0, 0.0, 84.0, 24.0)
        box.moveCenter(box.center().__class__(max(48.0, min(width - 48.0, share * width)), 0.88 * height))
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(theme.colour("well", 0.8))
        painter.drawRoundedRect(box, 12.0, 12.0)
        painter.setPen(theme.colour("text"))
        painter.drawText(box, Qt.AlignmentFlag.AlignCenter, text)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        kind = event.type()
        if not isinstance(event, QKeyEvent) or kind not in (QEvent.Type.KeyPress, QEvent.Type.KeyRelease):
            return False
        letter, key = command_key(event), physical_key(event)
        if kind == QEvent.Type.KeyRelease and key in self._keys and not event.isAutoRepeat():
            self.gaze.release(self._keys.pop(key))
            self._send()
            return True
        if kind == QEvent.Type.KeyRelease or event.modifiers() & _MODIFIERS or not self._is_for_us(watched):
            return False
        if letter not in (*KEYS, Qt.Key.Key_H, Qt.Key.Key_G):
            return False
        if not event.isAutoRepeat():
            self._take_key(letter, key)
        return True

    # --- inside ---

    def _is_for_us(self, watched: QObject) -> bool:
        if not isinstance(watched, QWidget) or watched.window() is not self._window.window():
            return False
        return self._window.video.isVisible() and not wants_letters(QApplication.focusWidget())

    def _take_key(self, letter: int, key: int) -> None:
        if letter == Qt.Key.Key_H:
            self.centre()
        elif letter == Qt.Key.Key_G:
            self.follow(not self.gaze.way)
        elif self._may():
            self._keys[key] = KEYS[letter]
            self.gaze.hold(KEYS[letter], *TURNS[KEYS[letter]])
            self._send()

    def _make_buttons(self) -> tuple[QPushButton, QPushButton]:
        """Return *centre* and *look where I drive*, put beside the camera's name."""
        centre, way = QPushButton("◎"), QPushButton("➚")
        centre.setObjectName("lookCentre")
        centre.setAccessibleName("Look straight ahead")
        centre.setToolTip("Turns the robot's head straight ahead (H). To look around drag the picture, or hold I J K L")
        way.setObjectName("lookWay")
        way.setAccessibleName("Look where I drive")
        way.setToolTip("Look where I drive: into turns, and aside when the robot goes sideways (G)")
        way.setCheckable(True)
        layout = self._window.cameraTitleLayout
        for place, button in enumerate((centre, way)):
            button.setProperty("kind", "small")
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
            button.setFixedWidth(BUTTON_WIDTH)
            layout.insertWidget(layout.indexOf(self._window.snapshotButton) + place, button)
        centre.clicked.connect(lambda _checked: self.centre())
        way.clicked.connect(lambda checked: self.follow(checked))
        return centre, way

    def _on_head(self, head: HeadState) -> None:
        turned = self._head is not None and (head.yaw, head.pitch) != (self._head.yaw, self._head.pitch)
        self._head = head
        if turned:
            self._window.video.update()

    def _refusal(self) -> str:
        """Why the head cannot be turned now; empty when it can."""
        head = self.head
        if head is None:
            return "This robot says nothing of a head, so it cannot be turned."
        return self._obstacle() or head.problem

    def _may(self) -> bool:
        refusal = self._refusal()
        if refusal:
            self.said.emit(refusal, "warn")
        return not refusal

    def _send(self) -> None:
        head = self.head
        if head is None:
            return
        refusal = self._refusal()
        if refusal:
            if self.gaze.holds:
                self.let_go()
                self.said.emit(refusal, "warn")
            return
        way = self.gaze.way
        look = self.gaze.want(head, time.monotonic())
        if look is not None:
            self._access.look(look)
        if way != self.gaze.way or (self.buttons and self.buttons[1].isChecked() != way):
            self._show()

    def _show(self) -> None:
        if self.buttons:
            self.buttons[1].setChecked(self.gaze.way)

    # --- a hand on the picture ---

    def _press(self, u: float, v: float) -> None:
        if self.head is None:
            self._floor.press(u, v)
            return
        self._pressed = u, v, time.monotonic()
        self._still.start()

    def _drag(self, u: float, v: float) -> None:
        if self._pressed is None:
            head = self.head
            if head is not None and self.gaze.holds:
                self.gaze.move(*self._bearing(u, v), head, time.monotonic())
            else:
                self._floor.drag(u, v)
            return
        image = self._window.video.image
        u0, v0, _ = self._pressed
        if image is None or math.hypot(u - u0, v - v0) <= MOVED * image.width():
            return
        self._give_up_hand()
        head = self.head
        if head is not None and self._may():
            self.gaze.drag(*self._bearing(u0, v0), head)
            self._drag(u, v)

    def _release(self) -> None:
        if self._pressed is not None:
            self._drive()  # it says why a click alone drives nowhere
        self.gaze.drop()
        self._floor.release()

    def _drive(self) -> None:
        """The hand stays: it drives."""
        if self._pressed is not None:
            u, v, since = self._pressed
            self._give_up_hand()
            self._floor.press(u, v, since)

    def _give_up_hand(self) -> None:
        self._still.stop()
        self._pressed = None

    def _bearing(self, u: float, v: float) -> tuple[float, float]:
        """How far a pixel is from the middle of the picture, right and down [rad]."""
        image, lens = self._window.video.image, self._lens()
        if image is None or lens is None:
            return 0.0, 0.0
        across, down = u * lens.width / image.width(), v * lens.height / image.height()
        return math.atan2(across - lens.cx, lens.fx), math.atan2(down - lens.cy, lens.fy)
