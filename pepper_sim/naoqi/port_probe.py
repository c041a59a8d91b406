"""Watches whether the robot's own port still lets clients in.

libqi stops accepting connections for good when one is reset between the kernel's accept queue and its own accept call.
Old clients go on and new ones hang, so nothing looks wrong from inside. The watch knocks as a client would; whoever
runs the robot ends the process when nobody opens, and roslaunch starts a fresh one.
"""

from __future__ import annotations

import logging
import threading

from pepper_sim.naoqi.codec import CodecError
from pepper_sim.naoqi.raw_client import knock

log = logging.getLogger(__name__)

PERIOD = 2.0
"""Between knocks [s]."""
TIMEOUT = 3.0
"""A knock that is not answered for so long has failed [s]; a loaded machine answers late, a stuck port never."""
FAILURES = 2
"""So many failed knocks in a row mean that the door is stuck."""


class PortProbe:
    """Knocks from construction until `close`.

    Args:
        endpoint: "tcp://address:port" of the robot.
        period, timeout: See PERIOD and TIMEOUT [s].
    Attributes:
        knocks: How many were answered.
    """

    def __init__(self, endpoint: str, period: float = PERIOD, timeout: float = TIMEOUT) -> None:
        self._endpoint, self._period, self._timeout = endpoint, period, timeout
        self.knocks = 0
        self._closing = threading.Event()
        self._stuck = threading.Event()
        self._thread = threading.Thread(target=self._run, name="door-watch", daemon=True)
        self._thread.start()

    @property
    def stuck(self) -> bool:
        """New clients are not served any more; it stays so."""
        return self._stuck.is_set()

    def close(self) -> None:
        """Stop knocking. Calling it again does nothing."""
        self._closing.set()
        self._thread.join(self._timeout + 1.0)

    def _run(self) -> None:
        failures = 0
        while not self._closing.wait(self._period):
            try:
                knock(self._endpoint, self._timeout)
                failures = 0
                self.knocks += 1
            except (OSError, CodecError) as error:
                failures += 1
                log.warning("%s does not let a client in: %s", self._endpoint, error)
            if failures >= FAILURES and not self._closing.is_set():
                log.error("%s is stuck: new clients are not served any more", self._endpoint)
                self._stuck.set()
                return
