"""HTTP for a web view: cookies, redirects, time-outs; another thread can cancel a request at any moment.

It runs on the pilot's computer, where pages of others find more than on a tablet: a redirect is followed on the page's
own server only, and never elsewhere.
"""

from __future__ import annotations

import errno
import http.client
import http.cookiejar
import io
import mimetypes
import os
import select
import socket
import ssl
import threading
import time
import urllib.error
import urllib.parse
import urllib.request
import urllib.response
from collections.abc import Callable
from email.message import Message
from pathlib import Path
from typing import Any

USER_AGENT = (
    "Mozilla/5.0 (Linux; Android 5.1; LPT_200AR Build/LMY47I) AppleWebKit/537.36 (KHTML, like Gecko) "
    "Chrome/44.0.2403.157 Crosswalk/15.44.384.6 Safari/537.36"
)
"""User agent of Pepper's tablet, as reported by public Pepper applications."""

CONNECT_TIMEOUT = 5.0  # seconds
READ_TIMEOUT = 10.0  # seconds without a byte
_MAX_COOKIES = 200
ROBOT_HOST = "198.18.0.1"
"""The robot as seen from the tablet; its web server holds the pages of installed applications."""
RobotFiles = Callable[[str], Path | None]
"""Path of an address on the robot's web server -> the file; None if there is none."""


class LoadError(Exception):
    """A resource did not load.

    Attributes:
        code: Error code of android.webkit.WebViewClient.
        text: Text of its error page, for example "net::ERR_CONNECTION_REFUSED".
    """

    def __init__(self, code: int, text: str) -> None:
        super().__init__(text)
        self.code = code
        self.text = text


class Cancelled(Exception):
    """`Fetcher.cancel` was called."""


# Source of the codes: Android reference, class WebViewClient, constants ERROR_*.
UNKNOWN, HOST_LOOKUP, CONNECT, IO, TIMEOUT, REDIRECT_LOOP, UNSUPPORTED_SCHEME, BAD_URL = (
    -1,
    -2,
    -6,
    -7,
    -8,
    -9,
    -10,
    -12,
)


def check_url(url: str) -> None:
    """Accept http and https with a host.

    Raises:
        LoadError: Anything else.
    """
    try:
        parts = urllib.parse.urlsplit(url)
        scheme, host, _ = parts.scheme, parts.hostname, parts.port
    except ValueError:
        raise LoadError(BAD_URL, "net::ERR_INVALID_URL") from None
    if scheme not in ("http", "https"):
        raise LoadError(UNSUPPORTED_SCHEME, "net::ERR_UNKNOWN_URL_SCHEME")
    if not host or any(c <= " " or c == "\x7f" for c in url):
        raise LoadError(BAD_URL, "net::ERR_INVALID_URL")


class Fetcher:
    """Makes the requests of one page; `cancel` may be called from any thread and ends a running one at once.

    Args:
        robot_files: What the robot's own web server has; without it that server is looked for in the network.
    """

    def __init__(self, cookies: http.cookiejar.CookieJar, robot_files: RobotFiles | None = None) -> None:
        self._cancelled = threading.Event()
        self._lock = threading.Lock()
        self._socket: socket.socket | None = None
        self._cookies = cookies
        opener = urllib.request.OpenerDirector()  # unlike build_opener it reads no files and uses no proxies
        for handler in (
            _HttpHandler(self, robot_files),
            urllib.request.HTTPCookieProcessor(cookies),
            _RedirectHandler(),
            urllib.request.HTTPDefaultErrorHandler(),
            urllib.request.HTTPErrorProcessor(),
        ):
            opener.add_handler(handler)
        self._opener = opener

    def get(self, url: str) -> Any:
        """Return the response to a GET, after redirects of the server to itself, whatever its status; the caller
        closes it.

        Raises:
            LoadError: There is no answer, or it is not HTTP.
            Cancelled: `cancel` was called.
        """
        check_url(url)
        request = urllib.request.Request(url, headers={"User-Agent": USER_AGENT, "Accept": "text/html,image/*,*/*"})
        if len(self._cookies) > _MAX_COOKIES:
            self._cookies.clear()
        try:
            return self._opener.open(request, timeout=READ_TIMEOUT)
        except urllib.error.HTTPError as error:
            if 300 <= error.code < 400:
                error.close()
                raise LoadError(REDIRECT_LOOP, "net::ERR_TOO_MANY_REDIRECTS") from None
            return error  # a web view shows the server's error page
        except LoadError:
            raise
        except (OSError, http.client.HTTPException, ValueError) as error:
            if self._cancelled.is_set():
                raise Cancelled from None
            raise _load_error(error) from error

    def read(self, response: Any, size: int) -> bytes:
        """Return what has arrived of the body, 1 to `size` bytes; b"" at its end.

        Raises:
            LoadError, Cancelled: As `get`.
        """
        try:
            data = response.read1(size)
        except (OSError, http.client.HTTPException, ValueError) as error:
            if not self._cancelled.is_set():
                raise _load_error(error) from error
            data = b""
        if self._cancelled.is_set():
            raise Cancelled
        return data

    def read_all(self, response: Any, limit: int, timeout: float) -> bytes:
        """Return the whole body, cut after `limit` bytes.

        Raises:
            LoadError: It is not complete after `timeout` seconds; or as `get`.
            Cancelled: As `get`.
        """
        deadline = time.monotonic() + timeout
        body = bytearray()
        while len(body) < limit:
            data = self.read(response, min(65536, limit - len(body)))
            if not data:
                break
            body += data
            if time.monotonic() > deadline:
                raise LoadError(TIMEOUT, "net::ERR_TIMED_OUT")
        return bytes(body)

    def cancel(self) -> None:
        self._cancelled.set()
        with self._lock:
            if self._socket is not None:
                try:
                    self._socket.shutdown(socket.SHUT_RDWR)
                except OSError:
                    pass  # closed already

    def connect(self, host: str, port: int) -> socket.socket:
        """Open a TCP connection. Unlike `socket.create_connection` it gives up soon after `cancel`."""
        deadline = time.monotonic() + CONNECT_TIMEOUT
        failure: OSError = OSError(f"{host} has no address")
        for family, kind, protocol, _, address in socket.getaddrinfo(host, port, type=socket.SOCK_STREAM):
            connection = socket.socket(family, kind, protocol)
            try:
                connection.setblocking(False)
                status = connection.connect_ex(address)
                if status == errno.EINPROGRESS:
                    self._await_connection(connection, deadline)
                    status = connection.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
                if status:
                    raise OSError(status, os.strerror(status))
                connection.settimeout(READ_TIMEOUT)
            except OSError as error:
                connection.close()
                failure = error
                continue
            except Cancelled:
                connection.close()
                raise
            with self._lock:
                self._socket = connection
            if self._cancelled.is_set():  # cancelled just before the line above, when there was no socket to shut down
                connection.close()
                raise Cancelled
            return connection
        raise failure

    def _await_connection(self, connection: socket.socket, deadline: float) -> None:
        while not select.select([], [connection], [], 0.1)[1]:
            if self._cancelled.is_set():
                raise Cancelled
            if time.monotonic() > deadline:
                raise TimeoutError("no answer")


