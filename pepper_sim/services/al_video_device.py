"""ALVideoDevice: the cameras.

A client subscribes to a camera with a size, a colour space and a rate, and gets a handle: its name and "_0", or the
next number that is free. With the handle it requests pictures:

    getImageRemote -> [width, height, layers, colour space, seconds, microseconds, pixels (raw), camera,
                       left, top, right, bottom angle [rad]]

Each call waits for a picture that this subscriber has not received yet, at most about a period; the time stamp is the
time at which it was taken. A client that dies leaves its subscription behind, as on the robot; it ends after five
minutes without a call. Sources: NAOqi 2.8 documentation, alvideodevice; order and types of the container as
ros-naoqi/naoqi_driver checks them; handles as a Pepper lists them in aldebaran/libqi, issue 19.
"""

from __future__ import annotations

import concurrent.futures
import logging
import threading
import time
from dataclasses import dataclass, field
from typing import Any

from pepper_sim.naoqi.service import Module, ServiceError, check_argument, remote, shown
from pepper_sim.naoqi.time_stamp import split_stamp
from pepper_sim.naoqi.video.calls import PictureCalls
from pepper_sim.naoqi.video.conversions import VideoConversions, known_camera
from pepper_sim.naoqi.video.formats import RESOLUTIONS
from pepper_sim.naoqi.video.multi_stream import CameraView, MultiStream
from pepper_sim.naoqi.video.old_forms import OldVideoForms
from pepper_sim.naoqi.video.settings import VideoSettings
from pepper_sim.naoqi.video.streams import Camera, Cursor, Streams
from pepper_sim.naoqi.vision.pictures import Picture, camera_poses, closest_resolution
from pepper_sim.robot import Pepper

log = logging.getLogger(__name__)

MAX_WAITING = 64
"""Calls that may wait for pictures of one subscription; the next one is refused."""
MAX_SERVED = 64
"""Subscriptions whose calls are served at once, with a thread each; others wait for their turn."""
MAX_INSTANCES = 6
"""Subscriptions that may share a name; the next one is refused (the same issue)."""
FORGET_AFTER = 300.0
"""A subscription that is not used for this long [s] ends."""
_CLEANUP_PERIOD = 1.0


@dataclass
class _Subscription:
    name: str
    views: list[CameraView]
    fps: int
    used: float = field(default_factory=time.monotonic)
    calls: PictureCalls = field(default_factory=lambda: PictureCalls(MAX_WAITING))

    @property
    def rate(self) -> int:
        """Pictures per second: as many as wanted, if all its cameras can deliver them at its resolutions."""
        return min(self.fps, *(view.camera.fastest(view.resolution) for view in self.views))


