"""What Caddy, the site's proxy, is to do: https://caddyserver.com/docs/caddyfile (2.6, Debian 12's).

    https://SITE/            the list of robots
    https://SITE/static/…    what belongs to it
    https://SITE/ROBOT/…     the page of a robot, from which /ROBOT is taken away: see `telepresence.page.proxy`

Caddy answers only those who call the site by its names, so that no page of another server can read the list (DNS
rebinding), and tells each page whose request it is: X-Forwarded-For that a browser sends, it throws away.
"""

from __future__ import annotations

import ipaddress
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

from telepresence.site.site_file import Elsewhere, Site, Unit
from telepresence.site.unit import socket_of

STATIC = Path(__file__).parent / "static"
DIAL_TIMEOUT = 2
"""[s] for a page to take a connection, after which the robot counts as away."""
ANSWER_TIMEOUT = 20
"""[s] for the head of an answer."""
MOST_BODY, MOST_HEADERS = "64KB", "16KB"
HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "Strict-Transport-Security": "max-age=31536000",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}


@dataclass(frozen=True)
class Files:
    """Where Caddy finds what it needs.

    Attributes:
        certificate, key: PEM; the key may be in the same file.
        folder: Of the site while it runs: the list, units' sockets, Caddy's own files.
    """

    certificate: Path
    key: Path
    folder: Path


def names_of(site: Site) -> list[str]:
    """Return how people may call the site."""
    loopback = ipaddress.ip_address(site.address).is_loopback
    return list(dict.fromkeys((site.host, site.address, *(("localhost", "127.0.0.1") if loopback else ()))))


def caddyfile(site: Site, files: Files) -> str:
    """Return Caddy's configuration."""
    own = ", ".join(f"https://{name}:{site.port}" for name in names_of(site))
    both = [f"bind {site.address}", f"tls {_quoted(files.certificate)} {_quoted(files.key)}"]
    headers = "\n".join(f"{name} {_quoted(value)}" for name, value in HEADERS.items())
    blocks = [
        _block(
            "",
            "admin off",
            "auto_https off",
            _block("storage file_system", f"root {_quoted(files.folder / 'caddy')}"),
            _block(
                "servers",
                "protocols h1 h2",
                f"max_header_size {MOST_HEADERS}",
                _block("timeouts", "read_header 10s", "read_body 20s", "idle 2m"),
            ),
            _block("log", "output stdout", "format console", "level WARN"),
        ),
        _block(
            own,
            *both,
            _block("request_body", f"max_size {MOST_BODY}"),
            *(_robot(robot, files.folder) for robot in site.robots),
            _block("handle /", _block("header", headers), f"root * {_quoted(files.folder / 'list')}", "file_server"),
            _block("handle_path /static/*", _block("header", headers), f"root * {_quoted(STATIC)}", "file_server"),
            _block("handle", "respond 404"),
            _errors(headers),
        ),
        _block(f"https://:{site.port}", *both, "respond 421"),
    ]
    return "\n".join(blocks)


def _robot(robot: Unit | Elsewhere, folder: Path) -> str:
    times = [f"dial_timeout {DIAL_TIMEOUT}s", f"response_header_timeout {ANSWER_TIMEOUT}s"]
    if isinstance(robot, Unit):
        place, extra = _quoted(f"unix/{socket_of(robot, folder)}"), []
    else:
        # By HTTP/1.1, as browsers send it: the page's websocket has no other.
        place, extra = robot.url.rstrip("/"), ["versions 1.1", f"tls_server_name {urlsplit(robot.url).hostname}"]
        if robot.authority is not None:
            extra.append(f"tls_trusted_ca_certs {_quoted(robot.authority)}")
    return "\n".join(
        (
            f"redir /{robot.name} /{robot.name}/ 308",
            _block(
                f"handle_path /{robot.name}/*",
                _block(f"reverse_proxy {place}", _block("transport http", *times, *extra)),
            ),
        )
    )


def _errors(headers: str) -> str:
    """A robot that is away: a page for who opens it, which waits for it; a sentence for a page that is open."""
    away = "This robot is not there now."
    return _block(
        "handle_errors",
        _block("header", headers),
        "@away expression {err.status_code} >= 500",
        "@opened header Accept *text/html*",
        _block(
            "handle @away",
            _block(
                "handle @opened",
                f"root * {_quoted(STATIC)}",
                "rewrite * /away.html",
                _block("file_server", "status {err.status_code}"),
            ),
            _block(
                "handle",
                "header Content-Type application/json",
                f'respond `{{"reason": "{away}"}}` {{err.status_code}}',
            ),
        ),
        _block("handle", "respond {err.status_code}"),
    )


def _block(head: str, *lines: str) -> str:
    inner = "\n".join(f"\t{line}" for text in lines for line in text.splitlines())
    return f"{head} {{\n{inner}\n}}".lstrip()


def _quoted(word: object) -> str:
    """Return a word as a Caddyfile takes it: there are no quotes in it, which `site_file` sees to."""
    return f'"{word}"'
