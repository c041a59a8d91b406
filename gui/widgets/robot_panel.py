"""Asks the robot to say a sentence or to take a posture."""

from __future__ import annotations

from collections.abc import Sequence

from PyQt5.QtCore import Qt, pyqtSignal
from PyQt5.QtWidgets import (
    QFrame,
    QGridLayout,
    QHBoxLayout,
    QLineEdit,
    QPushButton,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from gui.widgets.label import Label

LONGEST_SENTENCE = 300
"""Characters: half a minute of speech, during which nothing else can be said."""
SENTENCES = ("Hello!", "One moment, please.", "Thank you!", "Goodbye!")
COLUMNS = 3


class RobotPanel(QFrame):
    """A field for a sentence, and buttons for postures. Controls that a robot lacks are hidden."""

    say = pyqtSignal(str)
    """The robot should say this."""
    posture = pyqtSignal(str)
    """The robot should take the posture of this name."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.sentence = QLineEdit()
        self.sentence.setPlaceholderText("Type what the robot should say, then press Enter")
        self.sentence.setMaxLength(LONGEST_SENTENCE)
        self.sentence.setAccessibleName("Sentence to be said")
        self.sentence.setObjectName("sentence")
        self.say_button = QPushButton("Say")
        self.say_button.setProperty("kind", "primary")
        self.say_button.setObjectName("sayButton")
        self._answer = Label()
        self._answer.setProperty("role", "note")
        self._answer.setWordWrap(True)
        # A long word must not widen the window.
        self._answer.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self._speech, self._postures = QWidget(), QWidget()
        self._nothing = Label("This robot can neither speak nor take postures.")
        self._nothing.setProperty("role", "note")
        self._nothing.setAlignment(Qt.AlignmentFlag.AlignCenter)

        speech = QVBoxLayout(self._speech)
        speech.setContentsMargins(0, 0, 0, 0)
        row = QHBoxLayout()
        row.addWidget(self.sentence, 1)
        row.addWidget(self.say_button)
        speech.addLayout(row)
        shortcuts = QHBoxLayout()
        shortcuts.setSpacing(6)
        for index, text in enumerate(SENTENCES):
            button = QPushButton(text)
            button.setObjectName(f"say_{index}")
            button.setProperty("kind", "small")
            button.clicked.connect(lambda _checked, text=text: self._say(text))
            shortcuts.addWidget(button)
        shortcuts.addStretch(1)
        speech.addLayout(shortcuts)
        self._grid = QGridLayout(self._postures)
        self._grid.setContentsMargins(0, 0, 0, 0)
        self._grid.setSpacing(6)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(10, 10, 10, 10)
        layout.setSpacing(10)
        for widget in (self._speech, self._postures, self._nothing, self._answer):
            layout.addWidget(widget)
        layout.addStretch(1)
        self.say_button.clicked.connect(lambda: self._say(self.sentence.text()))
        self.sentence.returnPressed.connect(lambda: self._say(self.sentence.text()))
        self.set_robot(speaks=False, postures=())

    def set_robot(self, speaks: bool, postures: Sequence[tuple[str, str]]) -> None:
        """Show the controls that this robot has.

        Args:
            postures: (name, text of the button) of each.
        """
        self._speech.setVisible(speaks)
        self._postures.setVisible(bool(postures))
        self._nothing.setVisible(not speaks and not postures)
        while (item := self._grid.takeAt(0)) is not None:
            if (button := item.widget()) is not None:
                button.deleteLater()
        for index, (name, title) in enumerate(postures):
            choice = QPushButton(title)
            choice.setFocusPolicy(Qt.FocusPolicy.TabFocus)
            choice.setObjectName(f"posture_{name}")
            choice.clicked.connect(lambda _checked, name=name: self.posture.emit(name))
            self._grid.addWidget(choice, index // COLUMNS, index % COLUMNS)
        self.answer("")

    def answer(self, text: str) -> None:
        """Show the result of the last request."""
        self._answer.setText(text)
        self._answer.setVisible(bool(text))

    def refuse(self, sentence: str, reason: str) -> None:
        """Show why a sentence was not said, and keep it."""
        if not self.sentence.text():
            self.sentence.setText(sentence)
        self.answer(reason)

    def _say(self, text: str) -> None:
        text = " ".join(text.split())
        if not text:
            self.answer("Type a sentence first.")
            return
        self.sentence.clear()
        self.answer(f"Saying: {text}")
        self.say.emit(text)
