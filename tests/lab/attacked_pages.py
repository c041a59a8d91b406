"""Programs that serve web pages, a web server of an attacker, and the pilot's browser, for tests that attack pages."""

from __future__ import annotations

import contextlib
import http.client
import http.server
import json
import os
import re
import socket
import subprocess
import threading
import urllib.parse
from collections.abc import Callable
from pathlib import Path

from pepper_sim.tablet.devtools import BrowserError, DevTools
from telepresence.station import processes

ROOT = next(folder for folder in Path(__file__).resolve().parents if (folder / "stack").exists())


class Program:
    """A program that serves a web page, and the address that it prints.

    Attributes:
        url: As printed, with its key if it has one.
        log: Where its complaints go.
    """

    def __init__(self, folder: Path, *words: str, says: str, **environment: str) -> None:
        self.log = folder / "stderr"
        with self.log.open("wb") as log:
            self.process = processes.start(
                list(words),
                stdout=subprocess.PIPE,
                stderr=log,
                text=True,
                cwd=ROOT,
                env={**os.environ, "PYTHONUNBUFFERED": "1", **environment},
            )
        while not (found := re.search(says, line := self.process.stdout.readline())):
            assert line, self.log.read_text()
        self.url = found[1]
        parts = urllib.parse.urlsplit(self.url)
        self.host, self.port, self.query = parts.hostname, parts.port, parts.query

    def connect(self) -> socket.socket:
        return socket.create_connection((self.host, self.port), timeout=10.0)

    def ask(self, path: str, method: str = "GET", body: bytes | None = None, **headers: str) -> tuple[int, bytes]:
        """Send a request as a program does; the status and the first bytes of the answer."""
        with contextlib.closing(http.client.HTTPConnection(self.host, self.port, timeout=20.0)) as client:
            client.request(method, path, body, headers)
            answer = client.getresponse()
            return answer.status, answer.read1(4096)

    def with_key(self, path: str) -> str:
        return f"{path}?{self.query}" if self.query else path

    def memory(self) -> float:
        """What it holds of the machine's memory [MB]."""
        return int(Path(f"/proc/{self.process.pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6

    def close(self) -> None:
        processes.end(self.process)
        self.process.stdout.close()


class Attacker(http.server.ThreadingHTTPServer):
    """A web server of somebody else's on this machine; every page of it is empty."""

    daemon_threads = True

    def __init__(self) -> None:
        cookies = self.cookies = []

        class Page(http.server.BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                cookies.append(self.headers.get("Cookie", ""))
                self.send_response(200)
                self.send_header("Content-Type", "text/html")
                self.end_headers()
                self.wfile.write(b"<title>Kittens</title><body></body>")

            do_POST = do_GET

            def log_message(self, *_: object) -> None:
                """Nobody needs it."""

        super().__init__(("127.0.0.1", 0), Page)
        self._thread = threading.Thread(target=self.serve_forever, kwargs={"poll_interval": 0.02}, name="attacker")
        self._thread.start()

    def close(self) -> None:
        self.shutdown()
        self.server_close()
        self._thread.join()


class Browser:
    """The pilot's Chromium. For it evil.example and rebound.example are names of 127.0.0.1."""

    def __init__(self, wait_until: Callable) -> None:
        self.tools = DevTools()
        self._wait_until = wait_until
        self.tools.call("Page.enable")

    def open(self, url: str) -> None:
        host = urllib.parse.urlsplit(url).netloc
        self.tools.call("Page.navigate", url=url)
        self._wait_until(lambda: self.shows(f"location.host == {json.dumps(host)}"), f"the browser is at {host}")

    def shows(self, condition: str) -> bool:
        """Whether a page is open, and the condition, a script, true in it."""
        try:
            return self.run(f"document.readyState != 'loading' && {condition}") is True
        except BrowserError:  # between two pages
            return False

    def run(self, script: str) -> object:
        """Evaluate a script in the page that is open, and wait for the promise that it may return."""
        answer = self.tools.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    def frames(self) -> list[str]:
        """Addresses of the frames in the page, as far as they were let in."""
        tree = self.tools.call("Page.getFrameTree")["frameTree"]
        return [
            child["frame"]["url"] for child in tree.get("childFrames", []) if "unreachableUrl" not in child["frame"]
        ]
