"""ALLocalization: the way back home, with a panorama of pictures for the heading and the wheels for the place.

Source: NAOqi 2.8 documentation, ALLocalization. The panorama is taken by the head in four directions, and again after a
half-turn; later, one look or a half scan tells the heading.
"""

from __future__ import annotations

import concurrent.futures
import math
import shutil
from pathlib import Path, PurePosixPath
from typing import Any

from pepper_sim.disk import RobotDisk
from pepper_sim.naoqi.service import Module, finite, remote
from pepper_sim.naoqi.tasks import chained
from pepper_sim.navigation.behaviours import Behaviour, drive
from pepper_sim.navigation.glance import glance
from pepper_sim.navigation.keypoints import find_keypoints
from pepper_sim.navigation.panorama import BadPanorama, Panorama
from pepper_sim.navigation.scans import relative
from pepper_sim.robot import Pepper
from pepper_sim.services.al_memory import ALMemory
from pepper_sim.services.al_navigation import ALNavigation
from telepresence.geometry import Pose, wrap_angle

BASE = "/home/nao/.local/share/Localization"
"""Directories are given relatively to this one; the panorama in use is in `default`."""
TRUSTED_WAY = 3.0
"""Distance [m] and turn [rad] after which the wheels are no longer trusted."""
SCAN = tuple(math.radians(angle) for angle in (67.5, 22.5, -22.5, -67.5))
"""Headings of the head for half a panorama [rad]."""

OK, ASLEEP, NOT_IN_PANORAMA, NO_PANORAMA, NOT_WRITTEN, NOT_FOUND, NO_LOOP = range(7)
NOT_LOADED, STOPPED, BAD_NAME, FAILED, BUSY = range(8, 13)
INCOMPLETE = 15
NO_DIRECTORY, NO_NODE = 105, 107
MESSAGES = {
    OK: "OK.",
    ASLEEP: "Robot not woken up.",
    NOT_IN_PANORAMA: "The robot is not in the current panorama.",
    NO_PANORAMA: "The panorama has not been set.",
    NOT_WRITTEN: "Impossible to write the panorama on disk.",
    NOT_FOUND: "Impossible to find the current position.",
    NO_LOOP: "Impossible to perform a visual close loop.",
    NOT_LOADED: "Impossible to load the panorama.",
    STOPPED: "The robot has been interrupted by a stop.",
    BAD_NAME: "Invalid working directory name.",
    FAILED: "Call to a function from another proxy failed.",
    BUSY: "The robot is already performing an exclusive action.",
    INCOMPLETE: "The panorama is incomplete, and the robot is not back at its initial position.",
    NO_DIRECTORY: "Directory not found.",
    NO_NODE: "No node to load.",
}
_CAMERA, _WIDTH, _HEIGHT, _PITCH = "CameraTop", 320, 240, -0.1
_FILE = "panorama.node"
_EVENTS = tuple(
    f"ALLocalization/{event}"
    for event in (
        *("GoToBegin", "GoToNextMove", "GoToSuccess", "GoToFailed", "GoToLost", "LocalizeBegin", "LocalizeSuccess"),
        *("LocalizeLost", "OdometryBegin", "OdometryInsufficient", "HalfScanBegin", "HalfScanInsufficient"),
        *("HalfScanSuccess", "FullScanBegin", "UTurnEnd", "FullScanInsufficient", "FullScanSuccess"),
        *("LocalizeDirectionBegin", "LocalizeDirectionLost", "LocalizeDirectionSuccess"),
        *("StartingComputation", "StoppingComputation"),
    )
)


