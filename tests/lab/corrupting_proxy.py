"""An HTTP relay to a Robotino that spoils, delays or refuses what a test names."""

from __future__ import annotations

import collections
import http.client
import json
import threading
import time
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any


class CorruptingProxy:
    """Relays requests to 127.0.0.1:`target` over connections that stay open, as the robot's own do.

    Attributes:
        spoil: Path -> what becomes of the body of its answer. A function may wait: that is a robot that hangs.
        delay: Path -> seconds that pass before the robot gets the request.
        missing: Paths that are answered with 404.
        asked: Path -> requests that have arrived.
        put: What was written, as (when it was passed on [s, monotonic], path, value).
    """

    def __init__(self, target: int) -> None:
        self.spoil: dict[str, Callable[[bytes], bytes]] = {}
        self.delay: dict[str, float] = {}
        self.missing: set[str] = set()
        self.asked: collections.Counter[str] = collections.Counter()
        self.put: list[tuple[float, str, Any]] = []
        proxy = self

        class Handler(BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"
            disable_nagle_algorithm = True

            def setup(self) -> None:
                super().setup()
                self.robot = http.client.HTTPConnection("127.0.0.1", target, timeout=5.0)

            def finish(self) -> None:
                self.robot.close()
                super().finish()

            def relay(self) -> None:
                path = self.path.partition("?")[0]
                asked = self.rfile.read(int(self.headers.get("Content-Length") or 0))
                if path in proxy.missing:
                    self.send_response(404)
                    self.send_header("Content-Length", "0")
                    self.end_headers()
                    return
                delay = proxy.delay.get(path, 0.0)
                proxy.asked[path] += 1
                time.sleep(delay)
                if self.command == "PUT":
                    proxy.put.append((time.monotonic(), path, json.loads(asked)))
                kind = {"Content-Type": self.headers.get("Content-Type") or "application/json"}
                try:
                    self.robot.request(self.command, self.path, asked, kind)
                    answer = self.robot.getresponse()
                    body = answer.read()
                except OSError:
                    self.close_connection = True
                    return
                spoil = proxy.spoil.get(path)
                body = spoil(body) if spoil else body
                self.send_response(answer.status)
                self.send_header("Content-Type", answer.headers.get("Content-Type", "application/json"))
                self.send_header("Content-Length", str(len(body)))
                self.end_headers()
                self.wfile.write(body)

            do_GET = do_PUT = do_POST = relay

            def log_message(self, *_: object) -> None:
                pass

        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self._server.daemon_threads = True
        self._server.handle_error = lambda *_: None  # a client that hangs up is part of the tests
        self.port = self._server.server_address[1]
        threading.Thread(target=self._server.serve_forever, args=(0.05,), name="corrupting-proxy", daemon=True).start()

    def close(self) -> None:
        self._server.shutdown()
        self._server.server_close()
