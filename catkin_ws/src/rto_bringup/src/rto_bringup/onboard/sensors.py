"""The robot's sensors, read from its own web server 20 times a second, on a thread of its own."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from typing import NamedTuple

from rto_node.client import RobotinoError, Scan
from rto_node.reading_count import ReadingCount

from rto_bringup.onboard.parallel_client import ParallelClient
from telepresence.safety import Odometry
from telepresence.start_patience import StartPatience

log = logging.getLogger(__name__)

PERIOD = 0.05
SCAN_EVERY = 2
"""Cycles per question for the laser's scan."""
TIMEOUT = 0.3
REMINDER = 30.0
"""Seconds after which a web server that still does not answer is named again."""


class Reading(NamedTuple):
    """What one cycle read.

    Args:
        stamp: When it was asked for [s].
        distances: Of the infrared sensors [m].
        odometry: Stamped when the robot last counted a reading; None until it has counted one.
        scan: None in cycles without a new one.
        restarts: How often odometry has started again.
    """

    stamp: float
    distances: tuple[float, ...]
    bumper: bool
    odometry: Odometry | None
    scan: Scan | None
    restarts: int = 0


class Sensors:
    """Polls until closed.

    Args:
        address: Of the robot's web server.
        laser: Whether to ask for scans.
        take: Called with every reading, on this thread.
    Attributes:
        problem: Why there are no readings; empty while there are.
    """

    def __init__(self, address: str, laser: bool, take: Callable[[Reading], None]) -> None:
        self.problem = "the robot's web server has not been asked yet"
        self._client = ParallelClient(address, timeout=TIMEOUT)
        self._laser = laser
        self._take = take
        self._last_scan: int | None = None
        self._count = ReadingCount()
        self._odometry: Odometry | None = None
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="sensors", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def close(self) -> None:
        self._stop.set()
        self._thread.join(timeout=2.0)

    def _run(self) -> None:
        due, cycle, reminder, patience = time.monotonic(), 0, 0.0, StartPatience()
        while not self._stop.wait(max(0.0, due - time.monotonic())):
            due = max(due + PERIOD, time.monotonic())
            try:
                reading = self._read(cycle % SCAN_EVERY == 0)
                self._take(reading)
                if old := self._count.problem(reading.stamp):
                    raise RobotinoError(f"Robotino at {self._client.address} {old}")
                if self.problem:
                    log.info("the robot's web server at %s answers", self._client.address)
                self.problem = ""
                patience.works()
            except RobotinoError as error:
                if patience.over and (not self.problem or time.monotonic() > reminder):
                    reminder = time.monotonic() + REMINDER
                    log.error("%s; trying again", error)
                self.problem = str(error)
            cycle += 1
        self._client.end()

    def _read(self, with_scan: bool) -> Reading:
        stamp = time.monotonic()
        distances, bumper, odometry = self._client.distances(), self._client.bumper(), self._client.odometry()
        scan = self._client.scan() if self._laser and with_scan else None
        if scan is not None:
            fresh = scan.seq != self._last_scan
            self._last_scan = scan.seq
            scan = scan if fresh else None
        if self._count.take(odometry.seq, stamp):
            self._odometry = Odometry(odometry.x, odometry.y, odometry.phi, stamp)
        return Reading(stamp, distances, bumper, self._odometry, scan, self._count.restarts)
