"""ALVideoRecorder: videos on the robot's disk (NAOqi 2.8 documentation, alvideorecorder), written by OpenCV."""

from __future__ import annotations

import concurrent.futures
import logging
import threading
import time
from pathlib import PurePosixPath

import cv2

from pepper_sim.disk import HOME, RobotDisk
from pepper_sim.naoqi.service import ServiceError, one_of, remote, shown, within
from pepper_sim.naoqi.tasks import Workers
from pepper_sim.naoqi.video.camera_choice import BGR, GREY, CameraChoice
from pepper_sim.naoqi.video.formats import RESOLUTIONS
from pepper_sim.naoqi.video.streams import Cursor
from pepper_sim.services.al_video_device import ALVideoDevice

log = logging.getLogger(__name__)

_CAMERAS, _SIZES, _VGA = (0, 1), (0, 1, 2), 2
_CODECS = {"MJPG": "MJPG", "IYUV": "IYUV"}
_FASTEST, _FASTEST_VGA, _SLOWEST_MJPG = 30, 15, 3
MAX_LENGTH = 3600.0
"""A recording that is not stopped ends after this time [s]."""


class ALVideoRecorder(CameraChoice):
    """Records videos, one at a time."""

    name = "ALVideoRecorder"

    def __init__(self, video: ALVideoDevice, disk: RobotDisk, workers: Workers) -> None:
        super().__init__()
        self._video, self._disk, self._workers = video, disk, workers
        self._format, self._rate = "MJPG", 15
        self._lock = threading.Lock()
        self._recording: _Recording | None = None

    def close(self) -> None:
        if self._recording is not None:
            self._recording.stop()

    @remote("b()")
    def isRecording(self) -> bool:
        """Whether a video is being recorded."""
        return self._recording is not None

    @remote("v(i)")
    def setCameraID(self, cameraID: int) -> None:
        """Chooses the camera: 0 the top one, 1 the bottom one."""
        self._camera = one_of(cameraID, _CAMERAS, "cameraID")

    @remote("i()")
    def getFrameRate(self) -> int:
        """Returns the pictures per second."""
        return self._rate

    @remote("v(i)")
    def setFrameRate(self, frameRate: int) -> None:
        """Sets the pictures per second, 1 to 30."""
        self._rate = int(within(frameRate, 1, _FASTEST, "frameRate"))

    @remote("v(i)")
    def setResolution(self, resolution: int) -> None:
        """Sets the resolution: 0 QQVGA, 1 QVGA or 2 VGA."""
        self._resolution = one_of(resolution, _SIZES, "resolution")

    @remote("s()")
    def getVideoFormat(self) -> str:
        """Returns the codec."""
        return self._format

    @remote("v(s)")
    def setVideoFormat(self, videoFormat: str) -> None:
        """Sets the codec: "MJPG" or, in colour only, "IYUV", which is not compressed."""
        self._format = one_of(videoFormat, _CODECS, "videoFormat")

    @remote("v(ss)", "v(ssb)")
    def startRecording(self, folderPath: str, fileName: str, overwrite: bool = True) -> None:
        """Records into FILE.avi until stopRecording; an existing file is an error unless it may be overwritten."""
        if not fileName or "/" in fileName:
            raise ServiceError(f"fileName must be the name of a file in folderPath, got {shown(fileName)}")
        if self._format == "IYUV" and self._space == GREY:
            raise ServiceError("IYUV videos are in colour only")
        if self._format == "MJPG" and self._rate < _SLOWEST_MJPG:
            raise ServiceError(f"MJPG videos have more than {_SLOWEST_MJPG - 1} pictures per second")
        file = PurePosixPath(HOME, folderPath, fileName if fileName.endswith(".avi") else f"{fileName}.avi")
        path = self._disk.output(str(file))
        with self._lock:
            if self._recording is not None:
                raise ServiceError("a video is being recorded already")
            if path.exists() and not overwrite:
                raise ServiceError(f"the file '{file}' exists already")
            try:
                path.parent.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                raise ServiceError(f"the file '{file}' cannot be written: {error.strerror}") from None
            rate = min(self._rate, _FASTEST_VGA) if self._resolution == _VGA else self._rate
            code = cv2.VideoWriter.fourcc(*_CODECS[self._format])
            writer = cv2.VideoWriter(str(path), code, rate, RESOLUTIONS[self._resolution], self._space == BGR)
            if not writer.isOpened():
                raise ServiceError(f"the file '{file}' cannot be written")
            view = (self._camera, self._resolution, self._space)
            self._recording = _Recording(self._video, view, rate, writer, str(file))

    @remote("m()")
    def stopRecording(self) -> concurrent.futures.Future:
        """Ends the recording and returns [pictures, file]."""
        with self._lock:
            recording, self._recording = self._recording, None
        if recording is None:
            raise ServiceError("no video is being recorded")
        return self._workers.run(lambda: [recording.stop(), recording.file])


class _Recording:
    """Writes pictures at their rate on a thread of its own, until it is stopped; what comes late is shown longer."""

    def __init__(
        self, video: ALVideoDevice, view: tuple[int, int, int], rate: int, writer: cv2.VideoWriter, file: str
    ) -> None:
        self.file = file
        self._video, self._view, self._rate, self._writer = video, view, rate, writer
        self._count = 0
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name="video-recorder", daemon=True)
        self._thread.start()

    def stop(self) -> int:
        """End it and return how many pictures the video has; the file is complete afterwards."""
        self._ending.set()
        self._thread.join(timeout=10.0)
        return self._count

    def _run(self) -> None:
        cursor, began = Cursor(), None
        try:
            while not self._ending.is_set() and self._count < MAX_LENGTH * self._rate:
                picture = self._video.picture(*self._view, self._rate, cursor)
                if picture is None:
                    self._ending.wait(1.0 / self._rate)
                    continue
                began = time.monotonic() if began is None else began
                due = max(self._count + 1, round((time.monotonic() - began) * self._rate))
                for _ in range(due - self._count):
                    self._writer.write(picture.pixels)
                self._count = due
        except Exception:  # top of a thread; stopRecording tells how far it came
            log.exception("the video '%s' ends early", self.file)
        finally:
            self._writer.release()
