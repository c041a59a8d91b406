"""The link to the tablet over real qi sockets: with a service that records, and with the simulated robot's own."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from urllib.parse import parse_qs, urlsplit

import pytest
from naoqi_driver.connection import Address, Connection
from tablet_robot import tablet_robot
from telepresence_1 import robot_focus, tablet_link
from telepresence_1.retry import CALM, Retry
from telepresence_1.robot_focus import ACTIVITY
from telepresence_1.tablet_link import TabletLink, public, with_changing_query

from pepper_sim.tablet.tablet import Tablet


class Recorder:
    """An ALTabletService that remembers its calls; the page is on its screen while `shown`."""

    def __init__(self) -> None:
        self.calls: list[tuple[str, ...]] = []
        self.ready = True
        self.wifi = "CONNECTED"
        self.shown = False
        self.obeys = self.hides = True

    def getOnTouchScaleFactor(self) -> float:
        return 1.34 if self.shown else 1.0

    def getWifiStatus(self) -> str:
        return self.wifi

    def loadUrl(self, url: str) -> bool:
        self.calls.append(("loadUrl", url))
        return self.ready

    def showWebview(self) -> bool:
        self.calls.append(("showWebview",))
        self.shown = self.obeys
        return True

    def hideWebview(self) -> bool:
        self.calls.append(("hideWebview",))
        if not self.hides:
            raise RuntimeError("the tablet is asleep")
        self.shown = False
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
    monkeypatch.setattr(tablet_link, "CHECK_PERIOD", 0.05)
    monkeypatch.setattr(robot_focus, "FIRST_PAUSE", 0.05)
    opened: list[Connection | TabletLink] = []

    def show(url: str, port: int | None = None, activity: str = "") -> TabletLink:
        connection = Connection(Address.parse("127.0.0.1", port or naoqi.port)).start()
        link = TabletLink(connection, url, activity=activity).start()
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
    assert recorder.names() == ["loadUrl", "showWebview", "hideWebview", "loadUrl"]
    url = urlsplit(recorder.calls[3][1])
    assert (url.netloc, url.path) == ("10.0.0.2:10002", "/blank") and parse_qs(url.query)["k"] == ["secret"]


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
    with tablet_robot(naoqi) as tablet:
        link = show(f"{page.server.url}?k=secret")
        wait_until(lambda: blue_on(tablet), "the picture")
        link.close()
        wait_until(lambda: not tablet.image.peek().content.any(), "the screen turns dark")
        wait_until(lambda: page.stream.viewers == 0, "the hidden web view has let go of the picture")
        naoqi.session.service("ALTabletService").showWebview()
        wait_until(lambda: tablet.visible, "another program shows the web view")
        assert not blue_on(tablet), "and what it shows is not the pilot"


def test_a_page_that_somebody_hides_is_shown_again(
    naoqi, show: Callable, open_page: Callable, jpeg: Callable, wait_until: Callable
) -> None:
    page = open_page()
    page.image.put(jpeg((0, 0, 200)))
    with tablet_robot(naoqi) as tablet:
        link = show(page.server.url)
        wait_until(lambda: blue_on(tablet), "the picture")
        other = naoqi.session.service("ALTabletService")
        for disturb in (other.hideWebview, lambda: other.showImage(page.server.url + "frame.jpg"), other.hide):
            disturb()
            wait_until(lambda: tablet.visible and link.shown_since, "the page is back")
        wait_until(lambda: blue_on(tablet), "the picture is back")


def test_a_page_that_the_tablet_cannot_load_is_reported_and_loaded_again(
    naoqi, show: Callable, open_page: Callable, jpeg: Callable, free_port: Callable, wait_until: Callable
) -> None:
    port = free_port()
    with tablet_robot(naoqi) as tablet:
        link = show(f"http://127.0.0.1:{port}/?k=secret")
        wait_until(lambda: "cannot load it: net::ERR_CONNECTION_REFUSED" in link.problem, "the tablet's own words")
        assert link.shown_since is None and "secret" not in link.problem
        page = open_page(port=port)
        page.image.put(jpeg((0, 0, 200)))
        wait_until(lambda: blue_on(tablet) and link.shown_since, "the page is there now")


def test_somebody_who_goes_on_hiding_it_is_not_fought(
    recorder: Recorder, show: Callable, wait_until: Callable, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.WARNING):
        link = show("http://10.0.0.2:10002/")
        wait_until(lambda: link.shown_since, "the page is shown")
        recorder.obeys = recorder.shown = False
        wait_until(lambda: len(recorder.calls) >= 5, "several attempts")
    assert link.shown_since is None and "something else is on the screen" in link.problem
    assert caplog.text.count("something else is on the screen") == 1


def test_attempts_become_rare_and_begin_anew_when_it_was_calm() -> None:
    retry, made = Retry(0.5, 10.0), []
    for tick in range(1000):
        if retry.due(tick / 10):
            made.append(tick / 10)
    assert made[:6] == [0.0, 0.5, 1.5, 3.5, 7.5, 15.5] and made[6:9] == [25.5, 35.5, 45.5]
    assert retry.due(made[-1] + CALM + 1) and retry.due(made[-1] + CALM + 1.5)


def test_it_is_switched_off_and_on(recorder: Recorder, show: Callable, wait_until: Callable) -> None:
    link = show("http://10.0.0.2:10002/")
    wait_until(lambda: link.shown_since, "the page is shown")
    link.show(False)
    wait_until(lambda: not recorder.shown and link.shown_since is None, "the page is taken away")
    assert link.problem == "switched off"
    link.show(True)
    wait_until(lambda: recorder.shown and link.shown_since, "the page is shown")
    assert recorder.names() == ["loadUrl", "showWebview", "hideWebview", "loadUrl", "loadUrl", "showWebview"]


def test_a_page_that_the_tablet_does_not_hide_is_taken_away_later(
    recorder: Recorder, show: Callable, wait_until: Callable
) -> None:
    link = show("http://10.0.0.2:10002/")
    wait_until(lambda: link.shown_since, "the page is shown")
    recorder.hides = False
    link.show(False)
    wait_until(lambda: recorder.names().count("hideWebview") >= 2, "it is tried again")
    assert link.may_be_there
    recorder.hides = True
    wait_until(lambda: not recorder.shown and not link.may_be_there, "the page is taken away")
    recorder.calls.clear()
    link.show(True)
    wait_until(lambda: recorder.shown and link.shown_since, "the page is shown")
    link.show(False)
    wait_until(lambda: not recorder.shown and not link.may_be_there, "and taken away")


def test_a_page_that_is_switched_off_while_the_link_is_lost_is_taken_away_by_the_next(
    naoqi, recorder: Recorder, make_connection: Callable, show: Callable, wait_until: Callable
) -> None:
    wire = make_connection(naoqi.port)
    link = show("http://10.0.0.2:10002/", wire.port)
    wait_until(lambda: link.shown_since, "the page is shown")
    wire.cut()
    link.show(False)
    wait_until(lambda: not recorder.shown and not link.may_be_there, "the page is taken away")


def test_the_focus_is_taken_kept_and_given_back(
    add_life: Callable, recorder: Recorder, show: Callable, wait_until: Callable
) -> None:
    life = add_life(ACTIVITY, "other/dance")
    link = show("http://10.0.0.2:10002/", activity=ACTIVITY)
    wait_until(lambda: link.focus.held and link.shown_since, "shown, in focus")
    life.focus = "other/dance"
    wait_until(lambda: life.focus == ACTIVITY and link.focus.held, "the focus is taken again")
    link.close()
    assert life.focus == "" and not recorder.shown


def test_a_focus_that_somebody_else_holds_at_the_end_stays(
    add_life: Callable, recorder: Recorder, show: Callable, wait_until: Callable, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tablet_link, "CHECK_PERIOD", 60.0)
    life = add_life(ACTIVITY)
    link = show("http://10.0.0.2:10002/", activity=ACTIVITY)
    wait_until(lambda: recorder.shown, "the page is shown")
    life.focus = "other/dance"
    link.close()
    assert life.focus == "other/dance"


def test_without_the_activity_the_page_is_shown_all_the_same(
    add_life: Callable, recorder: Recorder, show: Callable, wait_until: Callable, caplog: pytest.LogCaptureFixture
) -> None:
    add_life("other/dance")
    with caplog.at_level(logging.WARNING):
        link = show("http://10.0.0.2:10002/", activity=ACTIVITY)
        wait_until(lambda: link.shown_since, "the page is shown")
    assert not link.focus.held and f"activity '{ACTIVITY}' is not installed" in link.focus.problem
    assert caplog.text.count("is not installed") == 1


def test_a_robot_whose_life_is_off_needs_no_focus_and_gets_it_when_it_lives(
    add_life: Callable, recorder: Recorder, show: Callable, wait_until: Callable, caplog: pytest.LogCaptureFixture
) -> None:
    life = add_life(ACTIVITY)
    life.state = "disabled"
    with caplog.at_level(logging.INFO):
        link = show("http://10.0.0.2:10002/", activity=ACTIVITY)
        wait_until(lambda: link.shown_since, "the page is shown all the same")
        assert link.focus.problem == "" and not link.focus.held and link.focus.needless
        life.state = "solitary"
        wait_until(lambda: link.focus.held, "the focus is taken once it lives")
        life.state, life.focus = "disabled", ""
        wait_until(lambda: link.focus.needless and not link.focus.held, "life is off again")
    assert caplog.text.count("autonomous life is off") == 2, "said once each time, not at every look"
    assert "without the robot's focus" not in caplog.text and "taking it again" not in caplog.text


def test_no_activity_leaves_the_focus_alone(
    add_life: Callable, recorder: Recorder, show: Callable, wait_until: Callable
) -> None:
    life = add_life(ACTIVITY, "other/dance")
    life.focus = "other/dance"
    link = show("http://10.0.0.2:10002/", activity="none")
    wait_until(lambda: link.shown_since, "the page is shown")
    assert life.focus == "other/dance" and not link.focus.held and not link.focus.problem


def blue_on(tablet: Tablet) -> bool:
    picture = tablet.image.peek()
    return picture is not None and abs(picture.content[200, 320].astype(int) - (0, 0, 200)).max() < 15


def test_the_query_changes_and_keeps_what_was_there() -> None:
    url = with_changing_query("http://10.0.0.2:10002?k=a%26b")
    assert url.startswith("http://10.0.0.2:10002/?k=a%26b&t=")
    assert public(url) == "http://10.0.0.2:10002/"
