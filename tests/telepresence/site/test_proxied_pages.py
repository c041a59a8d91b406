"""Two robots behind Debian's Caddy, for a person in a browser; the robots are but their pages."""

from __future__ import annotations

import tempfile
from pathlib import Path

import pytest
from axe import violations, wear
from page_in_process import PageBrowser
from page_server import ANNA
from proxied_site import ROBOTS, ProxiedSite
from waiting import wait_until

pytestmark = pytest.mark.browser

CTRL = 2
"""Of DevTools' Input.dispatchMouseEvent, modifiers."""


@pytest.fixture(scope="module")
def site(free_port):
    with tempfile.TemporaryDirectory(prefix="site-") as folder:  # a unix socket's path has 107 bytes
        site = ProxiedSite(Path(folder), free_port(), f"{ROBOTS}settings = {{sign_in = true}}\n")
        yield site
        site.close()


@pytest.fixture(scope="module")
def browser(site):
    browser = PageBrowser(site.url)
    yield browser
    browser.close()
    assert browser.errors == []


def go(browser, url: str) -> None:
    browser.tools.call("Page.navigate", url=url)


def open_list(browser, hash: str = "") -> None:
    """Open the list and wait for its style, too: without it a robot is elsewhere, and a click misses it."""
    go(browser, browser.url + hash)
    browser.until(
        "location.pathname === '/' && document.readyState === 'complete'"
        " && document.querySelectorAll('.state').length === 2",
        "the list",
    )


def open_by_link(browser, link: str) -> None:
    """Open the list with what a link carries behind its address, and wait until it has left that for the storage: an
    older list, which has no such address either, may still be shown at first."""
    open_list(browser, link)
    browser.until(f"location.hash === '' && sessionStorage.getItem('wayIn') === '{link}'", "the list has the way in")


def states(browser) -> list[str]:
    return browser.evaluate("[...document.querySelectorAll('.state')].map((e) => e.textContent)")


def pick(browser, name: str) -> None:
    """Press a robot in the list, sign in if need be, and wait for its picture."""
    open_list(browser)
    browser.click(f'a[href="{name}/"]')
    browser.until(f"location.pathname === '/{name}/' && document.readyState === 'complete'", "the robot's page")
    browser.until("['enter', 'drive'].some((id) => document.getElementById(id)?.hidden === false)", "it opens")
    if browser.evaluate("!document.getElementById('enter').hidden"):
        browser.sign_in("anna", ANNA["password"])
    browser.until("document.getElementById('picture').videoWidth > 0", "the picture is there")
    browser.until("document.getElementById('take').hidden", "the robot is taken")


def drive(browser, site, name: str) -> None:
    """Hold W until that robot moves, and none else."""
    robots = {each: page.robots["Pepper"] for each, page in site.pages.items()}
    for robot in robots.values():
        robot.driven.clear()

    def moves() -> bool:
        browser.key("KeyW", False)
        browser.key("KeyW", True)
        return any(velocity.vx > 0 for _, velocity in robots[name].driven)

    wait_until(moves, f"{name} moves")
    browser.key("KeyW", False)
    assert not any(velocity.vx for each, robot in robots.items() if each != name for _, velocity in robot.driven)


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_the_list_says_who_is_there_and_axe_finds_nothing(browser, theme):
    browser.tools.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": theme}])
    go(browser, browser.url)
    wait_until(lambda: states(browser) == ["there", "there"], "both robots are there")
    assert violations(browser) == []


def test_the_list_speaks_the_language_that_somebody_has_chosen(browser):
    open_list(browser)  # a browser's first, empty page has no storage
    for stored, words in (('{"language": "de"}', "Roboter"), ('{"language": "auto"}', "Robots"), ("x", "Robots")):
        browser.evaluate(f"localStorage.setItem('pilot', '{stored}')")
        go(browser, browser.url)
        browser.until(f"document.title === '{words}' && document.readyState === 'complete'", "the list")
    browser.evaluate("localStorage.clear()")


def test_a_link_to_the_list_goes_on_to_the_robot_and_stays_in_no_address(browser):
    open_by_link(browser, "#i=abc-DEF_123")
    assert browser.evaluate("document.documentElement.outerHTML.includes('abc-DEF')") is False
    browser.click('a[href="anna/"]')
    browser.until("document.getElementById('enterTitle')?.textContent === 'You are invited'", "the robot's page has it")
    assert browser.evaluate("location.hash") == ""
    browser.evaluate("sessionStorage.clear()")


