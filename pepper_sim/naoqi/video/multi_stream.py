"""ALVideoDevice: settings of a subscription to several cameras, one value for each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from pepper_sim.naoqi.service import ServiceError, check_argument, remote
from pepper_sim.naoqi.video.conversions import known_camera
from pepper_sim.naoqi.video.settings import VideoSettings
from pepper_sim.naoqi.video.streams import Camera, Cursor


@dataclass
class CameraView:
    """One camera of a subscription, and its last picture."""

    camera: Camera
    resolution: int
    space: int
    cursor: Cursor = field(default_factory=Cursor)


class MultiStream:
    """Part of ALVideoDevice.

    Args:
        views_of: Subscription handle -> its cameras; raises ServiceError for an unknown one.
    """

    def __init__(self, settings: VideoSettings, views_of: Callable[[str], Sequence[CameraView]]) -> None:
        self._settings = settings
        self._views_of = views_of

    @remote("m(s)")
    def getActiveCameras(self, handle: str) -> list[int]:
        """Returns the cameras of a subscription."""
        return [view.camera.index for view in self._views_of(handle)]

    @remote("m(sm)")
    def setActiveCameras(self, handle: str, activeCameras: Any) -> list[bool]:
        """Points a subscription at other cameras; answers for each whether it can deliver what is subscribed to."""
        return [
            self._point_at(view, known_camera(self._settings.cameras, index))
            for view, index in self._each(handle, activeCameras, "activeCameras")
        ]

    @remote("m(s)")
    def getResolutions(self, handle: str) -> list[int]:
        """Returns the resolutions of a subscription."""
        return [view.resolution for view in self._views_of(handle)]

    @remote("m(sm)")
    def setResolutions(self, handle: str, resolutions: Any) -> list[bool]:
        """Changes the resolutions of a subscription; answers for each camera whether it has it."""
        answers = []
        for view, resolution in self._each(handle, resolutions, "resolutions"):
            answers.append(resolution in view.camera.resolutions)
            if answers[-1]:
                view.resolution = resolution
        return answers

    @remote("m(s)")
    def getColorSpaces(self, handle: str) -> list[int]:
        """Returns the colour spaces of a subscription."""
        return [view.space for view in self._views_of(handle)]

    @remote("m(sm)")
    def setColorSpaces(self, handle: str, colorSpaces: Any) -> list[bool]:
        """Changes the colour spaces of a subscription; answers for each camera whether it has it."""
        answers = []
        for view, space in self._each(handle, colorSpaces, "colorSpaces"):
            answers.append(space in view.camera.spaces)
            if answers[-1]:
                view.space = space
        return answers

    @remote("m(si)")
    def getCamerasParameter(self, handle: str, id: int) -> list[int]:
        """Returns a parameter of each camera of a subscription."""
        return [self._settings.getParameter(view.camera.index, id) for view in self._views_of(handle)]

    @remote("m(sim)")
    def setCamerasParameter(self, handle: str, id: int, newValue: Any) -> list[bool]:
        """Sets a parameter of each camera of a subscription."""
        values = self._each(handle, newValue, "newValue")
        return [self._settings.setParameter(view.camera.index, id, value) for view, value in values]

    @remote("m(si)")
    def setCamerasParameterToDefault(self, handle: str, id: int) -> list[bool]:
        """Restores a parameter's default for each camera of a subscription."""
        return [self._settings.setParameterToDefault(view.camera.index, id) for view in self._views_of(handle)]

    def _each(self, handle: str, values: Any, name: str) -> list[tuple[CameraView, int]]:
        views = self._views_of(handle)
        numbers = check_argument("[i]", values, name)
        if len(numbers) != len(views):
            raise ServiceError(f"{name} must hold a number for each of {len(views)} cameras, got {len(numbers)}")
        return list(zip(views, numbers, strict=True))

    @staticmethod
    def _point_at(view: CameraView, camera: Camera) -> bool:
        if view.resolution not in camera.resolutions or view.space not in camera.spaces:
            return False
        view.camera = camera
        return True
