"""The calibration file that a camera's node was given by a parameter."""

from __future__ import annotations

import rospy

from telepresence_ros.camera_model import CameraModel, find_calibration, read_calibration


def calibration_of(parameter: str) -> CameraModel | None:
    """Return the camera of the file that this parameter names; None where there is none.

    A name that is wrong costs no pictures: an error in the log says what is wrong with it.
    """
    name = str(rospy.get_param(parameter, ""))
    if not name:
        return None
    try:
        return read_calibration(find_calibration(name))
    except (OSError, ValueError) as error:
        rospy.logerr("camera_info goes on without %s: %s", rospy.resolve_name(parameter), error)
        return None
