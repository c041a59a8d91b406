"""The passwords by which a browser uses the relay end: a page that has been connected for long dials with new ones."""

from __future__ import annotations

import pytest
from page_server import WILL

pytestmark = pytest.mark.browser

LINK = """
(async () => {
  const { Link } = await import("/static/link.js");
  const nothing = () => {};
  globalThis.link = new Link(document.createElement("video"),
    { onState: nothing, onSaid: nothing, onSignedOut: nothing, onSent: nothing, onEcho: nothing });
  link.robot = "Pepper";
  performance.clearResourceTimings();
})()
"""
ASKED = "performance.getEntriesByType('resource').filter((one) => one.name.endsWith('/servers')).length"
"""How often the page has asked for the servers."""


def redial(browser) -> int:
    """Return how often servers were asked for, once there is another connection."""
    browser.evaluate("globalThis.dialled = link.attempts; link.redial()")
    browser.until("link.attempts > dialled && link.way === 'webrtc'", "it is connected again")
    return browser.evaluate(ASKED)


@pytest.fixture
def link(chromium):
    """A connection of somebody who is signed in, on a page that has nothing else."""
    chromium.drive()
    chromium.tools.call("Page.navigate", url=f"{chromium.url}me")
    chromium.until("location.pathname === '/me' && document.readyState === 'complete'", "the page is open")
    chromium.evaluate(LINK)
    yield chromium
    chromium.evaluate("link.hangUp()")
    chromium.open()


def test_passwords_that_are_about_to_end_are_not_used(link):
    assert redial(link) == 1
    assert redial(link) == 1, "the answer to an offer has brought new ones"
    link.evaluate("link.serversAt -= 46 * 60000")
    assert redial(link) == 2
    assert redial(link) == 2
    link.evaluate("link.serversAt += 3600000")  # the clock was set back
    assert redial(link) == 3


def test_whoever_comes_next_has_passwords_of_their_own(chromium):
    chromium.drive()
    asked = chromium.evaluate(ASKED)
    chromium.evaluate("document.getElementById('leave').click()")
    chromium.until("!document.querySelector('#enterForm button').disabled", "anna is out")
    chromium.sign_in(WILL["name"], WILL["password"])
    chromium.until("document.getElementById('picture').videoWidth > 0", "will sees the robot")
    assert chromium.evaluate(ASKED) == asked + 1
    chromium.open()
