"""ALVisualCompass: how far the robot has turned, from what a camera sees.

A reference picture's keypoints are sought in the present picture; their common deviation, less what the head turned, is
the robot's. Source: NAOqi 2.8 documentation, ALVisualCompass.
"""

from __future__ import annotations

import concurrent.futures
import logging
import math
import threading
from dataclasses import dataclass

from pepper_sim.naoqi.service import remote
from pepper_sim.naoqi.tasks import Workers
from pepper_sim.naoqi.time_stamp import split_stamp
from pepper_sim.naoqi.video.formats import RESOLUTIONS
from pepper_sim.naoqi.vision_extractor import VisionExtractor
from pepper_sim.navigation.behaviours import Behaviour, drive
from pepper_sim.navigation.glance import focal_length
from pepper_sim.navigation.keypoints import Deviation, Keypoints, deviation, find_keypoints
from pepper_sim.robot import Pepper
from pepper_sim.services.al_memory import ALMemory
from pepper_sim.services.al_navigation import ALNavigation
from telepresence.geometry import Pose, wrap_angle
from telepresence.video.images import Picture

log = logging.getLogger(__name__)

CORRECTABLE = 0.6
"""A turn up to this leaves enough of the reference in sight [rad]."""
_DEVIATION, _FINAL, _MATCH, _ABORT, _SET, _INVALID = (
    f"VisualCompass/{event}"
    for event in ("Deviation", "FinalDeviation", "Match", "MoveAbort", "NewReferenceImageSet", "InvalidReference")
)
_CAMERAS = ("CameraTop", "CameraBottom")
_RGB = 11
_FIRST_PICTURE = 3.0  # seconds


@dataclass(frozen=True)
class _Seen:
    """A picture with its keypoints, and where the head and the base were."""

    picture: Picture
    keypoints: Keypoints
    head: float
    odometry: Pose


