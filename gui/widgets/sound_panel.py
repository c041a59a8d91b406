"""Controls the sound between pilot and robot: levels, mute, push to talk, choice of devices."""

from __future__ import annotations

import math
import time

from PyQt5.QtCore import QRectF, QSize, Qt, pyqtSignal
from PyQt5.QtGui import QHideEvent, QPainter, QPaintEvent
from PyQt5.QtWidgets import QComboBox, QFrame, QGridLayout, QPushButton, QSizePolicy, QWidget

from gui import theme
from gui.periodic_timer import PeriodicTimer
from gui.ros.readings import Levels, VoiceSettings, VoiceState
from gui.widgets.label import Label, tip

QUIETEST, LOUD = -60.0, -9.0
"""Range in which the meter is green; above it is red [dBFS]."""
FALL = 20.0
"""[dB/s] by which the bar falls after a peak (the order of magnitude of a peak programme meter)."""
FADE_PERIOD = 60  # ms
NO_DEVICE = "none"
"""The choice of no device, see `telepresence.audio.devices`."""
SHORTEST_NAME = 12
"""Letters of a device's name that are always shown."""


class LevelMeter(QWidget):
    """A bar for loudness [dBFS] that rises at once and falls slowly."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._level, self._at = QUIETEST, 0.0
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self._fade = PeriodicTimer(FADE_PERIOD, self._on_fade, self)

    def sizeHint(self) -> QSize:
        return QSize(160, 12)

    def set_level(self, level: float) -> None:
        """Show the present loudness [dBFS]; NaN counts as silence."""
        level = QUIETEST if math.isnan(level) else level
        if level >= self.level():
            self._level, self._at = min(0.0, level), time.monotonic()
        self._fade.start()
        self.update()

    def level(self) -> float:
        """Return what the bar shows [dBFS]."""
        return max(QUIETEST, self._level - FALL * (time.monotonic() - self._at))

    def _on_fade(self) -> None:
        self.update()
        if self.level() <= QUIETEST:
            self._fade.stop()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(theme.colour("sunken"))
        box = QRectF(0.0, self.height() / 2 - 4.0, float(self.width()), 8.0)
        painter.drawRoundedRect(box, 4.0, 4.0)
        share = (self.level() - QUIETEST) / -QUIETEST
        if share > 0.01:
            painter.setBrush(theme.colour("free" if self.level() < LOUD else "blocked"))
            painter.drawRoundedRect(QRectF(box.left(), box.top(), box.width() * share, box.height()), 4.0, 4.0)


class DeviceChoice(QComboBox):
    """Offers the devices of one kind, and shows which one the sound program uses."""

    chosen = pyqtSignal(str)
    """The pilot has chosen this device, see `telepresence.audio.devices`."""

    def __init__(self, what: str) -> None:
        super().__init__()
        self._fixed = {"auto": f"Usual {what}", NO_DEVICE: f"No {what}"}
        self._shown: tuple[tuple[str, ...], str] | None = None
        self.setAccessibleName(what.capitalize())
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        self.setMinimumContentsLength(SHORTEST_NAME)
        self.activated.connect(lambda index: self.chosen.emit(self.itemData(index)))

    def show_choice(self, names: tuple[str, ...], current: str) -> None:
        """Offer these devices, and show which one is used; it stays in the list even when it is gone."""
        if self._shown != (names, current):
            self._shown = (names, current)
            self.clear()
            for name in dict.fromkeys((*self._fixed, *names, current)):
                self.addItem(self._fixed.get(name, name), name)
                self.setItemData(self.count() - 1, tip(name), Qt.ItemDataRole.ToolTipRole)
        self.setCurrentIndex(self.findData(current))
        self.setToolTip(tip(self.currentText()))


class SoundPanel(QFrame):
    """Controls and meters. `set_available(False)` when no sound program runs."""

    mute_microphone = pyqtSignal(bool)
    mute_speaker = pyqtSignal(bool)
    talk = pyqtSignal(bool)
    """Push-to-talk is held, or let go of."""
    microphone_chosen = pyqtSignal(str)
    speaker_chosen = pyqtSignal(str)
    """Use this device."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.pilot, self.robot = LevelMeter(), LevelMeter()
        self._settings: VoiceSettings | None = None
        self.microphone = QPushButton("Mute me")
        self.speaker = QPushButton("Mute robot")
        self.talk_button = QPushButton("Hold to talk")
        self.microphones, self.speakers = DeviceChoice("microphone"), DeviceChoice("loudspeaker")
        self.microphones.setObjectName("microphoneChoice")
        self.speakers.setObjectName("speakerChoice")
        self.talk_button.setObjectName("talkButton")
        for button, name, purpose in (
            (self.microphone, "muteMicrophone", "The robot does not play your voice"),
            (self.speaker, "muteSpeaker", "Mutes the sound from the robot"),
        ):
            button.setCheckable(True)
            button.setObjectName(name)
            button.setToolTip(purpose)
        self.talk_button.setToolTip("While held, your voice goes to the robot even if you are muted")
        self.talk_button.setProperty("kind", "primary")
        self._state = Label()
        self._state.setProperty("role", "note")
        self._state.setWordWrap(True)
        self._state.setSizePolicy(
            QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred
        )  # long words do not widen it
        layout = QGridLayout(self)
        layout.setContentsMargins(10, 10, 10, 10)
        layout.setHorizontalSpacing(12)
        layout.setVerticalSpacing(10)
        for row, (name, meter, choice, button) in enumerate(
            (
                ("You", self.pilot, self.microphones, self.microphone),
                ("Robot", self.robot, self.speakers, self.speaker),
            )
        ):
            layout.addWidget(Label(name), row, 0)
            layout.addWidget(meter, row, 1)
            layout.addWidget(choice, row, 2)
            layout.addWidget(button, row, 3)
        layout.addWidget(self.talk_button, 2, 0, 1, 4)
        layout.addWidget(self._state, 3, 0, 1, 4)
        layout.setColumnStretch(1, 1)
        layout.setColumnStretch(2, 1)
        layout.setRowStretch(4, 1)
        self.microphone.clicked.connect(self.mute_microphone)
        self.speaker.clicked.connect(self.mute_speaker)
        self.microphones.chosen.connect(self.microphone_chosen)
        self.speakers.chosen.connect(self.speaker_chosen)
        self.talk_button.pressed.connect(lambda: self.talk.emit(True))
        self.talk_button.released.connect(lambda: self.talk.emit(False))
        self.set_available(False)

    @property
    def state(self) -> str:
        return self._state.text()

    @property
    def muted(self) -> bool:
        """Whether the robot does not hear the pilot: muted, or without a microphone."""
        return self.microphone.isChecked() or self.microphones.currentData() == NO_DEVICE

    def set_available(self, available: bool) -> None:
        """Enable the controls if a sound program answers."""
        for control in (self.microphone, self.speaker, self.talk_button, self.microphones, self.speakers):
            control.setEnabled(available)
        if not available:
            self._state.setText("No sound program runs. It starts with the robot's programs.")
        elif self._state.text().startswith("No sound"):
            self._state.setText("")

    def show_settings(self) -> None:
        """Show what the sound program has last said that it mutes."""
        if self._settings is not None:
            self.microphone.setChecked(self._settings.microphone_muted)
            self.speaker.setChecked(self._settings.speaker_muted)

    def hideEvent(self, event: QHideEvent) -> None:
        """Close the microphone when the panel is hidden while the button is held."""
        if self.talk_button.isDown():
            self.talk_button.setDown(False)
            self.talk.emit(False)
        super().hideEvent(event)

    def show_reading(self, reading: object) -> None:
        """Show `Levels`, `VoiceState` and `VoiceSettings`; other readings are ignored."""
        if isinstance(reading, Levels):
            self.pilot.set_level(reading.pilot)
            self.robot.set_level(reading.robot)
        elif isinstance(reading, VoiceState):
            self.set_available(True)
            self._state.setText(reading.text)
        elif isinstance(reading, VoiceSettings):
            self.set_available(True)
            self._settings = reading
            self.show_settings()
            self.microphones.show_choice(reading.microphones, reading.microphone)
            self.speakers.show_choice(reading.speakers, reading.speaker)
