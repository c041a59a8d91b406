"""Programs that speak to the pilot's page: a pilot who drives by the websocket, and strangers who do as they like."""

from __future__ import annotations

import http.client
import json
import math
import re
import secrets
import socket
import ssl
import threading
import time
from collections import Counter
from types import TracebackType
from urllib.parse import urlsplit

import tls_stream
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from telepresence.page.sign_ins import COOKIE, COOKIE_OF_PATH

FORWARD, ZERO = [0.2, 0.0, 0.0], [0.0, 0.0, 0.0]
_PERIOD = 0.05
_AGAIN = 0.5
"""[s] from one time that the robot is taken to the next: the page heeds few."""
_TIMEOUT = 60.0
_AT_ONCE = 50
_STATUS = re.compile(rb"HTTP/1\.1 (\d{3})")


class Stranger:
    """A client of the page that checks no certificate.

    Args:
        url: Of the page; with a path, behind a site's proxy.
    """

    def __init__(self, url: str) -> None:
        parts = urlsplit(url)
        assert parts.hostname and parts.port
        self.host, self.port, self.origin = parts.hostname, parts.port, f"https://{parts.netloc}"
        self._path = parts.path.rstrip("/")
        self._cookie = COOKIE_OF_PATH if self._path else COOKIE
        self.context = ssl.create_default_context()
        self.context.check_hostname, self.context.verify_mode = False, ssl.CERT_NONE

    def ask(
        self, method: str, path: str, body: object = None, cookie: str = "", sender: str = "127.0.0.1", **headers: str
    ) -> tuple[int, bytes, str]:
        """Send a request; status, body, and the cookie that came."""
        client = http.client.HTTPSConnection(
            self.host, self.port, context=self.context, timeout=_TIMEOUT, source_address=(sender, 0)
        )
        header = {name.replace("_", "-"): value for name, value in headers.items()}
        if cookie:
            header["Cookie"] = f"{self._cookie}={cookie}"
        data = body if isinstance(body, bytes | None) else json.dumps(body).encode()
        try:
            client.request(method, self._path + path, data, header)
            answer = client.getresponse()
            got = (answer.getheader("Set-Cookie") or "").partition(f"{self._cookie}=")[2].partition(";")[0].strip('"')
            return answer.status, answer.read(), got
        finally:
            client.close()

    def enter(self, **fields: str) -> str:
        """Come in; the cookie, or nothing."""
        return self.ask("POST", "/enter", fields)[2]

    def flood(self, bodies: list[str], sender: str) -> Counter[int]:
        """Try to come in with each body, many at a time, as fast as they are answered; how often each status came."""
        statuses: Counter[int] = Counter()
        requests = [
            f"POST /enter HTTP/1.1\r\nHost: {self.host}:{self.port}\r\nContent-Length: {len(body)}\r\n\r\n{body}"
            for body in bodies
        ]
        plain = socket.create_connection((self.host, self.port), _TIMEOUT, (sender, 0))
        with self.context.wrap_socket(plain) as connection:
            for begin in range(0, len(requests), _AT_ONCE):
                batch = requests[begin : begin + _AT_ONCE]
                connection.sendall("".join(batch).encode())
                answers = b""
                while len(found := _STATUS.findall(answers)) < len(batch) or not answers.endswith(b"}"):
                    received = connection.recv(65536)
                    assert received, "the page has hung up"
                    answers += received
                statuses.update(map(int, found))
        return statuses

    def open(self, cookie: str, origin: str | None = None, robot: str = "Pepper", **headers: str) -> ClientConnection:
        """Open the page's websocket, as a page of its own."""
        return connect(
            f"ws://{self.host}:{self.port}{self._path}/ws?robot={robot}&page={secrets.token_hex(8)}&attempt=1",
            sock=tls_stream.connect(self.host, self.port, self.context, _TIMEOUT),  # type: ignore[arg-type]
            additional_headers={"Cookie": f"{self._cookie}={cookie}", **headers},
            origin=origin or self.origin,  # type: ignore[arg-type]
            compression=None,
            max_size=None,
            max_queue=None,  # else it reads no goodbye while pictures wait
            open_timeout=_TIMEOUT,
        )


def drive(number: int, velocity: list[float] | None = FORWARD, sent: float | None = None) -> str:
    """Return a message of the page that drives."""
    now = time.monotonic() if sent is None else sent
    return f"drive {json.dumps({'n': number, 't': now, 'v': velocity, 'hold': ''})}"


def ask(number: int, action: str, value: object = None) -> str:
    """Return a message of the page that asks for something."""
    return f"ask {json.dumps({'id': number, 'do': action, 'with': value})}"


class Pilot(threading.Thread):
    """Takes the robot and drives, twenty commands a second, until it is closed.

    Attributes:
        had: Who had the robot, by each state: "I", "nobody" or "another". Nobody has it when this program, the page or
            drive_lease was held up for longer than a lease lasts: then it is taken again.
        silence: The longest time between two states [s].
        pictures: How many came.
        hung_up: Whether the page has.
    """

    def __init__(self, stranger: Stranger, cookie: str, robot: str = "Pepper", velocity: list[float] = FORWARD) -> None:
        super().__init__(name="pilot", daemon=True)
        self._socket = stranger.open(cookie, robot=robot)
        self._velocity = velocity
        self._over = threading.Event()
        self.had: list[str] = []
        self.silence = 0.0
        self._heard, self._took = math.inf, -math.inf
        self.pictures = 0
        self.hung_up = False
        self.start()

    def run(self) -> None:
        try:
            self._drive()
        except ConnectionClosed:
            self.hung_up = True

    def ask(self, action: str) -> None:
        """Ask for something."""
        self._socket.send(ask(1, action))

    def _drive(self) -> None:
        number = 0
        self._take()  # from another page of the same person
        due = time.monotonic()
        while not self._over.is_set():
            number += 1
            self._socket.send(drive(number, self._velocity))
            due += _PERIOD
            while (left := due - time.monotonic()) > 0:
                self._receive(left)

    def _take(self) -> None:
        self._took = time.monotonic()
        self.ask("take")

    def _receive(self, left: float) -> None:
        try:
            message = self._socket.recv(timeout=left)
        except TimeoutError:
            return
        if isinstance(message, bytes):
            self.pictures += 1
            self._socket.send("seen")
        elif message.startswith("state "):
            state, now = json.loads(message[6:]), time.monotonic()
            self.silence, self._heard = max(self.silence, now - self._heard), now
            self.had.append("I" if state["mine"] else "another" if state["pilot"] else "nobody")
            if self.had[-1] == "nobody" and time.monotonic() - self._took > _AGAIN:
                self._take()

    def __enter__(self) -> Pilot:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._over.set()
        self.join()
        self._socket.close()


def says_goodbye(socket: ClientConnection) -> bool:
    """Whether the page hangs up."""
    try:
        while True:
            socket.recv(timeout=_TIMEOUT)
    except ConnectionClosed:
        return True
    except TimeoutError:
        return False
