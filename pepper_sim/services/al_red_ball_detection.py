"""ALRedBallDetection: the largest red disc in the picture (NAOqi 2.8 documentation, alredballdetection)."""

from __future__ import annotations

import cv2
import numpy as np

from pepper_sim.naoqi.vision.blobs import ROUND, Blob, largest
from pepper_sim.naoqi.vision.picture_extractor import PictureExtractor
from pepper_sim.naoqi.vision.pictures import Picture

EVENT = "redBallDetected"
_LEAST_SIZE = 40
"""[px]"""


class ALRedBallDetection(PictureExtractor):
    """Detects a red ball."""

    name = "ALRedBallDetection"
    events = (EVENT,)
    resolution = 1

    def detect(self, picture: Picture) -> None:
        ball = largest(red(picture.pixels), _LEAST_SIZE, ROUND)
        if ball is not None:
            self.memory.announce(EVENT, [picture.time_stamp, _ball_info(picture, ball), *picture.origin])


def red(pixels: np.ndarray) -> np.ndarray:
    """Return which pixels are red: saturated, and of a hue near 0 degrees; (height, width) uint8, 0 or 1."""
    hsv = cv2.cvtColor(pixels, cv2.COLOR_RGB2HSV)
    hue, saturation, value = (hsv[:, :, channel] for channel in range(3))
    found = ((hue <= 6) | (hue >= 172)) & (saturation >= 150) & (value >= 60)
    return found.astype(np.uint8)


def _ball_info(picture: Picture, ball: Blob) -> list[float]:
    width, height = picture.extent(ball.x, ball.y, 2.0 * ball.radius, 2.0 * ball.radius)
    return [*picture.angles(ball.x, ball.y), width / 2.0, height / 2.0]
