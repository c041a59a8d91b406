"""The tablet's other web view: Chromium, script and style included."""

from __future__ import annotations

import socket
import threading
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from pepper_sim.tablet.devtools import DevTools

pytestmark = pytest.mark.browser

RED = (255, 0, 0)
GREEN = (0, 255, 0)
BLUE = (0, 0, 255)
BLACK = (0, 0, 0)


@pytest.fixture
def chromium(make_glass):
    return make_glass("chromium")


def test_chromium_runs_scripts_and_styles(site, chromium, wait_until) -> None:
    site.serve("/", "<style>body{background:#f00}</style>")
    site.serve(
        "/script", "<script>document.documentElement.style.background = innerWidth == 1280 ? '#0f0' : '#00f'</script>"
    )
    chromium.open(site.url())
    assert chromium.shows(RED, timeout=30)
    chromium.open(site.url("/script"))
    assert chromium.shows(GREEN)
    wait_until(lambda: chromium.events == ["started", "finished"] * 2)
    chromium.tablet.hide_webview()
    assert chromium.shows(BLACK)


def test_chromium_talks_to_the_robots_programs(chromium, wait_until, tmp_path) -> None:
    heard: list[str] = []
    chromium.tablet.on_js_event = lambda text: heard.append(f"event {text}")
    chromium.tablet.on_console = lambda text: heard.append(f"console {text}")
    (tmp_path / "index.html").write_text("<script src=app.js></script><body onclick=\"answer('touched')\">")
    (tmp_path / "app.js").write_text("function answer(text) { ALTabletBinding.raiseEvent(text); console.log(text, 7) }")
    files = {"/apps/mine/": tmp_path / "index.html", "/apps/mine/app.js": tmp_path / "app.js"}
    chromium.tablet.robot_files = files.get
    assert chromium.tablet.execute("1") is False, "there is no page yet"
    chromium.open("http://198.18.0.1/apps/mine/")
    wait_until(lambda: "finished" in chromium.events)
    assert chromium.tablet.execute("answer('hello'); document.body.style.background = '#00f'") is True
    wait_until(lambda: heard == ["event hello", "console hello 7"])
    assert chromium.shows(BLUE)


def test_chromium_follows_a_stream(live, chromium, wait_until, encoded) -> None:
    image, server = live
    image.put(encoded(RED))
    chromium.open(server.url + "?adv")
    for colour in (RED, GREEN, BLUE):
        image.put(encoded(colour))
        wait_until(lambda colour=colour: shows_anywhere(chromium, colour), timeout=30)
    wait_until(lambda: "finished" in chromium.events)


def shows_anywhere(glass, colour: tuple[int, int, int]) -> bool:
    picture = glass.tablet.image.peek()
    return picture is not None and bool((abs(picture.content[60, 60].astype(int) - colour) < 20).all())


def test_chromium_reports_what_does_not_load_and_leaves_nothing_behind(other_threads, chromium, wait_until) -> None:
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        url = f"http://127.0.0.1:{unused.getsockname()[1]}/"
        chromium.open(url)
        wait_until(lambda: len(chromium.events) == 2, timeout=30)
    assert chromium.events[1] == (-6, "net::ERR_CONNECTION_REFUSED", url)
    wait_until(lambda: chromium.ink() > 500)
    chromium.tablet.close()
    assert not [t.name for t in set(threading.enumerate()) - other_threads if t.name.startswith("tablet")]


def test_a_browser_leaves_no_file(monkeypatch) -> None:
    with TemporaryDirectory(prefix="t-") as place:  # pytest's own folders are too deep for the path of a socket
        monkeypatch.setenv("TMPDIR", place)
        monkeypatch.setattr("tempfile.tempdir", None)
        browser = DevTools()
        assert len([*Path(place).iterdir()]) == 2, "its profile, and the folder of its socket"
        browser.close()
        assert [*Path(place).iterdir()] == []
