"""What Robot feed begins besides the picture: the pilot on the robot's tablet, and sound both ways."""

from __future__ import annotations

import math
import time
from functools import partial
from typing import TYPE_CHECKING

from PyQt5.QtCore import QObject, pyqtSignal

from gui.periodic_timer import PeriodicTimer
from gui.ros.channels import Answer

if TYPE_CHECKING:
    from gui.driving.drive_access import DriveAccess
    from gui.ros.link import RosLink
    from gui.ros.readings import PageState, VoiceState

PERIOD = 500  # ms
PATIENCE = 30.0
"""[s] that programs which have just been started may take until they offer their part."""
SETTLED = 1.0
"""[s] after somebody else has had the robot until this window begins: they end their conversation meanwhile."""


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
        self.on = False
        """What the robot's programs say about it, whoever has begun it."""


class Conversation(QObject):
    """Begins the conversation, as soon as the robot's programs run and this window has the robot, and ends it: somebody
    who only watches must not end what the pilot has begun. What this window has begun ends with the robot in somebody
    else's hands, and when nobody is signed in any more: a camera and a microphone do not stay with a robot that others
    have. Programs that are started anew are asked again.

    Of several robots in one window only the one in front hears and shows the pilot: whoever turns to another robot
    turns to the people there.

    Args:
        link: The robot.
        access: Whether this window has it.
    """

    changed = pyqtSignal()
    """`text` has changed."""
    handed_on = pyqtSignal()
    """It has been ended because another robot came to the front, where it is to go on."""

    def __init__(self, link: RosLink, access: DriveAccess) -> None:
        super().__init__(link)
        self._link, self._access = link, access
        parts = (
            _Part("show_page", "page", "you on the robot's tablet"),
            _Part("conversation", "voice_state", "sound"),
        )
        self._parts = [part for part in parts if link.has(part.service)]
        self._wanted: bool | None = None
        self._in_front = True
        self._since = 0.0
        self._ends_since: float | None = None
        self._taken, self._taken_until = False, -math.inf
        self._reported = ""
        self._timer = PeriodicTimer(PERIOD, self._work, self)
        link.state_changed.connect(lambda state: self._work() if state.driver else self._forget())
        access.changed.connect(self._work)
        for part in self._parts:
            link.channel(part.sign).arrived.connect(partial(self._receive, part))

    @property
    def on(self) -> bool:
        """Whether there is one: this window wants it, or the programs have begun it and nobody has ended it here."""
        return bool(self._wanted) or (self._wanted is None and any(part.on for part in self._parts))

    @property
    def text(self) -> str:
        """What of the conversation is on, or does not end, as a sentence; empty when this window has begun none."""
        now = time.monotonic()
        if self._ends_since is not None and now - self._ends_since > PATIENCE:
            left = [part.name for part in self._parts if part.begun and part.sign in self._link.found]
            if left:
                return f"Not ended, for there is no answer: {', '.join(left)}."
        if not self._wanted or not self._parts:
            return ""
        done = [part.name for part in self._parts if part.done and not self._taken]
        missing = [part.name for part in self._parts if not part.done]
        sentence = f"Conversation: {', '.join(['the picture', *done])}."
        if missing and self._access.mine:
            waits = now - self._since < PATIENCE
            sentence += f" {'Waiting for' if waits else 'Not available:'} {', '.join(missing)}."
        return sentence

    def want(self, wanted: bool) -> None:
        """Begin the conversation, or end it."""
        self._wanted, self._since = wanted, time.monotonic()
        self._work()

    def set_in_front(self, in_front: bool) -> None:
        """Of several robots in this window, this is the one in front, or another one is."""
        self._in_front = in_front
        self._work()

    def leave(self) -> None:
        """End what this window has begun, because nobody is signed in here any more."""
        if self._wanted:
            self.want(False)

    def _forget(self) -> None:
        """The programs have ended, and the next ones have to be asked anew; or only the ROS master has, and they go on
        with what was begun."""
        for part in self._parts:
            part.done = None
        if self._wanted:
            self._since = time.monotonic()
        self._work()

    def _work(self) -> None:
        now = time.monotonic()
        self._notice_who_has_it(now)
        self._hand_on()
        has_robot = self._link.state.driver and self._access.mine
        settles = has_robot and now - self._taken_until < SETTLED
        if self._wanted and (settles or not has_robot):
            self._since = now
        waits = ends = False
        for part in self._parts:
            if has_robot:
                target = self._wanted
            else:
                target = False if part.begun and (self._taken or not self._wanted) else None
            if target is None or part.done is target:
                continue
            ends = ends or (part.begun and not target)
            waits = waits or ends or now - self._since < PATIENCE
            if not part.asked and part.sign in self._link.found and not (target and settles):
                self._ask(part, target)
        if not ends:
            self._ends_since = None
        elif self._ends_since is None:
            self._ends_since = now
        if waits:
            self._timer.start()
        else:
            self._timer.stop()
            self._wanted = self._wanted or None  # what is to end has ended; programs that come later are not meant
        self._report()

    def _hand_on(self) -> None:
        """End it when another robot is in front. What the robot's programs have begun by themselves is the pilot's,
        too, unless somebody else has the robot."""
        if self._in_front or not self.on or not (self._wanted or (self._link.state.driver and self._access.mine)):
            return
        self._wanted, self._since = False, time.monotonic()
        self.handed_on.emit()

    def _receive(self, part: _Part, state: PageState | VoiceState) -> None:
        if state.on != part.on:
            part.on = state.on
            self._work()

    def _notice_who_has_it(self, now: float) -> None:
        lease = self._access.state
        taken = lease is not None and bool(lease.pilot) and not self._access.mine
        if self._taken and not taken:
            self._taken_until = now
        self._taken = taken

    def _report(self) -> None:
        text = self.text
        if text != self._reported:
            before, self._reported = self._reported, text
            if not self._taken or "Not ended" in before + text:  # who has the robot now is said elsewhere
                self.changed.emit()

    def _ask(self, part: _Part, wanted: bool) -> None:
        part.asked, part.done = True, None
        part.begun = part.begun or wanted

        def answered(answer: Answer) -> None:
            part.asked = False
            if answer.ok:
                part.done = part.begun = part.on = wanted
                self._work()

        self._link.call(part.service, wanted, then=answered, patient=True, signed_out=not wanted)
