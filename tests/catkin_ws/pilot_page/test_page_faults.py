"""What goes wrong while somebody drives by the page: the robot stands, nothing late moves it, the page comes back.

The network's own faults are in test_page_far_away.py.
"""

from __future__ import annotations

import contextlib
import signal
import time
from collections.abc import Iterator

import pytest
from page_browser import FORWARD, ZERO, Browser, assert_stands, drives, enter, heard

from pepper_sim.tablet.devtools import BrowserError

pytestmark = [pytest.mark.ros, pytest.mark.browser]

BACK = 12.0
"""[s] after the end of a fault within which the page shows pictures and has the robot, on a machine that is busy with
other tests; on a quiet one it is 3."""
SURE = 0.5
"""[s] in which a page that drove would have sent ten commands."""
CLOCK = """
{
  const RightDate = Date;
  globalThis.wrong = 86400e3;
  globalThis.Date = class extends RightDate {
    constructor(...words) { words.length ? super(...words) : super(RightDate.now() + wrong); }
    static now() { return RightDate.now() + wrong; }
  };
  const origin = performance.timeOrigin;
  Object.defineProperty(performance, "timeOrigin", { get: () => origin + wrong });
}
"""
"""The browser's clock, `wrong` by so many milliseconds; what only counts on is right, as in a real one."""


@pytest.fixture(scope="module")
def browser(running):
    browser = Browser(running[1], CLOCK.replace("86400e3", "0"))
    yield browser
    browser.tools.close()


@pytest.fixture
def pilot(browser, wait_until):
    """The browser of somebody who has the robot; a test that failed may have left it to another page."""
    browser.evaluate("if (!document.getElementById('take')?.hidden) document.getElementById('take')?.click()")
    wait_until(lambda: browser.is_there() or browser.asks(), "the page is there")
    return browser if browser.is_there() else enter(browser, wait_until)


def comes_back(probe, wait_until, browser) -> None:
    """Wait for the page; what was held before moves nothing, and a new press does."""
    began = time.monotonic()
    probe.forget("/cmd_vel")
    wait_until(browser.is_there, "the page shows pictures and has the robot")
    assert time.monotonic() - began <= BACK
    time.sleep(SURE)
    assert FORWARD not in heard(probe)
    browser.key("KeyW", False)
    drives(probe, wait_until, browser)
    browser.key("KeyW", False)
    wait_until(lambda: heard(probe)[-1] == ZERO, "the release stops")


def test_another_tab_is_looked_at(pilot, probe, wait_until):
    @contextlib.contextmanager
    def another_tab() -> Iterator[None]:
        drives(probe, wait_until, pilot)
        pilot.tools.call("Emulation.setFocusEmulationEnabled", enabled=False)
        pilot.evaluate("globalThis.other = open('about:blank'); 0", userGesture=True)
        try:
            yield
            assert pilot.evaluate("document.hidden")
            time.sleep(2 * SURE)  # until pictures would count as lost
        finally:
            pilot.tools.call("Emulation.setFocusEmulationEnabled", enabled=True)
            pilot.evaluate("other.close()")
        comes_back(probe, wait_until, pilot)

    assert_stands(probe, wait_until, another_tab)


def revived(browser, url) -> bool:
    """Load the page anew; whether it answers then."""
    with contextlib.suppress(BrowserError):
        browser.tools._call("Page.navigate", {"url": url}, 5.0)
        return bool(browser.tools._call("Runtime.evaluate", {"expression": "1"}, 2.0))
    return False


def test_the_page_is_killed(pilot, running, probe, wait_until):
    @contextlib.contextmanager
    def crash() -> Iterator[None]:
        drives(probe, wait_until, pilot)
        pilot.tools.post("Page.crash")
        try:
            yield
        finally:  # a crashed page answers nobody, nor does one that is asked while it is loaded anew: it is asked again
            wait_until(lambda: revived(pilot, running[1]), "the page is loaded anew")
        comes_back(probe, wait_until, pilot)

    assert_stands(probe, wait_until, crash)


