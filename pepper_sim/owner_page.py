"""The robot's own page, as a real Pepper has one: its owner says there whether programs may switch reflexes off.

    GET /               the page; /?k=KEY leads there by way of a cookie
    POST /consent       form, programs=1: the owner consents, programs=0: no longer; leads back to the page

A real robot asks for its password; here the key in the address stands for it, which the simulator prints. What else
keeps others out is in `telepresence.web.page_auth`.
"""

from __future__ import annotations

import logging
import urllib.parse

from pepper_sim.body.consent import OwnerConsent
from telepresence.web.json_app import HTML, Application, BadRequest, Environ, Refusal, Response, json_app
from telepresence.web.page_auth import PageAuth, ProtectedPage
from telepresence.web.server import WebServer

log = logging.getLogger(__name__)

KEY_VARIABLE = "TELEPRESENCE_ROBOT_PAGE_KEY"
"""Environment variable that holds the key to the page."""
MAX_FORM = 64
"""Longest form that is read [bytes]; the page's own has 10."""
_CSP = "default-src 'none'; style-src 'unsafe-inline'"
_PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<link rel="icon" href="data:,">
<title>Pepper (simulated)</title>
<style>
  body {{ max-width: 40em; margin: 3em auto; font-family: sans-serif; line-height: 1.4; }}
  button {{ font-size: 1em; padding: 0.5em 1em; }}
</style>
</head>
<body>
<h1>Pepper (simulated)</h1>
<h2>Safety reflexes</h2>
<p>Programs <strong>{may}</strong> switch off what keeps the robot from driving into obstacles, from moving on after a
fall, and from falling when it is pushed.</p>
<form method="post" action="consent">
<input type="hidden" name="programs" value="{other}">
<button>{action}</button>
</form>
</body>
</html>
"""


def create_app(consent: OwnerConsent, key: str | None) -> Application:
    """Make the application for the robot whose owner's consent this is; `key` opens it, None lets everybody in."""

    def answer(method: str, path: str, environ: Environ) -> Response:
        if (method, path) == ("POST", "/consent"):
            consent.given = _choice(environ)
            return Response(303, headers=(("Location", "./"),))
        if path == "/consent":
            raise Refusal(405, "This address takes the form of the page.", (("Allow", "POST"),))
        if path != "/":
            raise Refusal(404, "There is nothing here.")
        if method == "POST":
            raise Refusal(405, "This page can be read and nothing else.", (("Allow", "GET"),))
        return Response(body=_page(consent.given), content_type=HTML)

    return ProtectedPage(json_app(answer), PageAuth(key), _CSP, forms=True)


def serve(consent: OwnerConsent, address: str, port: int, key: str) -> WebServer:
    """Start the page; port 0 takes a free one.

    Raises:
        OSError: The port is taken or the address is not this machine's.
    """
    server = WebServer(create_app(consent, key), address, port)
    if address not in ("127.0.0.1", "localhost", "::1"):
        log.warning("the owner's page listens on %s: its key crosses the network in the clear", address)
    server.start()
    return server


def _page(given: bool) -> bytes:
    if given:
        words = {"may": "may", "other": "0", "action": "Withdraw the consent"}
    else:
        words = {"may": "may not", "other": "1", "action": "Consent"}
    return _PAGE.format(**words).encode()


def _choice(environ: Environ) -> bool:
    """Return what the form says.

    Raises:
        BadRequest: It is not the page's form.
    """
    length = int(environ.get("CONTENT_LENGTH") or 0)  # the server has refused anything but digits
    body = environ["wsgi.input"].read(MAX_FORM + 1) if length <= MAX_FORM else b""
    choices = {b"programs=1": True, b"programs=0": False}
    if body not in choices:
        raise BadRequest("expected the form of the page: programs=1 or programs=0", (("Connection", "close"),))
    return choices[body]


def address_with_key(server: WebServer, key: str) -> str:
    """Return what the owner opens."""
    return f"{server.url}?{urllib.parse.urlencode({'k': key})}"
