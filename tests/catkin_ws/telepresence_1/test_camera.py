from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator

import cv2
import numpy as np
import pytest
from telepresence_1 import camera as camera_module
from telepresence_1.camera import Camera, CameraStatus, State
from telepresence_1.camera_sources import SourceError, open_source
from waiting import wait_until

from telepresence.video.images import LatestImage
from telepresence.video.mjpeg import CONTENT_TYPE, MjpegStream
from telepresence.web.server import WebServer


def decoded(camera: Camera) -> np.ndarray:
    return cv2.imdecode(np.frombuffer(camera.image.peek().content, np.uint8), cv2.IMREAD_COLOR)


def shows(camera: Camera, colour: tuple[int, int, int]) -> bool:
    return camera.image.peek() is not None and bool((abs(decoded(camera).mean(axis=(0, 1)) - colour) < 12).all())


@pytest.fixture(autouse=True)
def quick_retries(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(camera_module, "FIRST_PAUSE", 0.05)
    monkeypatch.setattr(camera_module, "LONGEST_PAUSE", 0.2)


@pytest.fixture
def video(tmp_path) -> str:
    """Ten pictures: five red, five blue (BGR)."""
    path = str(tmp_path / "video.mp4")
    writer = cv2.VideoWriter(path, cv2.VideoWriter_fourcc(*"mp4v"), 50.0, (320, 240))
    for number in range(10):
        writer.write(np.full((240, 320, 3), (0, 0, 255) if number < 5 else (255, 0, 0), np.uint8))
    writer.release()
    return path


def test_a_test_card_is_live_at_the_wanted_rate() -> None:
    with Camera("test", rate=40.0) as camera:
        wait_until(lambda: 15 < camera.status.rate < 42)
        assert camera.status.state is State.LIVE
        assert (camera.status.width, camera.status.height) == (640, 480)
        assert decoded(camera).shape == (480, 640, 3)


def test_a_video_is_repeated_for_ever(video: str) -> None:
    with Camera(video) as camera:
        for _ in range(2):
            wait_until(lambda: shows(camera, (0, 0, 255)))
            wait_until(lambda: shows(camera, (255, 0, 0)))
        assert camera.status.state is State.LIVE and camera.status.losses == 0


def test_a_picture_from_elsewhere_is_shown_in_place_of_the_source_s(monkeypatch: pytest.MonkeyPatch, jpeg) -> None:
    monkeypatch.setattr("telepresence_1.camera.ELSEWHERE_LIFE", 3.0)
    with Camera("test", rate=50.0) as camera:
        wait_until(lambda: camera.status.state is State.LIVE)
        camera.show(jpeg((0, 200, 0), 320, 240), 1.0)
        assert shows(camera, (0, 200, 0)) and camera.image.peek().stamp == 1.0
        assert (camera.status.source, camera.status.width) == ("elsewhere", 320)
        camera.show(b"", 2.0)
        covered = decoded(camera)
        assert not shows(camera, (0, 200, 0)) and camera.status.state is State.LOST
        for nonsense in (b"no picture", jpeg((0, 0, 0))[:-300], bytes(200_000)):
            with pytest.raises(ValueError, match="no picture"):
                camera.show(nonsense, 3.0)
        assert (decoded(camera) == covered).all()
        wait_until(lambda: camera.status.source == "test" and decoded(camera).shape == (480, 640, 3))
        wait_until(lambda: camera.image.peek().stamp > 3.0)


def test_the_source_is_open_only_while_it_is_wanted(monkeypatch: pytest.MonkeyPatch, jpeg) -> None:
    opened, closed = [], []

    class Green:
        """Its picture comes late, when nobody may want it any more."""

        def __init__(self, *_: object) -> None:
            opened.append(self)

        def read(self) -> np.ndarray:
            time.sleep(0.05)
            return np.full((480, 640, 3), (0, 200, 0), np.uint8)

        def close(self) -> None:
            closed.append(self)

    monkeypatch.setattr(camera_module, "open_source", Green)
    monkeypatch.setattr("telepresence_1.camera.NOTICE_PERIOD", 0.05)
    monkeypatch.setattr("telepresence_1.camera.ELSEWHERE_LIFE", 0.3)
    with Camera("0", wanted=False) as camera:
        for number in (1, 2):
            wait_until(lambda: camera.image.peek() is not None)
            first = camera.image.peek().sequence
            wait_until(lambda first=first: camera.image.peek().sequence > first + 2, "its notice is a stream")
            assert len(opened) == len(closed) == number - 1 and camera.status.text == "Camera off"
            camera.film(True)
            wait_until(lambda: shows(camera, (0, 200, 0)))
            assert camera.status.state is State.LIVE
            seen: list[tuple[int, ...]] = []
            listener = lambda: seen.append(tuple(decoded(camera).mean(axis=(0, 1))))  # noqa: B023, E731
            camera.film(False)
            camera.image.add_listener(listener)
            wait_until(lambda seen=seen: len(closed) == len(opened) and len(seen) > 3)
            camera.image.remove_listener(listener)
            assert not any(abs(np.array(one) - (0, 200, 0)).max() < 12 for one in seen)
        camera.show(jpeg((200, 0, 0)), 1.0)
        assert shows(camera, (0, 0, 200)) and camera.status.source == "elsewhere"
        wait_until(lambda: camera.status.text == "Camera off" and not shows(camera, (0, 0, 200)))
    assert len(opened) == len(closed) == 2


def test_a_still_picture_is_a_source(tmp_path, caplog: pytest.LogCaptureFixture) -> None:
    path = str(tmp_path / "still.png")
    cv2.imwrite(path, np.full((1000, 2000, 3), (0, 200, 0), np.uint8))
    with Camera(path) as camera:
        wait_until(lambda: shows(camera, (0, 200, 0)))
        assert decoded(camera).shape == (320, 640, 3), "scaled to fit"
    assert "failed" not in caplog.text, "it is let go without a complaint"


@pytest.mark.parametrize(
    ("source", "complaint"),
    [
        ("7", "no camera at /dev/video7"),
        ("/dev/video9", "no camera at /dev/video9"),
        ("/nowhere/at-all.mp4", "does not exist"),
        (__file__, "neither a video nor a picture"),
        ("http://127.0.0.1:9/video", "does not answer"),
        ("/dev/null", "/dev/null cannot be opened"),
    ],
)
def test_a_missing_source_says_what_is_wrong(source: str, complaint: str) -> None:
    with pytest.raises(SourceError, match=complaint):
        open_source(source, 640, 480, 30.0)
    with Camera(source) as camera:
        wait_until(lambda: camera.status.state is State.LOST)
        assert complaint in camera.status.text
        first = camera.image.peek().sequence
        wait_until(lambda: camera.image.peek().sequence > first + 2, "the notice is a stream of its own")
        assert decoded(camera).shape == (480, 640, 3)


def test_a_camera_that_is_plugged_in_later_is_found(tmp_path) -> None:
    path = tmp_path / "camera.png"
    with Camera(str(path)) as camera:
        wait_until(lambda: camera.status.state is State.LOST)
        beside = tmp_path / "beside.png"
        cv2.imwrite(str(beside), np.full((48, 64, 3), (10, 200, 10), np.uint8))
        beside.rename(path)
        wait_until(lambda: shows(camera, (10, 200, 10)))
        assert camera.status.state is State.LIVE


class NetworkCamera:
    """An MJPEG camera that can be unplugged."""

    def __init__(self) -> None:
        self.image = LatestImage()
        self._stream = MjpegStream(self.image)
        self._server = WebServer(self._answer)
        self.port = self._server.port

    def _answer(self, environ: dict, start_response: Callable) -> object:
        start_response("200 OK", [("Content-Type", CONTENT_TYPE)])
        return self._stream.view()

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}/"

    def plug(self) -> None:
        if self._server is None:
            self._server = WebServer(self._answer, port=self.port)
        self._server.start()

    def unplug(self) -> None:
        self._server.close()
        self._server = None

    def put(self, colour: tuple[int, int, int]) -> None:
        self.image.put(cv2.imencode(".jpg", np.full((240, 320, 3), colour, np.uint8))[1].tobytes())


