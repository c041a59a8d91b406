"""The page behind a site's proxy: whose request counts as whose, and cookies that no other robot of the site gets."""

from __future__ import annotations

import asyncio

import pytest
from page_server import ANNA, serve

from telepresence.page.attempts import MOST
from telepresence.page.proxy import UNKNOWN, Proxy, forwarded_for
from telepresence.page.serving import LIMITS
from telepresence.page.sign_ins import COOKIE, COOKIE_OF_PATH

URL = "https://robots.example:8443/anna/"
SITE = {"Host": "robots.example:8443", "Origin": "https://robots.example:8443"}
"""What a browser sends to the site, and Caddy on to the page."""


def guess(number: int) -> dict[str, str]:
    """A try with a link that opens nothing: refused at once, while a wrong password takes its time."""
    return {"name": "eve", "invitation": f"guess{number}"}


@pytest.fixture
def by_socket(tmp_path):
    return Proxy(URL, f"unix:{tmp_path}/anna.socket")


def test_a_page_behind_a_proxy_has_a_cookie_for_its_own_path(tmp_path, by_socket):
    async def scenario(client):
        answer, _ = await client.ask("POST", "/enter", ANNA, **SITE)
        morsel = answer.cookies[COOKIE_OF_PATH]
        assert (morsel["path"], morsel["secure"], morsel["httponly"], morsel["samesite"]) == (
            "/anna/", True, True, "Strict",
        )  # fmt: skip
        cookies = {COOKIE_OF_PATH: morsel.value}
        assert await client.status("GET", "/me", cookies=cookies, **SITE) == 200
        assert await client.status("GET", "/me", cookies={COOKIE: morsel.value}, **SITE) == 401
        answer, _ = await client.ask("POST", "/leave", {}, cookies, **SITE)
        assert answer.cookies[COOKIE_OF_PATH]["path"] == "/anna/" and answer.cookies[COOKIE_OF_PATH].value == ""
        assert await client.status("GET", "/me", cookies=cookies, **SITE) == 401

    serve(tmp_path, scenario, proxy=by_socket)


def test_only_the_sites_name_and_pages_of_the_site_get_in(tmp_path, by_socket):
    async def scenario(client):
        assert await client.status("POST", "/enter", ANNA, Host="evil.example") == 403
        assert await client.status("POST", "/enter", ANNA, Host=SITE["Host"], Origin="https://evil.example") == 403
        assert await client.status("POST", "/enter", ANNA, **SITE, Sec_Fetch_Site="cross-site") == 403

    serve(tmp_path, scenario, proxy=by_socket)


def test_tries_are_counted_by_the_address_that_the_proxy_names(tmp_path, by_socket):
    async def scenario(client):
        async def enter(fields, client_address):
            return await client.status("POST", "/enter", fields, **SITE, X_Forwarded_For=client_address)

        tries = [enter(guess(number), f"203.0.113.{number}, 198.51.100.7") for number in range(MOST)]
        assert set(await asyncio.gather(*tries)) == {403}
        assert await enter(ANNA, "198.51.100.8, 198.51.100.7") == 429, "what the browser wrote itself is not counted"
        assert await enter(ANNA, "198.51.100.8") == 200, "others notice nothing of it"

    serve(tmp_path, scenario, proxy=by_socket)


def test_connections_are_counted_by_the_browser_that_the_proxy_names(tmp_path, by_socket):
    async def half_request(client_address, cookie=""):
        """Return the connection of who begins to come in, and does not go on."""
        reader, writer = await asyncio.open_unix_connection(by_socket.socket)
        lines = (
            "POST /enter HTTP/1.1", f"Host: {SITE['Host']}", f"X-Forwarded-For: {client_address}",
            f"Cookie: {COOKIE_OF_PATH}={cookie}", "Content-Length: 100", "", "{",
        )  # fmt: skip
        writer.write("\r\n".join(lines).encode())
        return reader, writer

    async def scenario(client):
        answer, _ = await client.ask("POST", "/enter", ANNA, **SITE, X_Forwarded_For="198.51.100.8")
        other = await half_request("198.51.100.9")
        signed_in = await half_request("198.51.100.7", answer.cookies[COOKIE_OF_PATH].value)
        crowd = [await half_request("198.51.100.7") for _ in range(LIMITS.per_party + 3)]
        async with asyncio.timeout(20.0):
            while sum(reader.at_eof() for reader, _ in crowd) < 3:
                await asyncio.sleep(0.01)
        assert await client.status("GET", "/me", **SITE, X_Forwarded_For="198.51.100.7") == 401, "it is answered, too"
        assert not other[0].at_eof() and not signed_in[0].at_eof()
        for _, writer in (other, signed_in, *crowd):
            writer.transport.abort()

    serve(tmp_path, scenario, proxy=by_socket)


@pytest.mark.parametrize("place", ["", "127.0.0.9", "::1"])
def test_what_somebody_says_who_is_no_proxy_counts_for_nothing(tmp_path, place):
    """Neither another page's proxy nor a program of this machine chooses the address by which its tries are counted."""

    async def scenario(client):
        tries = [client.status("POST", "/enter", guess(n), X_Forwarded_For=f"203.0.113.{n}") for n in range(MOST)]
        assert set(await asyncio.gather(*tries)) == {403}
        assert await client.status("POST", "/enter", ANNA, X_Forwarded_For="203.0.113.99") == 429

    serve(tmp_path, scenario, proxy=Proxy(URL, place) if place else None)


def test_a_proxy_with_an_address_is_known_by_it(tmp_path):
    async def scenario(client):
        for number in range(MOST + 1):
            sender = f"203.0.113.{number}"
            assert await client.status("POST", "/enter", guess(number), X_Forwarded_For=sender) == 403

    serve(tmp_path, scenario, proxy=Proxy(URL, "127.0.0.1"))


@pytest.mark.parametrize("header", [{}, {"X_Forwarded_For": "somebody"}, {"X_Forwarded_For": "127.0.0.1, 10.0.0.7"}])
def test_who_comes_by_the_proxy_is_not_at_this_machine(tmp_path, by_socket, header):
    """Where nobody signs in, only who sits at this machine comes in without a link."""

    async def scenario(client):
        assert await client.status("POST", "/enter", {"name": "", "password": ""}, **SITE, **header) == 403
        fields = await client.fields("GET", "/me")
        assert fields["password"], "and the page asks for a password"

    serve(tmp_path, scenario, sign_in=False, proxy=by_socket)


@pytest.mark.parametrize(
    ("headers", "client"),
    [
        (["10.0.0.7"], "10.0.0.7"),
        (["1.2.3.4, 10.0.0.7"], "10.0.0.7"),
        (["1.2.3.4", "fd00::7"], "fd00::7"),
        ([], UNKNOWN),
        ([""], UNKNOWN),
        (["10.0.0.7,"], UNKNOWN),
        (["10.0.0.7:99"], UNKNOWN),
    ],
)
def test_the_last_address_is_the_proxys(headers, client):
    assert forwarded_for(headers) == client


@pytest.mark.parametrize(
    ("url", "place"),
    [
        ("http://robots.example/anna/", "127.0.0.1"),
        ("https://robots.example/anna", "127.0.0.1"),
        ("https://robots.example/an;na/", "127.0.0.1"),
        ("https:///anna/", "127.0.0.1"),
        ("https://robots.example/anna/", "somewhere"),
        ("https://robots.example/anna/", ""),
    ],
)
def test_what_is_no_proxy_is_refused(url, place):
    with pytest.raises(ValueError):
        Proxy(url, place)
