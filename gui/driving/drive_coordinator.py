"""Driving one robot: connects its input devices (pad, gamepad, picture) with the lease, with what forbids driving, and
with the red stop."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PyQt5.QtCore import QObject, pyqtSignal

from gui.driving.input_mux import InputMux
from gui.periodic_timer import PeriodicTimer
from gui.ros.channels import Answer
from telepresence.teleop.movement import movement_of

if TYPE_CHECKING:
    from gui.driving.drive_access import DriveAccess
    from gui.driving.drive_controls import DriveControls
    from gui.driving.gamepad import Gamepad
    from gui.ros.link import RosLink
    from gui.window import OperatorWindow

STOP_REPEATS = 5
"""Number of zeros after a stop: a keyboard node elsewhere receives them and lets go of its latched key."""
ZERO_PERIOD = 100  # ms
LATE = "The next picture of the robot takes too long, so nothing drives until it comes."


class DriveCoordinator(QObject):
    """Sends the commands of whichever input device drives, as long as nothing forbids it.

    Args:
        window: Pad and picture.
        link: The robot.
        access: Whether this window may drive.
        gamepad, controls: The gamepad, and the widget with speed limit and red stop.
    """

    said = pyqtSignal(str, str)
    """A message for the pilot, and its level."""
    sent = pyqtSignal()
    """A command has been sent."""
    blocked = pyqtSignal()
    """No command is sent from now on: something forbids it."""

    def __init__(
        self,
        window: OperatorWindow,
        link: RosLink,
        access: DriveAccess,
        gamepad: Gamepad,
        controls: DriveControls,
    ) -> None:
        super().__init__(window)
        self._window, self._link, self._access, self._controls = window, link, access, controls
        self._gate_stopped = ""
        self._away: dict[str, str] = {}
        self._share = 1.0
        self._zeros_left = 0
        self._zeros = PeriodicTimer(ZERO_PERIOD, self._send_zero, self)
        self.mux = InputMux(self)
        for source in (window.pad, gamepad):
            self.mux.add(source)
            source.stop_pressed.connect(self._on_stop_pressed)
            source.blocked.connect(lambda reason: self.said.emit(reason, "warn"))
        self.mux.velocity.connect(self._on_velocity)
        gamepad.restart_wanted.connect(self.restart_simulation)
        gamepad.lost.connect(lambda: self.said.emit("The gamepad was unplugged or fell silent.", "warn"))
        gamepad.changed.connect(controls.show_pad)
        controls.speeds_changed.connect(self._set_speeds)
        controls.stop_wanted.connect(self.red_stop)
        controls.reset_wanted.connect(self.reset_red_stop)
        controls.restart_wanted.connect(self.restart_simulation)
        window.activation_changed.connect(lambda active: None if active else self.mux.release_all())
        access.changed.connect(self.update_block)
        access.refused.connect(lambda reason: self.said.emit(reason, "warn"))
        link.state_changed.connect(lambda _state: self.update_block())
        if link.has("safety_text"):
            link.channel("safety_text").arrived.connect(self._on_safety)
        window.video.stale_changed.connect(lambda _stale: self.update_block())
        window.video.late_changed.connect(self._on_late)
        self.update_block()

    @property
    def hold(self) -> str:
        """Why nobody may drive while this window has the robot, not even a keyboard; empty when somebody may."""
        return self.picture_problem or (LATE if self._window.video.late else "")

    @property
    def picture_problem(self) -> str:
        """Why this window's picture forbids driving until something is pressed again; empty when it does not."""
        if not self._window.video.stale:
            return ""
        return "The robot's picture is lost, so nothing drives. Turn Robot feed off to drive without it."

    def update_block(self) -> None:
        """Find out what forbids driving, and show it: a pad that does nothing must say why."""
        link, state, passing = self._link, self._link.state, False
        if self._away:
            reason = next(iter(self._away.values()))
        elif not state.joined:
            reason = "Driving needs a ROS master. Press Roscore start."
        elif not state.driver:
            what = "The simulation does not run" if link.robot.by_movement else "No driver listens to this window"
            reason = f"{what}. Press Session start."
        elif self._access.obstacle():
            reason, passing = self._access.obstacle(), self._access.comes_back
        elif self._gate_stopped:
            reason = f"{self._gate_stopped} Press the red stop to reset it."
        elif not self._share:
            reason, passing = "The link is more than a second late, so nothing drives until it is faster.", True
        else:
            reason, passing = self.picture_problem, True
        self.mux.set_block(reason, passing)
        if reason:
            self.blocked.emit()
        self._access.set_hold(self.hold)
        lease = self._access.state
        stopped_by = lease.stopped_by if lease is not None else ""
        self._controls.show_stopped(stopped_by or ("the safety gate" if self._gate_stopped else ""))
        self._window.padLabel.setText("off" if reason else "hold to drive")
        self._window.padLabel.setToolTip(reason)

    def set_away(self, what: str, reason: str) -> None:
        """Do not drive this robot from this window because of what is in front of it, until the reason is empty."""
        self._away.pop(what, None)
        if reason:
            self._away[what] = reason
        self.mux.release_all()
        self.update_block()

    def set_share(self, share: float) -> None:
        """Set the share of the speed that the link's delay allows, 0 to 1; see `gui.driving.delay_speed_limit`."""
        self._share = share
        self.update_block()

    def stop(self) -> None:
        """Stop driving, and make keyboard nodes elsewhere let go of their latched keys."""
        self.mux.stop()
        self._zeros_left = STOP_REPEATS
        self._send_zero()
        self._zeros.start()

    def _on_stop_pressed(self) -> None:
        """Send one zero through drive_lease; past it, where that takes none of this window's commands."""
        if self._access.mine:
            self.mux.stop()
        elif not self._away:  # the pad of a robot in the back is heard there as well
            self.stop()
            self.said.emit("This window does not have the robot, which only stands for a moment: Esc stops it.", "warn")

    def red_stop(self) -> None:
        """Stop the robot and keep it stopped, whatever anybody sends, until `reset_red_stop`."""
        self.stop()
        self._access.ask("stop")
        if self._link.has("stop_drive"):
            # Directly as well: the gate's stop also works where no drive_lease runs.
            self._link.call("stop_drive", then=self._on_gate_stop)

    def reset_red_stop(self) -> None:
        """Reset the red stop, if this window may."""
        if self._access.state is None and self._access.is_pilot and self._link.has("reset_stop"):
            self._link.call("reset_stop", then=self._on_gate_reset)
        else:
            self._access.ask("reset_stop")

    def restart_simulation(self) -> None:
        """Reset the simulated world, of the robot in front: one gamepad is heard by all."""
        if self._away:
            return
        if not self._access.mine:
            self.said.emit(self._access.obstacle() or "Only the pilot can restart the simulation.", "warn")
            return
        self.mux.stop()
        self._link.call("restart_simulation", then=self._on_restarted)

    def _on_velocity(self, vx: float, vy: float, wz: float) -> None:
        if any((vx, vy, wz)):
            self._zeros.stop()
        share = 0.0 if self._window.video.late else self._share
        self._access.drive(*(part * share for part in (vx, vy, wz)))
        if not self._link.robot.by_movement:
            self._link.send("movement", int(movement_of(vx * share)))  # a report: the simulator drives by the velocity
        self.sent.emit()

    def _on_late(self, late: bool) -> None:
        """Pause: what is held drives on with the next picture, unless that comes so late that it counts as lost."""
        if late and self.mux.driver is not None:
            self._on_velocity(0.0, 0.0, 0.0)
        self.update_block()

    def _send_zero(self) -> None:
        self._link.send("zero")
        self._zeros_left -= 1
        if self._zeros_left <= 0:
            self._zeros.stop()

    def _set_speeds(self, speed: float, turn: float) -> None:
        self.mux.set_speeds(speed, turn)

    def _on_safety(self, text: str) -> None:
        state, _, reason = text.partition(": ")
        stopped = reason if state == "stopped" else ""
        if stopped != self._gate_stopped:
            self._gate_stopped = stopped
            self.update_block()

    def _on_gate_stop(self, answer: Answer) -> None:
        if not answer.ok and self._access.state is None:
            self.said.emit(f"The robot was asked to stop, but nothing keeps it stopped: {answer.text}", "bad")

    def _on_gate_reset(self, answer: Answer) -> None:
        if not answer.ok:
            self.said.emit(answer.text, "warn")

    def _on_restarted(self, answer: Answer) -> None:
        text = answer.text or "The simulation restarts."
        self.said.emit(text, "good" if answer.ok else "warn")
