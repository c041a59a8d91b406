"""What is known of a JPEG file before it is decoded."""

import itertools

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from telepresence.video.jpeg import decode_jpeg, encode_jpeg
from telepresence.video.jpeg_header import MAX_PIXELS, MAX_SCANS, JpegHeader, check_jpeg

PIXELS = cv2.GaussianBlur(np.random.default_rng(3).integers(0, 255, (48, 64, 3), np.uint8), (5, 5), 2)
FILE = encode_jpeg(PIXELS)
FRAME = FILE.find(b"\xff\xc0")
SCAN = FILE.find(b"\xff\xda")


def made(*options, pixels=PIXELS):
    return cv2.imencode(".jpg", pixels, options)[1].tobytes()


@pytest.mark.parametrize(
    ("data", "components"),
    [
        (FILE, 3),
        (made(pixels=PIXELS[:, :, 0]), 1),
        (made(cv2.IMWRITE_JPEG_PROGRESSIVE, 1), 3),
        (made(cv2.IMWRITE_JPEG_OPTIMIZE, 1, cv2.IMWRITE_JPEG_QUALITY, 1), 3),
        (made(cv2.IMWRITE_JPEG_RST_INTERVAL, 2), 3),
        (made(cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444), 3),
        (FILE[:2] + b"\xff\xff\xff\xfe\x00\x04hi" + FILE[2:], 3),
        (FILE + bytes(100), 3),
    ],
    ids=["baseline", "grey", "progressive", "coarse", "restarts", "444", "comment_behind_fill_bytes", "padded"],
)
def test_what_cameras_send_is_let_through_and_decoded(data, components):
    assert check_jpeg(data) == JpegHeader(64, 48, components)
    assert decode_jpeg(data).shape == (48, 64, 3)
    assert decode_jpeg(data, grey=True).shape == (48, 64)


def test_the_largest_pictures_of_one_colour_pass():
    flat = np.zeros((2160, 3840, 3), np.uint8)
    assert check_jpeg(made(cv2.IMWRITE_JPEG_QUALITY, 1, cv2.IMWRITE_JPEG_OPTIMIZE, 1, pixels=flat)).width == 3840


def changed(at, *values):
    return FILE[:at] + bytes(values) + FILE[at + len(values) :]


@pytest.mark.parametrize(
    ("data", "complaint"),
    [
        (b"", "no JPEG"),
        (b"\x89PNG\r\n\x1a\n" + FILE, "no JPEG"),
        (b"\xff\xd8\xff\xe0ftypavif" + FILE[12:], "no JPEG"),
        (changed(FRAME + 5, 0x7D, 0x00, 0x7D, 0x00), f"32000x32000 pixels; {MAX_PIXELS}"),
        (changed(FRAME + 5, 0x08, 0x00, 0x0F, 0x00), "too few for so many"),
        (changed(FRAME + 5, 0, 0), "64x0"),
        (changed(FRAME + 4, 12), "of 12 bits"),
        (changed(FRAME + 9, 4), "damaged frame"),
        (changed(FRAME + 11, 0x51), "sampling"),
        (changed(FRAME + 1, 0xC9), "0xc9"),
        (changed(FRAME + 2, 0xFF), "damaged headers"),
        (changed(FRAME, 0), "damaged headers"),
        (FILE[:FRAME] + FILE[FRAME : FRAME + 19] * 2 + FILE[FRAME + 19 :], "two frames"),
        (FILE[:FRAME] + FILE[FRAME + 19 :], "without a frame"),
        (FILE[:2] + b"\xff\xfe\x00\x02" * 300 + FILE[2:], "more than 200 headers"),
        (FILE[:SCAN], "damaged headers"),
        (changed(SCAN + 4, 1)[:-2] + b"\xff\xda" * MAX_SCANS + b"\xff\xd9", f"{MAX_SCANS + 1} scans"),
        (bytes(1 << 25), "no JPEG"),
        (FILE + bytes(1 << 24), "bytes"),
    ],
    ids=itertools.count(),
)
def test_what_no_camera_sends_is_refused_with_a_reason(data, complaint):
    with pytest.raises(ValueError, match=complaint):
        check_jpeg(data)
    with pytest.raises(ValueError, match=complaint):
        decode_jpeg(data)


def test_what_breaks_off_is_refused():
    with pytest.raises(ValueError, match="breaks off"):
        decode_jpeg(FILE[: SCAN + 200])


@given(st.lists(st.tuples(st.integers(0, len(FILE) - 1), st.integers(0, 255)), max_size=8), st.integers(0, len(FILE)))
def test_no_damage_does_more_than_that(changes, length):
    data = bytearray(FILE)
    for at, value in changes:
        data[at] = value
    try:
        header = check_jpeg(bytes(data[:length]))
        assert decode_jpeg(bytes(data[:length])).shape == (header.height, header.width, 3)
    except ValueError as error:
        assert str(error).isprintable()
