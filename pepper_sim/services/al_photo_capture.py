"""ALPhotoCapture: pictures on the robot's disk (NAOqi 2.8 documentation, alphotocapture), written by OpenCV."""

from __future__ import annotations

import concurrent.futures
import threading
from collections.abc import Callable
from pathlib import PurePosixPath

import cv2

from pepper_sim.disk import HOME, RobotDisk
from pepper_sim.naoqi.service import ServiceError, one_of, remote, shown, within
from pepper_sim.naoqi.tasks import Workers, chained
from pepper_sim.naoqi.video.camera_choice import BGR, GREY, CameraChoice
from pepper_sim.naoqi.video.conversions import known_camera
from pepper_sim.naoqi.video.streams import Cursor
from pepper_sim.services.al_video_device import ALVideoDevice
from telepresence.naoqi.incoming_call import caller

FORMATS = ("bmp", "dib", "jpeg", "jpg", "jpe", "png", "pbm", "pgm", "ppm", "sr", "ras", "tiff", "tif")
_GREY_ONLY = (".pbm", ".pgm")
MAX_PICTURES = 1000
MAX_SERIES = 8
"""Series that may be taken or wait for the camera at the same time; the next one is refused."""
_RATE = 30.0
_CHECKED = 0.1
"""How often a series looks whether it is still wanted [s]."""


class ALPhotoCapture(CameraChoice):
    """Takes pictures."""

    name = "ALPhotoCapture"

    def __init__(self, video: ALVideoDevice, disk: RobotDisk, workers: Workers) -> None:
        super().__init__()
        self._video, self._disk, self._workers = video, disk, workers
        self._format, self._interval, self._half_pressed = "jpg", 200, False
        self._taking = threading.Lock()  # one picture after the other, as one camera takes them
        self._places = threading.BoundedSemaphore(MAX_SERIES)

    # --- settings ----------------------------------------------------------------------------------------------------

    @remote("v(i)")
    def setCameraID(self, cameraID: int) -> None:
        """Chooses the camera, numbered as by ALVideoDevice."""
        camera = known_camera(self._video.settings.cameras, cameraID)
        if BGR not in camera.spaces:
            raise ServiceError(f"{camera.name} takes no photographs")
        self._camera = cameraID

    @remote("v(i)")
    def setResolution(self, resolution: int) -> None:
        """Sets the pictures' resolution, numbered as by ALVideoDevice."""
        one_of(resolution, self._video.settings.cameras[self._camera].resolutions, "resolution")
        self._resolution = resolution

    @remote("s()")
    def getPictureFormat(self) -> str:
        """Returns the format and file extension."""
        return self._format

    @remote("v(s)")
    def setPictureFormat(self, pictureFormat: str) -> None:
        """Sets the format and file extension, such as "jpg" or "png"."""
        self._format = one_of(pictureFormat, FORMATS, "pictureFormat")

    @remote("i()")
    def getCaptureInterval(self) -> int:
        """Returns the time between two pictures of a series [ms]."""
        return self._interval

    @remote("v(i)")
    def setCaptureInterval(self, captureInterval: int) -> None:
        """Sets the time between two pictures of a series [ms]."""
        self._interval = int(within(captureInterval, 0, 3_600_000, "captureInterval"))

    @remote("b(b)")
    def setHalfPressEnabled(self, enable: bool) -> bool:
        """Keeps the camera ready between pictures, or not. Here it is always ready."""
        self._half_pressed = enable
        return True

    @remote("b()")
    def isHalfPressEnabled(self) -> bool:
        """Whether the camera is kept ready."""
        return self._half_pressed

    @remote("b()")
    def halfPress(self) -> bool:
        """Toggles setHalfPressEnabled (old form)."""
        self._half_pressed = not self._half_pressed
        return True

    @remote("b()")
    def isHalfPressed(self) -> bool:
        """Old form of isHalfPressEnabled."""
        return self._half_pressed

    # --- pictures ----------------------------------------------------------------------------------------------------

    @remote("m(ss)", "m(ssb)")
    def takePicture(self, folderPath: str, fileName: str, overwrite: bool = True) -> concurrent.futures.Future:
        """Takes a picture and returns [file]; an existing file is an error unless it may be overwritten."""
        return self._start([self._file(folderPath, fileName)], overwrite)

    @remote("m(iss)", "m(issb)")
    def takePictures(
        self, numberOfPictures: int, folderPath: str, fileName: str, overwrite: bool = True
    ) -> concurrent.futures.Future:
        """Takes pictures one after the other into NAME_0.jpg, NAME_1.jpg, ... and returns [[file, file, ...]]. The
        series ends early with its caller, and when it is cancelled."""
        within(numberOfPictures, 1, MAX_PICTURES, "numberOfPictures")
        first = self._file(folderPath, fileName)
        files = [first.with_stem(f"{first.stem}_{number}") for number in range(numberOfPictures)]
        return chained(self._start(files, overwrite), lambda names: [names])

    def _file(self, folder: str, name: str) -> PurePosixPath:
        """Return a picture's file on the robot, with the chosen format's extension unless the name has one."""
        if not name or "/" in name:
            raise ServiceError(f"fileName must be the name of a file in folderPath, got {shown(name)}")
        file = PurePosixPath(HOME, folder, name)
        if file.suffix.lstrip(".").lower() not in FORMATS:
            file = file.with_name(f"{name}.{self._format}")
        self._disk.output(str(file))
        return file

    def _start(self, files: list[PurePosixPath], overwrite: bool) -> concurrent.futures.Future:
        if not self._places.acquire(blocking=False):
            raise ServiceError(f"{MAX_SERIES} series of pictures wait for the camera already")
        cancelled, connection = threading.Event(), caller()
        work = self._workers.run(
            self._take, files, overwrite, lambda: cancelled.is_set() or (connection is not None and connection.closed)
        )
        work.add_done_callback(lambda _: self._places.release())
        answer = chained(work, lambda names: names)
        answer.add_done_callback(lambda done: cancelled.set() if done.cancelled() else None)
        return answer

    def _take(self, files: list[PurePosixPath], overwrite: bool, unwanted: Callable[[], bool]) -> list[str]:
        cursor = Cursor()
        for number, file in enumerate(files):
            if number:
                self._pause(unwanted)
            with self._taking:
                self._save(file, overwrite, cursor)
        return [str(file) for file in files]

    def _pause(self, unwanted: Callable[[], bool]) -> None:
        """Wait between two pictures.

        Raises:
            ServiceError: Nobody wants the second one.
        """
        interval = self._interval / 1000.0
        if interval and self._workers.wait_until(unwanted, interval, min(interval, _CHECKED)):
            raise ServiceError("nobody waits for these pictures any more")
        if self._workers.closing.is_set():
            raise ServiceError("the robot is being switched off")

    def _save(self, file: PurePosixPath, overwrite: bool, cursor: Cursor) -> None:
        path = self._disk.path(str(file))
        if path.exists() and not overwrite:
            raise ServiceError(f"the file '{file}' exists already")
        space = GREY if file.suffix in _GREY_ONLY else self._space
        picture = self._video.picture(self._camera, self._resolution, space, _RATE, cursor)
        if picture is None:
            raise ServiceError(f"camera {self._camera} gives no picture")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            written = cv2.imwrite(str(path), picture.pixels)
        except OSError as error:
            raise ServiceError(f"the file '{file}' cannot be written: {error.strerror}") from None
        if not written:
            raise ServiceError(f"the file '{file}' cannot be written")
