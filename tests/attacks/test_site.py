"""Strangers at a site: two robots behind Debian's Caddy, which are but their pages."""

from __future__ import annotations

import secrets
import tempfile
from pathlib import Path

import pytest
import tls_stream
from page_server import ANNA
from proxied_site import ROBOTS, Client, ProxiedSite
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from telepresence.page.attempts import MOST
from telepresence.page.sign_ins import COOKIE_OF_PATH


@pytest.fixture(scope="module")
def site(free_port):
    with tempfile.TemporaryDirectory(prefix="site-") as folder:  # a unix socket's path has 107 bytes
        site = ProxiedSite(Path(folder), free_port(), ROBOTS)
        yield site
        site.close()


@pytest.fixture(scope="module")
def client(site):
    return Client(site)


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
