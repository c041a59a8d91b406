"""ALNavigation's maps: exploring, files, the robot's place in a map, and driving in it.

Two releases are served: 2.5 answers error codes and takes lists, 2.8 answers nothing or true and takes numbers.
Source: NAOqi 2.8 documentation, exploration-api; release 2.5's forms and codes as programs for robots of that release
use them. What no document gives was read from Aldebaran's own samples (aldebaran/naoqi_navigation_samples): the pixels
of the map come column by column, x rising, and in a column from large y to small y.
"""

from __future__ import annotations

import concurrent.futures
import math

import numpy as np

from pepper_sim.disk import RobotDisk
from pepper_sim.naoqi.navigation.navigator import Navigator
from pepper_sim.naoqi.service import ServiceError, finite, remote, shown
from pepper_sim.navigation import exploration_file
from pepper_sim.navigation.behaviours import Behaviour, NotMoved
from pepper_sim.navigation.grid import RESOLUTION
from pepper_sim.navigation.localizer import AGREEMENT, Estimate, Localizer
from pepper_sim.navigation.surveyor import Exploration, Surveyor
from telepresence.geometry import Pose

OK, FAILED, CANCELLED, NOT_REACHED, NOT_IN_MAP = 0, 1, 2, 4, 5
"""Error codes of release 2.5."""
FARTHEST = 3.0
"""A goal farther from the path of the exploration than this cannot be reached [m]."""
GUESS_REACH = 1.0
"""A guess of the robot's place may be wrong by this [m]."""
MARGIN = 0.5
"""The map that clients get goes this far beyond what is known [m]."""

_NO_MAP = "No exploration loaded."
_NOT_LOCALIZED = "Localization is not running."
_SCANS, _PATIENCE = 5, 25  # scans to relocalize by, and resumptions to wait for them
_UNSURE = (0.15, 0.15, 0.2)  # standard deviations of a guess that the lasers do not confirm [m, m, rad]


