"""What Robot feed begins besides the picture: the pilot on the robot's tablet, and sound both ways."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from PyQt5.QtCore import QObject, pyqtSignal

from gui.periodic_timer import PeriodicTimer
from gui.ros.channels import Answer

if TYPE_CHECKING:
    from gui.driving.drive_access import DriveAccess
    from gui.ros.link import RosLink

PERIOD = 500  # ms
PATIENCE = 30.0
"""[s] that programs which have just been started may take until they offer their part."""


class _Part:
    """The page or the sound.

    Args:
        service: The row of the robot's table whose argument true begins it.
        sign: The channel that is published where it can begin.
    """

    def __init__(self, service: str, sign: str, name: str) -> None:
        self.service, self.sign, self.name = service, sign, name
        self.done: bool | None = None
        """What the robot's programs have last confirmed; None when they have not been asked."""
        self.asked = False
        self.begun = False
        """Whether this window has asked the robot's programs to begin it, and they have not confirmed its end."""


class Conversation(QObject):
    """Begins and ends the conversation, as soon as the robot's programs run and this window has the robot: somebody who
    only watches must not end what the pilot has begun. What this window has begun it ends in any case, also when
    nobody is signed in any more, or a camera and a microphone would stay with a robot that others have. Programs that
    are started anew are asked again.

    Args:
        link: The robot.
        access: Whether this window has it.
    """

    changed = pyqtSignal()
    """`text` has changed."""

    def __init__(self, link: RosLink, access: DriveAccess) -> None:
        super().__init__(link)
        self._link, self._access = link, access
        parts = (
            _Part("show_page", "page", "you on the robot's tablet"),
            _Part("conversation", "voice_state", "sound"),
        )
        self._parts = [part for part in parts if link.has(part.service)]
        self._wanted: bool | None = None
        self._since = 0.0
        self._timer = PeriodicTimer(PERIOD, self._work, self)
        link.state_changed.connect(lambda state: None if state.driver else self._forget())

    @property
    def text(self) -> str:
        """What of the conversation is on, or does not end, as a sentence; empty when this window has begun none."""
        if not self._parts:
            return ""
        if not self._wanted:
            left = [part.name for part in self._parts if part.begun]
            return f"Not ended, for there is no answer: {', '.join(left)}." if left and self._waited() else ""
        done = [part.name for part in self._parts if part.done]
        missing = [part.name for part in self._parts if not part.done]
        sentence = f"Conversation: {', '.join(['the picture', *done])}."
        if missing:
            sentence += f" {'Not available:' if self._waited() else 'Waiting for'} {', '.join(missing)}."
        return sentence

    def want(self, wanted: bool) -> None:
        """Begin the conversation, or end it."""
        self._wanted, self._since = wanted, time.monotonic()
        self._timer.start()
        self._work()

    def leave(self) -> None:
        """End what this window has begun, because nobody is signed in here any more."""
        if self._wanted:
            self.want(False)

    def _forget(self) -> None:
        """The programs have ended, and the next ones have to be asked anew."""
        for part in self._parts:
            part.done = None
        if self._wanted:
            self._since = time.monotonic()
            self._timer.start()

    def _waited(self) -> bool:
        return time.monotonic() - self._since > PATIENCE

    def _work(self) -> None:
        has_robot = self._link.state.driver and self._access.mine
        if self._wanted and not has_robot:
            self._since = time.monotonic()
            return
        parts = [part for part in self._parts if has_robot or part.begun]
        for part in parts:
            if part.done is not self._wanted and not part.asked and part.sign in self._link.found:
                self._ask(part, bool(self._wanted))
        if all(part.done is self._wanted for part in parts) or self._waited():
            self._timer.stop()
            self.changed.emit()

    def _ask(self, part: _Part, wanted: bool) -> None:
        part.asked = True
        part.begun = part.begun or wanted

        def answered(answer: Answer) -> None:
            part.asked = False
            if answer.ok:
                part.done, part.begun = wanted, wanted
                self.changed.emit()

        self._link.call(part.service, wanted, then=answered, patient=True, signed_out=not wanted)
