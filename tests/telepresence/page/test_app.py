"""The page's HTTP: who gets what. A real server with TLS on a free port, asked by a real client."""

import asyncio
import json
import ssl

import aiohttp
import pytest
from aiohttp import web

from telepresence.page import app as page_app
from telepresence.page.app import MOST_BODY, PilotPage
from telepresence.page.certificate import server_context
from telepresence.page.sign_ins import COOKIE
from telepresence.teleop.lease_messages import PILOT, Account
from telepresence.video.images import LatestImage

ANNA = {"name": "anna", "password": "correct horse"}


class Station:
    robot = "Pepper"

    def __init__(self):
        self.picture = LatestImage()
        self.admitted = []

    def watch(self, wanted):
        pass

    def admit(self, name, password):
        self.admitted.append(name)
        if password != ANNA["password"]:
            raise ValueError("Name or password is wrong.")
        return Account(name, PILOT)

    def lease_link(self, name):
        return SilentLease(name)

    def state(self):
        return {"gate": None}


class SilentLease:
    def __init__(self, name):
        self.node_name = f"/pilot_page/{name}"


class Client:
    def __init__(self, session, url, station):
        self.session, self.url, self.station = session, url, station

    async def ask(self, method, path, body=None, cookies=None, **headers):
        data = body if isinstance(body, bytes | None) else json.dumps(body).encode()
        header = {name.replace("_", "-"): value for name, value in headers.items()}
        async with self.session.request(
            method, self.url + path, data=data, headers=header, cookies=cookies, allow_redirects=False
        ) as answer:
            return answer, await answer.read()

    async def status(self, *arguments, **more):
        return (await self.ask(*arguments, **more))[0].status

    async def enter(self):
        answer, _ = await self.ask("POST", "/enter", ANNA)
        return {COOKIE: answer.cookies[COOKIE].value}


@pytest.fixture
def on_page(tmp_path):
    def run(scenario):
        async def serve():
            station = Station()
            runner = web.AppRunner(PilotPage(station, "127.0.0.1").application(), access_log=None)
            await runner.setup()
            await web.TCPSite(runner, "127.0.0.1", 0, ssl_context=server_context(tmp_path, ["127.0.0.1"])).start()
            trust = ssl.create_default_context(cafile=str(tmp_path / "page.crt"))
            connector = aiohttp.TCPConnector(ssl=trust)
            jar = aiohttp.DummyCookieJar()
            async with aiohttp.ClientSession(connector=connector, cookie_jar=jar) as session:
                await scenario(Client(session, f"https://127.0.0.1:{runner.addresses[0][1]}", station))
            await runner.cleanup()

        asyncio.run(serve())

    return run


def test_without_a_sign_in_there_is_the_page_and_nothing_else(on_page):
    async def scenario(client):
        answer, body = await client.ask("GET", "/")
        assert answer.status == 200 and b"Enter" in body and "Set-Cookie" not in answer.headers
        for path in ("/static/main.js", "/static/page.css"):
            assert await client.status("GET", path) == 200
        assert await client.status("GET", "/me") == 401
        for path in ("/offer", "/stop", "/leave"):
            assert await client.status("POST", path, {"sdp": ""}) == 401
            assert await client.status("POST", path, {"sdp": ""}, {COOKIE: "x" * 43}) == 401
        for path in ("/static/../app.py", "/static/app.py", "/static/%2e%2e/app.py", "/x", "/static/a.svg"):
            assert await client.status("GET", path) == 404

    on_page(scenario)


def test_a_password_opens_it_until_leaving(on_page):
    async def scenario(client):
        answer, body = await client.ask("POST", "/enter", ANNA)
        morsel = answer.cookies[COOKIE]
        assert json.loads(body) == {"name": "anna", "role": "pilot", "robot": "Pepper"}
        assert morsel["httponly"] and morsel["secure"] and morsel["samesite"] == "Strict" and morsel["path"] == "/"
        cookies = {COOKIE: morsel.value}
        assert await client.status("GET", "/me", None, cookies) == 200
        assert await client.status("POST", "/leave", {}, cookies) == 200
        assert await client.status("GET", "/me", None, cookies) == 401

    on_page(scenario)


def test_a_wrong_password_opens_nothing(on_page):
    async def scenario(client):
        answer, body = await client.ask("POST", "/enter", ANNA | {"password": "wrong"})
        assert answer.status == 403 and COOKIE not in answer.cookies and b"wrong" in body

    on_page(scenario)


@pytest.mark.parametrize(
    "headers",
    [
        {"Host": "evil.example"}, {"Origin": "https://evil.example"}, {"Origin": "null"},
        {"Sec_Fetch_Site": "cross-site"},
        {"Sec_Fetch_Site": "same-site"}, {"Origin": "http://127.0.0.1"},
    ],
)  # fmt: skip
def test_no_other_page_reaches_anything(on_page, headers):
    async def scenario(client):
        cookies = await client.enter()
        client.station.admitted.clear()
        for method, path in (("GET", "/"), ("GET", "/me"), ("POST", "/enter"), ("POST", "/offer"), ("POST", "/stop")):
            assert await client.status(method, path, ANNA, cookies, **headers) == 403
        assert client.station.admitted == []

    on_page(scenario)


@pytest.mark.parametrize(
    "body", [b"", b"{", b"[]", b"null", b'"x"', b'{"sdp": 1}', b'{"sdp": "", "more": ""}', b"[" * 5000, b"\xff"]
)
def test_what_is_no_request_of_the_page_is_refused(on_page, body):
    async def scenario(client):
        cookies = await client.enter()
        assert await client.status("POST", "/offer", body, cookies) == 400
        assert await client.status("POST", "/enter", body) == 400

    on_page(scenario)


@pytest.mark.parametrize(
    "sdp", ["", "v=0\r\n", "x" * (60 * 1024), "m=application 9 UDP/DTLS/SCTP webrtc-datachannel\r\n"]
)
def test_an_offer_that_is_none_is_refused_and_leaves_nothing_behind(on_page, sdp):
    async def scenario(client):
        cookies = await client.enter()
        for _ in range(page_app.MOST_LINKS + 1):
            assert await client.status("POST", "/offer", {"sdp": sdp}, cookies) == 400

    on_page(scenario)


def test_a_body_has_an_end(on_page):
    async def scenario(client):
        assert await client.status("POST", "/enter", b"x" * (MOST_BODY + 1)) in (400, 413)

    on_page(scenario)


def test_passwords_are_checked_few_at_a_time(on_page, monkeypatch):
    monkeypatch.setattr(page_app, "MOST_WAITING", 2)

    async def scenario(client):
        statuses = await asyncio.gather(*(client.status("POST", "/enter", ANNA) for _ in range(12)))
        assert 429 in statuses and 200 in statuses

    on_page(scenario)


def test_every_answer_keeps_other_pages_out(on_page):
    async def scenario(client):
        for path in ("/", "/me", "/nothing", "/static/main.js"):
            answer, _ = await client.ask("GET", path)
            policy = answer.headers["Content-Security-Policy"]
            assert "default-src 'none'" in policy and "frame-ancestors 'none'" in policy and "unsafe" not in policy
            assert answer.headers["X-Content-Type-Options"] == "nosniff"
            assert "max-age" in answer.headers["Strict-Transport-Security"]

    on_page(scenario)
