"""The camera's view of the floor when a picture was taken, or why it is unknown. No ROS, no Qt."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from telepresence.teleop.robot_readings import BodyState, CameraView, Lens

PlaceOf = Callable[[str, str, float], tuple[np.ndarray, np.ndarray]]
"""Returns the pose of a frame as seen from another one at a time [s since 1970]: (3, 3) rotation, (3,) position [m].
Raises LookupError when it is unknown; see `telepresence_ros.transforms.Transforms.place_of`."""
NO_PICTURE = "There is no picture to point at."


def camera_view(lens: Lens | None, body: BodyState | None, place_of: PlaceOf, stamp: float) -> CameraView | str:
    """Return the view in the odometry's frame at that time [s since 1970]; or a sentence that says why it is unknown.

    Args:
        lens: The camera's calibration; None before there was one.
        body: The newest odometry, whose frame counts; None before there was any.
    """
    if lens is None:
        return "The camera publishes no calibration (camera_info), so positions in its picture are unknown."
    if body is None:
        return "The robot publishes no odometry, so it could not find the way there."
    try:
        rotation, place = place_of(lens.frame, body.frame, stamp)
    except LookupError as error:
        return f"The direction of the camera is unknown: {error}."
    return CameraView(lens, rotation, place)
