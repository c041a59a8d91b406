"""Properties of widgets that the style sheet selects by."""

from __future__ import annotations

from PyQt5.QtWidgets import QWidget


def set_property(widget: QWidget, name: str, value: object) -> None:
    """Set a property that the style sheet selects by, and restyle the widget if it has changed."""
    if widget.property(name) != value:
        widget.setProperty(name, value)
        restyle(widget)


def restyle(widget: QWidget) -> None:
    """Apply the style sheet again; Qt does not do so when a property changes."""
    style = widget.style()
    assert style is not None  # a widget without a style of its own returns the application's
    style.unpolish(widget)
    style.polish(widget)
