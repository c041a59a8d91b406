"""Panoramas: what the robot sees around a place, as keypoints with their bearings; by it a robot finds its heading."""

from __future__ import annotations

import zipfile
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from pepper_sim.navigation.keypoints import Deviation, Keypoints, deviation
from telepresence.geometry import Pose

_VERSION = 1
_MOST = 100_000


class BadPanorama(ValueError):
    """A file is not a panorama; the text says why."""


@dataclass
class Panorama:
    """Keypoints around a place.

    Args:
        home: Pose of the robot there, by odometry; headings count from its own.
        views: Keypoints of each picture, their first angles being bearings from home's heading [rad].
    """

    home: Pose
    views: list[Keypoints] = field(default_factory=list)

    def add(self, keypoints: Keypoints, heading: float) -> None:
        """Add a picture that was taken in direction `heading` from home's own [rad]."""
        bearings = keypoints.angles + np.array((heading, 0.0))
        self.views.append(Keypoints(keypoints.points, bearings, keypoints.descriptors))

    def heading(self, seen: Keypoints) -> tuple[float, Deviation | None]:
        """Return the direction in which the camera looks [rad], and the comparison that says so, or None."""
        best: Deviation | None = None
        for view in self.views:
            found = deviation(view, seen)
            if found.matches and (best is None or len(found.inliers_left) > len(best.inliers_left)):
                best = found
        return (0.0, None) if best is None else (best.left, best)

    def save(self, path: Path) -> None:
        """Write it.

        Raises:
            OSError: It cannot be written.
        """
        angles = [view.angles for view in self.views] or [np.zeros((0, 2))]
        descriptors = [view.descriptors for view in self.views] or [np.zeros((0, 32), np.uint8)]
        with path.open("wb") as file:
            np.savez_compressed(
                file,
                version=_VERSION,
                home=np.array(self.home),
                counts=np.array([len(view.angles) for view in self.views], int),
                angles=np.concatenate(angles),
                descriptors=np.concatenate(descriptors),
            )

    @classmethod
    def load(cls, path: Path) -> Panorama:
        """Read one.

        Raises:
            BadPanorama: It is not one.
            OSError: There is no such file, or it cannot be read.
        """
        try:
            with path.open("rb") as file, np.load(file, allow_pickle=False) as data:
                counts, angles, descriptors = data["counts"], data["angles"], data["descriptors"]
                if int(data["version"]) != _VERSION or counts.sum() != len(angles) or len(angles) > _MOST:
                    raise BadPanorama("it was written by another version")
                if len(descriptors) != len(angles) or descriptors.shape[1:] != (32,) or angles.shape[1:] != (2,):
                    raise BadPanorama("its parts do not belong together")
                ends = np.cumsum(counts)[:-1]
                parts = zip(np.split(angles, ends), np.split(descriptors.astype(np.uint8), ends), strict=True)
                return cls(Pose(*data["home"].tolist()), [Keypoints((), *part) for part in parts])
        except (ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile) as error:
            raise BadPanorama(f"it is not a panorama: {error}") from error
