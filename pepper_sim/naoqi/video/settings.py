"""ALVideoDevice: the cameras and their settings."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from pepper_sim.naoqi.service import remote
from pepper_sim.naoqi.video.conversions import known_camera
from pepper_sim.naoqi.video.formats import (
    DEPTH_SPACES,
    RESOLUTIONS,
    RGB_SPACES,
    STEREO_DEPTH_RANGE,
    STEREO_DEPTH_SPACES,
)
from pepper_sim.naoqi.video.parameters import (
    CAMERA_SELECT,
    STEREO_DEPTH_PARAMETERS,
    STEREO_PARAMETERS,
    CameraParameters,
)
from pepper_sim.naoqi.video.streams import Camera
from pepper_sim.robot import STEREO_CAMERA, Pepper

_OV5640, _XTION, _STEREO_DEPTH, _OV4689 = 3, 4, 7, 8
_RATE, _STEREO_RATE = 30, 15
_SLOW, _SLOW_OLDER = {4: 15}, {3: 1, 4: 1}
"""Resolution id -> highest rate where it is lower [1/s], of head 1.8 and of older ones. Source: NAOqi 2.8, pages
video_2D_pep and video_2D_pep_v18a."""
_COLOUR_SIZES, _XTION_SIZES = (0, 1, 2, 3, 4, 7, 8), (0, 1, 2, 3, 7, 8)
_STEREO_DEPTH_SIZES, _STEREO_SIZES = (5, 9, 10, 11, 12), (13, 14, 15, 16, 17)


def robot_cameras(robot: Pepper) -> dict[int, Camera]:
    """Return the cameras of `robot` by ALVideoDevice's index, with the field of view of the simulated cameras.

    The renderer's pinhole has square pixels: its vertical field of view is the documented one, and the horizontal one
    follows from the picture's shape. For the eyes that is 91.5 degrees instead of 96, which their lenses distort.
    """

    def camera(
        index: int, name: str, model: int, sizes: tuple[int, ...], spaces: Mapping[int, int], rate: int, **more: Any
    ) -> Camera:
        eyes = robot.cameras[name]
        kind = "depth" if name == "CameraDepth" else "rgb"
        width, height = RESOLUTIONS[sizes[0]]
        fovy = math.radians(float(robot.world.model.camera(eyes[0]).fovy[0]))
        fovx = 2.0 * math.atan(math.tan(fovy / 2.0) * width / len(eyes) / height)
        return Camera(index, name, model, kind, sizes, spaces, rate, fovx, fovy, len(eyes), **more)

    stereo = STEREO_CAMERA in robot.cameras
    slow = _SLOW if stereo else _SLOW_OLDER
    found = [
        camera(0, "CameraTop", _OV5640, _COLOUR_SIZES, RGB_SPACES, _RATE, slow=slow),
        camera(1, "CameraBottom", _OV5640, _COLOUR_SIZES, RGB_SPACES, _RATE, slow=slow),
    ]
    if stereo:
        depth = {"parameters": STEREO_DEPTH_PARAMETERS, "depth_range": STEREO_DEPTH_RANGE}
        found += [
            camera(2, "CameraDepth", _STEREO_DEPTH, _STEREO_DEPTH_SIZES, STEREO_DEPTH_SPACES, _STEREO_RATE, **depth),
            camera(3, STEREO_CAMERA, _OV4689, _STEREO_SIZES, RGB_SPACES, _STEREO_RATE, parameters=STEREO_PARAMETERS),
        ]
    else:
        found.append(camera(2, "CameraDepth", _XTION, _XTION_SIZES, DEPTH_SPACES, _RATE))
    return {one.index: one for one in found}


class VideoSettings:
    """Camera part of ALVideoDevice.

    Args:
        camera_of: Subscription handle -> its camera; raises ServiceError for an unknown one.
    """

    def __init__(self, robot: Pepper, camera_of: Callable[[str], Camera]) -> None:
        self.cameras = robot_cameras(robot)
        self.parameters = {index: CameraParameters(camera.parameters) for index, camera in self.cameras.items()}
        self.active = 0
        self._camera_of = camera_of
        self._closed: set[int] = set()

    def is_open(self, camera: Camera) -> bool:
        """Whether the camera delivers pictures: nobody has closed or stopped it."""
        return camera.index not in self._closed

    # --- cameras -----------------------------------------------------------------------------------------------------

    @remote("m()")
    def getCameraIndexes(self) -> list[int]:
        """Lists the cameras."""
        return list(self.cameras)

    @remote("s(i)")
    def getCameraName(self, cameraIndex: int) -> str:
        """Returns a camera's name."""
        return known_camera(self.cameras, cameraIndex).name

    @remote("i(i)")
    def getCameraModel(self, cameraIndex: int) -> int:
        """Returns a camera's sensor id: 3 OV5640, 4 Xtion, 7 depth from stereo, 8 OV4689."""
        return known_camera(self.cameras, cameraIndex).model

    @remote("b()")
    def hasDepthCamera(self) -> bool:
        """Whether the robot has a depth camera."""
        return True

    @remote("i()")
    def getActiveCamera(self) -> int:
        """Returns the camera that calls without a camera use."""
        return self.active

    @remote("b(i)")
    def setActiveCamera(self, activeCamera: int) -> bool:
        """Sets the camera that calls without a camera use."""
        self.active = known_camera(self.cameras, activeCamera).index
        return True

    @remote("f(i)")
    def getHorizontalFOV(self, cameraIndex: int) -> float:
        """Returns the horizontal field of view [rad]."""
        return known_camera(self.cameras, cameraIndex).fovx

    @remote("f(i)")
    def getVerticalFOV(self, cameraIndex: int) -> float:
        """Returns the vertical field of view [rad]."""
        return known_camera(self.cameras, cameraIndex).fovy

    @remote("i(i)")
    def getResolution(self, cameraIndex: int) -> int:
        """Returns the resolution a camera starts with: 2, VGA, or its largest where it has no VGA."""
        resolutions = known_camera(self.cameras, cameraIndex).resolutions
        return 2 if 2 in resolutions else resolutions[0]

    @remote("i(i)")
    def getColorSpace(self, cameraIndex: int) -> int:
        """Returns the native colour space: 9 YUV422, or 17 depth."""
        return 17 if known_camera(self.cameras, cameraIndex).kind == "depth" else 9

    @remote("i(i)")
    def getFrameRate(self, cameraIndex: int) -> int:
        """Returns the highest rate [1/s]."""
        return known_camera(self.cameras, cameraIndex).max_fps

    # --- on and off --------------------------------------------------------------------------------------------------

    @remote("b(i)")
    def openCamera(self, cameraIndex: int) -> bool:
        """Opens a camera. All are open at the start."""
        self._closed.discard(known_camera(self.cameras, cameraIndex).index)
        return True

    @remote("b(i)")
    def closeCamera(self, cameraIndex: int) -> bool:
        """Closes a camera: its pictures are None."""
        self._closed.add(known_camera(self.cameras, cameraIndex).index)
        return True

    @remote("b(i)")
    def isCameraOpen(self, cameraIndex: int) -> bool:
        """Whether a camera is open."""
        return self.is_open(known_camera(self.cameras, cameraIndex))

    @remote("b(i)")
    def startCamera(self, cameraIndex: int) -> bool:
        """Starts a camera; the same as openCamera."""
        return self.openCamera(cameraIndex)

    @remote("b(i)")
    def stopCamera(self, cameraIndex: int) -> bool:
        """Stops a camera; the same as closeCamera."""
        return self.closeCamera(cameraIndex)

    @remote("b(i)")
    def isCameraStarted(self, cameraIndex: int) -> bool:
        """Whether a camera runs."""
        return self.isCameraOpen(cameraIndex)

    # --- parameters --------------------------------------------------------------------------------------------------

    @remote("i(ii)")
    def getParameter(self, cameraIndex: int, parameterId: int) -> int:
        """Returns a parameter; 0xDEAD404 for one the camera does not have."""
        return self.parameters[known_camera(self.cameras, cameraIndex).index].get(parameterId)

    @remote("b(iii)")
    def setParameter(self, cameraIndex: int, parameterId: int, newValue: int) -> bool:
        """Sets a parameter; -1 restores its default."""
        self.parameters[known_camera(self.cameras, cameraIndex).index].set(parameterId, newValue)
        return True

    @remote("m(ii)")
    def getParameterRange(self, cameraIndex: int, parameterId: int) -> list[int]:
        """Returns [lowest, highest] of a parameter."""
        parameter = self.parameters[known_camera(self.cameras, cameraIndex).index].known(parameterId)
        return [parameter.low, parameter.high]

    @remote("b(ii)")
    def setParameterToDefault(self, cameraIndex: int, parameterId: int) -> bool:
        """Restores a parameter's default."""
        self.parameters[known_camera(self.cameras, cameraIndex).index].set_default(parameterId)
        return True

    @remote("b(i)")
    def setAllParametersToDefault(self, cameraIndex: int) -> bool:
        """Restores the defaults of all parameters."""
        self.parameters[known_camera(self.cameras, cameraIndex).index].set_all_defaults()
        return True

    @remote("i(si)")
    def getCameraParameter(self, name: str, parameterId: int) -> int:
        """Returns a parameter of a subscription's camera."""
        return self.getParameter(self._camera_of(name).index, parameterId)

    @remote("b(sii)")
    def setCameraParameter(self, name: str, parameterId: int, newValue: int) -> bool:
        """Sets a parameter of a subscription's camera."""
        return self.setParameter(self._camera_of(name).index, parameterId, newValue)

    @remote("m(si)")
    def getCameraParameterRange(self, name: str, parameterId: int) -> list[int]:
        """Returns [lowest, highest] of a parameter of a subscription's camera."""
        return self.getParameterRange(self._camera_of(name).index, parameterId)

    @remote("b(si)")
    def setCameraParameterToDefault(self, name: str, parameterId: int) -> bool:
        """Restores a parameter's default for a subscription's camera."""
        return self.setParameterToDefault(self._camera_of(name).index, parameterId)

    @remote("b(s)")
    def setAllCameraParametersToDefault(self, name: str) -> bool:
        """Restores the defaults of all parameters of a subscription's camera."""
        return self.setAllParametersToDefault(self._camera_of(name).index)

    @remote("v(ii)")
    def setParam(self, id: int, newValue: int) -> None:
        """Sets a parameter of the active camera (old form); parameter 18 selects that camera."""
        if id == CAMERA_SELECT:
            self.setActiveCamera(newValue)
        else:
            self.setParameter(self.active, id, newValue)

    @remote("i(i)")
    def getParam(self, id: int) -> int:
        """Returns a parameter of the active camera (old form)."""
        return self.active if id == CAMERA_SELECT else self.getParameter(self.active, id)

    @remote("v(i)")
    def setParamDefault(self, id: int) -> None:
        """Restores a parameter's default for the active camera (old form)."""
        if id == CAMERA_SELECT:
            self.active = 0
        else:
            self.setParameterToDefault(self.active, id)
