"""The page's HTTP: who gets what. A real server with TLS on a free port, asked by a real client."""

import asyncio
import json
from functools import partial

import aiohttp
import pytest
from page_server import ANNA, serve

from telepresence.page import browser_messages, sign_in_routes, tabs
from telepresence.page.app import MOST_BODY
from telepresence.page.sign_ins import COOKIE, MOST_OF_ONE


@pytest.fixture
def on_page(tmp_path):
    return partial(serve, tmp_path)


def test_without_a_sign_in_there_is_the_page_and_nothing_else(on_page):
    async def scenario(client):
        answer, body = await client.ask("GET", "/")
        assert answer.status == 200 and b"entering.enter" in body and "Set-Cookie" not in answer.headers
        for path in ("/static/main.js", "/static/page.css"):
            assert await client.status("GET", path) == 200
        for path in ("/me", "/servers", "/ws?robot=Pepper", "/invitations"):
            assert await client.status("GET", path) == 401
        for path in ("/offer", "/stop", "/leave", "/invite", "/withdraw"):
            assert await client.status("POST", path, {"sdp": ""}) == 401
            assert await client.status("POST", path, {"sdp": ""}, {COOKIE: "x" * 43}) == 401
        for path in ("/static/../app.py", "/static/app.py", "/static/%2e%2e/app.py", "/x", "/static/a.svg"):
            assert await client.status("GET", path) == 404

    on_page(scenario)


def test_a_password_opens_it_until_leaving(on_page):
    async def scenario(client):
        answer, body = await client.ask("POST", "/enter", ANNA)
        morsel = answer.cookies[COOKIE]
        assert json.loads(body) == {"name": "anna", "role": "pilot", "robots": ["Pepper"], "invites": True}
        assert morsel["httponly"] and morsel["secure"] and morsel["samesite"] == "Strict" and morsel["path"] == "/"
        cookies = {COOKIE: morsel.value}
        assert await client.status("GET", "/me", None, cookies) == 200
        assert await client.status("POST", "/leave", {}, cookies) == 200
        assert await client.status("GET", "/me", None, cookies) == 401

    on_page(scenario)


def test_a_wrong_password_opens_nothing(on_page):
    async def scenario(client):
        answer, body = await client.ask("POST", "/enter", ANNA | {"password": "wrong"})
        assert answer.status == 403 and COOKIE not in answer.cookies and b"Wrong" in body

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
        tried = []
        client.station.entrance.admit = lambda *words: tried.append(words)
        for method, path in (("GET", "/"), ("GET", "/me"), ("GET", "/ws"), ("POST", "/enter"), ("POST", "/offer")):
            assert await client.status(method, path, ANNA, cookies, **headers) == 403
        assert tried == []

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
        for attempt in range(1, tabs.MOST_LINKS + 2):
            offer = {"robot": "Pepper", "page": "0123456789abcdef", "attempt": attempt, "sdp": sdp}
            assert await client.status("POST", "/offer", offer, cookies) == 400

    on_page(scenario)


def test_an_attempt_that_comes_late_ends_no_later_one(on_page):
    async def scenario(client):
        cookies = await client.enter()
        offer = {"robot": "Pepper", "page": "0123456789abcdef", "sdp": "v=0"}
        for attempt, status in ((2, 400), (1, 409), (2, 409), (2.5, 400), (float("nan"), 409), (3, 400)):
            assert await client.status("POST", "/offer", offer | {"attempt": attempt}, cookies) == status
        socket = "/ws?robot=Pepper&page=0123456789abcdef"
        for attempt, status in (("&attempt=3", 409), ("&attempt=-1", 400), ("", 400), ("&attempt=4e9", 400)):
            assert await client.status("GET", socket + attempt, None, cookies) == status

    on_page(scenario)


@pytest.mark.parametrize("name", ["", "0", "0123456789abcdeg", "0" * 17, "0123456789abcdef\n"])
def test_a_page_has_a_name_of_its_kind(on_page, name):
    async def scenario(client):
        cookies = await client.enter()
        assert await client.status("POST", "/stop", {"robot": "Pepper", "page": name}, cookies) == 400

    on_page(scenario)


def test_pages_of_one_sign_in_are_windows_of_their_own_and_few(on_page):
    async def scenario(client):
        cookies = await client.enter()
        robot = client.station.robots["Pepper"]

        async def press(number):
            stop = {"robot": "Pepper", "page": f"{number:x}" * 16}
            assert await client.status("POST", "/stop", stop, cookies) == 200

        for number in (*range(tabs.MOST_TABS), 0, 0xF):
            await press(number)
        assert len(set(robot.windows)) == tabs.MOST_TABS + 1 == len(robot.windows)
        await press(0)
        assert len(robot.windows) == tabs.MOST_TABS + 1
        await press(1)  # used last longest ago, so it has made room for the last one
        assert robot.windows[-1] == robot.windows[1]

    on_page(scenario)


