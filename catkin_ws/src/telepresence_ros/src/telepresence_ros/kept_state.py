"""What people have set in a node, kept on the ROS master for as long as the node runs.

A node that dies or fails and is started again goes on with it: a microphone that was muted stays muted. One that ends
in order forgets it, so that the next session begins as its parameters say. After a session that was killed as a whole
the next one may be quieter than they say, and never louder.
"""

from __future__ import annotations

import http.client
import os
import threading
import time
import xmlrpc.client
from collections.abc import Callable
from typing import Any

import rosgraph
import rospy

from telepresence.safety.latches import Latched
from telepresence.security.outside_text import clean
from telepresence.station.ros_master import master_proxy
from telepresence.station.vitals import start_time

TIMEOUT = 0.5
"""Seconds that the master may take for an answer."""
REPEAT = 5.0
"""Seconds after which the same is kept again: a ROS master that died has lost what was new to it."""
ERRORS = (OSError, http.client.HTTPException, xmlrpc.client.Error)


class KeptState:
    """The node's private parameter `~kept`: switches and texts by name."""

    def __init__(self) -> None:
        self._name = rospy.resolve_name("~kept")
        found = rospy.get_param(self._name, {})
        self._found = found if isinstance(found, dict) else {}
        # A session is whoever starts the node, and starts it again: pid and time of start, in the kernel's ticks.
        self._session = f"{os.getppid()} {start_time(os.getppid())}"
        self._same = self._found.get("session") == self._session
        self._ended = False
        self._lock = threading.Lock()
        self._changed = threading.Event()
        self._kept: dict[str, bool | str] | None = None
        self._due = 0.0

    def switch(self, name: str, otherwise: bool, quiet: bool) -> bool:
        """Return what `choice` does; `otherwise` if there is none."""
        choice = self.choice(name, quiet)
        return otherwise if choice is None else choice

    def choice(self, name: str, quiet: bool) -> bool | None:
        """Return a switch of a run of this node that has died; None if there is none. Of another session only the
        `quiet` position counts."""
        value = self._found.get(name)
        return value if isinstance(value, bool) and (self._same or value is quiet) else None

    def text(self, name: str) -> str:
        """Return a text of such a run; empty if there is none."""
        value = self._found.get(name)
        return value if isinstance(value, str) else ""

    def latched(self) -> Latched:
        """Return what was latched in the safety gate of such a run."""
        return Latched(clean(self.text("stopped")), self.switch("bumped", False, quiet=True))

    def keep(self, values: Callable[[], dict[str, bool | str]]) -> None:
        """Keep these in place of what was kept before. To be called at every change, and again and again."""
        with self._lock:
            newest, now = {**values(), "session": self._session}, time.monotonic()
            if self._ended or (newest == self._kept and now < self._due):
                return
            try:
                self._master().setParam(rospy.get_name(), self._name, newest)
            except ERRORS as error:
                rospy.logwarn_throttle(
                    60.0, f"if this node dies now, what was set here is lost: the ROS master does not take it: {error}"
                )
            else:
                self._kept, self._due = newest, now + REPEAT

    def keep_always(self, keep: Callable[[], None], stop: threading.Event, period: float) -> None:
        """Call `keep` every `period` seconds, and at once after `keep_soon`, until `stop` is set, beside the node's
        loops: these count as frozen when they are late, and the ROS master may keep us waiting."""

        def run() -> None:
            while not stop.is_set():
                self._changed.wait(period)
                self._changed.clear()
                keep()

        threading.Thread(target=run, name="kept", daemon=True).start()

    def keep_soon(self) -> None:
        """Have `keep_always` keep what has just changed, and do not wait for it."""
        self._changed.set()

    def forget_after(self, code: int) -> int:
        """Keep nothing any more if the node has ended in order; return its exit code. A master that has gone keeps
        nothing either."""
        if code != 0:
            return code
        with self._lock:
            self._ended = True
            try:
                self._master().deleteParam(rospy.get_name(), self._name)
            except ERRORS as error:
                rospy.logdebug("%s was not deleted: %s", self._name, error)
        return code

    def _master(self) -> Any:  # XML-RPC has no types
        return master_proxy(rosgraph.get_master_uri(), TIMEOUT)
