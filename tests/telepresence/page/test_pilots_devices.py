"""The pilot's microphone and camera: the parts of the page that open them, in Chromium with made-up devices.

The parts stand here without a station, so that none of it depends on how fast one answers: the tests say what a
station would, and look at what the page does then.
"""

from __future__ import annotations

import json
from typing import Any

import pytest
from page_in_process import PageBrowser

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
  globalThis.take = (state) => page.onState(state);
  globalThis.tracks = [];
  globalThis.allowed = Promise.resolve();
  const devices = navigator.mediaDevices, getUserMedia = devices.getUserMedia.bind(devices);
  devices.getUserMedia = async (wanted) => {
    await allowed;
    const stream = await getUserMedia(wanted);
    tracks.push(...stream.getTracks());
    return stream;
  };
  globalThis.open = (kind) => tracks.filter((track) => track.kind === kind && track.readyState === "live");
  globalThis.press = (name) => document.getElementById(`tool_${name}`).click();
  globalThis.on = (name) => document.getElementById(`tool_${name}`).ariaPressed === "true";
  globalThis.said = () => [...document.getElementById("alert").children].map((line) => line.textContent);
})()"""
EVERYTHING = {"speak": True, "listen": True, "face": True, "say": True, "listens": True, "shows": False, "seen": False}
MINE = {"mine": True, "sound": EVERYTHING}


@pytest.fixture(scope="module")
def address(page):
    return page.url


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


def count_open(browser: PageBrowser) -> list[int]:
    """Return how many microphones and cameras are open: what makes the browser show its sign of a device in use."""
    return browser.evaluate("[open('audio').length, open('video').length]")


def ask_first(browser: PageBrowser) -> None:
    """From now on the browser asks somebody whether a page may have a device; `allow()` is their answer."""
    browser.evaluate("globalThis.allowed = new Promise((resolve) => { globalThis.allow = resolve; }); 0")


def settle(browser: PageBrowser, number: int) -> None:
    """Wait until so many devices were opened in all, and the page has done with them what it does."""
    browser.until(f"tracks.length >= {number}", "the browser has opened what was asked of it")
    browser.evaluate("new Promise((resolve) => setTimeout(resolve, 200))")


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


@pytest.mark.parametrize("name", ["microphone", "camera"])
def test_a_device_that_is_allowed_after_the_robot_was_lost_is_not_open(browser, name):
    ask_first(browser)
    browser.evaluate(f"press('{name}')")
    report(browser, {"mine": False, "sound": EVERYTHING})
    browser.evaluate("allow()")
    settle(browser, 1)
    assert count_open(browser) == [0, 0]
    report(browser, MINE)
    assert not browser.evaluate(f"on('{name}')")


def test_who_lets_go_of_the_key_to_answer_the_browser_has_no_open_microphone(browser):
    ask_first(browser)
    browser.evaluate("dispatchEvent(new KeyboardEvent('keydown', { code: 'KeyV' }))")
    browser.evaluate("dispatchEvent(new Event('blur')); allow()")
    settle(browser, 1)
    assert count_open(browser) == [0, 0]
    browser.evaluate("dispatchEvent(new KeyboardEvent('keydown', { code: 'KeyV' }))")
    browser.until("on('microphone')", "the next press counts")


@pytest.mark.parametrize("lost", [{"mine": False, "sound": EVERYTHING}, {"mine": True}], ids=["robot", "way"])
def test_what_the_robot_does_not_take_is_not_open(browser, lost):
    open_both(browser)
    report(browser, lost)
    assert count_open(browser) == [0, 0]


def test_without_a_connection_nothing_is_open_and_no_button_says_so(browser):
    """As in a page that nobody looks at, which hangs up."""
    open_both(browser)
    short = f"take({json.dumps(MINE)}); page.stateAt -= 900; page.tick();"  # as when a machine was held up
    assert browser.evaluate(short + "on('microphone') && on('camera') && on('speaker')")
    browser.evaluate("page.stateAt -= 2200; page.tick()")
    assert count_open(browser) == [0, 0]
    assert not browser.evaluate("on('microphone') || on('camera') || on('speaker')")
    off = [f"Your {device} is off: the connection to the robot was lost." for device in ("microphone", "camera")]
    assert browser.evaluate("said()") == off
    browser.evaluate("press('camera'); press('microphone')")
    assert browser.evaluate("said().at(-1)") == "There is no connection to the robot."
    report(browser, MINE)
    assert browser.evaluate("[on('microphone'), on('camera'), on('speaker')]") == [False, False, True]


@pytest.mark.parametrize(("name", "kind"), [("microphone", "audio"), ("camera", "video")])
def test_of_devices_that_are_chosen_one_after_the_other_the_last_is_open(browser, name, kind):
    """As the arrow keys do in the list."""
    browser.evaluate(f"press('{name}')")
    browser.until(f"open('{kind}').length", "it is open")
    browser.until(f"document.querySelectorAll('#choice_{kind}input option').length > 2", "the list has several")
    ask_first(browser)
    last = browser.evaluate(
        f"(() => {{ const list = document.getElementById('choice_{kind}input');"
        "const options = [...list.options].slice(1, 3);"
        "for (const { value } of options) { list.value = value; list.dispatchEvent(new Event('change')); }"
        "return options[1].value; })()"
    )
    assert count_open(browser) == [0, 0], "the one of before is closed"
    browser.evaluate("allow()")
    browser.until(f"open('{kind}').some((track) => track.getSettings().deviceId === '{last}')", "it is open")
    settle(browser, 3)
    assert sum(count_open(browser)) == 1 and browser.evaluate(f"on('{name}')")
