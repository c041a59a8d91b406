"""Text as it is. Qt takes a label or a tool tip that looks like HTML for HTML, loads the pictures that it names, and
makes a key of a letter behind `&` on a button: nothing that a robot or a person may send must do that.

Every label of the window is a `Label`; texts of tool tips go through `tip`, those of buttons and menus through
`caption`, unless they are literals. `telepresence.security.outside_text` has removed control characters before.
"""

from __future__ import annotations

import html
from typing import Any

from PyQt5.QtCore import Qt
from PyQt5.QtWidgets import QLabel


class Label(QLabel):
    """A label whose text, and whose tool tip, is shown literally.

    Args:
        arguments: Those of QLabel.
    """

    def __init__(self, *arguments: Any) -> None:
        text = arguments[0] if arguments and isinstance(arguments[0], str) else ""
        super().__init__(*arguments[1:] if text else arguments)
        self.setTextFormat(Qt.TextFormat.PlainText)  # before there is a text that Qt could read
        self.setText(text)

    def setToolTip(self, text: str) -> None:
        super().setToolTip(tip(text))


def tip(text: str) -> str:
    """Return a text for a tool tip, which Qt then shows literally."""
    return f"<qt>{html.escape(text)}</qt>" if "<" in text else text


def caption(text: str) -> str:
    """Return a text for a button, a menu or a tab, which Qt then shows literally."""
    return text.replace("&", "&&")
