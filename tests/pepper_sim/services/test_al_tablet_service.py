"""ALTabletService over the wire, with a page that is really served."""

import http.server
import threading
import time
from pathlib import PurePosixPath

import cv2
import numpy as np
import pytest
from PIL import Image

from pepper_sim.disk import APPS

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
def tablet(naoqi, simulation, wait_until):
    service = naoqi.ALTabletService
    service.hide()
    wait_until(lambda: _brightest(simulation) == 0, "what an earlier test has shown is gone")
    yield service
    service.hide()


def _colour(simulation):
    picture = simulation.tablet.image.peek()
    return None if picture is None else tuple(int(v) for v in np.median(picture.content.reshape(-1, 3), axis=0))


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
    assert tablet.playVideo("no address") is False and tablet.getVideoLength() == tablet.getVideoPosition() == -1
    assert tablet.pauseVideo() is tablet.resumeVideo() is tablet.stopVideo() is False
    assert tablet.setVolume(10) is False and tablet.robotIp() == "198.18.0.1"
    assert tablet.loadApplication("app") is False
    tablet.executeJS("1+1")
    tablet.reloadPage(True)
    assert "brightness" in refused(tablet.setBrightness, 2.0)
    assert "security" in refused(tablet.configureWifi, "magic", "home", "secret")
    assert "volume" in refused(tablet.setVolume, 99)
    tablet.setBrightness(1.0)


@pytest.fixture
def application(simulation):
    """Folder of the page of the application "film" on the robot's disk."""
    folder = simulation.server.catalogue.disk.path(str(PurePosixPath(APPS, "film", "html")))
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def test_the_robots_own_web_server_has_the_pages_of_applications(tablet, application, simulation, wait_until):
    cv2.imwrite(str(application / "orange.png"), np.full((40, 64, 3), ORANGE[::-1], np.uint8))
    (application / "index.html").write_text("<img src=orange.png>")
    assert tablet.loadApplication("film") is True and tablet.loadApplication("none") is False
    tablet.showWebview()
    wait_until(lambda: _near(_colour(simulation), ORANGE), "the page's picture is on the screen")
    tablet.hideWebview()
    assert tablet.showImage(f"http://{tablet.robotIp()}/apps/film/orange.png") is True
    wait_until(lambda: _near(_colour(simulation), ORANGE), "the picture is on the screen")
    errors = []
    tablet.onLoadPageError.connect(lambda code, text, url: errors.append(url))
    tablet.onPageFinished.connect(lambda: errors.append("a page says that there is none"))
    tablet.loadUrl(f"http://{tablet.robotIp()}/apps/film/../../../../../etc/passwd")
    wait_until(lambda: errors, "the address was looked for")
    assert errors == ["a page says that there is none"]


def test_a_video_plays_pauses_and_ends(tablet, application, simulation, wait_until):
    writer = cv2.VideoWriter(str(application / "film.avi"), cv2.VideoWriter.fourcc(*"MJPG"), 10, (64, 40))
    for _ in range(12):
        writer.write(np.full((40, 64, 3), ORANGE[::-1], np.uint8))
    writer.release()
    seen = []
    tablet.videoStarted.connect(lambda: seen.append("started"))
    tablet.videoFinished.connect(lambda: seen.append("finished"))
    assert tablet.playVideo("http://198.18.0.1/apps/film/film.avi") is True
    wait_until(lambda: _near(_colour(simulation), ORANGE), "the video is on the screen")
    assert tablet.pauseVideo() is True
    assert tablet.getVideoLength() == 1200 and 0 < tablet.getVideoPosition() < 1200
    assert seen == ["started"] and tablet.resumeVideo() is True
    wait_until(lambda: "finished" in seen, "it has ended")
    wait_until(lambda: not _near(_colour(simulation), ORANGE), "the screen is dark again")
    (application / "list.m3u8").write_text("#EXTM3U\nfilm.avi\n")
    assert tablet.playVideo("http://198.18.0.1/apps/film/list.m3u8") is True
    wait_until(lambda: tablet.stopVideo() is False, "what is no video was put away")
    assert seen == ["started", "finished"]


def test_a_question_is_answered_by_a_person(tablet, simulation, wait_until):
    answers = []
    tablet.onInputText.connect(lambda validation, text: answers.append((validation, text)))
    tablet.showInputTextDialog("What is your name?", "ok", "cancel")
    wait_until(lambda: _brightest(simulation) == 255, "the question is on the screen")
    simulation.tablet.answer(True, "Ada")
    wait_until(lambda: answers == [(1, "Ada")], "the answer has come")
    tablet.showInputDialog("text", "Which one?", "ok", "cancel")
    tablet.hideDialog()
    simulation.tablet.answer(True, "too late")
    wait_until(lambda: _brightest(simulation) == 0, "the screen is dark again")
    assert answers == [(1, "Ada")]


def test_the_screen_is_dimmed_covered_and_put_to_sleep(tablet, pages, simulation, wait_until):
    tablet.showImage(pages + "/picture.png")
    wait_until(lambda: _near(_colour(simulation), ORANGE), "the picture is on the screen")
    tablet.setBrightness(0.0)
    wait_until(lambda: _near(_colour(simulation), [part // 4 for part in ORANGE]), "it is dimmed")
    tablet.setBrightness(1.0)
    tablet.goToSleep()
    wait_until(lambda: _brightest(simulation) == 0, "it sleeps")
    tablet.wakeUp()
    wait_until(lambda: _near(_colour(simulation), ORANGE), "it shows what it showed")
    tablet.showAlertView(1.0, "#0000FF", 3000)
    wait_until(lambda: _near(_colour(simulation), (0, 0, 255)), "it is covered")
    wait_until(lambda: _near(_colour(simulation), ORANGE), "the cover is gone after its time")


def _brightest(simulation):
    picture = simulation.tablet.image.peek()
    return 0 if picture is None else int(picture.content.max())


def test_an_animated_picture_moves_until_it_is_paused(tablet, application, simulation, wait_until):
    frames = [Image.new("RGB", (64, 40), colour) for colour in (ORANGE, (0, 0, 255))]
    frames[0].save(application / "two.gif", save_all=True, append_images=frames[1:], duration=100, loop=0)
    assert tablet.showImage("http://198.18.0.1/apps/film/two.gif") is True
    for colour in (ORANGE, (0, 0, 255), ORANGE):
        wait_until(lambda colour=colour: _near(_colour(simulation), colour), "it shows one picture after the other")
    tablet.pauseGif()
    wait_until(lambda: _changes(simulation) == 0, "it stands still")
    tablet.resumeGif()
    wait_until(lambda: _changes(simulation) > 1, "it moves again")


def _changes(simulation):
    """How often the screen changes in three periods of the animated picture."""
    before = simulation.tablet.image.peek().sequence
    time.sleep(0.3)
    return simulation.tablet.image.peek().sequence - before
