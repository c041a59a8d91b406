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

SOUND = "conversation"
"""The row of the robot's table that begins the sound both ways."""
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
    turns to the people there, and takes the conversation along.

    Args:
        link: The robot.
        access: Whether this window has it.
    """

    changed = pyqtSignal()
    """`text` has changed."""
    handed_on = pyqtSignal()
    """The pilot has turned to another robot, where the conversation is to go on."""

    def __init__(self, link: RosLink, access: DriveAccess) -> None:
        super().__init__(link)
        self._link, self._access = link, access
        parts = (
            _Part("show_page", "page", "you on the robot's tablet"),
            _Part(SOUND, "voice_state", "sound"),
        )
        self._parts = [part for part in parts if link.has(part.service)]
        self._wanted: bool | None = None
        self._in_front, self._muted = True, False
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
        """Whether there is one: this window wants it, or the programs have begun it, and the robot is the pilot's."""
        if self._taken:
            return False
        begun = any(part.on for part in self._parts if part.service == SOUND)
        return bool(self._wanted) or (self._wanted is None and begun and self._has_robot)

    @property
    def _has_robot(self) -> bool:
        return self._link.state.driver and self._access.mine

    @property
    def text(self) -> str:
        """What of the conversation is on, or does not end, as a sentence; empty when this window has begun none."""
        if self.problem:
            return self.problem
        now = time.monotonic()
        if not self._wanted or not self._parts:
            return ""
        done = [part.name for part in self._parts if part.done and not self._taken]
        missing = [part.name for part in self._parts if not part.done]
        sentence = f"Conversation: {', '.join(['the picture', *done])}."
        if missing and self._access.mine:
            waits = now - self._since < PATIENCE
            sentence += f" {'Waiting for' if waits else 'Not available:'} {', '.join(missing)}."
        return sentence

    @property
    def problem(self) -> str:
        """What does not end, as a sentence; empty for nothing."""
        if self._ends_since is None or time.monotonic() - self._ends_since <= PATIENCE:
            return ""
        left = [part.name for part in self._parts if part.begun and part.sign in self._link.found]
        return f"Not ended, for there is no answer: {', '.join(left)}." if left else ""

    def want(self, wanted: bool, muted: bool = False) -> None:
        """Begin the conversation, or end it.

        Args:
            muted: The robot does not hear the pilot, until the pilot wants that: the microphone is muted first.
        """
        self._wanted, self._muted, self._since = wanted, muted, time.monotonic()
        self._work()

    def greet(self) -> None:
        """Begin the conversation if the robot is in front: whoever comes to it is seen and heard there."""
        if self._in_front:
            self.want(True)

    def set_in_front(self, in_front: bool) -> None:
        """Of several robots in this window, this is the one in front, or another one is: then end what there is."""
        taken_along = self._in_front and not in_front and self.on
        self._in_front = in_front
        if self._wanted and not in_front:
            self.want(False)
        else:
            self._work()
        if taken_along:
            self.handed_on.emit()

    def leave(self) -> None:
        """End what this window has begun, because nobody is signed in here any more."""
        if self._wanted:
            self.want(False)

    def end_earlier(self) -> None:
        """End what an earlier window may have begun that died with somebody signed in."""
        for part in self._parts:
            part.begun, part.done = True, None
        self._work()

    def _forget(self) -> None:
        """The programs have ended, and the next ones have to be asked anew; or only the ROS master has, and they go on
        with what was begun."""
        for part in self._parts:
            part.done, part.on = None, False
        if self._wanted:
            self._since = time.monotonic()
        self._work()

    def _work(self) -> None:
        now = time.monotonic()
        self._notice_who_has_it(now)
        has_robot = self._has_robot
        settles = has_robot and now - self._taken_until < SETTLED
        if self._wanted and (settles or not has_robot):
            self._since = now
        waits = ends = False
        for part in self._parts:
            if has_robot and not self._in_front:
                target = self._quiet(part)
            elif has_robot:
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

    def _quiet(self, part: _Part) -> bool | None:
        """What a robot that is not in front shall do: end what is on, whoever has begun it, and whenever."""
        if part.on and not part.asked:
            part.begun, part.done = True, None
        return False if part.begun else self._wanted

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
        mutes = wanted and self._muted and part.service == SOUND
        part.begun = part.begun or (wanted and not mutes)

        def answered(answer: Answer) -> None:
            part.asked = False
            if answer.ok and mutes:
                self._muted = False
            elif answer.ok:
                part.done = part.begun = part.on = wanted
            if answer.ok:
                self._work()

        service = "mute_microphone" if mutes else part.service
        self._link.call(service, wanted, then=answered, patient=True, signed_out=not wanted)
