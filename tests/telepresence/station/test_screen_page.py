"""The window's picture in a browser where there is no screen."""

import urllib.request

import cv2
import numpy as np
import pytest

from telepresence.station.screen_page import create_app
from telepresence.video.images import LatestImage
from telepresence.video.mjpeg import MjpegStream
from telepresence.web.page_auth import make_token
from telepresence.web.server import WebServer

KEY = make_token()


@pytest.fixture
def image():
    return LatestImage()


@pytest.fixture
def url(image):
    with WebServer(create_app(MjpegStream(image), KEY)) as server:
        yield server.url


def test_the_page_holds_the_picture(url):
    browser = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
    with browser.open(f"{url}?k={KEY}", timeout=10) as page:
        assert KEY not in page.url
        assert b'<img src="screen.mjpeg"' in page.read()


def test_the_picture_is_the_newest_screen(url, image):
    image.put(cv2.imencode(".jpg", np.full((60, 80, 3), (0, 128, 255), np.uint8))[1].tobytes())
    with urllib.request.urlopen(f"{url}screen.mjpeg?k={KEY}", timeout=10) as stream:
        received = b""
        while received.count(b"--frame") < 2:
            received += stream.read1(65536)
    jpeg = received[received.index(b"\xff\xd8") : received.rindex(b"\xff\xd9") + 2]
    pixels = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)
    assert np.abs(pixels[30, 40].astype(int) - (0, 128, 255)).max() < 8
