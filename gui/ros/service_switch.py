"""A switch in one of the robot's programs: a service whose argument is on or off."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PyQt5.QtCore import QObject, QTimer, pyqtSignal

from gui.ros.channels import Answer

if TYPE_CHECKING:
    from gui.ros.link import RosLink

RETRY = 300
"""[ms] between two calls for the same."""
LATE = 5000
"""[ms] after which the pilot is told that there is no answer yet."""


class ServiceSwitch(QObject):
    """Turns a switch to what was wanted last: one call at a time, or a press could arrive after its release.

    What is `quiet`, such as a closed microphone, is asked for until the program has answered, also for somebody who has
    signed out; the other position once, for nobody wants to be heard by surprise, or as long as it is held.

    Args:
        link: The robot.
        name: The row of the robot's table.
        repeat: [ms] after which what is not quiet is asked for again, because it is held, and the program ends it when
            nobody asks any more; 0 for never.
    """

    answered = pyqtSignal(object)
    """The `Answer` to what was wanted last: the first of each request, and the one that confirms it."""
    late = pyqtSignal(str)
    """There is no answer yet; a sentence."""

    def __init__(self, link: RosLink, name: str, quiet: bool, owner: QObject, repeat: int = 0) -> None:
        super().__init__(owner)
        self._link, self._name, self._quiet, self._repeat = link, name, quiet, repeat
        self._wanted = False
        self._request = 0
        self._calls, self._told = False, False
        self._retry, self._late = QTimer(self), QTimer(self)
        for timer, after, action in ((self._retry, RETRY, self._call), (self._late, LATE, self._complain)):
            timer.setSingleShot(True)
            timer.setInterval(after)
            timer.timeout.connect(action)

    def turn(self, wanted: bool) -> None:
        """Turn it on or off, as soon as the call before has ended."""
        self._wanted = wanted
        self._request += 1
        self._told = False
        self._retry.stop()
        self._late.start()
        if not self._calls:
            self._call()

    def _complain(self) -> None:
        self._told = True
        self.late.emit(f"{self._link.service_name(self._name)} has not answered yet.")

    def _report(self, answer: Answer) -> None:
        self._late.stop()
        if answer.ok or not self._told:
            self._told = not answer.ok
            self.answered.emit(answer)

    def _call(self) -> None:
        self._calls, request = True, self._request
        quiet = self._wanted is self._quiet

        def ended(answer: Answer) -> None:
            self._calls = False
            if request != self._request:
                self._call()
                return
            if quiet and not answer.arrived:
                self._retry.start(RETRY)
            elif not quiet and self._repeat and (answer.ok or not answer.arrived):
                self._retry.start(self._repeat)
            self._report(answer)

        self._link.call(self._name, self._wanted, then=ended, patient=True, signed_out=quiet)
