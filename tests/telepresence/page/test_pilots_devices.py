"""The pilot's microphone and camera: the parts of the page that open them, in Chromium with made-up devices.

The parts stand here without a station, so that none of it depends on how fast one answers: the tests say what a
station would, and look at what the page does then.
"""

from __future__ import annotations

import json
from typing import Any

import pytest
from page_in_process import PageBrowser, PageInProcess

pytestmark = pytest.mark.browser

FLAGS = ("--use-fake-ui-for-media-stream", "--use-fake-device-for-media-stream=device-count=3")
PARTS = """(async () => {
  document.body.innerHTML = `<video id="picture"></video><div id="over"></div><div id="tools"></div>
    <div id="sections"></div><p id="alert"></p>`;
  localStorage.clear();
  const { loadLanguage, text } = await import("/static/language.js");
  await loadLanguage("en");
  const { Page } = await import("/static/page.js");
  globalThis.page = new Page();
  page.link.keep = () => {}; // there is no station to dial
  page.me = { name: "anna", role: "pilot", robots: ["Pepper"] };
  globalThis.asked = [];
  page.ask = async (...words) => { asked.push(words); return true; };
  for (const part of ["alert", "sound", "face"]) (await import(`/static/${part}.js`)).start(page);
  globalThis.take = (state) => { page.state = state; page.emit("state"); };
  globalThis.press = (name) => document.getElementById(`tool_${name}`).click();
  globalThis.on = (name) => document.getElementById(`tool_${name}`).ariaPressed === "true";
  globalThis.said = () => [...document.getElementById("alert").children].map((line) => line.textContent);
})()"""
EVERYTHING = {"speak": True, "listen": True, "face": True, "say": True, "listens": True, "shows": False, "seen": False}
MINE = {"mine": True, "sound": EVERYTHING}


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    station = PageInProcess(tmp_path_factory.mktemp("page"))
    yield station.url
    station.close()


@pytest.fixture(scope="module")
def chromium(address):
    browser = PageBrowser(address, FLAGS)
    yield browser
    browser.close()


@pytest.fixture
def browser(address, chromium):
    """The parts, with the robot and everything closed."""
    chromium.errors.clear()
    chromium.tools.call("Page.navigate", url=f"{address}me?")  # any page of that origin
    chromium.until(
        "location.search === '' && location.pathname === '/me' && document.readyState === 'complete'"
        " && typeof page === 'undefined'",
        "an empty page",
    )
    chromium.evaluate(PARTS)
    report(chromium, MINE)
    yield chromium
    assert chromium.errors == []


def report(browser: PageBrowser, state: dict[str, Any]) -> None:
    """Let the page know what a station says."""
    browser.evaluate(f"take({json.dumps(state)})")


def open_both(browser: PageBrowser) -> None:
    browser.evaluate("press('microphone'); press('camera')")
    browser.until("on('microphone') && on('camera') && !document.getElementById('selfView').hidden", "both are open")


def test_each_device_says_itself_why_it_is_off_and_the_other_stays_on(browser):
    open_both(browser)
    report(browser, {"mine": True, "sound": {**EVERYTHING, "face": False}})
    assert browser.evaluate("on('microphone') && !on('camera')")
    off = "Your camera is off: the robot's program for it cannot be reached at the moment."
    assert browser.evaluate("said()") == [off]
    report(browser, {"mine": True})
    assert not browser.evaluate("on('microphone')")
    assert browser.evaluate("said().at(-1)") == "Your microphone is off: it needs WebRTC, which this connection lacks."


def test_who_loses_the_robot_can_read_all_that_is_said_of_it(browser):
    """The station says who has it now a moment before or after the page has seen that it is lost."""
    open_both(browser)
    lost = json.dumps({"mine": False, "sound": EVERYTHING})
    together, again, newest = browser.evaluate(  # at once: who has had the time to read them needs them no more
        "(() => { const say = (words) => { page.emit('said', words); return said(); };"
        f"say('ben drives now.'); take({lost});"
        "return [said(), say('ben drives now.'), say('Take the robot first.')]; })()"
    )
    off = [f"Your {device} is off: you do not have the robot any more." for device in ("microphone", "camera")]
    assert together == ["ben drives now.", *off]
    assert again == [*off, "ben drives now."], "each once"
    assert newest == [off[1], "ben drives now.", "Take the robot first."], "no more than three"
    browser.evaluate("new Promise((resolve) => setTimeout(resolve, 4100))")
    browser.evaluate("page.emit('said', 'Who asked is not here any more.')")
    assert browser.evaluate("said()") == ["Who asked is not here any more."]
