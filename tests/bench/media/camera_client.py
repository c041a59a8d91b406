"""A client of ALVideoDevice as a stranger would write it, in a process of its own: asks for 30 pictures/s, counts them.

Run by the benchmarks: `python camera_client.py URL CAMERA`. For every picture it prints `<arrival> <stamp>` [s].
"""

from __future__ import annotations

import contextlib
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence

VGA, RGB, FPS = 2, 11, 30


class Viewer:
    """One client process; `pictures` grows by (arrival, stamp) [s since 1970]."""

    def __init__(self, url: str, camera: int) -> None:
        self.pictures: list[tuple[float, float]] = []
        self._process = subprocess.Popen(
            [sys.executable, __file__, url, str(camera)], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        )
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def _read(self) -> None:
        for line in self._process.stdout:
            arrival, stamp = map(float, line.split())
            self.pictures.append((arrival, stamp))

    def close(self) -> None:
        self._process.terminate()
        self._process.wait(10)
        self._thread.join(10)


class Viewers:
    def __init__(self, viewers: Sequence[Viewer]) -> None:
        self.viewers = viewers

    def wait_for_first_pictures(self, timeout: float = 60.0) -> None:
        deadline = time.monotonic() + timeout
        while not all(len(viewer.pictures) > 5 for viewer in self.viewers):
            if time.monotonic() > deadline:
                raise RuntimeError(f"no pictures within {timeout:.0f} s: {self.counts()}")
            time.sleep(0.05)

    def counts(self) -> list[int]:
        return [len(viewer.pictures) for viewer in self.viewers]


@contextlib.contextmanager
def start_viewers(url: str, cameras: Sequence[int]) -> Iterator[Viewers]:
    viewers = [Viewer(url, camera) for camera in cameras]
    try:
        yield Viewers(viewers)
    finally:
        for viewer in viewers:
            viewer.close()


def main(url: str, camera: int) -> None:
    import qi

    session = qi.Session()
    session.connect(url)
    video = session.service("ALVideoDevice")
    handle = video.subscribeCamera("benchmark", camera, VGA, RGB, FPS)
    while True:
        image = video.getImageRemote(handle)
        if image is not None:
            assert len(image[6]) == 640 * 480 * 3
            print(time.time(), image[4] + image[5] * 1e-6, flush=True)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
