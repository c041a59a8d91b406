"""The eyes of head 1.8 over the wire, against NAOqi 2.8's documentation: pages video_Stereo_pep and video_3D_pep."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest
from naoqi_clients import connected

from pepper_sim.simulation import Simulation

DEPTH, STEREO = 2, 3
K720P, K720P_X2 = 5, 13
YUV422, RGB, MILLIMETRES = 9, 11, 17
HEIGHT, WIDTH = 720, 1280
BASELINE = 2 * 0.039
"""The left eye is 39 mm left of the head's middle (pepper.urdf, CameraDepth_frame)."""


@pytest.fixture(scope="module")
def session(qi):
    with Simulation(scene="apartment", port=0, head="1.8") as running, connected(qi, running.url) as client:
        yield client


@pytest.fixture(scope="module")
def video(session):
    return session.service("ALVideoDevice")


def test_head_1_8_has_a_stereo_camera_and_computes_depth_from_it(video, session):
    assert video.getCameraIndexes() == [0, 1, 2, 3]
    assert [video.getCameraName(index) for index in (DEPTH, STEREO)] == ["CameraDepth", "CameraStereo"]
    assert [video.getCameraModel(index) for index in (DEPTH, STEREO)] == [7, 8]
    assert math.degrees(video.getVerticalFOV(STEREO)) == pytest.approx(60.0)
    assert math.degrees(video.getVerticalFOV(DEPTH)) == pytest.approx(58.0)
    assert [video.getFrameRate(index) for index in (DEPTH, STEREO)] == [15, 15]
    assert "CameraStereo" in session.service("ALMotion").getSensorNames(), "so naoqi_driver knows this head"
    assert video.getParameterRange(STEREO, 0) == [0, 8] and video.getParameterRange(DEPTH, 42) == [5, 43]
    with pytest.raises(RuntimeError, match="multiple"):
        video.setParameter(DEPTH, 42, 22)


@pytest.mark.parametrize("resolution", range(13, 18))
def test_every_documented_size_shows_two_eyes(video, resolution):
    handle = video.subscribeCamera("sizes", STEREO, resolution, YUV422, 15)
    image = video.getImageRemote(handle)
    video.unsubscribe(handle)
    halved = resolution - K720P_X2
    assert image[:3] == [2560 >> halved, 720 >> halved, 2] and len(image[6]) == image[0] * image[1] * 2


def test_sizes_of_the_other_head_are_refused(video):
    assert video.subscribeCamera("vga", STEREO, 2, RGB, 15) == "" == video.subscribeCamera("vga", DEPTH, 2, 17, 15)


def test_what_is_near_is_seen_in_different_directions_by_78_mm_of_baseline(video):
    def take(camera, resolution, space):
        handle = video.subscribeCamera("pair", camera, resolution, space, 15)
        pixels = np.frombuffer(video.getImageRemote(handle)[6], np.uint8)
        video.unsubscribe(handle)
        return pixels

    pair = cv2.cvtColor(take(STEREO, K720P_X2, RGB).reshape(HEIGHT, 2 * WIDTH, 3), cv2.COLOR_RGB2GRAY)
    depth = take(DEPTH, K720P, MILLIMETRES).view("<u2").reshape(HEIGHT, WIDTH) / 1000.0
    focal, depth_focal = (HEIGHT / 2 / math.tan(video.getVerticalFOV(camera) / 2) for camera in (STEREO, DEPTH))
    left, right = pair[:, :WIDTH], pair[:, WIDTH:]
    baselines = []
    for x, y in cv2.goodFeaturesToTrack(left, 200, 0.05, 15)[:, 0].astype(int):
        # The same direction in the depth picture, which has the same centre.
        u = round(WIDTH / 2 + (x - WIDTH / 2) * depth_focal / focal)
        v = round(HEIGHT / 2 + (y - HEIGHT / 2) * depth_focal / focal)
        around = depth[v - 1 : v + 2, u - 1 : u + 2]
        inside = 140 <= x < WIDTH - 10 and 10 <= y < HEIGHT - 10
        if inside and around.size == 9 and around.min() > 0.4 and np.ptp(around) < 0.03:
            disparity = find_disparity(left, right, x, y)
            if disparity:
                baselines.append(disparity * around.mean() / focal)
    assert len(baselines) >= 4
    assert np.median(baselines) == pytest.approx(BASELINE, abs=0.001)


def find_disparity(left: np.ndarray, right: np.ndarray, x: int, y: int) -> float | None:
    """How many pixels further left the right eye sees what the left one sees at (x, y); None if that is unclear."""
    patch, row = left[y - 10 : y + 11, x - 10 : x + 11], right[y - 10 : y + 11, x - 130 : x + 11]
    likeness = cv2.matchTemplate(row, patch, cv2.TM_CCOEFF_NORMED)[0]
    best = int(likeness.argmax())
    if likeness[best] < 0.95 or best in (0, len(likeness) - 1):
        return None
    before, here, after = likeness[best - 1 : best + 2]
    return 120 - best - (before - after) / (2 * (before - 2 * here + after))