class ALVideoDevice(Module):
    """Pictures of the robot's cameras for any number of clients."""

    name = "ALVideoDevice"

    def __init__(self, robot: Pepper) -> None:
        self.settings = VideoSettings(robot, self._camera_of)
        conversions = VideoConversions(self.settings.cameras)
        several = MultiStream(self.settings, self._views)
        old = OldVideoForms(self.settings, conversions, lambda handle: self._views(handle)[0], self.getFrameRate)
        self._parts = (self, self.settings, conversions, several, old)
        self._robot = robot
        self._streams = Streams(robot)
        self._lock = threading.Lock()
        self._subscriptions: dict[str, _Subscription] = {}
        self._pool = concurrent.futures.ThreadPoolExecutor(MAX_SERVED, thread_name_prefix="picture-call")
        self._closing = threading.Event()
        self._cleanup = threading.Thread(target=self._end_unused, name="video-cleanup", daemon=True)
        self._cleanup.start()

    def parts(self) -> tuple[Any, ...]:
        return self._parts

    def close(self) -> None:
        self._closing.set()
        self._cleanup.join(timeout=2.0)
        self._end(list(self._subscriptions))
        self._pool.shutdown(wait=False, cancel_futures=True)
        self._streams.close()

    # --- subscriptions -----------------------------------------------------------------------------------------------

    @remote("s(siiii)")
    def subscribeCamera(self, name: str, cameraIndex: int, resolution: int, colorSpace: int, fps: int) -> str:
        """Subscribes to a camera and returns the handle for the other calls; "" if that is not possible."""
        return self._subscribe(name, [(cameraIndex, resolution, colorSpace)], fps)

    @remote("s(smmmi)")
    def subscribeCameras(self, name: str, cameraIndexes: Any, resolutions: Any, colorSpaces: Any, fps: int) -> str:
        """Subscribes to several different cameras with one handle, for getImagesRemote."""
        cameraIndexes, resolutions, colorSpaces = (
            check_argument("[i]", values, argument)
            for argument, values in (
                ("cameraIndexes", cameraIndexes), ("resolutions", resolutions), ("colorSpaces", colorSpaces)
            )
        )  # fmt: skip
        if not len(cameraIndexes) == len(resolutions) == len(colorSpaces) or not cameraIndexes:
            raise ServiceError("cameraIndexes, resolutions and colorSpaces must have the same length, at least 1")
        return self._subscribe(name, list(zip(cameraIndexes, resolutions, colorSpaces, strict=True)), fps)

    @remote("s(siii)")
    def subscribe(self, name: str, resolution: int, colorSpace: int, fps: int) -> str:
        """Subscribes to the active camera (old form)."""
        return self._subscribe(name, [(self.settings.active, resolution, colorSpace)], fps)

    @remote("b(s)")
    def unsubscribe(self, nameId: str) -> bool:
        """Ends a subscription; false if the handle is unknown."""
        return bool(self._end([nameId]))

    @remote("b(s)")
    def unsubscribeAllInstances(self, id: str) -> bool:
        """Ends all subscriptions under a name; false if there is none."""
        with self._lock:
            handles = [handle for handle, known in self._subscriptions.items() if id in (handle, known.name)]
        return bool(self._end(handles))

    @remote("m()")
    def getSubscribers(self) -> list[str]:
        """Lists the handles in use."""
        with self._lock:
            return list(self._subscriptions)

    # --- pictures ----------------------------------------------------------------------------------------------------

    @remote("m(s)")
    def getImageRemote(self, name: str) -> concurrent.futures.Future | None:
        """Returns the next picture of a subscription; None for an unknown handle or a closed camera."""
        subscription = self._use(name)
        if subscription is None:
            return None
        return subscription.calls.run(self._pool, lambda: self._image(subscription, subscription.views[0]))

    @remote("m(s)")
    def getImagesRemote(self, name: str) -> concurrent.futures.Future | None:
        """Returns the next picture of each camera of a subscription."""
        subscription = self._use(name)
        if subscription is None:
            return None
        views = subscription.views
        return subscription.calls.run(self._pool, lambda: [self._image(subscription, view) for view in views])

    @remote("m(s)")
    def getDirectRawImageRemote(self, name: str) -> concurrent.futures.Future | None:
        """Returns the next picture in the camera's native format; here in the subscription's format."""
        return self.getImageRemote(name)

    @remote("m(s)")
    def getImageLocal(self, name: str) -> None:
        """Returns a pointer; only for modules in the robot's own process."""
        raise ServiceError("can only be called by a module on the robot; use getImageRemote")

    @remote("b(s)")
    def releaseImage(self, name: str) -> bool:
        """Gives a picture back. Nothing is held for remote clients."""
        return self._use(name) is not None

    @remote("m(s)")
    def getImagesLocal(self, name: str) -> None:
        """Returns pointers; only for modules in the robot's own process."""
        raise ServiceError("can only be called by a module on the robot; use getImagesRemote")

    @remote("m(s)")
    def getDirectRawImageLocal(self, name: str) -> None:
        """Returns a pointer; only for modules in the robot's own process."""
        raise ServiceError("can only be called by a module on the robot; use getDirectRawImageRemote")

    @remote("m(s)")
    def getDirectRawImagesLocal(self, name: str) -> None:
        """Returns pointers; only for modules in the robot's own process."""
        raise ServiceError("can only be called by a module on the robot; use getDirectRawImagesRemote")

    @remote("m(s)")
    def getDirectRawImagesRemote(self, name: str) -> concurrent.futures.Future | None:
        """Returns the next pictures in the cameras' native format; here in the subscription's format."""
        return self.getImagesRemote(name)

    @remote("m(s)")
    def releaseImages(self, name: str) -> list[bool]:
        """Gives pictures back. Nothing is held for remote clients."""
        subscription = self._use(name)
        return [True] * len(subscription.views) if subscription else [False]

    @remote("m(s)")
    def releaseDirectRawImages(self, name: str) -> list[bool]:
        """Gives pictures back. Nothing is held for remote clients."""
        return self.releaseImages(name)

    @remote("b(s)")
    def releaseDirectRawImage(self, name: str) -> bool:
        """Gives a picture back. Nothing is held for remote clients."""
        return self._use(name) is not None

    # --- a subscription's own settings -------------------------------------------------------------------------------

    @remote("b(si)")
    def setResolution(self, name: str, resolution: int) -> bool:
        """Changes the size of a subscription's pictures."""
        for view in self._views(name):
            if resolution not in view.camera.resolutions:
                raise ServiceError(_unknown("resolution", resolution, view.camera.resolutions, view.camera))
        for view in self._views(name):
            view.resolution = resolution
        return True

    @remote("b(si)")
    def setColorSpace(self, name: str, colorSpace: int) -> bool:
        """Changes the colour space of a subscription's pictures."""
        for view in self._views(name):
            if colorSpace not in view.camera.spaces:
                raise ServiceError(_unknown("colorSpace", colorSpace, view.camera.spaces, view.camera))
        for view in self._views(name):
            view.space = colorSpace
        return True

    @remote("b(si)")
    def setFrameRate(self, name: str, frameRate: int) -> bool:
        """Changes a subscription's pictures per second."""
        subscription = self._require(name)
        if not 1 <= frameRate <= max(view.camera.max_fps for view in subscription.views):
            raise ServiceError(f"frameRate {frameRate} is not possible")
        subscription.fps = frameRate
        return True

    @remote("i(s)")
    def getResolution(self, name: str) -> int:
        """Returns the resolution id of a subscription."""
        return self._views(name)[0].resolution

    @remote("i(s)")
    def getColorSpace(self, name: str) -> int:
        """Returns the colour space id of a subscription."""
        return self._views(name)[0].space

    @remote("i(s)")
    def getFrameRate(self, name: str) -> int:
        """Returns a subscription's pictures per second."""
        return self._require(name).rate

    @remote("b(si)")
    def setActiveCamera(self, name: str, cameraIndex: int) -> bool:
        """Points a subscription at another camera."""
        camera = known_camera(self.settings.cameras, cameraIndex)
        view = self._views(name)[0]
        if view.resolution not in camera.resolutions or view.space not in camera.spaces:
            wanted = f"resolution {view.resolution} in colour space {view.space}"
            raise ServiceError(f"{camera.name} cannot deliver {wanted}")
        view.camera = camera
        return True

    @remote("i(s)")
    def getActiveCamera(self, name: str) -> int:
        """Returns the camera of a subscription."""
        return self._views(name)[0].camera.index

    # --- for the robot's other services ------------------------------------------------------------------------------

    def picture(self, index: int, resolution: int, space: int, fps: float, cursor: Cursor) -> Picture | None:
        """Wait for the next picture of a camera, newer than `cursor`'s last one; None if it is closed or none comes.

        A resolution that the camera does not have is replaced by the one most like it.

        Raises:
            ServiceError: There is no such camera, or it has no such colour space.
        """
        camera = known_camera(self.settings.cameras, index)
        if space not in camera.spaces:
            raise ServiceError(_unknown("colour space", space, camera.spaces, camera))
        if not self.settings.is_open(camera):
            return None
        if resolution not in camera.resolutions:
            offered = tuple((number, RESOLUTIONS[number]) for number in camera.resolutions)
            resolution = closest_resolution(RESOLUTIONS.get(resolution, RESOLUTIONS[1]), offered)
        rate = min(max(1, round(fps)), camera.fastest(resolution))
        key = (camera.name, resolution, rate, *self.settings.parameters[camera.index].flips)
        image = self._streams.read(camera, key, space, cursor)
        if image is None:
            return None
        return Picture(camera, image.data, image.stamp, camera_poses(self._robot, camera.name))

    # --- inside ------------------------------------------------------------------------------------------------------

    def _subscribe(self, name: str, wanted: list[tuple[int, int, int]], fps: int) -> str:
        problem = self._problem(name, wanted, fps)
        if problem:
            log.warning("subscription '%s' refused: %s", shown(name)[1:-1], problem)
            return ""
        views = [CameraView(self.settings.cameras[index], resolution, space) for index, resolution, space in wanted]
        with self._lock:
            for number in range(MAX_INSTANCES):
                handle = f"{name}_{number}"
                if handle not in self._subscriptions:
                    self._subscriptions[handle] = _Subscription(name, views, fps)
                    return handle
        log.warning("subscription '%s' refused: %d of this name exist already", name, MAX_INSTANCES)
        return ""

    def _problem(self, name: str, wanted: list[tuple[int, int, int]], fps: int) -> str | None:
        """Return why a subscription is not possible. A robot returns an empty handle and logs the reason."""
        if not name or len(name) > 200:
            return "a name of 1 to 200 characters is needed"
        if fps < 1:
            return f"{fps} pictures per second are not possible"
        if len({index for index, _, _ in wanted}) < len(wanted):
            return "the same camera stands in it twice"
        for index, resolution, space in wanted:
            camera = self.settings.cameras.get(index)
            if camera is None:
                return f"there is no camera {index}"
            if resolution not in camera.resolutions:
                return _unknown("resolution", resolution, camera.resolutions, camera)
            if space not in camera.spaces:
                return _unknown("colour space", space, camera.spaces, camera)
        return None

    def _end(self, handles: list[str]) -> list[str]:
        """End subscriptions and the calls that wait for their pictures; return the handles that there were."""
        with self._lock:
            ended = {handle: self._subscriptions.pop(handle) for handle in handles if handle in self._subscriptions}
        for subscription in ended.values():
            subscription.calls.close()
        return list(ended)

    def _use(self, handle: str) -> _Subscription | None:
        with self._lock:
            subscription = self._subscriptions.get(handle)
        if subscription is not None:
            subscription.used = time.monotonic()
        return subscription

    def _require(self, handle: str) -> _Subscription:
        subscription = self._use(handle)
        if subscription is None:
            raise ServiceError(f"there is no subscription '{shown(handle)[1:-1]}'")
        return subscription

    def _views(self, handle: str) -> list[CameraView]:
        return self._require(handle).views

    def _camera_of(self, handle: str) -> Camera:
        return self._views(handle)[0].camera

    def _image(self, subscription: _Subscription, view: CameraView) -> list | None:
        camera = view.camera
        if not self.settings.is_open(camera):
            return None
        flips = self.settings.parameters[camera.index].flips
        key = (camera.name, view.resolution, subscription.rate, *flips)
        image = self._streams.read(camera, key, view.space, view.cursor)
        if image is None:
            return None
        width, height = RESOLUTIONS[view.resolution]
        head = [width, height, camera.spaces[view.space], view.space, *split_stamp(image.stamp), image.data]
        return [*head, camera.index, camera.fovx / 2, camera.fovy / 2, -camera.fovx / 2, -camera.fovy / 2]

    def _end_unused(self) -> None:
        while not self._closing.wait(_CLEANUP_PERIOD):
            self._streams.close_idle()
            self.forget_unused(FORGET_AFTER)

    def forget_unused(self, age: float) -> None:
        """End the subscriptions that were not used for `age` seconds."""
        limit = time.monotonic() - age
        with self._lock:
            unused = [handle for handle, known in self._subscriptions.items() if known.used < limit]
        for handle in self._end(unused):
            log.warning("subscription '%s' ended: not used for %.0f s", handle, age)


def _unknown(what: str, value: int, known: Any, camera: Camera) -> str:
    return f"{what} {value} is not possible with {camera.name}; possible: {', '.join(map(str, known))}"
