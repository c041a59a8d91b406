"""Navigator: runs the robot's navigation: a thread that observes, and one behaviour at a time that drives."""

from __future__ import annotations

import concurrent.futures
import logging
import math
import threading
from collections.abc import Callable
from typing import Any

from pepper_sim.body.joints import resolve
from pepper_sim.naoqi.motion.base import MotionBase
from pepper_sim.naoqi.tasks import Workers
from pepper_sim.navigation.behaviours import PERIOD, Behaviour, Driver
from pepper_sim.navigation.depth_eye import DepthEye
from pepper_sim.navigation.scans import relative
from pepper_sim.navigation.surveyor import Surveyor
from pepper_sim.robot import Pepper
from telepresence.geometry import Pose

log = logging.getLogger(__name__)

HALT_TIMEOUT = 1.0
"""A behaviour waits so long for the one that it replaces to halt [s]; one that plans a way may take its time."""


class BaseWheels:
    """ALMotion's base as what behaviours drive with, so that its rules and limits hold for them, too."""

    def __init__(self, robot: Pepper, base: MotionBase) -> None:
        self._robot = robot
        self._base = base
        self._failures = 0

    def go(self, x: float, y: float, theta: float, speed: float, rate: float) -> concurrent.futures.Future:
        """Drive to a pose relative to the robot, at most at `speed` [m/s] and `rate` [rad/s]; True when it is there."""
        self._failures = self._robot.snapshot().move_failed.count
        return self._base.moveTo(x, y, theta, [["MaxVelXY", speed], ["MaxVelTheta", rate]])

    def halt(self) -> None:
        """Stop."""
        self._robot.stop_move()

    def obstacle(self) -> tuple[float, float] | None:
        """Return the obstacle that ended the last drive, relative to the robot [m]; None if something else did."""
        snapshot = self._robot.snapshot()
        failure = snapshot.move_failed
        if failure.count == self._failures or failure.cause != "obstacle":
            return None
        place = relative(Pose(*snapshot.odometry), Pose(failure.obstacle[0], failure.obstacle[1], 0.0))
        return place.x, place.y


class Navigator:
    """Navigation of one robot.

    Args:
        report: Receives what a behaviour reports, see `Driver`, and "motion" for what an infrared spot detects.
    """

    def __init__(self, robot: Pepper, base: MotionBase, workers: Workers, report: Callable[[str, Any], None]) -> None:
        self.surveyor = Surveyor(robot)
        eye = DepthEye(robot, self.surveyor) if robot.has_cameras else None
        self.wheels = BaseWheels(robot, base)
        self.driver = Driver(self.surveyor, self.wheels, eye, report)
        self._robot = robot
        self._workers = workers
        self._report = report
        self._running: tuple[concurrent.futures.Future, threading.Event] | None = None
        self._halted: concurrent.futures.Future = concurrent.futures.Future()  # what ran last no longer drives
        self._halted.set_result(True)
        self._lock = threading.Lock()
        self._infrared: dict[str, bool] = {}
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._observe, name="navigation", daemon=True)
        self._thread.start()
        robot.world.on_reset(self._reset)

    def run(self, behaviour: Behaviour[Any], stopped: Any = False) -> concurrent.futures.Future:
        """Run a behaviour instead of the one that runs, once that has halted.

        Args:
            stopped: The result if it is stopped before its end.
        Returns:
            Future: What the behaviour returns or raises; cancelling it stops the behaviour.
        """
        future: concurrent.futures.Future = concurrent.futures.Future()
        stop, halted = threading.Event(), concurrent.futures.Future[bool]()
        with self._lock:  # in one go: of two callers at once each stops what was begun before it
            replaced, self._running = self._running, (future, stop)
            before, self._halted = self._halted, halted
        if replaced is not None:
            replaced[1].set()

        def work() -> None:
            concurrent.futures.wait([before], HALT_TIMEOUT)  # or it would halt what is begun here
            try:
                self._drive(behaviour, future, stop, stopped)
            finally:
                resolve(halted, True)

        self._workers.run(work)
        return future

    def stop(self) -> concurrent.futures.Future:
        """Stop the behaviour that runs; the future is done when it has halted, and can stop nobody else any more."""
        with self._lock:
            running, self._running = self._running, None
            halted = self._halted
        if running is not None:
            running[1].set()
        future: concurrent.futures.Future = concurrent.futures.Future()  # a client may cancel its own
        halted.add_done_callback(lambda _: resolve(future, True))
        return future

    @property
    def busy(self) -> bool:
        """Whether a behaviour runs."""
        running = self._running
        return running is not None and not running[0].done()

    def close(self) -> None:
        self.stop()
        self._closing.set()
        self._thread.join(timeout=2.0)

    # --- inside ------------------------------------------------------------------------------------------------------

    def _drive(
        self, behaviour: Behaviour[Any], future: concurrent.futures.Future, stop: threading.Event, stopped: Any
    ) -> None:
        try:
            while True:
                next(behaviour)  # once in any case: closing one that has not begun would not end it properly
                if stop.wait(PERIOD) or future.cancelled() or self._workers.closing.is_set():
                    break
            behaviour.close()
        except StopIteration as end:
            stopped = end.value
        except Exception as error:  # the client that called reads it
            if future.set_running_or_notify_cancel():
                future.set_exception(error)
            return
        if future.set_running_or_notify_cancel():
            future.set_result(stopped)

    def _observe(self) -> None:
        while not self._closing.wait(PERIOD):
            try:
                self.surveyor.observe()
                self._watch_infrared()
            except Exception:  # top of a thread: the robot goes on without this scan
                log.exception("a scan could not be used")

    def _watch_infrared(self) -> None:
        snapshot = self._robot.snapshot()
        for side, near in snapshot.infrared.items():
            if self._infrared.get(side, near) != near:
                self._report("motion", (side, Pose(*snapshot.odometry), near))
        self._infrared = dict(snapshot.infrared)

    def _reset(self) -> None:
        """The world was put back to its start: no map, no memory, nothing that runs."""
        self.stop()
        self.surveyor.load(None)
        self.surveyor.forget()
        self._infrared = {}


def place_beside(side: str, pose: Pose, distance: float) -> list[float]:
    """Return [x, y, z] of what an infrared spot detects, on its ray at `distance` [m]; by odometry [m]."""
    sign = 1.0 if side == "Left" else -1.0
    heading = pose.theta + sign * math.pi / 4
    c, s = math.cos(pose.theta), math.sin(pose.theta)
    x = pose.x + c * 0.04913 - s * sign * 0.07434 + distance * math.cos(heading)
    y = pose.y + s * 0.04913 + c * sign * 0.07434 + distance * math.sin(heading)
    return [x, y, 0.2676]