class ALVisualCompass(VisionExtractor):
    """Measures turns by pictures, and corrects moves by them."""

    name = "ALVisualCompass"
    events = (_DEVIATION, _FINAL, _MATCH, _ABORT, _SET, _INVALID)

    def __init__(self, robot: Pepper, memory: ALMemory, navigation: ALNavigation, workers: Workers) -> None:
        super().__init__(memory)
        self._robot = robot
        self._navigator = navigation.navigator
        self._workers = workers
        self._resolution = 0  # QQVGA, the smallest that is documented
        self._reference: _Seen | None = None
        self._refresh = True
        self._quality = (0.0, 0)
        self._move: concurrent.futures.Future | None = None
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="visual-compass", daemon=True)
        self._thread.start()
        robot.world.on_reset(self._forget)

    def close(self) -> None:
        self._closing.set()
        self._thread.join(timeout=2.0)

    @remote("v(b)")
    def enableReferenceRefresh(self, refresh: bool) -> None:
        """Chooses whether the reference is taken anew when somebody subscribes."""
        self._refresh = refresh

    @remote("b()")
    def setCurrentImageAsReference(self) -> bool:
        """Takes the present picture as the reference; false if there is none."""
        self._set_reference(None)
        self._set_reference(self._look())
        return self._reference is not None

    @remote("m()")
    def getReferenceImage(self) -> list | None:
        """Returns the reference as ALVideoDevice.getImageRemote does; None if there is none."""
        seen = self._reference
        if seen is None:
            return None
        height, width = seen.picture.content.shape[:2]
        focal = focal_length(self._robot, _CAMERAS[self._camera], height)
        x, y = math.atan(0.5 * width / focal), math.atan(0.5 * height / focal)
        head = [width, height, 3, _RGB, *split_stamp(seen.picture.stamp), seen.picture.content.tobytes()]
        return [*head, self._camera, x, y, -x, -y]

    @remote("m()")
    def getMatchingQuality(self) -> list:
        """Returns [share of the matches that agree, number of matches] of the last comparison."""
        return [self._quality[0], self._quality[1]]

    @remote("v(f)")
    def moveStraightTo(self, pDistance: float) -> concurrent.futures.Future:
        """Drives straight on, or back, by a distance [m], and corrects the heading by pictures."""
        return self._start(self._straight(pDistance))

    @remote("v(fff)")
    def moveTo(self, x: float, y: float, theta: float) -> concurrent.futures.Future:
        """Turns towards a place, drives there and turns again [m, m, rad]; corrects all of it by pictures."""
        return self._start(self._go(x, y, theta))

    @remote("v()")
    def waitUntilTargetReached(self) -> concurrent.futures.Future:
        """Ends when the move that runs does."""
        move = self._move
        return self._workers.run(self._workers.wait_until, lambda: move is None or move.done())

    # --- moving ------------------------------------------------------------------------------------------------------

    def _start(self, behaviour: Behaviour[bool]) -> concurrent.futures.Future:
        self._move = self._navigator.run(self._reported(behaviour), False)
        return self._move

    def _reported(self, behaviour: Behaviour[bool]) -> Behaviour[bool]:
        reached = False
        try:
            reached = yield from behaviour
        finally:
            self.memory.announce(_ABORT, not reached)
        return reached

    def _go(self, x: float, y: float, theta: float) -> Behaviour[bool]:
        distance, heading = math.hypot(x, y), math.atan2(y, x)
        if distance < 1e-3:
            return (yield from self._turn(wrap_angle(theta)))
        if not (yield from self._turn(heading)) or not (yield from self._straight(distance)):
            return False
        return (yield from self._turn(wrap_angle(theta - heading)))

    def _turn(self, angle: float) -> Behaviour[bool]:
        """Turn, and again by what the pictures say is missing."""
        if abs(angle) < 1e-3:
            return True
        before = self._look()
        if not (yield from drive(self._navigator.wheels, Pose(0.0, 0.0, angle))):
            return False
        turned = self._turned(before) if abs(angle) <= CORRECTABLE else None
        self.memory.announce(_FINAL, [0.0, angle if turned is None else turned])
        if turned is not None and 0.005 < abs(angle - turned) < 0.2:
            return (yield from drive(self._navigator.wheels, Pose(0.0, 0.0, angle - turned)))
        return True

    def _straight(self, distance: float) -> Behaviour[bool]:
        before = self._look()
        if not (yield from drive(self._navigator.wheels, Pose(distance, 0.0, 0.0))):
            return False
        turned = self._turned(before)
        if turned is not None and 0.005 < abs(turned) < 0.2:
            return (yield from drive(self._navigator.wheels, Pose(0.0, 0.0, -turned)))
        return True

    def _turned(self, before: _Seen | None) -> float | None:
        """Return how far the robot has turned since a picture [rad]; None if the pictures do not tell."""
        after = self._look()
        if before is None or after is None:
            return None
        found = self._compare(before, after)
        return _robot_turn(before, after, found) if found.sure else None

    # --- looking -----------------------------------------------------------------------------------------------------

    def _run(self) -> None:
        subscribed = False
        while not self._closing.wait(max(0.1, self.getCurrentPeriod() / 1000.0)):
            try:
                if self.active and not subscribed and (self._refresh or self._reference is None):
                    self.setCurrentImageAsReference()
                subscribed = self.active
                if subscribed:
                    self._compare_now()
            except Exception:  # top of a thread: the next picture may do
                log.exception("a picture could not be compared")

    def _compare_now(self) -> None:
        reference, seen = self._reference, self._look()
        if reference is None or seen is None:
            return
        found = self._compare(reference, seen)
        if not found.matches:  # nothing of the reference is in sight, or nothing can be recognized
            return
        turned = [-found.up, _robot_turn(reference, seen, found)]
        self.memory.announce(_DEVIATION, [turned, list(seen.odometry), split_stamp(seen.picture.stamp)])
        keypoints = [_described(of.keypoints) for of in (reference, seen)]
        matches = [list(match) for match in found.matches]
        self.memory.announce(_MATCH, [*keypoints, matches, [list(found.inliers_up), list(found.inliers_left)]])

    def _compare(self, before: _Seen, after: _Seen) -> Deviation:
        found = deviation(before.keypoints, after.keypoints)
        self._quality = (found.share, len(found.matches))
        return found

    def _look(self) -> _Seen | None:
        """Return the present picture; None from a robot without cameras, or if no picture comes."""
        if not self._robot.has_cameras:
            return None
        camera = _CAMERAS[self._camera]
        width, height = RESOLUTIONS[self._resolution]
        with self._robot.subscribe_camera(camera, width, height, 10.0) as feed:
            picture = feed.image.wait_newer(0, _FIRST_PICTURE)
        if picture is None:
            return None
        snapshot = self._robot.snapshot()
        keypoints = find_keypoints(picture.content, focal_length(self._robot, camera, height))
        return _Seen(picture, keypoints, snapshot.joint_positions["HeadYaw"], Pose(*snapshot.odometry))

    def _set_reference(self, seen: _Seen | None) -> None:
        known, self._reference = self._reference, seen
        if seen is not None:
            self.memory.announce(_SET, True)
        elif known is not None:
            self.memory.announce(_SET, False)
        else:
            self.memory.announce(_INVALID, True)

    def _forget(self) -> None:
        """The world was put back to its start."""
        self._reference, self._quality = None, (0.0, 0)


def _robot_turn(before: _Seen, after: _Seen, found: Deviation) -> float:
    """Return how far the base has turned to the left [rad]: what the camera turned, less what the head did."""
    return found.left - (after.head - before.head)


def _described(keypoints: Keypoints) -> list:
    """Return [[[x, y], size, angle, response, octave], ...] as the event's page gives them."""
    return [
        [list(point.pt), point.size, math.radians(point.angle), point.response, point.octave & 0xFF]
        for point in keypoints.points
    ]
