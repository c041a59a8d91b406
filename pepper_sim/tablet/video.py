"""The tablet's video player, and animated pictures: fetches a file and shows its pictures at their rate, without sound.

The file is fetched like a page, see `http_fetch`, and decoded by OpenCV from a temporary file. Play lists, which lead
elsewhere, are refused.
"""

from __future__ import annotations

import logging
import tempfile
import threading
import time

import cv2

from pepper_sim.tablet.http_fetch import UNKNOWN, Cancelled, Fetcher, LoadError
from pepper_sim.tablet.screen import MAX_PIXELS, Layer, letterbox
from pepper_sim.tablet.web_view import Events

log = logging.getLogger(__name__)

VIDEO_LIMIT = 200_000_000
"""Bytes of a video that are fetched."""
LOAD_TIMEOUT = 60.0
NO_VIDEO = -1
_USUAL_RATE = 25.0


class Video:
    """One video that is fetched and shown in `layer` on a thread of its own. `events.finished` is its end.

    Args:
        repeated: It is an animated picture, which begins again at its end.
    """

    def __init__(self, url: str, layer: Layer, events: Events, fetcher: Fetcher, repeated: bool = False) -> None:
        self._repeated = repeated
        self._url, self._layer, self._events, self._fetcher = url, layer, events, fetcher
        self._changed = threading.Condition()
        self._paused = self._stopped = False
        self._shown, self._count, self._rate = 0, 0, _USUAL_RATE
        self._thread = threading.Thread(target=self._run, name="tablet-video", daemon=True)
        self._thread.start()

    @property
    def length(self) -> int:
        """How long it is [ms]; -1 as long as that is not known."""
        return round(1000 * self._count / self._rate) if self._count > 0 else NO_VIDEO

    @property
    def position(self) -> int:
        """What has been shown of it [ms]."""
        return round(1000 * self._shown / self._rate)

    def pause(self, paused: bool) -> None:
        """Stand still, or go on."""
        with self._changed:
            self._paused = paused
            self._changed.notify()

    def cancel(self) -> None:
        """Stop at once, without waiting for the thread."""
        with self._changed:
            self._stopped = True
            self._changed.notify()
        self._fetcher.cancel()

    def join(self, timeout: float) -> bool:
        """Wait at most `timeout` seconds for the thread; whether it has ended."""
        if self._thread is not threading.current_thread():  # a callback may close the tablet
            self._thread.join(timeout)
        return not self._thread.is_alive()

    def _run(self) -> None:
        try:
            with tempfile.NamedTemporaryFile(prefix="pepper-video-") as file:
                with self._fetcher.get(self._url) as response:
                    data = self._fetcher.read_all(response, VIDEO_LIMIT, LOAD_TIMEOUT)
                if response.status >= 400 or not (_is_gif if self._repeated else _is_video)(data):
                    raise LoadError(UNKNOWN, "it is no video that can be played")
                file.write(data)
                file.flush()
                self._play(file.name)
        except Cancelled:
            pass
        except LoadError as error:
            self._events.failed(error.code, error.text, self._url)
        except Exception:  # top of a thread that decodes foreign files and calls the owner's callbacks
            log.exception("the tablet's video %s failed", self._url)

    def _play(self, path: str) -> None:
        capture = cv2.VideoCapture(path)
        try:
            size = capture.get(cv2.CAP_PROP_FRAME_WIDTH) * capture.get(cv2.CAP_PROP_FRAME_HEIGHT)
            if not capture.isOpened() or not 0 < size <= MAX_PIXELS:
                raise LoadError(UNKNOWN, "it is no video that can be played")
            self._rate = capture.get(cv2.CAP_PROP_FPS) or _USUAL_RATE
            self._count = int(capture.get(cv2.CAP_PROP_FRAME_COUNT))
            self._events.started()
            due = time.monotonic()
            while self._wait_until(due):
                good, frame = capture.read()
                if not good and self._repeated and self._shown:
                    capture.release()
                    capture.open(path)
                    continue
                if not good:
                    self._events.finished()
                    return
                self._shown += 1
                self._layer.put(letterbox(cv2.cvtColor(frame, cv2.COLOR_BGR2RGB)))
                due = max(due + 1.0 / self._rate, time.monotonic() - 1.0 / self._rate)
        finally:
            capture.release()

    def _wait_until(self, due: float) -> bool:
        """Wait for the time of the next picture, longer while paused; whether to go on."""
        with self._changed:
            while not self._stopped:
                wait = due - time.monotonic()
                if not self._paused and wait <= 0.0:
                    return True
                self._changed.wait(None if self._paused else wait)
        return False


def _is_gif(data: bytes) -> bool:
    return data.startswith(b"GIF8")


def _is_video(data: bytes) -> bool:
    """Whether a file is MP4, WebM or Matroska, AVI or Ogg."""
    return data[4:8] == b"ftyp" or data.startswith((b"\x1a\x45\xdf\xa3", b"RIFF", b"OggS"))
