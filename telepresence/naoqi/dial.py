"""Dialling: from an address to a connection that is not logged in yet."""

from __future__ import annotations

import socket
import ssl
import time

from .connection import Connection
from .dynamics import PYTHON, Dialect
from .limits import Limits
from .socket_options import prepare

CONNECT_S = 10.0
"""Seconds within which a connection must be made, TLS included."""
DEFAULT_PORT = 9559


def connect(
    url: str,
    *,
    capabilities: dict[str, bool],
    tls: ssl.SSLContext | None = None,
    timeout: float = CONNECT_S,
    limits: Limits = Limits(),  # noqa: B008 -- frozen
    dialect: Dialect = PYTHON,
) -> Connection:
    """Connect to "tcp://host:port" or "tcps://host:port"; the caller's thread waits. Log in next, see `login.py`.

    Args:
        capabilities: To announce, see `releases.py`.
        tls: For tcps; without it as libqi: TLS 1.2, and no certificate is checked.
        timeout: Until it is connected, TLS included [s].
    Raises:
        RuntimeError: It cannot connect; the text begins with "Connect error" as libqi's.
    """
    secure, host, port = split_url(url)
    deadline = time.monotonic() + timeout
    try:
        stream = socket.create_connection((host, port), timeout)
    except OSError as error:
        raise RuntimeError(f"Connect error: {_number(error)}{error.strerror or error} ({url})") from None
    try:
        if secure:
            stream.settimeout(max(0.001, deadline - time.monotonic()))
            stream = (tls or client_tls()).wrap_socket(stream, server_hostname=host)
        prepare(stream)
        there = str(stream.getpeername()[0])
    except (OSError, ValueError) as error:
        stream.close()
        raise RuntimeError(f"Connect error: {error} ({url})") from None
    connection = Connection(
        stream, capabilities=capabilities, limits=limits, dialect=dialect, dialled=True, peer=f"{host}:{port}"
    )
    connection.url, connection.there = url, there
    return connection


def client_tls() -> ssl.SSLContext:
    """Return libqi's idea of TLS: version 1.2, no certificate is checked. Passwords are visible to a man in the middle;
    whoever knows the robot's certificate gives a context of his own."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname = False
    context.verify_mode = ssl.CERT_NONE
    context.minimum_version = context.maximum_version = ssl.TLSVersion.TLSv1_2
    return context


def split_url(url: str) -> tuple[bool, str, int]:
    """Return (TLS, host, port) of "tcp://host:port", "tcps://host:port", "host:port" or "host".

    Raises: RuntimeError: It is no such address.
    """
    scheme, separator, rest = url.partition("://")
    if not separator:
        scheme, rest = "tcp", url
    host, separator, number = rest.rpartition(":")
    if not separator or (":" in host and not host.endswith("]")):
        host, number = rest, str(DEFAULT_PORT)
    if scheme not in ("tcp", "tcps") or not number.isdigit() or int(number) > 65535:
        raise RuntimeError(f"Invalid url: {url!r} is not tcp://host:port or tcps://host:port")
    return scheme == "tcps", host.strip("[]") or "127.0.0.1", int(number)


def _number(error: OSError) -> str:
    return f"{error.errno}: " if error.errno else ""
