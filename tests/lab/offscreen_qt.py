"""Qt without a screen, for tests of widgets in their own process."""

from PyQt5.QtWidgets import QApplication

_applications: list[QApplication] = []
"""The one application of this process. It is never destroyed: Python would do that while widgets are left, and then Qt
crashes now and then."""


def application() -> QApplication:
    """Return Qt's application, made at the first call. The environment stays as it is: programs inherit it."""
    if not _applications:
        _applications.append(QApplication(["tests", "-platform", "offscreen"]))
    return _applications[0]
