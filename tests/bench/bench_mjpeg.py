"""The pilot's picture for many viewers: com_cam against the report's server, which captures and encodes per viewer."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from media.mjpeg_servers import RATE
from media.mjpeg_viewers import Audience
from report import Row, percentile

from telepresence.station import processes

WARM_UP, SECONDS = 2.0, 8.0
CROWD_SECONDS = float(os.environ.get("BENCH_MJPEG_SECONDS", "30"))
"""How long 64 viewers watch; 300 shows whether memory stays flat."""
PARTS = 10
"""How often memory is looked at meanwhile."""
THROTTLED = 600_000.0
"""What a weak Wi-Fi carries [bytes/s]; the stream is about three times as much."""
_TICK = os.sysconf("SC_CLK_TCK")


@dataclass(frozen=True)
class Load:
    """What a server does for a number of viewers: pictures delivered per second, processor share [cores]."""

    pictures: float
    cores: float


def run() -> list[Row]:
    with tempfile.TemporaryDirectory(prefix="bench-mjpeg-") as folder:
        video = write_video(Path(folder) / "pilot.avi")
        with server("report", video) as (port, pid):
            report = {viewers: load(port, pid, viewers) for viewers in (1, 16)}
            report_age = throttled_age(port)
        with server("ours", video) as (port, pid):
            ours = {viewers: load(port, pid, viewers) for viewers in (1, 16)}
            age = throttled_age(port)
        with server("ours", video) as (port, pid):
            crowd = crowd_rows(port, pid)
    each, each_report = ours[16].cores / ours[16].pictures, report[16].cores / report[16].pictures
    return [
        Row("processor per picture, 16 viewers", each * 1e3, each_report * 1e3, "ms", "report's server"),
        Row("processor per further viewer", further(ours) * 1e3, further(report) * 1e3, "ms/s", "report's server"),
        Row("pictures/s at 16 viewers", ours[16].pictures, report[16].pictures, "1/s", "report's server"),
        Row("age at a viewer of 600 kB/s, p50", age, report_age, "s", "report's server"),
        *crowd,
    ]


def write_video(path: Path) -> str:
    """A textured picture that moves, 640x480, three seconds, motion JPEG as webcams deliver it."""
    texture = np.random.default_rng(1).integers(60, 190, (48, 64, 3), np.uint8)
    texture = cv2.resize(texture, (640, 480), interpolation=cv2.INTER_CUBIC)
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), RATE, (640, 480))
    for number in range(90):
        writer.write(np.roll(texture, 7 * number, axis=1))
    writer.release()
    return str(path)


@contextlib.contextmanager
def server(kind: str, video: str) -> Iterator[tuple[int, int]]:
    """Port and process id of a running server."""
    program = Path(__file__).with_name("media") / "mjpeg_servers.py"
    process = processes.start(
        [sys.executable, str(program), kind, video], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )
    try:
        yield int(process.stdout.readline()), process.pid
    finally:
        processes.end(process)
        process.stdout.close()


def load(port: int, pid: int, viewers: int) -> Load:
    with Audience(port, quick=viewers) as audience:
        audience.watch(WARM_UP)
        before = cpu_seconds(pid)
        audience.watch(SECONDS)
        cores = (cpu_seconds(pid) - before) / SECONDS
        return Load(sum(viewer.pictures for viewer in audience.quick) / SECONDS, cores)


def further(loads: dict[int, Load]) -> float:
    few, many = sorted(loads)
    return (loads[many].cores - loads[few].cores) / (many - few)


def throttled_age(port: int) -> float:
    with Audience(port, throttled=(THROTTLED,)) as audience:
        audience.watch(12.0)  # buffers fill
        audience.watch(SECONDS)
        return percentile(audience.throttled[0].ages, 50)


def crowd_rows(port: int, pid: int) -> list[Row]:
    """60 viewers, and 4 more that have stalled."""
    with Audience(port, quick=60, stalled=4) as audience:
        audience.watch(WARM_UP)
        memory = [resident(pid)]
        begin, busy = time.monotonic(), cpu_seconds(pid)
        counts, ages = np.zeros(60), []
        for _ in range(PARTS):
            audience.watch(CROWD_SECONDS / PARTS)
            memory.append(resident(pid))
            counts += [viewer.pictures for viewer in audience.quick]
            ages += [age for viewer in audience.quick for age in viewer.ages]
        cores = (cpu_seconds(pid) - busy) / (time.monotonic() - begin)
    counts /= CROWD_SECONDS
    span = f"{CROWD_SECONDS:.0f} s"
    return [
        Row("pictures/s to 60 viewers, 4 more stalled", counts.sum(), 60 * RATE, "1/s", "all pictures of the source"),
        Row("pictures/s to the worst of them", counts.min(), RATE, "1/s", "all pictures of the source"),
        Row("age at a viewer among them, p50", percentile(ages, 50) * 1e3, 1e3 / RATE, "ms", "one period"),
        Row("processor of the server meanwhile", cores, 1.0, "cores", "one core"),
        Row(f"memory grown in {span}", (memory[-1] - memory[0]) / 1e6, memory[0] / 1e6, "MB", "memory before"),
        Row(f"memory, most within {span}", max(memory) / 1e6, memory[0] / 1e6, "MB", "memory before"),
    ]


def cpu_seconds(pid: int) -> float:
    user, system = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[11:13]
    return (int(user) + int(system)) / _TICK


def resident(pid: int) -> int:
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
