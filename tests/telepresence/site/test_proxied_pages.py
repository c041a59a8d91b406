"""Two robots behind Debian's Caddy, for strangers and for a person in a browser; the robots are but their pages."""

from __future__ import annotations

import http.client
import json
import secrets
import ssl
import tempfile
from pathlib import Path

import pytest
import tls_stream
from axe import violations, wear
from page_in_process import PageBrowser, until
from page_server import ANNA
from proxied_site import ProxiedSite
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from telepresence.page.attempts import MOST
from telepresence.page.sign_ins import COOKIE_OF_PATH

pytestmark = pytest.mark.browser

ROBOTS = "[robot.anna]\ntitle = 'Anna <b>'\n[robot.ben]\nkind = 'robotino'\n"


@pytest.fixture(scope="module")
def site(free_port):
    with tempfile.TemporaryDirectory(prefix="site-") as folder:  # a unix socket's path has 107 bytes
        site = ProxiedSite(Path(folder), free_port(), ROBOTS)
        yield site
        site.close()


class Client:
    """A program that speaks to the site; it believes this computer's authority alone."""

    def __init__(self, site: ProxiedSite) -> None:
        self._site = site
        self.context = ssl.create_default_context(cafile=str(site.folder / "authority.crt"))

    def ask(self, method: str, path: str, body: object = None, sender: str = "127.0.0.1", **headers: str):
        """Send a request; the answer, whose body is read, and the body."""
        client = http.client.HTTPSConnection(
            "localhost", self._site.site.port, context=self.context, timeout=30.0, source_address=(sender, 0)
        )
        try:
            named = {name.replace("_", "-"): value for name, value in headers.items()}
            client.request(method, path, None if body is None else json.dumps(body), named)
            answer = client.getresponse()
            return answer, answer.read()
        finally:
            client.close()

    def status(self, *arguments, **more) -> int:
        return self.ask(*arguments, **more)[0].status


@pytest.fixture(scope="module")
def client(site):
    return Client(site)


# --- strangers -------------------------------------------------------------------------------------------------------


def test_a_stranger_learns_names_and_no_more(client):
    answer, body = client.ask("GET", "/")
    assert answer.status == 200 and b"Anna &lt;b&gt;" in body and b"ben/" in body
    assert "script-src 'self'" in answer.headers["Content-Security-Policy"]
    assert answer.headers["Strict-Transport-Security"] and answer.headers["X-Frame-Options"] == "DENY"
    for path in ("/anna/me", "/anna/servers", "/ben/invitations"):
        answer, body = client.ask("GET", path)
        assert answer.status == 401 and b"Pepper" not in body
    for path in (
        "/Caddyfile",
        "/anna.socket",
        "/static/../Caddyfile",
        "/static/%2e%2e/running.py",
        "/list/",
        "/watch/",
    ):
        assert client.status("GET", path) == 404


def test_only_who_calls_the_site_by_its_name_is_answered(client, site):
    """A page of another server whose name suddenly leads here reads not even the list."""
    for path in ("/", "/anna/me", "/static/list.js"):
        assert client.status("GET", path, Host="evil.example") == 421
        assert client.status("GET", path, Host=f"127.0.0.1:{site.site.port}") in (200, 401)


def test_pages_of_others_send_nothing_to_a_robot(client):
    for headers in ({"Origin": "https://evil.example"}, {"Sec_Fetch_Site": "cross-site"}):
        assert client.status("POST", "/anna/enter", ANNA, **headers) == 403


def test_tries_are_counted_by_who_makes_them_whatever_they_say(client):
    """Neither does a stranger choose the address by which tries are counted, nor keep others out."""
    sender = "127.0.0.77"
    for number in range(MOST):
        fields = {"name": "eve", "invitation": f"guess{number}"}
        assert client.status("POST", "/ben/enter", fields, sender, X_Forwarded_For=f"203.0.113.{number}") == 403
    assert client.status("POST", "/ben/enter", ANNA, sender, X_Forwarded_For="203.0.113.99") == 429
    assert client.status("POST", "/ben/enter", ANNA, "127.0.0.78") == 200


def test_the_cookie_of_one_robot_lets_in_at_no_other(client):
    answer, _ = client.ask("POST", "/anna/enter", ANNA)
    cookie = answer.headers["Set-Cookie"]
    assert cookie.startswith(f"{COOKIE_OF_PATH}=") and "Path=/anna/" in cookie and "HttpOnly" in cookie
    shown = cookie.partition(";")[0]
    assert client.status("GET", "/anna/me", Cookie=shown) == 200
    assert client.status("GET", "/ben/me", Cookie=shown) == 401


def test_a_websocket_of_another_page_is_refused(client, site):
    cookie = client.ask("POST", "/anna/enter", ANNA)[0].headers["Set-Cookie"].partition(";")[0]

    def dial(origin: str):
        return connect(
            f"ws://localhost:{site.site.port}/anna/ws?robot=Pepper&page={secrets.token_hex(8)}&attempt=1",
            sock=tls_stream.connect("localhost", site.site.port, client.context, 30.0),  # type: ignore[arg-type]
            additional_headers={"Cookie": cookie},
            origin=origin,  # type: ignore[arg-type]
        )

    with dial(site.url.rstrip("/")) as socket:
        assert socket.recv(timeout=30.0)
    with pytest.raises(InvalidStatus, match="403"):
        dial("https://evil.example")


def test_bodies_and_headers_are_bounded(client):
    assert client.status("POST", "/anna/enter", {"name": "x" * 70_000, "password": ""}) == 413
    assert client.status("GET", "/anna/me", X="x" * 40_000) == 431


# --- a person --------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def browser(site):
    browser = PageBrowser(site.url)
    yield browser
    browser.close()
    assert browser.errors == []


def go(browser, url: str) -> None:
    browser.tools.call("Page.navigate", url=url)


def states(browser) -> list[str]:
    return browser.evaluate("[...document.querySelectorAll('.state')].map((e) => e.textContent)")


def pick(browser, name: str) -> None:
    """Press a robot in the list, sign in if need be, and wait for its picture."""
    go(browser, browser.url)
    browser.until("document.querySelectorAll('.state').length === 2", "the list")
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

    until(moves, f"{name} moves")
    browser.key("KeyW", False)
    assert not any(velocity.vx for each, robot in robots.items() if each != name for _, velocity in robot.driven)


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_the_list_says_who_is_there_and_axe_finds_nothing(browser, theme):
    browser.tools.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": theme}])
    go(browser, browser.url)
    until(lambda: states(browser) == ["there", "there"], "both robots are there")
    assert violations(browser) == []


def test_a_link_to_the_list_goes_on_to_the_robot_and_stays_in_no_address(browser):
    go(browser, f"{browser.url}#i=abc-DEF_123")
    browser.until("document.querySelectorAll('.state').length === 2 && location.hash === ''", "it leaves the address")
    assert browser.evaluate("document.documentElement.outerHTML.includes('abc-DEF')") is False
    browser.click('a[href="anna/"]')
    browser.until("document.getElementById('enterTitle')?.textContent === 'You are invited'", "the robot's page has it")
    assert browser.evaluate("location.hash") == ""
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
    go(browser, browser.url)
    until(lambda: states(browser) == ["there", "not there"], "the list says so")
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
        until(lambda: not site.pages["anna"].robots["Pepper"].velocity.vx, "the robot stands")
        site.start_proxy()
        drive(browser, site, "anna")
    finally:
        browser.tools.call("Page.removeScriptToEvaluateOnNewDocument", **script)