class ALLocalization(Module):
    """Learns a home and finds the way back to it."""

    name = "ALLocalization"

    def __init__(self, robot: Pepper, navigation: ALNavigation, disk: RobotDisk, memory: ALMemory) -> None:
        self._robot = robot
        self._navigator = navigation.navigator
        self._disk = disk
        self._memory = memory
        self._panorama: Panorama | None = None
        self._fix: Pose | None = None  # odometry when the heading was last certain
        self._error = 0.0  # of the wheels' heading, by the panorama [rad]
        self._busy = False
        memory.declare(_EVENTS, self.name)
        robot.world.on_reset(self._forget)

    # --- home --------------------------------------------------------------------------------------------------------

    @remote("i()")
    def learnHome(self) -> concurrent.futures.Future:
        """Takes a panorama of where the robot stands; returns a return code."""
        return self._run(self._learn())

    @remote("i()")
    def goToHome(self) -> concurrent.futures.Future:
        """Drives to where learnHome was called; returns a return code."""
        return self._run(self._go_home())

    @remote("i(f)")
    def goToPosition(self, theta: float) -> concurrent.futures.Future:
        """Turns to a heading of the panorama [rad]; returns a return code."""
        return self._run(self._turn_to(theta))

    @remote("[f](b)")
    def getRobotPosition(self, active: bool) -> concurrent.futures.Future | list[float]:
        """Returns the pose [x, y, theta] seen from home; `active` lets the robot look around if it is not sure."""
        if not active or not self.isRelocalizationRequired():
            return list(self._pose())
        return chained(self._run(self._localize()), lambda _: list(self._pose()))

    @remote("m(b)")
    def getRobotOrientation(self, active: bool) -> concurrent.futures.Future:
        """Returns [heading in the panorama, success, confidence, by the wheels alone]."""
        found = self._run(self._orient(active))
        return chained(found, lambda answer: answer if isinstance(answer, list) else self._by_wheels())

    @remote("v()")
    def stopAll(self) -> concurrent.futures.Future | None:
        """Ends what is being done; ends itself when the robot no longer drives for it."""
        return self._navigator.stop() if self._busy else None

    @remote("b()")
    def isRelocalizationRequired(self) -> bool:
        """Whether the robot has gone so far that it would look around before it goes home."""
        if self._panorama is None or self._fix is None:
            return True
        moved = relative(self._fix, self._navigator.surveyor.odometry())
        return math.hypot(moved.x, moved.y) + abs(moved.theta) > TRUSTED_WAY

    @remote("b()")
    def isDataAvailable(self) -> bool:
        """Whether there is a panorama."""
        return self._panorama is not None

    @remote("s(i)")
    def getMessageFromErrorCode(self, pCode: int) -> str:
        """Returns what a return code means."""
        return MESSAGES.get(pCode, f"Unknown code {pCode}.")

    # --- files -------------------------------------------------------------------------------------------------------

    @remote("i(s)")
    def clear(self, pDirectory: str) -> int:
        """Deletes what is saved in a directory; the default one is also unloaded."""
        directory = self._directory(pDirectory)
        if directory is None:
            return BAD_NAME
        if not directory.is_dir():
            return NO_DIRECTORY
        shutil.rmtree(directory)
        if directory == self._default():
            self._panorama = None
        return OK

    @remote("i(s)")
    def load(self, pDirectory: str) -> int:
        """Uses the panorama that is saved in a directory."""
        directory = self._directory(pDirectory)
        if directory is None:
            return BAD_NAME
        if not directory.is_dir():
            return NO_DIRECTORY
        try:
            panorama = Panorama.load(directory / _FILE)
        except FileNotFoundError:
            return NO_NODE
        except (BadPanorama, OSError):
            return NOT_LOADED
        self._panorama, self._fix, self._error = panorama, None, 0.0
        return OK

    @remote("i(s)")
    def save(self, pDirectory: str) -> int:
        """Saves the panorama into a directory."""
        directory = self._directory(pDirectory)
        if directory is None:
            return BAD_NAME
        return NO_PANORAMA if self._panorama is None else self._write(directory)

    def _write(self, directory: Path) -> int:
        try:
            directory.mkdir(parents=True, exist_ok=True)
            if self._panorama is not None:
                self._panorama.save(directory / _FILE)
        except OSError:
            return NOT_WRITTEN
        return OK

    def _default(self) -> Path:
        return self._disk.path(f"{BASE}/default")

    def _directory(self, name: str) -> Path | None:
        """Return a directory under the base; None if the name leads out of it, or names the base itself."""
        inside = PurePosixPath(name or "default")
        if not inside.parts or inside.is_absolute() or ".." in inside.parts or "\0" in name:
            return None
        return self._disk.path(f"{BASE}/{inside}")

    # --- behaviours --------------------------------------------------------------------------------------------------

    def _run(self, behaviour: Behaviour[Any]) -> concurrent.futures.Future:
        if self._busy:
            behaviour.close()
            done: concurrent.futures.Future = concurrent.futures.Future()
            done.set_result(BUSY)
            return done
        self._busy = True
        return self._navigator.run(self._until_idle(behaviour), STOPPED)

    def _until_idle(self, behaviour: Behaviour[Any]) -> Behaviour[Any]:
        try:
            return (yield from behaviour)
        finally:
            self._busy = False

    def _learn(self) -> Behaviour[int]:
        if not self._robot.can_drive:
            return ASLEEP
        panorama = Panorama(self._navigator.surveyor.odometry())
        for event in ("HalfScanBegin", "FullScanBegin"):
            self._raise(event)
            turned = relative(panorama.home, self._navigator.surveyor.odometry()).theta
            for yaw in SCAN:
                view = yield from glance(self._robot, _CAMERA, _WIDTH, _HEIGHT, yaw, _PITCH)
                if view is None:
                    return FAILED
                panorama.add(find_keypoints(view.pixels, view.focal), turned + yaw)
            if not (yield from drive(self._navigator.wheels, Pose(0.0, 0.0, math.pi))):
                return INCOMPLETE
            self._raise("UTurnEnd")
        self._raise("FullScanSuccess")
        self._panorama = panorama
        self._fix, self._error = self._navigator.surveyor.odometry(), 0.0
        return self._write(self._default())

    def _go_home(self) -> Behaviour[int]:
        if problem := self._problem():
            return problem
        if self.isRelocalizationRequired() and (yield from self._localize()) != OK:
            self._raise("GoToLost")
        self._raise("GoToBegin")
        here = self._pose()
        way = relative(here, Pose(0.0, 0.0, 0.0))
        self._memory.announce("ALLocalization/GoToNextMove", list(way))
        reached = yield from self._navigator.driver.drive_near(way.x, way.y)
        reached = reached and (
            yield from drive(self._navigator.wheels, Pose(0.0, 0.0, wrap_angle(-self._pose().theta)))
        )
        self._raise("GoToSuccess" if reached else "GoToFailed")
        return OK if reached else FAILED

    def _turn_to(self, theta: float) -> Behaviour[int]:
        finite(theta, "theta")
        if problem := self._problem():
            return problem
        if not (yield from drive(self._navigator.wheels, Pose(0.0, 0.0, wrap_angle(theta - self._pose().theta)))):
            return FAILED
        found = yield from self._look(0.0)
        if found is None:
            return NO_LOOP
        return (
            OK
            if (yield from drive(self._navigator.wheels, Pose(0.0, 0.0, wrap_angle(theta - self._pose().theta))))
            else FAILED
        )

    def _localize(self) -> Behaviour[int]:
        """Find the heading again, by one look and then by half a scan."""
        if problem := self._problem():
            return problem
        self._raise("LocalizeBegin")
        self._raise("HalfScanBegin")
        for yaw in (0.0, *SCAN):
            if (yield from self._look(yaw)) is not None:
                self._raise("HalfScanSuccess")
                self._raise("LocalizeSuccess")
                return OK
        self._raise("HalfScanInsufficient")
        self._raise("LocalizeLost")
        return NOT_FOUND

    def _orient(self, active: bool) -> Behaviour[list]:
        if self._panorama is None:
            return [0.0, False, 0.0, True]
        self._raise("LocalizeDirectionBegin")
        head = self._robot.snapshot().joint_positions["HeadYaw"]
        for yaw in SCAN if active else (head,):
            confidence = yield from self._look(yaw)
            if confidence is not None:
                self._raise("LocalizeDirectionSuccess")
                return [self._pose().theta, True, confidence, False]
        self._raise("LocalizeDirectionLost")
        return self._by_wheels()

    def _look(self, yaw: float) -> Behaviour[float | None]:
        """Look in one direction; return how sure the heading is that the picture gives, None if it gives none."""
        view = yield from glance(self._robot, _CAMERA, _WIDTH, _HEIGHT, yaw, _PITCH)
        if view is None or self._panorama is None:
            return None
        self._raise("StartingComputation")
        heading, found = self._panorama.heading(find_keypoints(view.pixels, view.focal))
        self._raise("StoppingComputation")
        if found is None or not found.sure:
            return None
        self._fix = self._navigator.surveyor.odometry()
        self._error = wrap_angle(heading - yaw - relative(self._panorama.home, self._fix).theta)
        return found.share

    # --- inside ------------------------------------------------------------------------------------------------------

    def _problem(self) -> int:
        if not self._robot.can_drive:
            return ASLEEP
        return NO_PANORAMA if self._panorama is None else OK

    def _pose(self) -> Pose:
        """Return the pose seen from home: the place by the wheels, the heading by the last picture and the wheels."""
        odometry = self._navigator.surveyor.odometry()
        here = odometry if self._panorama is None else relative(self._panorama.home, odometry)
        return Pose(here.x, here.y, wrap_angle(here.theta + self._error))

    def _by_wheels(self) -> list:
        return [self._pose().theta, self._panorama is not None, 0.0, True]

    def _raise(self, event: str) -> None:
        self._memory.announce(f"ALLocalization/{event}", True)

    def _forget(self) -> None:
        """The world was put back to its start."""
        self._panorama, self._fix, self._error = None, None, 0.0
