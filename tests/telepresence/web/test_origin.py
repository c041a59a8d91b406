"""Whose requests are refused because of the name under which they reach this machine; headers as they were recorded."""

from __future__ import annotations

import pytest

from telepresence.web.origin import foreign, may_be_a_browsers

NAMES = frozenset({"localhost"})
HOST = "robotino.lab:8080"
PROGRAMS = {
    "curl": {"USER_AGENT": "curl/7.88.1", "ACCEPT": "*/*"},
    "requests": {
        "USER_AGENT": "python-requests/2.32.3",
        "ACCEPT_ENCODING": "gzip, deflate",
        "ACCEPT": "*/*",
        "CONNECTION": "keep-alive",
    },
    "urllib": {"ACCEPT_ENCODING": "identity", "USER_AGENT": "Python-urllib/3.11", "CONNECTION": "close"},
    "aiohttp": {"ACCEPT": "*/*", "ACCEPT_ENCODING": "gzip, deflate", "USER_AGENT": "Python/3.11 aiohttp/3.11.18"},
    "a raw socket": {},
}
BROWSERS = {
    "an address that somebody typed": {
        "USER_AGENT": "Mozilla/5.0 (X11; Linux x86_64; rv:128.0) Gecko/20100101 Firefox/128.0",
        "ACCEPT_LANGUAGE": "en-US,en;q=0.5",
        "UPGRADE_INSECURE_REQUESTS": "1",
    },
    "fetch in Firefox, disguised as curl": {"USER_AGENT": "curl/8", "ACCEPT": "*/*", "ACCEPT_LANGUAGE": ""},
    "fetch in Chromium, disguised as curl": {"USER_AGENT": "Mozilla/5.0 (X11; Linux x86_64)", "ACCEPT_LANGUAGE": ""},
    "a post of the page itself": {"USER_AGENT": "curl/8", "ORIGIN": f"http://{HOST}"},
    "a picture": {"REFERER": f"http://{HOST}/"},
    "a request to a trustworthy address": {"SEC_FETCH_SITE": "same-origin"},
    "a link that was followed": {"SEC_FETCH_MODE": "navigate"},
    "one with a cookie": {"COOKIE": "a=b"},
}


def environ(headers: dict[str, str], host: str = HOST) -> dict[str, str]:
    return {f"HTTP_{name}": value for name, value in {**headers, "HOST": host}.items()}


@pytest.mark.parametrize("headers", PROGRAMS.values(), ids=PROGRAMS)
def test_a_program_may_use_any_name_where_programs_are_served(headers: dict[str, str]) -> None:
    assert not may_be_a_browsers(environ(headers))
    assert foreign(environ(headers), NAMES, programs=True) is None
    assert "is not called 'robotino.lab:8080'" in str(foreign(environ(headers), NAMES))


@pytest.mark.parametrize("headers", BROWSERS.values(), ids=BROWSERS)
def test_a_browser_may_not(headers: dict[str, str]) -> None:
    """DNS rebinding: its page's own name leads here."""
    assert may_be_a_browsers(environ(headers))
    for programs in (False, True):
        assert "is not called 'robotino.lab:8080'" in str(foreign(environ(headers), NAMES, programs=programs))


@pytest.mark.parametrize("host", ["127.0.0.1:8080", "[::1]:8080", "localhost:8080"])
@pytest.mark.parametrize("programs", [False, True])
def test_own_names_are_for_everybody_but_other_pages(host: str, programs: bool) -> None:
    typed = environ(BROWSERS["an address that somebody typed"], host)
    assert foreign(typed, NAMES, programs=programs) is None
    for name, value in (("HTTP_ORIGIN", "http://page.example"), ("HTTP_SEC_FETCH_SITE", "cross-site")):
        assert foreign({**typed, name: value}, NAMES, programs=programs) is not None
