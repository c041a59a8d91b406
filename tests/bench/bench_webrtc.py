"""Age of Robotino's pictures by WebRTC at 640x480 and 30 pictures/s, against a frame period and against MJPEG.

One sender process, one receiver in this one, on loopback. Each picture carries the time it was taken; its age is read
from the decoded picture. The reference "aiortc as it is" is the same pair without the early release.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from report import Row, percentile

from telepresence.station import processes
from telepresence.video import webrtc

ROOT = Path(__file__).resolve().parents[2]
SOURCES = [ROOT / "catkin_ws" / "src" / name / "src" for name in ("rto_bringup", "rto_node")]
sys.path[:0] = map(str, SOURCES)

from media.mjpeg_of_camera import read_pictures  # noqa: E402
from rto_node.webrtc_camera import WebrtcCamera  # noqa: E402

RATE = 30.0
PERIOD = 1000.0 / RATE
WARM_UP, SECONDS = 4.0, 15.0


def run() -> list[Row]:
    plain = measure_webrtc()
    webrtc.release_early()
    ours = measure_webrtc()
    mjpeg = measure_mjpeg()
    rows = []
    for percent in (50, 99):
        age = percentile(ours.ages, percent) * 1e3
        rows += [
            Row(f"age of the decoded picture, p{percent}", age, PERIOD, "ms", "one frame period"),
            Row(f"age, p{percent}", age, percentile(mjpeg.ages, percent) * 1e3, "ms", "MJPEG of the same camera"),
            Row(f"age, p{percent}", age, percentile(plain.ages, percent) * 1e3, "ms", "aiortc as it is"),
        ]
    return [
        *rows,
        Row("pictures/s", ours.rate, RATE, "1/s", "asked for"),
        Row("processor of the sender", ours.cpu * 100, mjpeg.cpu * 100, "% of a core", "MJPEG of the same camera"),
    ]


class Figures:
    """Ages [s], pictures per second, cores used by the sender."""

    def __init__(self, ages: list[float], seconds: float, cpu: float) -> None:
        if len(ages) < RATE * seconds / 3:
            raise RuntimeError(f"only {len(ages)} pictures came in {seconds:.0f} s")
        self.ages, self.rate, self.cpu = ages, len(ages) / seconds, cpu


def measure_webrtc() -> Figures:
    words = ("-m", "rto_bringup.onboard", "camera", "--port", "0", "--source", "test", "--rate", str(RATE))
    with program(*words) as sender:
        camera = WebrtcCamera(sender.url, with_time=True)
        camera.want(True)
        try:
            return collect(sender, webrtc_ages(camera))
        finally:
            camera.close()


def webrtc_ages(camera: WebrtcCamera) -> Iterator[float | None]:
    sequence = 0
    while True:
        picture = camera.image.wait_newer(sequence, timeout=10.0)
        if picture is None:
            raise RuntimeError(f"no picture: {camera.problem}")
        sequence = picture.sequence
        yield camera.age


def measure_mjpeg() -> Figures:
    with program(str(Path(__file__).with_name("media") / "mjpeg_of_camera.py"), str(RATE)) as server:
        return collect(server, read_pictures(server.url))


def collect(server, ages: Iterator[float | None]) -> Figures:
    begin = time.monotonic()
    while time.monotonic() - begin < WARM_UP:
        next(ages)
    begin, cpu, found = time.monotonic(), server.cpu(), []
    while time.monotonic() - begin < SECONDS:
        age = next(ages)
        if age is not None:
            found.append(age)
    seconds = time.monotonic() - begin
    return Figures(found, seconds, (server.cpu() - cpu) / seconds)


class Server:
    def __init__(self, process: subprocess.Popen) -> None:
        self._pid = process.pid
        self.url = process.stdout.readline().split()[-1]

    def cpu(self) -> float:
        """Processor seconds that the process has used."""
        fields = Path(f"/proc/{self._pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


@contextmanager
def program(*arguments: str) -> Iterator[Server]:
    environment = {**os.environ, "PYTHONPATH": ":".join(map(str, [ROOT, *SOURCES]))}
    process = processes.start(
        [sys.executable, *arguments], env=environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )
    try:
        yield Server(process)
    finally:
        processes.end(process)
        process.stdout.close()
