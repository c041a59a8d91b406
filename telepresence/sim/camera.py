"""Cameras: pictures of the world, drawn by one thread with one OpenGL context.

The thread copies positions under the world's lock (microseconds) and draws outside of it, so every picture shows one
instant and physics does not wait. A picture is drawn only for a feed that is due.
"""

from __future__ import annotations

import atexit
import logging
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, field

import mujoco
import numpy as np

from telepresence.sim.painter import Painter
from telepresence.sim.world import World
from telepresence.video.images import LatestImage

log = logging.getLogger(__name__)

KINDS = ("rgb", "depth")
TEXTURE_RATE = 15.0
"""A texture changes at most this often [Hz]; each change costs an upload."""
_START_TIMEOUT = 30.0


class CamerasFailed(RuntimeError):
    """Pictures cannot be drawn: no OpenGL, or the drawing thread has ended."""


@dataclass(eq=False)
class Feed:
    """Pictures of one camera, or of several side by side, at one size and rate.

    `image` holds `(height, width, 3) uint8, RGB` or, for depth, `(height, width) float32`: distance along the optical
    axis [m], the far clipping plane's where nothing is. Arrays are read-only. The stamp is the instant shown.
    """

    camera: str | tuple[str, ...]
    width: int
    height: int
    fps: float
    kind: str
    image: LatestImage = field(default_factory=LatestImage)
    _cameras: Cameras | None = field(default=None, repr=False)
    _camera_ids: tuple[int, ...] = field(default=(), repr=False)
    _due: float = field(default=0.0, repr=False)

    def close(self) -> None:
        """Stop drawing for this feed. The last picture stays readable."""
        if self._cameras is not None:
            self._cameras._remove(self)

    def __enter__(self) -> Feed:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class Cameras:
    """All cameras of one world. OpenGL starts at once, beside whoever has made this; `wait_ready` waits for it (0.4 s),
    so that nothing stalls later. If it cannot, the first `subscribe` says why."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._model = world.model
        self._changed = threading.Condition()
        self._feeds: list[Feed] = []
        self._textures: dict[int, np.ndarray] = {}
        self._next_upload: dict[int, float] = {}
        self._ready = threading.Event()
        self._failure: BaseException | None = None
        self._closed = False
        self._thread = threading.Thread(target=self._run, name="cameras", daemon=True)
        self._thread.start()

    def wait_ready(self) -> None:
        """Wait until OpenGL has started, or cannot."""
        if not self._ready.wait(_START_TIMEOUT):
            log.error("OpenGL is not ready after %.0f s", _START_TIMEOUT)

    def subscribe(self, camera: str | tuple[str, ...], width: int, height: int, fps: float, kind: str = "rgb") -> Feed:
        """Start drawing pictures of `camera`.

        Args:
            camera: Full name with the robot's prefix, e.g. `"pepper/CameraTop"`, or a camera of the scene. Several are
                drawn side by side, at the same instant, as a stereo camera delivers them.
            width, height: Size [px], at most the model's offscreen buffer for each camera.
            fps: Pictures per second.
            kind: `"rgb"` or `"depth"`.
        Raises:
            ValueError: Unknown camera or kind, or a size or rate that cannot be drawn.
            CamerasFailed: There is no OpenGL.
        """
        limit = self._model.vis.global_
        names = (camera,) if isinstance(camera, str) else camera
        if not names or width % len(names):
            raise ValueError(f"{width} pixels cannot be shared by {len(names)} cameras")
        if kind not in KINDS:
            raise ValueError(f"unknown kind of picture {kind!r}; kinds: {', '.join(KINDS)}")
        if not (0 < width // len(names) <= limit.offwidth and 0 < height <= limit.offheight):
            raise ValueError(
                f"{width}x{height} cannot be drawn; the largest picture is {limit.offwidth}x{limit.offheight}"
            )
        if not fps > 0.0:
            raise ValueError(f"the rate must be positive, got {fps}")
        found = tuple(map(self._find, names))
        feed = Feed(camera, int(width), int(height), float(fps), kind, LatestImage(), self, found)
        if not self._ready.wait(_START_TIMEOUT):
            raise CamerasFailed("OpenGL is not ready")
        if self._failure is not None:
            raise CamerasFailed(f"pictures cannot be drawn: {self._failure}") from self._failure
        with self._changed:
            if self._closed:
                raise CamerasFailed("the cameras are closed")
            feed._due = time.monotonic()
            self._feeds.append(feed)
            self._changed.notify()
        return feed

    def set_texture(self, name: str, pixels: np.ndarray) -> None:
        """Show `pixels` on the texture called `name` from the next picture on. Only the newest call counts.

        Args:
            name: Full name with the robot's prefix, e.g. `"pepper/screen"`.
            pixels: `(height, width, 3) uint8, RGB` of exactly the texture's size.
        Raises:
            ValueError: Unknown texture or wrong shape or type.
        """
        texture = mujoco.mj_name2id(self._model, mujoco.mjtObj.mjOBJ_TEXTURE, name)
        if texture < 0:
            names = [self._model.texture(i).name for i in range(self._model.ntex)]
            raise ValueError(f"there is no texture {name!r}; textures: {', '.join(names)}")
        shape = (int(self._model.tex_height[texture]), int(self._model.tex_width[texture]), 3)
        if pixels.shape != shape or pixels.dtype != np.uint8:
            raise ValueError(f"texture {name!r} holds {shape} uint8, the array holds {pixels.shape} {pixels.dtype}")
        pixels = pixels.copy()
        with self._changed:
            self._textures[texture] = pixels

    def close(self) -> None:
        """Stop the thread and free the context. Calling it again does nothing."""
        with self._changed:
            self._closed = True
            self._feeds.clear()
            self._changed.notify()
        atexit.unregister(self.close)
        if self._thread is not threading.current_thread():
            self._thread.join(timeout=10.0)
            if self._thread.is_alive():
                log.error("the drawing thread did not end within 10 s")

    def _find(self, camera: str) -> int:
        found = mujoco.mj_name2id(self._model, mujoco.mjtObj.mjOBJ_CAMERA, camera)
        if found < 0:
            names = [self._model.camera(i).name for i in range(self._model.ncam)]
            raise ValueError(f"there is no camera {camera!r}; cameras: {', '.join(names) or 'none'}")
        return found

    def _remove(self, feed: Feed) -> None:
        with self._changed:
            if feed in self._feeds:
                self._feeds.remove(feed)

    # --- the drawing thread ------------------------------------------------------------------------------------------

    def _run(self) -> None:
        try:
            painter = Painter(self._world)
        except Exception as error:  # OpenGL and its drivers raise errors of many types; `subscribe` reports them
            log.exception("OpenGL could not be started")
            self._failure = error
            self._ready.set()
            return
        # After OpenGL has registered its own end, so that it runs before: a context must not outlive its display.
        atexit.register(self.close)
        self._ready.set()
        try:
            while self._draw_due(painter):
                pass
        except Exception as error:  # the top of a thread; `subscribe` reports it
            log.critical("drawing pictures ended", exc_info=True)
            self._failure = error
        finally:
            painter.close()

    def _draw_due(self, painter: Painter) -> bool:
        """Wait until a feed is due, draw for all that are, and say whether to go on."""
        with self._changed:
            while not self._closed:
                if not self._feeds:
                    self._changed.wait()
                    continue
                wait = min(feed._due for feed in self._feeds) - time.monotonic()
                if wait <= 0.0:
                    break
                self._changed.wait(wait)
            if self._closed:
                return False
            now = time.monotonic()
            due = [feed for feed in self._feeds if feed._due <= now]
            painter.fit(*_largest(self._feeds))
        stamp = painter.snapshot()
        views = {
            (camera, feed.width // len(feed._camera_ids), feed.height) for feed in due for camera in feed._camera_ids
        }
        with self._changed:
            textures = self._take_textures(now, painter, views)
        painter.upload(textures)
        drawn: dict[tuple, np.ndarray] = {}
        for feed in due:
            key = (feed._camera_ids, feed.width, feed.height, feed.kind)
            if key not in drawn:
                drawn[key] = _draw(painter, *key)
            feed.image.put(drawn[key], stamp)
            feed._due = next_due(feed._due, feed.fps, time.monotonic())
        return True

    def _take_textures(self, now: float, painter: Painter, views: set[tuple[int, int, int]]) -> dict[int, np.ndarray]:
        """Return those that have changed and that one of the pictures to be drawn shows; `views`: cameras and sizes."""
        ready = {}
        for texture in list(self._textures):
            seen = any(painter.sees(texture, *view) for view in views)
            if seen and now >= self._next_upload.get(texture, 0.0):
                self._next_upload[texture] = now + 1.0 / TEXTURE_RATE
                ready[texture] = self._textures.pop(texture)
        return ready


def _largest(feeds: Sequence[Feed]) -> tuple[int, int]:
    """Return width and height that no picture of one camera exceeds [px]."""
    return max(feed.width // len(feed._camera_ids) for feed in feeds), max(feed.height for feed in feeds)


def _draw(painter: Painter, cameras: tuple[int, ...], width: int, height: int, kind: str) -> np.ndarray:
    """Draw what `cameras` see, side by side."""
    views = [painter.draw(camera, width // len(cameras), height, kind) for camera in cameras]
    if len(views) == 1:
        return views[0]
    pixels = np.concatenate(views, axis=1)
    pixels.flags.writeable = False
    return pixels


def next_due(due: float, fps: float, now: float) -> float:
    """Return when the picture after the one due at `due` is due.

    Deadlines are absolute, so that 30 Hz stay 30 Hz; after a stall at most one picture is made up for.
    """
    return max(due + 1.0 / fps, now - 1.0 / fps)
