"""Which input device of one window drives: drive pad, gamepad, or a place in the picture. When several are used at
once, the one that started last has control; a reason not to drive holds for all of them."""

from __future__ import annotations

from typing import Protocol

from PyQt5.QtCore import QObject, pyqtBoundSignal, pyqtSignal


class InputDevice(Protocol):
    """What may be added.

    Attributes:
        speed, turn: What it may ask for [m/s, rad/s].
    """

    speed: float
    turn: float

    @property
    def velocity(self) -> pyqtBoundSignal:
        """Signal of forward, left [m/s] and counter-clockwise [rad/s]: repeated ten times a second or more while
        something is held, with one zero at the end."""

    @property
    def keeps_control(self) -> bool:
        """Whether something is still held although the velocity is zero."""

    def release_all(self) -> None:
        """Act as if everything that is held had been released."""

    def set_block(self, reason: str, passing: bool = False) -> None:
        """Do not drive until the reason is an empty string again; see `InputMux.set_block`."""


class InputMux(QObject):
    """Passes on the velocity of one input device at a time."""

    velocity = pyqtSignal(float, float, float)
    """Forward, left [m/s], counter-clockwise [rad/s]; repeated while held, zero once at the end, then quiet."""
    block_changed = pyqtSignal(str)
    """`block` has changed; what it was before."""

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._devices: list[InputDevice] = []
        self._driver: InputDevice | None = None
        self._block, self._passing = "", False
        self._speeds: tuple[float, float] | None = None

    @property
    def driver(self) -> InputDevice | None:
        """The device that drives now; None when none does."""
        return self._driver

    @property
    def block(self) -> str:
        """Why nobody may drive; empty when everybody may."""
        return self._block

    def add(self, device: InputDevice) -> None:
        """Let another device drive, too."""
        self._devices.append(device)
        device.velocity.connect(lambda *velocity: self._on_velocity(device, velocity))
        device.set_block(self._block, self._passing)
        if self._speeds is not None:
            device.speed, device.turn = self._speeds

    def set_speeds(self, speed: float, turn: float) -> None:
        """Set what every device may ask for from now on [m/s, rad/s]."""
        self._speeds = speed, turn
        for device in self._devices:
            device.speed, device.turn = speed, turn

    def set_block(self, reason: str, passing: bool = False) -> None:
        """Do not drive until the reason is an empty string again.

        Args:
            passing: The cause will pass on its own, like a late picture: a drive to a place may go on afterwards,
                while keys and gamepad have to be pressed again.
        """
        if (reason, passing) == (self._block, self._passing):
            return
        before, self._block, self._passing = self._block, reason, passing
        for device in self._devices:
            device.set_block(reason, passing)
        if reason and self._driver is not None:
            self._driver = None
            self.velocity.emit(0.0, 0.0, 0.0)
        if reason != before:
            self.block_changed.emit(before)

    def stop(self) -> None:
        """Release everything and send zero, whether anything was held or not."""
        self._driver = None
        for device in self._devices:
            device.release_all()
        self.velocity.emit(0.0, 0.0, 0.0)

    def release_all(self) -> None:
        """Act as if everything that is held had been released."""
        if self._driver is not None:
            self.stop()
        else:
            for device in self._devices:
                device.release_all()

    def _on_velocity(self, device: InputDevice, velocity: tuple[float, float, float]) -> None:
        if device is self._driver:
            if not any(velocity) and not device.keeps_control:
                self._driver = None
            self.velocity.emit(*velocity)
        elif any(velocity) and not self._block:
            self._driver = device
            for other in self._devices:
                if other is not device:
                    other.release_all()  # its zero is not passed on: the newcomer's velocity follows at once
            self.velocity.emit(*velocity)
