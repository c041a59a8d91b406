from __future__ import annotations

import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from telepresence.video import images
from telepresence.video.images import ENCODINGS, LatestImage, fill_image_message, read_image_message


def test_there_is_no_picture_at_first() -> None:
    image = LatestImage()
    assert image.peek() is None
    assert image.age() == float("inf")
    assert image.wait_newer(0, timeout=0.01) is None


def test_a_reader_gets_the_newest_picture_only() -> None:
    image = LatestImage()
    for number in range(5):
        image.put(number, stamp=100.0 + number)
    picture = image.wait_newer(0, timeout=1.0)
    assert (picture.content, picture.stamp, picture.sequence) == (4, 104.0, 5)
    assert image.wait_newer(5, timeout=0.01) is None


def test_the_age_counts_from_the_arrival_here(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 100.0
    monkeypatch.setattr(images, "time", SimpleNamespace(time=time.time, monotonic=lambda: now))
    image = LatestImage()
    image.put("old", stamp=3.0)
    assert image.age() == 0.0
    now += 0.02
    assert image.age() == pytest.approx(0.02)


def test_a_forgotten_picture_is_none_and_the_next_one_is_new() -> None:
    image = LatestImage()
    image.put("a")
    image.forget()
    assert image.peek() is None and image.age() == float("inf") and image.wait_newer(0, timeout=0.01) is None
    image.put("b")
    assert image.wait_newer(1, timeout=1.0).content == "b", "its number is none that a reader has had"


def test_a_reader_begins_with_a_picture_that_is_old_by_neither_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 100.0
    monkeypatch.setattr(images, "time", SimpleNamespace(time=time.time, monotonic=lambda: now))
    image = LatestImage()
    assert image.begin(1.0) == 0, "there is none"
    image.put("a")
    assert image.begin(1.0) == 0
    now += 1.1
    assert image.begin(1.0) == 1, "it came long ago"
    image.put("b", stamp=time.time() - 3600.0)
    assert image.begin(1.0) == 2, "it was taken long ago"


def test_the_stamp_is_the_time_of_putting_unless_given() -> None:
    image = LatestImage()
    before = time.time()
    image.put("a")
    assert before <= image.peek().stamp <= time.time()


def test_put_wakes_every_reader() -> None:
    image = LatestImage()
    seen: list[object] = []
    ready = threading.Barrier(9)

    def read() -> None:
        ready.wait()
        seen.append(image.wait_newer(0, timeout=10.0))

    readers = [threading.Thread(target=read) for _ in range(8)]
    for reader in readers:
        reader.start()
    ready.wait()
    image.put("x")
    for reader in readers:
        reader.join()
    assert [picture.content for picture in seen] == ["x"] * 8


def test_writers_from_several_threads_lose_no_number() -> None:
    image = LatestImage()
    writers = [threading.Thread(target=lambda: [image.put(0) for _ in range(500)]) for _ in range(4)]
    for writer in writers:
        writer.start()
    for writer in writers:
        writer.join()
    assert image.peek().sequence == 2000


def test_listeners_hear_each_put_until_removed() -> None:
    image, heard = LatestImage(), []

    def listener() -> None:
        heard.append(image.peek().content)

    image.add_listener(listener)
    image.put(1)
    image.put(2)
    image.remove_listener(listener)
    image.put(3)
    assert heard == [1, 2]


@given(
    encoding=st.sampled_from(sorted(ENCODINGS)),
    height=st.integers(1, 12),
    width=st.integers(1, 12),
    padding=st.integers(0, 9),
    big_endian=st.booleans(),
    seed=st.integers(0, 2**32 - 1),
)
def test_every_encoding_survives_the_way_there_and_back(
    encoding: str, height: int, width: int, padding: int, big_endian: bool, seed: int
) -> None:
    kind, channels = ENCODINGS[encoding]
    shape = (height, width, channels) if channels > 1 else (height, width)
    pixels = np.random.default_rng(seed).integers(0, 255, shape).astype(kind)
    message = fill_image_message(SimpleNamespace(), pixels, encoding)
    assert message.step == width * channels * np.dtype(kind).itemsize
    assert (read_image_message(message) == pixels).all()

    order = ">" if big_endian else "<"
    swapped = pixels.astype(np.dtype(kind).newbyteorder(order)).reshape(height, width * channels)
    rows = np.ascontiguousarray(swapped).view(np.uint8).reshape(height, -1)
    message.is_bigendian = int(big_endian)
    message.data = np.pad(rows, ((0, 0), (0, padding))).tobytes()
    message.step += padding
    read = read_image_message(message)
    assert read.shape == shape and (read == pixels).all()


def test_a_slice_of_a_picture_is_packed() -> None:
    pixels = np.arange(4 * 6 * 3, dtype=np.uint8).reshape(4, 6, 3)
    message = fill_image_message(SimpleNamespace(), pixels[::2, ::-1], "rgb8")
    assert (read_image_message(message) == pixels[::2, ::-1]).all()


@pytest.mark.parametrize(
    ("pixels", "encoding", "complaint"),
    [
        (np.zeros((2, 2, 3), np.uint8), "yuv422", "known: rgb8"),
        (np.zeros((2, 2, 4), np.uint8), "rgb8", r"needs 3 channel\(s\)"),
        (np.zeros((2, 2), np.float32), "mono8", "holds uint8, the array holds float32"),
        (np.zeros(4, np.uint8), "mono8", r"shape \(4,\)"),
    ],
)
def test_refuses_what_does_not_fit_and_says_why(pixels: np.ndarray, encoding: str, complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        fill_image_message(SimpleNamespace(), pixels, encoding)


@pytest.mark.parametrize(("step", "size"), [(5, 100), (6, 11)])
def test_refuses_a_message_that_promises_more_than_it_holds(step: int, size: int) -> None:
    message = SimpleNamespace(encoding="rgb8", height=2, width=2, step=step, is_bigendian=0, data=bytes(size))
    with pytest.raises(ValueError, match="2x2 rgb8 needs step >= 6"):
        read_image_message(message)
