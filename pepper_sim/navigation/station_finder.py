"""Station finder: finds the marker of the charging station in a picture and works out where the station stands."""

from __future__ import annotations

import math

import cv2
import numpy as np

from pepper_sim.models.charging_station import MARKER_BEHIND, MARKER_BOTTOM, MARKER_HEIGHT, MARKER_WIDTH
from telepresence.geometry import Pose

LEAST_AREA = 150
"""A smaller patch of the marker's colour is not looked at [px]."""
HEIGHT_ERROR, TILT = 0.12, math.radians(25.0)
"""The marker's middle must be at its height within this [m], and upright within this [rad]."""

_LOWEST, _HIGHEST = (
    np.array((140, 120, 60)),
    np.array((160, 255, 255)),
)  # hue (of 180), saturation and value of the marker
_X, _Y = MARKER_WIDTH / 2, MARKER_HEIGHT / 2
_CORNERS = np.array([(-_X, -_Y, 0.0), (_X, -_Y, 0.0), (_X, _Y, 0.0), (-_X, _Y, 0.0)])


def find_station(image: np.ndarray, focal: float, camera: np.ndarray) -> Pose | None:
    """Return the pose of a robot on the charging station that the picture shows; None if it shows none.

    Args:
        image: `(height, width, 3) uint8, RGB`.
        focal: Focal length of the camera [px].
        camera: Pose (4, 4) of the camera, x along its axis and z up, in the frame in which the answer is wanted.
    """
    corners = _corners(image)
    if corners is None:
        return None
    height, width = image.shape[:2]
    lens = np.array([[focal, 0.0, (width - 1) / 2], [0.0, focal, (height - 1) / 2], [0.0, 0.0, 1.0]])
    found, rotation, place = cv2.solvePnP(_CORNERS, corners, lens, np.zeros(4), flags=cv2.SOLVEPNP_IPPE)
    if not found:
        return None
    # From the axes of pictures (x right, y down, z ahead) to those of the camera's link.
    link = camera[:3, :3] @ np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    middle = link @ place.ravel() + camera[:3, 3]
    axes = link @ cv2.Rodrigues(rotation)[0]
    away = -axes[:, 2]  # the marker's front looks against the axis of its own z
    upright = abs(math.asin(max(-1.0, min(1.0, float(away[2]))))) < TILT
    if not upright or abs(middle[2] - MARKER_BOTTOM - MARKER_HEIGHT / 2) > HEIGHT_ERROR:
        return None
    theta = math.atan2(away[1], away[0])
    x, y = middle[:2] + MARKER_BEHIND * np.array((math.cos(theta), math.sin(theta)))
    return Pose(float(x), float(y), theta)


def _corners(image: np.ndarray) -> np.ndarray | None:
    """Return the corners of the largest patch of the marker's colour, clockwise from the upper left one, (4, 2)."""
    mask = cv2.inRange(cv2.cvtColor(image, cv2.COLOR_RGB2HSV), _LOWEST, _HIGHEST)
    contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    if not contours:
        return None
    patch = max(contours, key=cv2.contourArea)
    height, width = mask.shape
    x, y, w, h = cv2.boundingRect(patch)
    cut = x <= 1 or y <= 1 or x + w >= width - 1 or y + h >= height - 1
    if cv2.contourArea(patch) < LEAST_AREA or cut:
        return None
    hull = cv2.convexHull(patch)
    for share in (0.02, 0.03, 0.05, 0.08):
        outline = cv2.approxPolyDP(hull, share * cv2.arcLength(hull, True), True).reshape(-1, 2)
        if len(outline) == 4:
            break
    else:
        return None
    rough = np.ascontiguousarray(outline, np.float32).reshape(-1, 1, 2)
    ending = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 30, 0.01)
    corners = cv2.cornerSubPix(mask, rough, (3, 3), (-1, -1), ending).reshape(4, 2).astype(np.float64)
    by_height = corners[np.argsort(corners[:, 1])]
    (upper_left, upper_right), (lower_left, lower_right) = (
        pair[np.argsort(pair[:, 0])] for pair in np.split(by_height, 2)
    )
    return np.array([upper_left, upper_right, lower_right, lower_left])
