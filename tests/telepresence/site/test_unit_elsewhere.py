"""A robot whose unit runs elsewhere: Caddy asks its page by HTTPS, and believes only whom the file names."""

from __future__ import annotations

import secrets
import tempfile
from pathlib import Path

import pytest
import tls_stream
from page_in_process import PageInProcess
from page_server import ANNA
from page_stranger import FORWARD, ask, drive
from proxied_site import Client, ProxiedSite
from waiting import wait_until
from websockets.sync.client import connect

from telepresence.page.attempts import MOST
from telepresence.page.certificate import server_files
from telepresence.page.proxy import Proxy


@pytest.fixture(scope="module")
def site(free_port):
    """Dora's unit is the one that the file says; behind erin's address is another one than the file believes."""
    with tempfile.TemporaryDirectory(prefix="site-") as name:
        folder, port = Path(name), free_port()
        elsewhere = folder / "elsewhere"
        elsewhere.mkdir()
        page = PageInProcess(elsewhere, ("Pepper",), Proxy(f"https://localhost:{port}/dora/", "127.0.0.1"))
        server_files(folder, [], "other")  # makes another computer's authority
        robots = (
            f"[robot.dora]\nurl = '{page.url}'\nauthority = 'elsewhere/authority.crt'\n"
            f"[robot.erin]\nurl = '{page.url.replace('127.0.0.1', 'localhost')}'\nauthority = 'authority.crt'\n"
        )
        site = ProxiedSite(folder, port, robots)
        site.pages["dora"] = page
        yield site
        site.close()


@pytest.fixture(scope="module")
def client(site):
    return Client(site)


def test_its_page_is_there_by_the_site(client):
    assert client.status("GET", "/dora/") == 200 and client.status("GET", "/dora/static/main.js") == 200
    answer, _ = client.ask("POST", "/dora/enter", ANNA)
    cookie = answer.headers["Set-Cookie"]
    assert "Path=/dora/" in cookie
    assert client.status("GET", "/dora/me", Cookie=cookie.partition(";")[0]) == 200


def test_who_poses_as_a_robots_unit_gets_nothing(client):
    answer, body = client.ask("POST", "/erin/enter", ANNA)
    assert answer.status == 502 and b"not there" in body


def test_one_drives_by_the_proxy(client, site):
    cookie = client.ask("POST", "/dora/enter", ANNA)[0].headers["Set-Cookie"].partition(";")[0]
    robot = site.pages["dora"].robots["Pepper"]
    with connect(
        f"ws://localhost:{site.site.port}/dora/ws?robot=Pepper&page={secrets.token_hex(8)}&attempt=1",
        sock=tls_stream.connect("localhost", site.site.port, client.context, 30.0),
        additional_headers={"Cookie": cookie},
        origin=site.url.rstrip("/"),
        max_size=None,
    ) as socket:
        socket.send(ask(1, "take"))
        number = 0

        def drives() -> bool:
            nonlocal number
            number += 1
            socket.send(drive(number))
            return robot.velocity.vx == FORWARD[0]

        wait_until(drives, "the robot drives")
    wait_until(lambda: robot.velocity.vx == 0.0, "and stands when the browser has gone")


def test_tries_are_counted_by_the_browsers_address(client):
    for number in range(MOST):
        assert client.status("POST", "/dora/enter", {"name": "eve", "invitation": f"g{number}"}, "127.0.0.77") == 403
    assert client.status("POST", "/dora/enter", ANNA, "127.0.0.77") == 429
    assert client.status("POST", "/dora/enter", ANNA, "127.0.0.78") == 200
