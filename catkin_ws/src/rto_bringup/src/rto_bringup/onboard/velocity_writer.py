"""Writes velocities to the robot's web server without making whoever decides on them wait: a server may take a tenth of
a second to answer, and from a computer that rides on the robot there is a network between.

Two threads with a connection each: one writes what moves the robot, the newest only, and one writes zeros. So a zero
never waits for the answer to a velocity. Which of two requests that are under way the server obeys last nobody knows:
a zero that overtakes a velocity is followed by another one once that has its answer or is given up.
"""

from __future__ import annotations

import logging
import math
import threading
import time

from rto_node.client import RobotinoClient, RobotinoError

from telepresence.drive.server import AT_REST

log = logging.getLogger(__name__)

WRITE_TIMEOUT = 0.4
"""Seconds within which the robot's web server must take a velocity."""
LONGEST_WAIT = 0.15
"""Seconds for which a velocity may wait for the answer to the one before; newer ones replace it 20 times a second, so
one that is older was left behind by a program that hung."""
FAULT_TIME = 0.5
"""Seconds for which a velocity that the robot's web server did not take is reported as a fault."""
END_PATIENCE = 2.0 * WRITE_TIMEOUT
"""Seconds that the last zero has to reach the robot."""

Velocity = tuple[float, float, float]


class VelocityWriter:
    """For one thread, besides its own, which start with the first velocity and so have its priority.

    Args:
        robot: Address of the robot's web server.
    Raises:
        ValueError: It is not an address.
    """

    def __init__(self, robot: str) -> None:
        self._driving = RobotinoClient(robot, timeout=WRITE_TIMEOUT)
        self._stopping = RobotinoClient(robot, timeout=WRITE_TIMEOUT)
        self._changed = threading.Condition()  # protects all below
        self._waiting: tuple[Velocity, float] | None = None
        """What is to move the robot next, and when that was decided [s]."""
        self._zero_waits = self._velocity_under_way = self._zero_under_way = self._overtaken = self._closed = False
        self._problem, self._failed_at = "", -math.inf
        self._threads: list[threading.Thread] = []

    def write(self, velocity: Velocity) -> None:
        """Have a velocity [m/s, m/s, rad/s] written, instead of those that still wait."""
        with self._changed:
            if any(velocity):
                self._waiting = velocity, time.monotonic()
            else:
                self._waiting, self._zero_waits = None, True
            self._start()
            self._changed.notify_all()

    def problem(self, now: float) -> str:
        """Return why the robot's web server did not take a velocity lately; empty if it did. What one write met counts
        for a moment only: nobody writes while nobody drives, and nothing would clear it."""
        with self._changed:
            return self._problem if now - self._failed_at <= FAULT_TIME else ""

    def finish(self) -> None:
        """Wait until the zeros are written, `END_PATIENCE` seconds at most."""
        with self._changed:
            self._changed.wait_for(
                lambda: not (self._zero_waits or self._zero_under_way or self._velocity_under_way), END_PATIENCE
            )

    def close(self) -> None:
        """End the threads; what waits is not written any more."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        for thread in self._threads:
            thread.join(timeout=2.0 * WRITE_TIMEOUT)

    # --- inside ------------------------------------------------------------------------------------------------------

    def _start(self) -> None:
        if self._threads:
            return
        for work, name in ((self._drive, "velocities"), (self._stop, "zeros")):
            self._threads.append(threading.Thread(target=work, name=name, daemon=True))
            self._threads[-1].start()

    def _drive(self) -> None:
        while (velocity := self._next_velocity()) is not None:
            self._put(self._driving, velocity)
            with self._changed:
                self._velocity_under_way = False
                # A newer velocity that waits is written after it anyway.
                self._zero_waits = self._zero_waits or (self._overtaken and self._waiting is None)
                self._overtaken = False
                self._changed.notify_all()
        self._driving.close()

    def _next_velocity(self) -> Velocity | None:
        """Wait for one, and until no zero is under way that it could overtake; None at the end."""
        with self._changed:
            while True:
                self._changed.wait_for(
                    lambda: self._closed or (self._waiting and not (self._zero_waits or self._zero_under_way))
                )
                if self._closed or self._waiting is None:
                    return None
                (velocity, decided), self._waiting = self._waiting, None
                if time.monotonic() - decided <= LONGEST_WAIT:
                    self._velocity_under_way = True
                    return velocity

    def _stop(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._closed or self._zero_waits)
                if self._closed:
                    break
                self._zero_waits, self._zero_under_way = False, True
                self._overtaken = self._overtaken or self._velocity_under_way
            self._put(self._stopping, AT_REST)
            with self._changed:
                self._zero_under_way = False
                self._changed.notify_all()
        self._stopping.close()

    def _put(self, client: RobotinoClient, velocity: Velocity) -> None:
        try:
            client.drive(*velocity)
            problem = ""
        except RobotinoError as error:
            problem = str(error)
        with self._changed:
            if problem and not self._problem:
                log.error("%s", problem)
            self._problem = problem
            self._failed_at = time.monotonic() if problem else self._failed_at