def test_pages_whose_numbers_begin_alike_are_different_windows(on_page):
    async def scenario(client):
        cookies = await client.enter()
        for number in ("0123456789abcdef", "0123456789abcdee"):
            assert await client.status("POST", "/stop", {"robot": "Pepper", "page": number}, cookies) == 200
        assert len(set(client.station.robots["Pepper"].windows)) == 2

    on_page(scenario)


def test_a_robot_that_fails_once_does_not_end_the_looks_at_the_browsers(on_page, monkeypatch, caplog):
    monkeypatch.setattr(tabs, "BROWSER_KEPT", 0.1)

    async def scenario(client):
        def fail(names):
            raise RuntimeError("on purpose")

        client.station.robots["Pepper"].show_who_looks = fail
        socket = await client.socket(await client.enter(), attempt=1)
        async with asyncio.timeout(5.0):
            while "on purpose" not in caplog.text:
                await asyncio.sleep(0.01)
            await socket.close()
            while client.page._tabs.all:
                await asyncio.sleep(0.01)

    on_page(scenario)


def test_a_sign_in_that_opens_page_after_page_is_held_up(on_page, monkeypatch):
    monkeypatch.setattr(tabs, "NEW_TABS", (5, 3600.0))

    async def scenario(client):
        cookies = await client.enter()
        stops = [{"robot": "Pepper", "page": f"{number:016x}"} for number in range(8)]
        assert [await client.status("POST", "/stop", stop, cookies) for stop in stops] == 5 * [200] + 3 * [429]
        assert len(client.station.robots["Pepper"].windows) == 5
        assert await client.status("POST", "/stop", stops[4], cookies) == 200, "one that is open already"
        assert await client.status("POST", "/stop", stops[0], await client.enter()) == 200, "another sign-in"

    on_page(scenario)


def test_an_attempt_that_waits_for_the_end_of_an_old_one_ends_no_later_one(on_page):
    async def scenario(client):
        cookies = await client.enter()
        _old = await client.socket(cookies, attempt=1)
        (link,) = client.page._tabs.links.values()
        close, ends, ended = link.close, asyncio.Event(), asyncio.Event()

        async def close_slowly():
            ends.set()
            await ended.wait()
            await close()

        link.close = close_slowly
        held_up = asyncio.ensure_future(client.socket(cookies, attempt=2))
        await ends.wait()
        latest = await client.socket(cookies, attempt=3)
        ended.set()
        with pytest.raises(aiohttp.WSServerHandshakeError) as refused:
            await held_up
        assert refused.value.status == 409
        assert (await latest.receive(5.0)).type is aiohttp.WSMsgType.TEXT

    on_page(scenario)


def test_a_sign_in_that_ends_while_a_request_comes_opens_nothing(on_page):
    async def scenario(client):
        cookies = await client.enter()
        begun, left = asyncio.Event(), asyncio.Event()

        async def body():
            yield b'{"robot": "Pepper", "page": "0123456789abcdef", "attempt": 1, '
            begun.set()
            await left.wait()
            yield b'"sdp": "v=0"}'

        offer = asyncio.ensure_future(client.session.post(f"{client.url}/offer", data=body(), cookies=cookies))
        await begun.wait()
        assert await client.status("POST", "/leave", {}, cookies) == 200
        left.set()
        assert (await offer).status == 401
        assert client.station.robots["Pepper"].windows == []

    on_page(scenario)


def test_a_sign_in_that_makes_room_for_others_loses_what_it_has_open(on_page, monkeypatch):
    monkeypatch.setattr(browser_messages, "SILENCE", 60.0)

    async def scenario(client):
        socket = await client.socket(await client.enter(), attempt=1)
        for _ in range(MOST_OF_ONE):
            await client.enter()
        async with asyncio.timeout(10.0):
            while (await socket.receive()).type is aiohttp.WSMsgType.TEXT:
                pass
        assert socket.closed

    on_page(scenario)


def test_a_body_has_an_end(on_page):
    async def scenario(client):
        assert await client.status("POST", "/enter", b"x" * (MOST_BODY + 1)) in (400, 413)

    on_page(scenario)


def test_passwords_are_checked_few_at_a_time(on_page, monkeypatch):
    monkeypatch.setattr(sign_in_routes, "MOST_WAITING", 2)

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
