"""Driving to the place on the floor that the pilot points at in the picture, for as long as the button is held: the
window's input device. What it does: `telepresence.teleop.floor_goal`."""

from __future__ import annotations

import time
from collections.abc import Callable

from PyQt5.QtCore import QObject, pyqtSignal

from gui.periodic_timer import PeriodicTimer
from gui.ros.readings import BodyState, CameraView, Safety
from telepresence.teleop.command_timeout import SEND_PERIOD
from telepresence.teleop.floor_goal import CLICKED, FloorGoal, FloorStep


class FloorDrive(QObject):
    """An input device that drives to a place.

    Args:
        view_of, picture_age, farthest: See `FloorGoal`; the picture is the one that is shown.
    """

    velocity = pyqtSignal(float, float, float)
    """Forward, left [m/s], counter-clockwise [rad/s]: 20 times a second while driving, zero once at the end."""
    target_changed = pyqtSignal(object)
    """(x, y) in odom [m], or None."""
    refused = pyqtSignal(str)
    """Why the robot does not drive there, or not yet."""
    resumed = pyqtSignal()
    """The drive goes on: what `refused` reported is over."""
    arrived = pyqtSignal()
    keeps_control = False
    """The zero that it sends ends its control of the robot, see `InputMux`."""

    def __init__(
        self,
        view_of: Callable[[], CameraView | str],
        picture_age: Callable[[], float],
        farthest: float = 3.0,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._goal = FloorGoal(view_of, picture_age, farthest)
        self._shown: tuple[float, float] | None = None
        self._block, self._block_passes = "", False
        self._timer = PeriodicTimer(round(1000 * SEND_PERIOD), self._step, self, precise=True)

    @property
    def speed(self) -> float:
        """What it may ask for [m/s]."""
        return self._goal.speed

    @speed.setter
    def speed(self, value: float) -> None:
        self._goal.speed = value

    @property
    def turn(self) -> float:
        """What it may ask for [rad/s]."""
        return self._goal.turn

    @turn.setter
    def turn(self, value: float) -> None:
        self._goal.turn = value

    @property
    def target(self) -> tuple[float, float] | None:
        """The place in odom [m] while the button is held and it is known."""
        return self._goal.target

    @property
    def driving(self) -> bool:
        return self._goal.driving

    def show_reading(self, reading: object) -> None:
        """Use a `BodyState` or `Safety`; other readings are ignored."""
        if isinstance(reading, BodyState):
            self._goal.body = reading
        elif isinstance(reading, Safety):
            self._goal.safety = reading

    def set_block(self, reason: str, passing: bool = False) -> None:
        """Do not drive until the reason is an empty string again.

        Args:
            passing: The cause will pass on its own: a button that is still held then drives on.
        """
        self._block, self._block_passes = reason, passing
        if reason and self._goal.held:
            self._apply(self._goal.wait(reason) if passing else self._goal.end(reason))

    def press(self, u: float, v: float, since: float | None = None) -> None:
        """Start: the button was pressed on this pixel of the picture, `since` [monotonic s] if that was earlier."""
        if self._block and not self._block_passes:
            self.refused.emit(self._block)
            return
        self._goal.press(u, v, time.monotonic() if since is None else since)
        self._look_again()

    def drag(self, u: float, v: float) -> None:
        """Change the place: the pointer was moved with the button held."""
        if self._goal.held:
            self._goal.drag(u, v)
            self._look_again()

    def release(self) -> None:
        """End the drive: the button was released. After a click say why the robot does not go there by itself."""
        clicked = self._goal.clicked(time.monotonic())
        self.release_all()
        if clicked:
            self.refused.emit(CLICKED)

    def release_all(self) -> None:
        """End the drive: something happened that counts as releasing the button."""
        if self._goal.held:
            self._apply(self._goal.end())

    def tone(self) -> str:
        """Return the colour of the path to the place: free, slow or blocked."""
        return self._goal.tone(time.monotonic())

    def way(self) -> tuple[float, float] | None:
        """Return distance [m] and bearing [rad] of the place as seen from the robot; None when either is unknown."""
        return self._goal.way()

    def _look_again(self) -> None:
        """Find the place under the pointer, which has moved."""
        if not self._timer.isActive():  # restarted by every move of the pointer it would never fire
            self._timer.start()
            self._step()
        else:
            self._apply(self._goal.find())

    def _step(self) -> None:
        self._apply(self._goal.step(time.monotonic(), self._block))

    def _apply(self, step: FloorStep) -> None:
        if not self._goal.held or step.arrived:
            self._timer.stop()
        if self._goal.target != self._shown:
            self._shown = self._goal.target
            self.target_changed.emit(self._shown)
        if step.resumed:
            self.resumed.emit()
        if step.velocity is not None:
            self.velocity.emit(*step.velocity)
        if step.refused:
            self.refused.emit(step.refused)
        if step.arrived:
            self.arrived.emit()
