"""The camera of this machine, unplugged and frozen: OpenCV on a Video4Linux device that a preloaded library plays."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest

FILM = """
import json, sys, threading
import cv2, numpy
from telepresence_1.camera import Camera
with Camera(sys.argv[1]) as camera:
    sequence = 0
    while (picture := camera.image.wait_newer(sequence, 10.0)):
        sequence = picture.sequence
        pixels = cv2.imdecode(numpy.frombuffer(picture.content, numpy.uint8), cv2.IMREAD_GRAYSCALE)
        status = camera.status
        print(json.dumps([status.state.value, status.text, int(pixels[240, 320]), len(picture.content)]), flush=True)
"""
DEVICE = "/dev/video42"


class Device:
    """`state` as fake_v4l2.c has it; `next()` is what the camera program shows then."""

    def __init__(self, folder: Path, **environment: str) -> None:
        library = folder / "fake_v4l2.so"
        source = Path(__file__).with_name("fake_v4l2.c")
        subprocess.run(["cc", "-shared", "-fPIC", "-o", library, source, "-ldl"], check=True)
        self._state = folder / "state"
        self.set("gone")
        self._process = subprocess.Popen(
            [sys.executable, "-c", FILM, DEVICE],
            env={
                **os.environ,
                "PYTHONPATH": os.pathsep.join(sys.path),
                "LD_PRELOAD": str(library),
                "FAKE_CAMERA": DEVICE,
                "FAKE_CAMERA_STATE": str(self._state),
                **environment,
            },
            stdout=subprocess.PIPE,
            text=True,
        )

    def set(self, state: object) -> None:
        beside = self._state.with_suffix(".new")
        beside.write_text(str(state))
        beside.rename(self._state)

    def next(self) -> tuple[str, str, int, int]:
        line = self._process.stdout.readline()
        assert line, "the program has ended, or no picture came for ten seconds"
        return tuple(json.loads(line))

    def close(self) -> None:
        self._process.kill()
        self._process.communicate()


@pytest.fixture
def device(tmp_path: Path) -> Iterator[Device]:
    device = Device(tmp_path)
    yield device
    device.close()


def test_a_device_that_is_unplugged_freezes_and_returns(device: Device, wait_until: Callable) -> None:
    state, text, *_ = wait_until(lambda: _shown(device, "lost"), "there is no camera")
    assert (state, text) == ("lost", f"There is no camera at {DEVICE}. Plug one in, and it will be found.")
    for level, fault in ((100, "gone"), (180, "frozen"), (40, "gone")):
        device.set(level)
        wait_until(lambda level=level: _shown(device, "live", level), f"the camera films {level}")
        device.set(fault)
        _, text, *_ = wait_until(lambda: _shown(device, "lost"), f"the camera is {fault}")
        assert DEVICE in text


@pytest.mark.parametrize("tables", [True, False])
def test_what_the_camera_has_encoded_is_passed_on(tmp_path: Path, wait_until: Callable, tables: bool) -> None:
    noise = np.random.default_rng(1).integers(0, 255, (480, 640, 3), np.uint8)
    noise[200:280, 280:360] = 77
    encoded = cv2.imencode(".jpg", noise, (cv2.IMWRITE_JPEG_QUALITY, 20))[1].tobytes()
    assert len(encoded) < 100_000
    filmed = tmp_path / "filmed.jpg"
    filmed.write_bytes((encoded if tables else without_huffman_tables(encoded)) + bytes(100))
    device = Device(tmp_path, FAKE_CAMERA_JPEG=str(filmed))
    try:
        device.set(1)
        *_, pixel, size = wait_until(lambda: _shown(device, "live"), "the camera films")
        assert abs(pixel - 77) < 5 and size == len(encoded)
    finally:
        device.close()


def without_huffman_tables(jpeg: bytes) -> bytes:
    """Drop the Huffman tables, as many webcams do."""
    while (at := jpeg.find(b"\xff\xc4")) > 0:
        jpeg = jpeg[:at] + jpeg[at + 2 + int.from_bytes(jpeg[at + 2 : at + 4], "big") :]
    return jpeg


def _shown(device: Device, state: str, level: int | None = None) -> tuple[str, str, int, int] | None:
    """What it shows next, if that is this state and a picture of this level (YUV: 16..235 stand for 0..255)."""
    seen = device.next()
    filmed = level is None or abs(seen[2] - (level - 16) * 255 / 219) < 4
    return seen if seen[0] == state and filmed else None