@pytest.fixture
def network_camera() -> Iterator[NetworkCamera]:
    network_camera = NetworkCamera()
    stop = threading.Event()
    colour = [(0, 0, 200)]

    def film() -> None:
        while not stop.wait(0.03):
            network_camera.put(colour[0])

    network_camera.paint = lambda new: colour.__setitem__(0, new)  # type: ignore[attr-defined]
    thread = threading.Thread(target=film)
    thread.start()
    network_camera.plug()
    yield network_camera
    stop.set()
    thread.join()
    if network_camera._server is not None:
        network_camera.unplug()


def test_survives_being_unplugged_and_plugged_in_again(network_camera: NetworkCamera) -> None:
    changes: list[CameraStatus] = []
    with Camera(network_camera.url, on_change=changes.append) as camera:
        wait_until(lambda: shows(camera, (0, 0, 200)))
        for losses, colour in ((1, (0, 200, 0)), (2, (200, 0, 0))):
            network_camera.unplug()
            wait_until(lambda: camera.status.state is State.LOST)
            assert network_camera.url in camera.status.text
            assert camera.status.losses == losses
            network_camera.paint(colour)
            network_camera.plug()
            wait_until(lambda colour=colour: shows(camera, colour))
    states = [change.state for change in changes]
    assert states == [State.LIVE, State.LOST, State.LIVE, State.LOST, State.LIVE]


def test_pauses_grow_between_attempts(monkeypatch: pytest.MonkeyPatch) -> None:
    attempts: list[float] = []

    def refuse(*_: object) -> None:
        attempts.append(time.monotonic())
        raise SourceError("No", "not this time")

    monkeypatch.setattr(camera_module, "open_source", refuse)
    with Camera("0"):
        wait_until(lambda: len(attempts) >= 5)
    pauses = np.diff(attempts)
    assert (pauses[:4] >= (0.045, 0.095, 0.19, 0.19)).all()


def test_a_bug_in_a_source_does_not_end_the_stream(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(camera_module, "open_source", fail)
    with Camera("0") as camera:
        wait_until(lambda: camera.status.state is State.LOST)
        monkeypatch.undo()
        monkeypatch.setattr(camera_module, "open_source", lambda *_: open_source("test", 64, 48, 30.0))
        wait_until(lambda: camera.status.state is State.LIVE)


def test_closing_ends_the_thread_whatever_the_source() -> None:
    for source in ("test", "0"):
        with Camera(source) as camera:
            wait_until(lambda camera=camera: camera.image.peek() is not None)
        assert "camera" not in {thread.name for thread in threading.enumerate()}


def test_the_quality_decides_the_size() -> None:
    sizes = []
    for quality in (30, 80, 95):
        with Camera("test", quality=quality) as camera:
            wait_until(lambda camera=camera: camera.status.state is State.LIVE)
            sizes.append(len(camera.image.peek().content))
    assert sizes[0] < sizes[1] < sizes[2] < 150_000
