"""Shows the quality of the link to the robot: round trip of commands, age and rate of pictures; and the battery."""

from __future__ import annotations

import math
import time

from PyQt5.QtWidgets import QFrame, QHBoxLayout, QWidget

from gui.periodic_timer import PeriodicTimer
from gui.ros.readings import Battery
from gui.styling import set_property
from gui.widgets.label import Label

GOOD_DELAY, BAD_DELAY = 0.15, 0.30
"""[s]. Drivers notice 100 to 200 ms and drive clearly worse from 200 to 300 ms on (arXiv 2508.18074)."""
GOOD_RATE, BAD_RATE = 8.0, 3.0
"""Pictures per second."""
LOW_BATTERY, EMPTY_BATTERY = 0.3, 0.15
"""Charge, from 0 to 1."""
FORGET_AFTER = 5.0
"""[s] after which a round trip is no longer shown."""
FORGET_BATTERY_AFTER = 3.0
"""[s]; the drivers of both robots publish it once a second."""
FORGET_PERIOD = 500  # ms
NAMES = {"command": "Command", "age": "Picture", "rate": "Rate", "battery": "Battery"}


class LinkHealth(QFrame):
    """A row of gauges. An unknown value is shown as a dash, never as the last one that was known."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(2, 0, 2, 0)
        layout.setSpacing(6)
        self._values: dict[str, Label] = {}
        tips = {
            "command": "From sending a command to the safety gate's answer",
            "age": "How old a picture is when it is shown, by the robot's clock",
            "rate": "Pictures per second",
            "battery": "Charge, or voltage where the robot publishes no charge",
        }
        for name, title in NAMES.items():
            label = Label(title)
            label.setProperty("role", "detail")
            value = Label("–")
            value.setProperty("kind", "gauge")
            for part in (label, value):
                part.setToolTip(tips[name])
                layout.addWidget(part)
            layout.addStretch(1)
            self._values[name] = value
        self._share = Label()
        self._share.setProperty("kind", "gauge")
        self._share.setToolTip("The link's delay caps the speed: half above 0.5 s, none above 1 s")
        self._share.hide()
        layout.addWidget(self._share)
        self._round_trip_at = self._battery_at = 0.0
        self._check = PeriodicTimer(FORGET_PERIOD, self._forget, self)
        self._check.start()
        self.clear()

    def clear(self) -> None:
        for name in NAMES:
            self._show(name, "–", "off")

    def gauge(self, name: str) -> tuple[str, str]:
        """Return text and level (off, good, warn, bad) of a gauge of `NAMES`."""
        return self._values[name].text(), self._values[name].property("level")

    def show_round_trip(self, seconds: float) -> None:
        """Show the round trip of a command [s]."""
        self._round_trip_at = time.monotonic()
        self._show("command", f"{1e3 * seconds:.0f} ms", _level_of_delay(seconds))

    def show_picture(self, age: float, rate: float) -> None:
        """Show a picture's age [s], NaN if clocks disagree, and the rate [1/s], 0 without pictures, NaN if unknown."""
        if not math.isfinite(age):
            self._show("age", "–", "off")
        elif age >= 10.0:
            self._show("age", f"{age:.0f} s", "bad")
        else:
            self._show("age", f"{1e3 * age:.0f} ms" if age < 1.0 else f"{age:.1f} s", _level_of_delay(age))
        if math.isnan(rate):
            self._show("rate", "–", "off")
            return
        level = "good" if rate >= GOOD_RATE else "warn" if rate >= BAD_RATE else "bad"
        self._show("rate", f"{rate:.0f} /s", level)

    def show_share(self, share: float) -> None:
        """Show the share of the speed that the delay allows, 0 to 1."""
        self._share.setText("half speed" if share else "no driving")
        self._share.setVisible(share < 1.0)
        set_property(self._share, "level", "warn" if share else "bad")

    def clear_picture(self) -> None:
        """Show that there are no pictures because nobody asked for any."""
        self._show("age", "–", "off")
        self._show("rate", "–", "off")

    def show_reading(self, reading: object) -> None:
        """Show a `Battery`; other readings are ignored."""
        if not isinstance(reading, Battery):
            return
        self._battery_at = time.monotonic()
        text = f"{100 * reading.share:.0f} %" if math.isfinite(reading.share) else f"{reading.voltage:.1f} V"
        if not math.isfinite(reading.share) and not math.isfinite(reading.voltage):
            text = "–"
        empty = reading.low or reading.share < EMPTY_BATTERY
        level = "bad" if empty else "warn" if reading.share < LOW_BATTERY else "good"
        self._show("battery", f"{text} charging" if reading.charging else text, level)

    def _forget(self) -> None:
        now = time.monotonic()
        if self._round_trip_at and now - self._round_trip_at > FORGET_AFTER:
            self._round_trip_at = 0.0
            self._show("command", "–", "off")
        if self._battery_at and now - self._battery_at > FORGET_BATTERY_AFTER:
            self._battery_at = 0.0
            self._show("battery", "–", "off")

    def _show(self, name: str, text: str, level: str) -> None:
        value = self._values[name]
        if value.text() != text:
            value.setText(text)
        set_property(value, "level", level)


def _level_of_delay(seconds: float) -> str:
    return "good" if seconds < GOOD_DELAY else "warn" if seconds < BAD_DELAY else "bad"
