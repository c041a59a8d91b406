"""A live test of the gamepad: shows what is pressed and moved, and what that does."""

from __future__ import annotations

from PyQt5.QtCore import QPointF, QRectF, QSize, Qt
from PyQt5.QtGui import QColor, QPainter, QPaintEvent, QPen
from PyQt5.QtWidgets import QFrame, QWidget

from gui import theme
from gui.driving.gamepad import JoystickState

TITLE = "No gamepad"
HINT = "Plug one in and it is found. Or use the pad on the topic joy:  --gamepad joy"
KEYS = "LB hold to drive    RB fast    LT look    B stop    button 0 held 1 s: restart the simulation"
DIRECT_KEYS = "cross or left stick: walk    B stop    button 0: restart the simulation"


class GamepadView(QFrame):
    """Paints a `JoystickState`."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._state: JoystickState | None = None
        self.keys = KEYS
        """What the buttons do."""
        self.setAccessibleName("Gamepad test")

    def sizeHint(self) -> QSize:
        return QSize(420, 190)

    def show_state(self, state: JoystickState | None) -> None:
        """Show a state; None when there is no pad."""
        self._state = state
        self.setAccessibleDescription(state.note if state else HINT)
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        state = self._state
        area = QRectF(self.rect()).adjusted(10.0, 8.0, -10.0, -8.0)
        painter.setPen(theme.colour("text"))
        painter.drawText(area, Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop, state.name if state else TITLE)
        painter.setPen(theme.colour("good" if state and state.driving else "quiet"))
        painter.drawText(
            area.adjusted(0, 18, 0, 0),
            Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop | Qt.TextFlag.TextWordWrap,
            self._note(),
        )
        painter.setPen(theme.colour("quiet"))
        painter.drawText(
            area, Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignBottom | Qt.TextFlag.TextWordWrap, self.keys
        )
        if state is None:
            return
        radius = max(18.0, min(40.0, (area.height() - 80.0) / 2.0))
        middle = area.top() + 42.0 + radius
        layout, x = state.layout, area.left() + radius
        for horizontal, vertical in ((layout.left_x, layout.left_y), (layout.right_x, layout.right_y)):
            tilt = QPointF(_at(state.axes, horizontal), _at(state.axes, vertical))
            self._paint_stick(painter, QPointF(x, middle), radius, tilt, state.driving)
            x += 2.0 * radius + 14.0
        self._paint_cross(painter, QPointF(x - radius + 22.0, middle), state)
        self._paint_buttons(painter, QPointF(x - radius + 58.0, middle - radius), area.right(), state)

    def _note(self) -> str:
        if self._state is None:
            return HINT
        if self._state.restart > 0.0:
            return f"Restarts the simulation: {100.0 * self._state.restart:.0f} %"
        return self._state.note

    def _paint_stick(self, painter: QPainter, centre: QPointF, radius: float, tilt: QPointF, driving: bool) -> None:
        painter.setPen(QPen(theme.colour("line"), 1.5))
        painter.setBrush(theme.colour("well"))
        painter.drawEllipse(centre, radius, radius)
        # Left and up are positive.
        knob = centre - tilt * (radius - 8.0)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(theme.colour("accent" if driving else "quiet"))
        painter.drawEllipse(knob, 8.0, 8.0)

    def _paint_cross(self, painter: QPainter, centre: QPointF, state: JoystickState) -> None:
        left, up = _at(state.axes, state.layout.hat_x), _at(state.axes, state.layout.hat_y)
        for dx, dy, on in ((-1, 0, left > 0.5), (1, 0, left < -0.5), (0, -1, up > 0.5), (0, 1, up < -0.5)):
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(theme.colour("accent" if on else "line"))
            painter.drawRoundedRect(QRectF(centre.x() + 13 * dx - 6, centre.y() + 13 * dy - 6, 12, 12), 3, 3)

    def _paint_buttons(self, painter: QPainter, corner: QPointF, right: float, state: JoystickState) -> None:
        names = {state.layout.LB: "LB", state.layout.RB: "RB", state.layout.B: "B"}
        x, y = corner.x(), corner.y()
        for number, down in enumerate(state.buttons):
            if x + 26.0 > right:
                x, y = corner.x(), y + 26.0
            box = QRectF(x, y, 24.0, 22.0)
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(theme.colour("accentfill" if down else "line"))
            painter.drawRoundedRect(box, 5.0, 5.0)
            painter.setPen(QColor("#ffffff") if down else theme.colour("text"))
            painter.drawText(box, Qt.AlignmentFlag.AlignCenter, names.get(number, str(number)))
            x += 28.0


def _at(values: tuple[float, ...], index: int) -> float:
    return values[index] if 0 <= index < len(values) else 0.0