def test_the_lid_is_closed(pilot, probe, wait_until):
    @contextlib.contextmanager
    def closed() -> Iterator[None]:
        drives(probe, wait_until, pilot)
        pilot.tools.signal(signal.SIGSTOP)
        try:
            yield
            time.sleep(3 * SURE)  # longer than a lease
        finally:
            pilot.tools.signal(signal.SIGCONT)
        comes_back(probe, wait_until, pilot)

    assert_stands(probe, wait_until, closed)


def test_the_browser_is_killed(open_page, pilot, probe, wait_until):
    @contextlib.contextmanager
    def killed() -> Iterator[None]:
        pilot.evaluate("document.getElementById('leave').click()")
        other = enter(open_page(), wait_until)
        drives(probe, wait_until, other)
        other.tools.signal(signal.SIGKILL)
        yield
        enter(pilot, wait_until)  # somebody takes another one
        comes_back(probe, wait_until, pilot)

    assert_stands(probe, wait_until, killed)


def test_the_page_s_program_is_killed(page, running, pilot, probe, wait_until):
    program = running[0]

    @contextlib.contextmanager
    def killed() -> Iterator[None]:
        nonlocal program
        drives(probe, wait_until, pilot)
        program.kill()
        try:
            yield
        finally:
            program = page()
            program.wait_for("https://")
        comes_back(probe, wait_until, pilot)

    assert_stands(probe, wait_until, killed)


def test_one_person_has_two_pages(open_page, pilot, probe, wait_until):
    """Whoever comes by another page drives there, and the first page says so; neither drives past the other."""
    drives(probe, wait_until, pilot)
    pilot.evaluate(
        "globalThis.said = ''; new MutationObserver(() => said += document.getElementById('alert').textContent)"
        ".observe(document.getElementById('alert'), { childList: true, characterData: true, subtree: true })"
    )
    other = enter(open_page(), wait_until)
    wait_until(lambda: "drives now" in pilot.evaluate("said"), "the first page says who has it")
    wait_until(lambda: heard(probe)[-1] == ZERO, "the robot is told to stand")
    wait_until(lambda: "anna drives" in pilot.text("status"), "and goes on saying so")
    assert not pilot.is_there() and not pilot.evaluate("document.getElementById('take').hidden")
    probe.forget("/cmd_vel")
    time.sleep(SURE)
    assert FORWARD not in heard(probe)  # although the key is held there
    drives(probe, wait_until, other)
    pilot.evaluate("document.getElementById('take').click()")
    wait_until(lambda: heard(probe)[-1] == ZERO, "the robot is told to stand")
    wait_until(lambda: "anna drives" in other.text("status"), "the other page says so")
    comes_back(probe, wait_until, pilot)


def test_two_tabs_share_a_sign_in(pilot, probe, wait_until):
    pilot.evaluate("globalThis.other = open('/'); 0", userGesture=True)
    wait_until(
        lambda: pilot.evaluate("other.document.getElementById('picture')?.videoWidth > 0"), "the second tab sees"
    )
    wait_until(lambda: pilot.evaluate("other.document.getElementById('take').hidden"), "the second tab has the robot")
    pilot.evaluate("other.close()")
    wait_until(lambda: not pilot.evaluate("document.getElementById('picture').classList.contains('stale')"), "it sees")
    pilot.evaluate("document.getElementById('take').click()")
    comes_back(probe, wait_until, pilot)


def test_the_browser_s_clock_is_wrong_by_a_day(pilot, probe, wait_until):
    """It is set while somebody drives, to either side; then the page is loaded with it."""
    drives(probe, wait_until, pilot)
    for wrong in ("86400e3", "-86400e3"):
        pilot.evaluate(f"wrong = {wrong}")
        drives(probe, wait_until, pilot)
    pilot.key("KeyW", False)
    wait_until(lambda: heard(probe)[-1] == ZERO, "the release stops")
    pilot.tools.call("Page.addScriptToEvaluateOnNewDocument", source=CLOCK)
    pilot.tools.call("Page.reload")
    comes_back(probe, wait_until, pilot)
    assert pilot.evaluate("Date.now()") / 1000 - time.time() > 80_000
