"""The robot's camera sender and sound server as programs, for those who attack them, and a false robot."""

from __future__ import annotations

import asyncio
import http.client
import os
import re
import socket
import subprocess
import sys
import threading
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

from telepresence.security import signed_requests
from telepresence.security.robot_key import RobotKey
from telepresence.station import processes
from telepresence.video.webrtc import on_address, peer_connection

ROOT = Path(__file__).resolve().parents[2]
SOURCES = [ROOT, *(ROOT / "catkin_ws" / "src" / name / "src" for name in ("rto_bringup", "rto_node"))]
HOST = "127.0.0.1"
SDP = "application/sdp"
FILES = 1024
"""A service's limit of open files, as systemd sets it."""


class Service:
    """One of the two programs, and requests to it."""

    def __init__(self, role: str, folder: Path, key: Path | None) -> None:
        self.role, self.path = role, f"/{role}"
        self.key = RobotKey.read(key) if key is not None else None
        self.log = folder / f"{len(list(folder.iterdir()))}_{role}.log"
        source = {"camera": ["--source", "test", "--size", "160x120", "--rate", "5"]}
        devices = source.get(role, ["--microphone", "none", "--speaker", "none"])
        option = ["--key", str(key)] if key is not None else []
        command = [sys.executable, "-m", "rto_bringup.onboard", role, "--port", "0", *devices, *option]
        with self.log.open("w") as log:
            self.process = processes.start(
                ["bash", "-c", f'ulimit -Sn {FILES}; exec "$@"', "bash", *command],
                env={**os.environ, "PYTHONPATH": ":".join(map(str, SOURCES))},
                stdout=subprocess.PIPE, stderr=log, text=True,
            )  # fmt: skip
        announcement = self.process.stdout.readline()
        assert "listens on" in announcement, f"{announcement!r} {self.log.read_text()}"
        self.port = int(announcement.rpartition(":")[2])

    def connect(self, source: str = HOST) -> socket.socket:
        connection = socket.create_connection((HOST, self.port), timeout=10.0, source_address=(source, 0))
        connection.settimeout(10.0)
        return connection

    def ask(
        self, method: str = "GET", path: str = "", body: bytes = b"", headers: dict[str, str] | None = None
    ) -> tuple[int, dict[str, str], bytes]:
        connection = http.client.HTTPConnection(HOST, self.port, timeout=10.0)
        try:
            kind = {"Content-Type": SDP} if body else {}
            connection.request(method, path or self.path, body or None, {**kind, **(headers or {})})
            answer = connection.getresponse()
            return answer.status, dict(answer.headers), answer.read()
        except (ConnectionError, http.client.BadStatusLine):
            return 0, {}, b""
        finally:
            connection.close()

    def sign(self, method: str, path: str = "", body: bytes = b"", key: RobotKey | None = None) -> dict[str, str]:
        """The headers by which an invited pilot proves a request; none where the service has no key."""
        if self.key is None:
            return {}
        challenge = signed_requests.challenge_in(self.ask()[1]["WWW-Authenticate"])
        request = signed_requests.Request(method, path or self.path, SDP if body else "", body)
        return {"Authorization": signed_requests.authorization(key or self.key, request, challenge)[0]}

    def ask_as_pilot(self, method: str, path: str = "", body: bytes = b"") -> tuple[int, dict[str, str], bytes]:
        return self.ask(method, path, body, self.sign(method, path, body))

    def end(self) -> None:
        processes.end(self.process, patience=10.0)
        self.process.stdout.close()


def make_offer(kind: str, target: tuple[str, int] | None = None) -> bytes:
    """An offer of a receiver; its candidates may name somebody else, who must not be sent anything."""

    async def offer() -> str:
        peer = peer_connection()
        try:
            peer.addTransceiver(kind, direction="sendrecv" if kind == "audio" else "recvonly")
            with on_address(HOST):
                await peer.setLocalDescription(await peer.createOffer())
            return peer.localDescription.sdp
        finally:
            await peer.close()

    text = asyncio.run(offer())
    if target is not None:
        text = re.sub(r"127\.0\.0\.1 \d+ typ", f"{target[0]} {target[1]} typ", text)
    return text.encode()


class FalseRobot:
    """Answers in a robot's place: passes on what the pilot asks to a real camera sender, and changes the answers."""

    def __init__(self, camera: Service, change: Callable[[int, dict[str, str], bytes], tuple]) -> None:
        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                self.do_POST()

            def do_POST(self) -> None:
                body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
                names = ("Content-Type", "Authorization")
                sent = {name: self.headers[name] for name in names if name in self.headers}
                status, headers, content = change(*camera.ask(self.command, self.path, body, sent))
                self.send_response(status)
                for name in ("Content-Type", "Location", "WWW-Authenticate", "Authentication-Info"):
                    if name in headers:
                        self.send_header(name, headers[name])
                self.send_header("Content-Length", str(len(content)))
                self.end_headers()
                self.wfile.write(content)

            def log_message(self, *_: object) -> None:
                pass

        self._server = ThreadingHTTPServer((HOST, 0), Handler)
        self._server.daemon_threads = True
        self.port = self._server.server_address[1]
        threading.Thread(target=self._server.serve_forever, daemon=True).start()

    def close(self) -> None:
        self._server.shutdown()
        self._server.server_close()
