"""Signing out on a computer that others use, too, and through a network that comes and goes."""

from __future__ import annotations

import pytest
from page_in_process import PageBrowser, PageInProcess

pytestmark = pytest.mark.browser

STILL_IN = "The station cannot be reached: your sign-in may still hold in this browser."
ENTRANCE = "!document.getElementById('enter').hidden && document.getElementById('drive').hidden"
PROBLEM = "document.getElementById('enterProblem').textContent"


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    page = PageInProcess(tmp_path_factory.mktemp("page"))
    yield page
    page.close()


@pytest.fixture
def browser(page):
    """A page of somebody who drives."""
    browser = PageBrowser(page.url)
    browser.tools.call("Network.enable")
    browser.drive()
    yield browser
    browser.close()
    assert browser.errors == []


def block(browser: PageBrowser, *paths: str) -> None:
    """Let no request to these paths through."""
    browser.tools.call("Network.setBlockedURLs", urls=[f"*/{path}" for path in paths])


def is_known(browser: PageBrowser) -> bool:
    """Whether the station takes the browser's cookie."""
    return browser.evaluate("fetch('me').then((answer) => answer.ok)")


def sign_out(browser: PageBrowser) -> None:
    browser.evaluate("document.getElementById('leave').click()")


def test_without_a_network_one_is_out_at_once_and_told_until_the_station_knows(browser):
    block(browser, "leave")
    sign_out(browser)
    assert browser.evaluate(ENTRANCE + " && document.getElementById('picture').srcObject === null")
    browser.until(f"{PROBLEM}.startsWith('{STILL_IN}')", "it is said")
    assert is_known(browser), "which is why"
    browser.tools.call("Page.reload")
    browser.until(f"document.readyState === 'complete' && {PROBLEM}.startsWith('{STILL_IN}')", "it is said again")
    assert browser.evaluate(ENTRANCE), "and nobody comes in by the old cookie"
    block(browser)
    browser.until(f"{PROBLEM} === ''", "it is over")
    assert browser.evaluate(ENTRANCE) and not is_known(browser)


def test_a_station_that_does_not_answer_keeps_nobody_in(browser):
    browser.tools.call("Fetch.enable", patterns=[{"urlPattern": "*/leave"}])  # held, and never continued
    sign_out(browser)
    assert browser.evaluate(ENTRANCE)
    browser.until(f"{PROBLEM}.startsWith('{STILL_IN}')", "it is said after a while")
    browser.tools.call("Fetch.disable")
    browser.until(f"{PROBLEM} === ''", "it is over")
    assert browser.evaluate(ENTRANCE) and not is_known(browser)


def test_whoever_comes_next_comes_in_once_the_one_before_is_out(browser):
    block(browser, "leave")
    sign_out(browser)
    browser.until(f"{PROBLEM}.startsWith('{STILL_IN}')", "it is said")
    browser.sign_in("will", "battery staple")
    browser.until("!document.querySelector('#enterForm button').disabled", "it has been tried")
    assert browser.evaluate(ENTRANCE)
    block(browser)
    browser.sign_in("will", "battery staple")
    browser.until(f"!({ENTRANCE})", "will is in")
    assert browser.evaluate("fetch('me').then((answer) => answer.json()).then((me) => me.name)") == "will"
    browser.evaluate("new Promise((resolve) => setTimeout(resolve, 2500))")
    assert is_known(browser) and not browser.evaluate(ENTRANCE), "what was owed for anna does not send will away"
