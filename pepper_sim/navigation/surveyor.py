"""Surveyor: watches the lasers, keeps the map and the robot's place in it, and remembers what was seen lately.

`observe` is called many times a second, by the surveyor's own thread in a running robot. What drives the robot (module
`behaviours`) reads the results. All of it is computed from the sensors and the wheels; nothing here knows the scene.
"""

from __future__ import annotations

import logging
import math
import threading
from collections import deque

import numpy as np

from pepper_sim.body.description import LASER_PERIOD
from pepper_sim.navigation.grid import OccupancyGrid
from pepper_sim.navigation.localizer import Localizer
from pepper_sim.navigation.scans import Scan, compose, read_scan, relative, transform
from pepper_sim.robot import Pepper
from telepresence.geometry import Pose

log = logging.getLogger(__name__)

MEMORY = 15.0
"""How long obstacles stay in mind after they were seen last [s] (NAOqi 2.8 documentation, ALNavigation, safety map)."""
COLLECTION = 60.0
"""What is collected for a free zone is not longer than this [s] (the same page)."""
COLLECTED = math.ceil(COLLECTION / LASER_PERIOD)
PATH_STEP, PATH_TURN = 0.25, 0.5
"""The path is sampled when the robot has gone so far or turned so much [m, rad]."""
MAX_PATH = 10_000


class Exploration:
    """A map and the path on which it was made."""

    def __init__(self, grid: OccupancyGrid | None = None, path: list[Pose] | None = None) -> None:
        self.grid = grid or OccupancyGrid()
        self.path: list[Pose] = path or []

    def pass_by(self, pose: Pose) -> None:
        """Add a pose to the path if the robot has moved on."""
        if self.path:
            last = self.path[-1]
            turned = abs(math.remainder(pose.theta - last.theta, math.tau))
            if math.hypot(pose.x - last.x, pose.y - last.y) < PATH_STEP and turned < PATH_TURN:
                return
        if len(self.path) < MAX_PATH:
            self.path.append(pose)


class Surveyor:
    """Mapping and localization of one robot. The methods may be called from any thread.

    Attributes:
        exploration: The map that is loaded or being made; None without one.
        mapping: Whether what is seen becomes part of the map.
        localizing: Whether the robot follows its place in the map.
    """

    def __init__(self, robot: Pepper) -> None:
        self.exploration: Exploration | None = None
        self.mapping = False
        self.localizing = False
        self.lock = threading.RLock()
        self._robot = robot
        self._localizer: Localizer | None = None
        self._last: np.ndarray | None = None
        self._recent: deque[tuple[float, Scan]] = deque(maxlen=math.ceil(MEMORY / LASER_PERIOD))
        self._since = -math.inf
        self._collected: deque[Scan] | None = None

    def observe(self) -> None:
        """Take in the lasers' newest scan, if there is a new one."""
        snapshot = self._robot.snapshot()
        if snapshot.laser["Front"] is self._last:
            return
        self._last = snapshot.laser["Front"]
        scan = read_scan(snapshot)
        with self.lock:
            self._recent.append((snapshot.time, scan))
            if self._collected is not None and len(self._collected) < COLLECTED:
                self._collected.append(scan)
            if self._localizer is None or not (self.mapping or self.localizing):
                return
            self._localizer.add(scan, map_too=self.mapping)
            if self.mapping and self.exploration is not None:
                self.exploration.pass_by(self._localizer.pose)

    # --- maps --------------------------------------------------------------------------------------------------------

    def begin(self) -> Exploration:
        """Begin a new map; its origin is where the robot stands, x ahead."""
        with self.lock:
            self.exploration = Exploration()
            self._localizer = Localizer(self.exploration.grid)
            self.mapping = self.localizing = True
            return self.exploration

    def load(self, exploration: Exploration | None) -> None:
        """Use another map, or none. The robot is taken to stand where that map was begun."""
        with self.lock:
            self.mapping = self.localizing = False
            self.exploration = exploration
            self._localizer = Localizer(exploration.grid) if exploration is not None else None

    def follow(self) -> None:
        """Follow the robot's place in the map from now on."""
        with self.lock:
            # What the wheels did in between is known: they count on while nobody looks.
            self.localizing = self._localizer is not None

    def stop(self) -> None:
        """End mapping and localization; the map stays."""
        with self.lock:
            self.mapping = self.localizing = False

    @property
    def localizer(self) -> Localizer | None:
        """The robot's place in the map, for use with `lock` held."""
        return self._localizer

    def odometry(self) -> Pose:
        """Return where the robot is now, by its wheels."""
        return Pose(*self._robot.snapshot().odometry)

    def pose(self) -> Pose:
        """Return where the robot is in the map now.

        Raises:
            RuntimeError: There is no map.
        """
        odometry = self.odometry()
        with self.lock:
            if self._localizer is None:
                raise RuntimeError("there is no map")
            return self._localizer.at(odometry)

    def add_depth(self, points: np.ndarray) -> None:
        """Add obstacles that the depth camera sees, in base_footprint as it stands now, shape (n, 2) [m]."""
        pose = self.pose() if self.exploration is not None else None
        with self.lock:
            if self.mapping and self.exploration is not None and pose is not None and len(points):
                self.exploration.grid.add_depth(transform(pose, points))

    # --- what was seen lately ----------------------------------------------------------------------------------------

    def forget(self) -> None:
        """Forget what was seen lately."""
        now = self._robot.snapshot().time  # first: the world's lock is never taken with this one held
        with self.lock:
            self._recent.clear()
            self._since = now

    def begin_collection(self) -> None:
        """Keep what is seen from now on, for as long as `COLLECTION`, until `end_collection`."""
        with self.lock:
            self._collected = deque()

    def end_collection(self) -> list[Scan]:
        """Return what was kept since `begin_collection`; nothing if it was not called."""
        with self.lock:
            collected, self._collected = self._collected, None
        return list(collected or ())

    def recent(self, longest: float = MEMORY) -> list[Scan]:
        """Return the scans of the last `longest` seconds, oldest first."""
        now = self._robot.snapshot().time
        with self.lock:
            return [scan for time, scan in self._recent if time >= max(now - longest, self._since)]

    def obstacles(self, frame: Pose, longest: float = MEMORY) -> np.ndarray:
        """Return the obstacles seen in the last `longest` seconds, shape (n, 2) [m].

        Args:
            frame: The robot's present pose in the frame in which they are wanted.
        """
        here = self.odometry()
        found = [
            transform(compose(frame, relative(here, scan.odometry)), scan.obstacles) for scan in self.recent(longest)
        ]
        return np.concatenate(found) if found else np.zeros((0, 2))