@pytest.mark.parametrize(
    ("link", "robot", "way"),
    [
        ("#k=a-key&i=abc-DEF_123", "ben", "#i=abc-DEF_123"),
        ("#k=a-key&i=abc-DEF_123", "anna", "#k=a-key"),
        ("#k=a-key", "ben", ""),
        ("#k=a-key", "anna", "#k=a-key"),
    ],
)
def test_a_link_with_a_key_hands_each_robot_its_own(browser, link, robot, way):
    """At anna's, by the file, nobody signs in, at ben's people do: there a key counts as a failed try."""
    noted = f"if (location.pathname === '/{robot}/') sessionStorage.setItem('came', location.hash)"
    script = browser.tools.call("Page.addScriptToEvaluateOnNewDocument", source=noted)
    try:
        open_by_link(browser, link)
        browser.click(f'a[href="{robot}/"]')
        browser.until(f"location.pathname === '/{robot}/' && document.readyState === 'complete'", "its page")
        assert browser.evaluate("sessionStorage.getItem('came')") == way
    finally:
        browser.tools.call("Page.removeScriptToEvaluateOnNewDocument", **script)
        browser.evaluate("sessionStorage.clear()")


@pytest.mark.parametrize(
    "pressed", [{"button": "left", "modifiers": CTRL}, {"button": "middle"}], ids=["Ctrl", "middle"]
)
def test_a_robot_that_is_opened_in_another_tab_gets_the_way_in_too(browser, monkeypatch, pressed):
    def pages() -> set[str]:
        targets = browser.tools.call("Target.getTargets")["targetInfos"]
        return {target["targetId"] for target in targets if target["type"] == "page"}

    open_by_link(browser, "#i=abc-DEF_123")
    before = pages()
    x, y = browser.place('a[href="ben/"]')
    for kind in ("mousePressed", "mouseReleased"):
        browser.tools.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, clickCount=1, **pressed)
    wait_until(lambda: pages() - before, "another tab")
    (other,) = pages() - before
    assert browser.evaluate("location.pathname") == "/", "the list stays open"
    assert browser.evaluate("document.documentElement.outerHTML.includes('abc-DEF')") is False
    session = browser.tools.call("Target.attachToTarget", targetId=other, flatten=True)["sessionId"]
    with monkeypatch.context() as patched:
        patched.setattr(browser.tools, "_session", session)
        browser.until("document.getElementById('enterTitle')?.textContent === 'You are invited'", "ben's page has it")
    browser.tools.call("Target.closeTarget", targetId=other)
    browser.evaluate("sessionStorage.clear()")


def test_pick_a_robot_and_drive_it_then_the_other(browser, site):
    pick(browser, "ben")
    drive(browser, site, "ben")
    assert browser.evaluate("document.title") == "ben – pilot"
    for theme in ("dark", "light"):
        wear(browser, theme)
        assert violations(browser) == []
    browser.click("#site")
    browser.until("location.pathname === '/'", "back in the list")
    pick(browser, "anna")
    drive(browser, site, "anna")


def test_a_robot_that_goes_leaves_the_others_alone_and_comes_back_to_its_page(browser, site):
    pick(browser, "anna")
    site.stop_page("ben")
    drive(browser, site, "anna")
    open_list(browser)
    wait_until(lambda: states(browser) == ["there", "not there"], "the list says so")
    assert violations(browser) == []
    browser.click('a[href="ben/"]')
    browser.until("document.querySelector('h1')?.textContent === 'This robot is not there now.'", "so does its page")
    assert violations(browser) == []
    site.start_page("ben")
    browser.until("!!document.getElementById('picture')", "its page opens by itself")


def test_a_proxy_that_was_killed_and_is_back_is_dialled_again(browser, site):
    """Without WebRTC, where pictures and commands go through the proxy, too."""
    script = browser.tools.call("Page.addScriptToEvaluateOnNewDocument", source="delete globalThis.RTCPeerConnection")
    try:
        pick(browser, "anna")
        browser.until("document.getElementById('way').dataset.way === 'slower'", "the slower way")
        drive(browser, site, "anna")
        site.proxy.kill()
        site.proxy.wait()
        wait_until(lambda: not site.pages["anna"].robots["Pepper"].velocity.vx, "the robot stands")
        site.start_proxy()
        drive(browser, site, "anna")
    finally:
        browser.tools.call("Page.removeScriptToEvaluateOnNewDocument", **script)
