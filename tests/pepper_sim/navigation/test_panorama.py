"""A panorama tells the heading of a picture, also after it was on disk."""

import math

import cv2
import numpy as np
import pytest

from pepper_sim.navigation.keypoints import find_keypoints
from pepper_sim.navigation.panorama import BadPanorama, Panorama
from telepresence.geometry import Pose

FOCAL, WIDTH, HEIGHT = 300.0, 320, 240


def test_a_heading_is_found(tmp_path):
    rng = np.random.default_rng(2)
    walls = []
    for _ in range(3):
        wall = np.full((HEIGHT, 2 * WIDTH, 3), 128, np.uint8)
        for _ in range(120):
            x, y, w, h = rng.integers((0, 0, 8, 8), (600, 230, 60, 60)).tolist()
            cv2.rectangle(wall, (x, y), (x + w, y + h), rng.integers(0, 255, 3).tolist(), -1)
        walls.append(wall)
    panorama = Panorama(Pose(1.0, 2.0, 0.5))
    for wall, heading in zip(walls, (0.0, 2.0, -2.0), strict=True):
        panorama.add(find_keypoints(wall[:, 100 : 100 + WIDTH], FOCAL), heading)
    panorama.save(tmp_path / "panorama.node")
    panorama = Panorama.load(tmp_path / "panorama.node")
    assert panorama.home == Pose(1.0, 2.0, 0.5)
    # The second wall, seen 30 px farther to the right.
    heading, found = panorama.heading(find_keypoints(walls[1][:, 130 : 130 + WIDTH], FOCAL))
    assert found is not None and found.sure
    assert heading == pytest.approx(2.0 - math.atan(30 / FOCAL), abs=0.03)
    (tmp_path / "panorama.node").write_bytes(b"nothing")
    with pytest.raises(BadPanorama):
        Panorama.load(tmp_path / "panorama.node")
