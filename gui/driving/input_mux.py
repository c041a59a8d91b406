"""All hands on the robot in one window: drive pad, gamepad, a place in the picture. One drives at a time, the one that
began last; a reason not to drive holds for all of them."""

from __future__ import annotations

from typing import Protocol

from PyQt5.QtCore import QObject, pyqtSignal


class Source(Protocol):
    """What may be added: `velocity` is a signal (forward, left [m/s], counter-clockwise [rad/s]), repeated ten times a
    second or more while something is held, with one zero at the end. `speed` and `turn` are what it may ask for.
    A source with `waits` goes on by itself after a block that passes by itself; the others want a new press."""

    velocity: pyqtSignal
    speed: float
    turn: float

    def release_all(self) -> None: ...

    def set_block(self, reason: str) -> None: ...


class InputMux(QObject):
    """The one that drives."""

    velocity = pyqtSignal(float, float, float)
    """Forward, left [m/s], counter-clockwise [rad/s]; repeated while held, zero once at the end, then quiet."""

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._sources: list[Source] = []
        self._driver: Source | None = None
        self._block, self._passing = "", False
        self._speeds: tuple[float, float] | None = None

    @property
    def driver(self) -> Source | None:
        """Which source drives now."""
        return self._driver

    @property
    def block(self) -> str:
        """Why nobody may drive; empty when everybody may."""
        return self._block

    def add(self, source: Source) -> None:
        """Let it drive, too."""
        self._sources.append(source)
        source.velocity.connect(lambda *velocity: self._on_velocity(source, velocity))
        self._report_block(source)
        if self._speeds is not None:
            source.speed, source.turn = self._speeds

    def set_speeds(self, speed: float, turn: float) -> None:
        """What every source may ask for from now on [m/s, rad/s]."""
        self._speeds = speed, turn
        for source in self._sources:
            source.speed, source.turn = speed, turn

    def set_block(self, reason: str, passing: bool = False) -> None:
        """Do not drive until the reason is an empty string again.

        Args:
            passing: It passes by itself, like a late picture; who is on the way to a place may go on afterwards.
        """
        if (reason, passing) == (self._block, self._passing):
            return
        self._block, self._passing = reason, passing
        for source in self._sources:
            self._report_block(source)
        if reason:
            self._let_go()

    def stop(self) -> None:
        """Let go of everything and send zero, whether anything was held or not."""
        self._driver = None
        for source in self._sources:
            source.release_all()
        self.velocity.emit(0.0, 0.0, 0.0)

    def release_all(self) -> None:
        """As if everything that is held had been released."""
        if self._driver is not None:
            self.stop()
        else:
            for source in self._sources:
                source.release_all()

    def _on_velocity(self, source: Source, velocity: tuple[float, float, float]) -> None:
        if source is self._driver:
            if not any(velocity) and not getattr(source, "held", False):
                self._driver = None
            self.velocity.emit(*velocity)
        elif any(velocity) and not self._block:
            self._driver = source
            for other in self._sources:
                if other is not source:
                    other.release_all()  # its zero is not passed on: the newcomer's velocity follows at once
            self.velocity.emit(*velocity)

    def _report_block(self, source: Source) -> None:
        if getattr(source, "waits", False):
            source.set_block(self._block, self._passing)
        else:
            source.set_block(self._block)

    def _let_go(self) -> None:
        if self._driver is not None:
            self._driver = None
            self.velocity.emit(0.0, 0.0, 0.0)