class _HttpHandler(urllib.request.AbstractHTTPHandler):
    """Opens http and https over `Fetcher.connect`, and the robot's files where they are."""

    def __init__(self, fetcher: Fetcher, robot_files: RobotFiles | None) -> None:
        super().__init__()
        self._fetcher = fetcher
        self._robot_files = robot_files

    def http_open(self, request: urllib.request.Request) -> Any:
        if self._robot_files is not None and request.host == ROBOT_HOST:
            return _answer_from_disk(self._robot_files, request.full_url)
        return self.do_open(lambda host, **options: _Connection(self._fetcher, None, host, **options), request)

    def https_open(self, request: urllib.request.Request) -> Any:
        context = ssl.create_default_context()
        return self.do_open(lambda host, **options: _Connection(self._fetcher, context, host, **options), request)

    http_request = urllib.request.AbstractHTTPHandler.do_request_
    https_request = urllib.request.AbstractHTTPHandler.do_request_


def _answer_from_disk(robot_files: RobotFiles, url: str) -> urllib.response.addinfourl:
    file = robot_files(urllib.parse.unquote(urllib.parse.urlsplit(url).path))
    headers = Message()
    kind = (mimetypes.guess_type(file.name)[0] if file is not None else None) or "text/html"
    headers["Content-Type"] = kind
    body = file.read_bytes() if file is not None else b"<h1>404 Not Found</h1>"
    response = urllib.response.addinfourl(io.BytesIO(body), headers, url, 200 if file is not None else 404)
    response.msg = "OK" if file is not None else "Not Found"  # type: ignore[attr-defined]  # urllib reads it
    return response


class _Connection(http.client.HTTPConnection):
    def __init__(self, fetcher: Fetcher, context: ssl.SSLContext | None, host: str, **options: Any) -> None:
        if context is not None:
            self.default_port = http.client.HTTPS_PORT
        super().__init__(host, **options)
        self._fetcher = fetcher
        self._context = context

    def connect(self) -> None:
        self.sock = self._fetcher.connect(self.host, self.port)
        if self._context is not None:
            self.sock = self._context.wrap_socket(self.sock, server_hostname=self.host)


class _RedirectHandler(urllib.request.HTTPRedirectHandler):
    max_redirections = 10

    def http_error_302(self, req: Any, fp: Any, code: int, msg: str, headers: Any) -> Any:
        fp.close()
        target = urllib.parse.urljoin(req.full_url, headers.get("Location", ""))
        check_url(target)
        if _server(target) != _server(req.full_url):
            raise LoadError(CONNECT, "net::ERR_UNSAFE_REDIRECT")
        # The base class reads the body to its end, which may never come.
        return super().http_error_302(req, io.BytesIO(), code, msg, headers)

    http_error_301 = http_error_303 = http_error_307 = http_error_308 = http_error_302


def _server(url: str) -> tuple[str, str | None, int | None]:
    parts = urllib.parse.urlsplit(url)
    return parts.scheme, parts.hostname, parts.port


def _load_error(error: Exception) -> LoadError:
    """Return the error that Android's web view reports for a network failure."""
    cause = error.reason if isinstance(error, urllib.error.URLError) else error
    if isinstance(cause, socket.gaierror):
        return LoadError(HOST_LOOKUP, "net::ERR_NAME_NOT_RESOLVED")
    if isinstance(cause, TimeoutError):
        return LoadError(TIMEOUT, "net::ERR_TIMED_OUT")
    if isinstance(cause, ConnectionRefusedError):
        return LoadError(CONNECT, "net::ERR_CONNECTION_REFUSED")
    if isinstance(cause, http.client.RemoteDisconnected):  # a kind of ConnectionResetError
        return LoadError(IO, "net::ERR_EMPTY_RESPONSE")
    if isinstance(cause, ConnectionError):
        return LoadError(IO, "net::ERR_CONNECTION_RESET")
    if isinstance(cause, http.client.HTTPException | ValueError):
        return LoadError(UNKNOWN, "net::ERR_INVALID_HTTP_RESPONSE")
    if isinstance(cause, OSError) and cause.errno:
        return LoadError(CONNECT, "net::ERR_ADDRESS_UNREACHABLE")
    return LoadError(UNKNOWN, "net::ERR_FAILED")
