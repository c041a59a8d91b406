"""ALTabletService over the wire, with a page that is really served."""

import http.server
import threading

import cv2
import numpy as np
import pytest

ORANGE = (255, 140, 0)


class _Pages(http.server.BaseHTTPRequestHandler):
    def do_GET(self):
        if self.path.startswith("/picture"):
            pixels = np.full((100, 160, 3), ORANGE[::-1], np.uint8)
            body, kind = cv2.imencode(".png", pixels)[1].tobytes(), "image/png"
        elif self.path == "/":
            body, kind = b"<html><body><img src='/picture.png'></body></html>", "text/html"
        else:
            self.send_error(404)
            return
        self.send_response(200)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_):
        """Quiet."""


@pytest.fixture
def pages():
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), _Pages)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    yield f"http://127.0.0.1:{server.server_address[1]}"
    server.shutdown()
    server.server_close()
    thread.join()


@pytest.fixture
def tablet(naoqi):
    service = naoqi.ALTabletService
    yield service
    service.hide()


def _colour(simulation):
    picture = simulation.tablet.image.peek()
    return None if picture is None else tuple(int(v) for v in np.median(picture.pixels.reshape(-1, 3), axis=0))


def _near(colour, wanted):
    return colour is not None and all(abs(a - b) < 12 for a, b in zip(colour, wanted, strict=True))


def test_a_page_is_fetched_and_shown(tablet, pages, simulation, wait_until):
    finished = []
    tablet.onPageFinished.connect(lambda: finished.append(True))
    assert tablet.loadUrl(pages + "/") is True
    assert tablet.showWebview() is True
    wait_until(lambda: finished, "the page was reported as finished")
    wait_until(lambda: _near(_colour(simulation), ORANGE), "the page's picture is on the screen")
    assert simulation.tablet.visible
    assert tablet.getOnTouchScaleFactor() == pytest.approx(1.34), "of the web view"
    assert tablet.hideWebview() is True
    assert tablet.getOnTouchScaleFactor() == 1.0, "of every other view"
    wait_until(lambda: not _near(_colour(simulation), ORANGE), "the screen is dark again")


def test_a_server_that_does_not_answer_is_reported(tablet, free_port, wait_until):
    errors = []
    tablet.onLoadPageError.connect(lambda code, text, url: errors.append((code, text, url)))
    address = f"http://127.0.0.1:{free_port()}/page"
    assert tablet.showWebview(address) is True
    wait_until(lambda: errors, "the error was reported")
    code, text, url = errors[0]
    assert code < 0 and text and url == address


def test_pictures_are_shown_over_the_page(tablet, pages, simulation, wait_until):
    assert tablet.showImage(pages + "/picture.png") is True
    wait_until(lambda: _near(_colour(simulation), ORANGE), "the picture is on the screen")
    tablet.hideImage()
    wait_until(lambda: not _near(_colour(simulation), ORANGE), "the picture is gone")
    assert tablet.setBackgroundColor("#102030") is True and tablet.setBackgroundColor("blue") is False


def test_addresses_that_are_none_answer_false(tablet):
    for address in ("", "file:///etc/passwd", "not an address", "ftp://127.0.0.1/x"):
        assert tablet.loadUrl(address) is False
        assert tablet.showImage(address) is False


def test_what_an_android_box_would_add(tablet, refused):
    assert tablet.getWifiStatus() == "CONNECTED"
    changes = []
    tablet.onWifiStatusChange.connect(changes.append)
    tablet.disableWifi()
    assert tablet.getWifiStatus() == "DISCONNECTED"
    tablet.enableWifi()
    assert tablet.connectWifi("home") and tablet.configureWifi("wpa", "home", "secret")
    tablet.setOnTouchWebviewScaleFactor(1.0)
    tablet.setOnTouchWebviewScaleFactor(1.34)
    assert tablet.setBrightness(0.5) and tablet.getBrightness() == pytest.approx(0.5)
    assert tablet.playVideo("http://127.0.0.1/v.mp4") is False and tablet.getVideoLength() == -1
    assert tablet.setVolume(10) is False and tablet.robotIp() == "198.18.0.1"
    assert tablet.loadApplication("app") is False
    tablet.executeJS("1+1")
    tablet.showInputTextDialog("Name?", "ok", "cancel")
    tablet.reloadPage(True)
    assert "brightness" in refused(tablet.setBrightness, 2.0)
    assert "security" in refused(tablet.configureWifi, "magic", "home", "secret")
    assert "volume" in refused(tablet.setVolume, 99)
    tablet.setBrightness(1.0)
