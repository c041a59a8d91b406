"""The link to the tablet over real qi sockets: with a service that records, and with the simulated robot's own."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from urllib.parse import parse_qs, urlsplit

import pytest
from naoqi_driver.connection import Address, Connection
from telepresence_1 import tablet_link
from telepresence_1.tablet_link import TabletLink, public, with_changing_query

from pepper_sim.naoqi.publish import qi_object
from pepper_sim.services.al_tablet_service import ALTabletService
from pepper_sim.tablet.tablet import Tablet


class Recorder:
    """An ALTabletService that remembers its calls."""

    def __init__(self) -> None:
        self.calls: list[tuple[str, ...]] = []
        self.ready = True
        self.wifi = "CONNECTED"

    def getWifiStatus(self) -> str:
        return self.wifi

    def loadUrl(self, url: str) -> bool:
        self.calls.append(("loadUrl", url))
        return self.ready

    def showWebview(self) -> bool:
        self.calls.append(("showWebview",))
        return True

    def hideWebview(self) -> bool:
        self.calls.append(("hideWebview",))
        return True

    def names(self) -> list[str]:
        return [call[0] for call in self.calls]


@pytest.fixture
def recorder(naoqi) -> Recorder:
    recorder = Recorder()
    naoqi.register("ALTabletService", recorder)
    return recorder


@pytest.fixture
def show(naoqi, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., TabletLink]]:
    monkeypatch.setattr(tablet_link, "FIRST_PAUSE", 0.05)
    opened: list[Connection | TabletLink] = []

    def show(url: str, port: int | None = None) -> TabletLink:
        connection = Connection(Address.parse("127.0.0.1", port or naoqi.port)).start()
        link = TabletLink(connection, url).start()
        opened.extend((connection, link))
        return link

    yield show
    for part in reversed(opened):
        part.close()


def test_shows_the_page_and_takes_it_away(recorder: Recorder, show: Callable, wait_until: Callable) -> None:
    link = show("http://10.0.0.2:10002/?k=secret")
    wait_until(lambda: link.shown_since, "the page is shown")
    url = urlsplit(recorder.calls[0][1])
    assert url.netloc == "10.0.0.2:10002" and parse_qs(url.query)["k"] == ["secret"] and "t" in parse_qs(url.query)
    assert recorder.names() == ["loadUrl", "showWebview"]
    link.close()
    assert recorder.names() == ["loadUrl", "showWebview", "hideWebview"]


def test_shows_it_again_after_a_lost_link(
    naoqi, recorder: Recorder, make_connection: Callable, show: Callable, wait_until: Callable
) -> None:
    wire = make_connection(naoqi.port)
    link = show("http://10.0.0.2:10002/", wire.port)
    wait_until(lambda: link.shown_since, "the page is shown")
    wire.cut()
    wait_until(lambda: recorder.names() == ["loadUrl", "showWebview"] * 2, "it is shown again")
    assert recorder.calls[0] != recorder.calls[2], "the query has to change, the web view caches"


def test_a_tablet_that_is_not_ready_is_asked_again(
    recorder: Recorder, show: Callable, wait_until: Callable, caplog: pytest.LogCaptureFixture
) -> None:
    recorder.ready = False
    with caplog.at_level(logging.WARNING):
        link = show("http://10.0.0.2:10002/")
        wait_until(lambda: len(recorder.calls) >= 3, "several attempts")
        assert link.shown_since is None and "not ready" in link.problem
        recorder.ready = True
        wait_until(lambda: link.shown_since, "the page is shown")
    assert caplog.text.count("not ready") == 1, "said once, not at every attempt"
    assert link.problem == ""


def test_a_robot_without_tablet_is_reported_once(
    naoqi, show: Callable, wait_until: Callable, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.WARNING):
        link = show("http://10.0.0.2:10002/")
        wait_until(lambda: "ALTabletService" in link.problem, "the problem is named")
    assert caplog.text.count("does not show the page") == 1


def test_a_tablet_without_wifi_is_warned_about(
    recorder: Recorder, show: Callable, wait_until: Callable, caplog: pytest.LogCaptureFixture
) -> None:
    recorder.wifi = "DISCONNECTED"
    with caplog.at_level(logging.WARNING):
        link = show("http://10.0.0.2:10002/?k=secret")
        wait_until(lambda: link.shown_since, "the page is shown all the same")
    assert "Wi-Fi is DISCONNECTED" in caplog.text
    assert "secret" not in caplog.text, "the key does not belong in a log"


def test_closing_does_not_wait_for_a_robot_that_is_gone(show: Callable, free_port: Callable) -> None:
    link = show("http://10.0.0.2:10002/", free_port())
    link.close()
    assert link.shown_since is None and link.problem


def test_the_simulated_robots_tablet_shows_the_pilot(
    naoqi, show: Callable, open_page: Callable, jpeg: Callable, wait_until: Callable
) -> None:
    """Page, qi, ALTabletService, web view: everything between the camera and the glass."""
    page = open_page(token="secret")
    page.image.put(jpeg((0, 0, 200)))
    with Tablet() as tablet:
        naoqi.register("ALTabletService", qi_object(ALTabletService(tablet)))
        link = show(f"{page.server.url}?k=secret")
        wait_until(lambda: blue_on(tablet), "the picture")
        link.close()
        wait_until(lambda: not tablet.image.peek().pixels.any(), "the screen turns dark")


def blue_on(tablet: Tablet) -> bool:
    picture = tablet.image.peek()
    return picture is not None and abs(picture.pixels[200, 320].astype(int) - (0, 0, 200)).max() < 15


def test_the_query_changes_and_keeps_what_was_there() -> None:
    url = with_changing_query("http://10.0.0.2:10002?k=a%26b")
    assert url.startswith("http://10.0.0.2:10002/?k=a%26b&t=")
    assert public(url) == "http://10.0.0.2:10002/"