class MapCalls:
    """Methods of ALNavigation about maps."""

    def __init__(self, navigator: Navigator, disk: RobotDisk) -> None:
        self._navigator = navigator
        self._disk = disk
        self._default: str | None = None

    @property
    def _surveyor(self) -> Surveyor:
        return self._navigator.surveyor

    # --- making a map ------------------------------------------------------------------------------------------------

    @remote("i(f)")
    def explore(self, radius: float) -> concurrent.futures.Future:
        """Explores the surroundings up to a distance [m]; 0 when nothing is left to see, else an error code."""
        if radius <= 0.0:
            raise ServiceError(f"radius must be positive, got {radius:g}")
        return self._navigator.run(self._explore(radius), CANCELLED)

    @remote("v()")
    def startMapping(self) -> concurrent.futures.Future:
        """Begins a map: the robot looks around, then whoever drives it adds to the map, until stopExploration."""
        return self._navigator.run(self._begin(), None)

    @remote("v()")
    def stopExploration(self) -> concurrent.futures.Future:
        """Ends exploring, mapping and localization; ends itself when the robot no longer drives for them."""
        halted = self._navigator.stop()
        self._surveyor.stop()
        return halted

    def _explore(self, radius: float) -> Behaviour[int]:
        self._surveyor.begin()
        try:
            yield from self._navigator.driver.explore(radius)
        except NotMoved:
            self._surveyor.load(None)
            return FAILED
        finally:
            self._surveyor.stop()
        return OK

    def _begin(self) -> Behaviour[None]:
        self._surveyor.begin()
        try:
            yield from self._navigator.driver.sweep(mapping=True)
        except NotMoved as error:
            self._surveyor.load(None)
            raise ServiceError(f"the map could not be begun: {error}") from None

    # --- files -------------------------------------------------------------------------------------------------------

    @remote("s()")
    def saveExploration(self) -> str:
        """Writes the exploration to the robot's disk; returns its path."""
        exploration = self._exploration()
        name = f"{exploration_file.FOLDER}/{exploration_file.file_name()}"
        with self._surveyor.lock:
            try:
                exploration_file.save(exploration, self._disk.path(name))
            except OSError as error:
                raise ServiceError(f"cannot write {name}: {error.strerror}") from None
        return name

    @remote("b(s)")
    def loadExploration(self, path: str) -> bool:
        """Loads an exploration from the robot's disk."""
        self._navigator.stop()
        self._surveyor.load(self._read(path))
        return True

    @remote("v(s)")
    def setDefaultExploration(self, path: str) -> None:
        """Names the exploration that is loaded when localization starts and none is."""
        if not self._disk.path(path).is_file():
            raise ServiceError(f"there is no exploration {shown(path)}")
        self._default = path

    def _read(self, path: str) -> Exploration:
        try:
            return exploration_file.load(self._disk.path(path))
        except FileNotFoundError:
            raise ServiceError(f"there is no exploration {shown(path)}") from None
        except OSError as error:
            raise ServiceError(f"cannot read {shown(path)}: {error.strerror}") from None
        except exploration_file.BadExploration as error:
            raise ServiceError(f"cannot load {shown(path)}: {error}") from None

    # --- what the map holds ------------------------------------------------------------------------------------------

    @remote("m()")
    def getMetricalMap(self) -> list:
        """Returns [metres per pixel, width, height, [x, y] of pixel (0, 0), [pixels: 0 occupied to 100 free]]."""
        grid = self._exploration().grid
        with self._surveyor.lock:
            cells = grid.likelihoods()
            known = np.argwhere((grid.lasers != 0.0) | (grid.depth != 0.0))
        low, high = (known.min(axis=0), known.max(axis=0)) if len(known) else (np.zeros(2), np.zeros(2))
        size = min(grid.cells, int((high - low).max()) + 1 + 2 * round(MARGIN / RESOLUTION))
        middle = (low + high) // 2
        first = np.clip(middle - size // 2, 0, grid.cells - size).astype(int)
        part = cells[first[0] : first[0] + size, first[1] : first[1] + size][:, ::-1]
        x, y = grid.place(int(first[0]), int(first[1]) + size - 1)
        return [RESOLUTION, size, size, [x, y], part.ravel().tolist()]

    @remote("m()")
    def getExplorationPath(self) -> list[list[float]]:
        """Returns the poses [[x, y, theta], ...] that the robot passed while it explored."""
        return [list(pose) for pose in self._exploration().path]

    # --- the robot in the map ----------------------------------------------------------------------------------------

    @remote("v()")
    def startLocalization(self) -> None:
        """Follows the robot's place in the map from now on."""
        if self._surveyor.exploration is None and self._default is not None:
            self.loadExploration(self._default)
        self._exploration()
        self._surveyor.follow()

    @remote("v()")
    def stopLocalization(self) -> None:
        """Ends localization."""
        if not self._surveyor.mapping:
            self._surveyor.stop()

    @remote("b()")
    def isLocalizationRunning(self) -> bool:
        """Whether the robot follows its place in a map."""
        return self._surveyor.localizing

    @remote("v()")
    def relocalizeInMap(self) -> concurrent.futures.Future:
        """Looks around and finds the robot's place in the map (2.8)."""
        self._exploration()
        return self._navigator.run(self._relocalize(), None)

    @remote("m([f])", name="relocalizeInMap")
    def relocalizeInMapAt(self, estimation: list[float]) -> concurrent.futures.Future:
        """Finds the robot's place near a pose [x, y] or [x, y, theta]; returns [pose, uncertainty] (2.5)."""
        if len(estimation) not in (2, 3):
            raise ServiceError(f"estimation must be [x, y, theta], got {shown(estimation)}")
        x, y, *theta = (finite(value, "estimation") for value in estimation)
        self._exploration()
        return self._navigator.run(self._relocalize_near(Pose(x, y, theta[0] if theta else math.nan)), None)

    @remote("v(fff)")
    def relocalizeInMapWithHint(self, x: float, y: float, theta: float) -> concurrent.futures.Future:
        """Finds the robot's place near a pose [m, m, rad] (2.8)."""
        self._exploration()
        return self._navigator.run(self._relocalize_near(Pose(x, y, theta)), None)

    @remote("m()")
    def getRobotPositionInMap(self) -> list:
        """Returns [[x, y, theta], [radius x, radius y, radius of theta]]: the pose and how sure it is."""
        self._localized()
        estimate = self._localizer().estimate
        return _localized(Estimate(self._surveyor.pose(), estimate.deviations))

    @remote("i([f])")
    def navigateToInMap(self, target: list[float]) -> concurrent.futures.Future:
        """Drives to [x, y, theta] in the map, whatever its theta; 0 when it is there, else an error code (2.5)."""
        if len(target) not in (2, 3):
            raise ServiceError(f"target must be [x, y, theta], got {shown(target)}")
        self._localized()
        return self._navigator.run(self._go(target[0], target[1]), CANCELLED)

    @remote("b(ff)", name="navigateToInMap")
    def navigateToPlaceInMap(self, x: float, y: float) -> concurrent.futures.Future:
        """Drives to a place in the map [m]; true when it is there (2.8)."""
        self._localized()
        return self._navigator.run(self._reach(x, y), False)

    def _go(self, x: float, y: float) -> Behaviour[int]:
        path = self._exploration().path
        if min((math.dist(pose[:2], (x, y)) for pose in path), default=math.inf) > FARTHEST:
            return NOT_IN_MAP
        return OK if (yield from self._navigator.driver.drive_to((x, y))) else NOT_REACHED

    def _reach(self, x: float, y: float) -> Behaviour[bool]:
        return (yield from self._go(x, y)) == OK

    def _relocalize(self) -> Behaviour[None]:
        try:
            yield from self._navigator.driver.sweep()
        except NotMoved as error:
            raise ServiceError(f"the robot could not look around: {error}") from None
        agreement = self._search(None)
        if agreement < AGREEMENT:
            raise ServiceError(f"the robot does not recognize the map: {100 * agreement:.0f} % of what it sees agrees")
        self._surveyor.follow()

    def _relocalize_near(self, guess: Pose) -> Behaviour[list]:
        for _ in range(_PATIENCE):
            if len(self._surveyor.recent()) >= _SCANS:
                break
            yield
        if self._search(guess) < AGREEMENT:
            theta = guess.theta if math.isfinite(guess.theta) else 0.0
            with self._surveyor.lock:
                self._localizer().place(Pose(guess.x, guess.y, theta), _UNSURE)
        self._surveyor.follow()
        return _localized(self._localizer().estimate)

    def _search(self, guess: Pose | None) -> float:
        points = self._surveyor.obstacles(Pose(0.0, 0.0, 0.0))
        with self._surveyor.lock:
            return self._localizer().search(points, guess, GUESS_REACH)

    # --- inside ------------------------------------------------------------------------------------------------------

    def forget_default(self) -> None:
        """Forget the default exploration; the world was put back to its start."""
        self._default = None

    def _exploration(self) -> Exploration:
        exploration = self._surveyor.exploration
        if exploration is None:
            raise ServiceError(_NO_MAP)
        return exploration

    def _localized(self) -> None:
        self._exploration()
        if not self._surveyor.localizing:
            raise ServiceError(_NOT_LOCALIZED)

    def _localizer(self) -> Localizer:
        localizer = self._surveyor.localizer
        if localizer is None:
            raise ServiceError(_NO_MAP)
        return localizer


def _localized(estimate: Estimate) -> list:
    """Return [pose, uncertainty]: the greatest errors along x and y and of the heading, at three deviations."""
    return [list(estimate.pose), [3.0 * deviation for deviation in estimate.deviations]]
