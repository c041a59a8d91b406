"""Probes whether the robot's own port still accepts clients.

libqi stops accepting connections for good when one is reset between the kernel's accept queue and its own accept call.
Old clients go on and new ones hang, so nothing seems wrong from inside. The probe connects as a client would; whoever
runs the robot ends the process when the probe gets no answer, and roslaunch restarts it.
"""

from __future__ import annotations

import logging
import threading

from pepper_sim.naoqi.codec import CodecError
from pepper_sim.naoqi.raw_client import probe

log = logging.getLogger(__name__)

PERIOD = 2.0
"""Time between probes [s]."""
TIMEOUT = 3.0
"""A probe that is not answered within this time has failed [s]; a loaded machine answers late, a stuck port never."""
FAILURES = 2
"""This many failed probes in a row mean that the port is stuck."""


class PortProbe:
    """Probes from construction until `close`.

    Args:
        endpoint: "tcp://address:port" of the robot.
        period, timeout: See PERIOD and TIMEOUT [s].
    Attributes:
        answered: How many probes were answered.
    """

    def __init__(self, endpoint: str, period: float = PERIOD, timeout: float = TIMEOUT) -> None:
        self._endpoint, self._period, self._timeout = endpoint, period, timeout
        self.answered = 0
        self._closing = threading.Event()
        self._stuck = threading.Event()
        self._thread = threading.Thread(target=self._run, name="port-probe", daemon=True)
        self._thread.start()

    @property
    def stuck(self) -> bool:
        """Whether new clients are no longer served; a stuck port stays stuck."""
        return self._stuck.is_set()

    def close(self) -> None:
        """Stop probing. Calling it again does nothing."""
        self._closing.set()
        self._thread.join(self._timeout + 1.0)

    def _run(self) -> None:
        failures = 0
        while not self._closing.wait(self._period):
            try:
                probe(self._endpoint, self._timeout)
                failures = 0
                self.answered += 1
            except (OSError, CodecError) as error:
                failures += 1
                log.warning("%s does not accept a client: %s", self._endpoint, error)
            if failures >= FAILURES and not self._closing.is_set():
                log.error("%s is stuck: new clients are not served any more", self._endpoint)
                self._stuck.set()
                return
