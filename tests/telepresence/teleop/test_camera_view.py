"""The camera's view when a picture was taken, or the sentence that says what is missing."""

import numpy as np
import pytest

from telepresence.teleop.camera_view import camera_view
from telepresence.teleop.robot_readings import BodyState, CameraView, Lens

LENS = Lens(525.0, 525.0, 320.0, 240.0, 640, 480, "camera_optical_frame")
BODY = BodyState(1.0, 2.0, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, "robot/odom")
POSE = np.eye(3), np.array((0.1, 0.0, 1.1))


def test_the_pose_is_looked_up_for_the_pictures_time_in_the_odometrys_frame():
    asked = []

    def place_of(*question):
        asked.append(question)
        return POSE

    view = camera_view(LENS, BODY, place_of, 12.5)
    assert asked == [("camera_optical_frame", "robot/odom", 12.5)]
    assert isinstance(view, CameraView) and (view.lens, view.rotation, view.place) == (LENS, *POSE)


@pytest.mark.parametrize(("lens", "body", "why"), [(None, BODY, "calibration"), (LENS, None, "odometry")])
def test_it_says_what_has_not_come_and_asks_for_no_pose(lens, body, why):
    assert why in camera_view(lens, body, lambda *_: pytest.fail("a pose of what?"), 12.5)


def test_it_says_why_the_pose_is_unknown():
    def place_of(*_):
        raise LookupError("no transforms are received yet")

    assert camera_view(LENS, BODY, place_of, 12.5) == (
        "The direction of the camera is unknown: no transforms are received yet."
    )
