"""Explorations on disk: one file with the map's layers and the path, as NumPy writes arrays (.npz).

The real robot's files have the same ending, .explo, and a format of their own that nobody has described.
"""

from __future__ import annotations

import zipfile
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from pepper_sim.navigation.grid import MAX_CELLS, RESOLUTION, OccupancyGrid
from pepper_sim.navigation.surveyor import MAX_PATH, Exploration
from telepresence.geometry import Pose

FOLDER = "/home/nao/.local/share/Explorer"
"""Where the robot keeps its explorations."""
_VERSION = 1


class BadExploration(ValueError):
    """A file is not an exploration; the text says why."""


def file_name(now: datetime | None = None) -> str:
    """Return the name that a robot gives a file: the time of day in UTC, to milliseconds."""
    now = now or datetime.now(UTC)
    return f"{now:%Y-%m-%dT%H%M%S}.{now.microsecond // 1000:03d}Z.explo"


def save(exploration: Exploration, path: Path) -> None:
    """Write an exploration.

    Raises:
        OSError: It cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    grid = exploration.grid
    with path.open("wb") as file:
        np.savez_compressed(
            file,
            version=_VERSION,
            resolution=RESOLUTION,
            origin=np.array(grid.origin),
            lasers=grid.lasers,
            depth=grid.depth,
            path=np.array(exploration.path, float).reshape(-1, 3),
        )


def load(path: Path) -> Exploration:
    """Read an exploration.

    Raises:
        BadExploration: It is not one.
        OSError: There is no such file, or it cannot be read.
    """
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as data:
            if int(data["version"]) != _VERSION or float(data["resolution"]) != RESOLUTION:
                raise BadExploration("it was written by another version")
            if data["lasers"].shape[0] > MAX_CELLS or len(data["path"]) > MAX_PATH:
                raise BadExploration("it is too large")
            grid = OccupancyGrid.restore(data["lasers"], data["depth"], tuple(data["origin"].tolist()))
            poses = [Pose(*pose) for pose in data["path"].reshape(-1, 3).tolist()]
    except (ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile) as error:
        raise BadExploration(f"it is not an exploration: {error}") from error
    return Exploration(grid, poses)
