"""What the camera nodes say about the camera: sensor_msgs/CameraInfo, of a calibration file or of a focal length."""

from __future__ import annotations

import rospy
from sensor_msgs.msg import CameraInfo, Image
from telepresence_ros.calibration_parameter import calibration_of
from telepresence_ros.camera_model import centred

FOCAL_LENGTH, CALIBRATED_WIDTH = 526.4, 640
"""[px] at this width [px]: the vendor's calibration of a Logitech C905; for other cameras it has 664.2 (camd2)."""


class CameraCalibration:
    """The camera of this node's parameters ~calibration_file (a path, file:///PATH or package://PACKAGE/PATH) and
    ~focal_length, which also counts where the file is no calibration. Make one after `rospy.init_node`."""

    def __init__(self) -> None:
        self._model = calibration_of("~calibration_file")
        self._focal_length = float(rospy.get_param("~focal_length", FOCAL_LENGTH))

    def info(self, image: Image) -> CameraInfo:
        """Return what belongs to this picture: its stamp, frame and size [px]."""
        if self._model is not None:
            model = self._model.scaled(image.width, image.height)
        else:
            model = centred(image.width, image.height, self._focal_length * image.width / CALIBRATED_WIDTH)
        message = CameraInfo(height=image.height, width=image.width, distortion_model=model.distortion_model)
        message.header = image.header
        message.D, message.K, message.R, message.P = model.D, model.K, model.R, model.P
        return message
