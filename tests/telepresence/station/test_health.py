"""A container's healthcheck, against a master, a driver and a page that really listen."""

from __future__ import annotations

import http.server
import socketserver
import ssl
import struct
import threading
import xmlrpc.server
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from telepresence.page.certificate import server_context
from telepresence.station import health


class Driver:
    """A node that publishes `drive_state`, latched: its XML-RPC, and TCPROS for one message."""

    def __init__(self, state: str) -> None:
        text = state.encode()
        message = struct.pack("<II", len(text) + 4, len(text)) + text

        class Publisher(socketserver.StreamRequestHandler):
            def handle(self) -> None:
                (length,) = struct.unpack("<I", self.rfile.read(4))
                assert b"topic=/drive_state" in self.rfile.read(length)
                self.wfile.write(struct.pack("<I", 0) + message)

        self._tcp = socketserver.ThreadingTCPServer(("127.0.0.1", 0), Publisher)
        place = list(self._tcp.server_address)
        self._xmlrpc = rpc({"requestTopic": lambda *_: (1, "", ["TCPROS", *place])})
        self.uri = uri(self._xmlrpc)
        serve(self._tcp)

    def close(self) -> None:
        for server in (self._tcp, self._xmlrpc):
            server.shutdown()
            server.server_close()


def serve(server: socketserver.BaseServer) -> None:
    threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True).start()


def rpc(functions: dict[str, Callable]) -> xmlrpc.server.SimpleXMLRPCServer:
    server = xmlrpc.server.SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False, allow_none=True)
    for name, function in functions.items():
        server.register_function(function, name)
    serve(server)
    return server


def uri(server: socketserver.BaseServer) -> str:
    return f"http://127.0.0.1:{server.server_address[1]}"


class Station:
    """What the healthcheck looks at; `driver` can be another one or be closed."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.driver = Driver("driving")
        self.master = rpc(
            {
                "getPid": lambda _: (1, "", 1),
                "getSystemState": lambda _: (1, "", [[["/drive_state", ["/naoqi_driver"]]], [], []]),
                "lookupNode": lambda *_: (1, "", self.driver.uri),
            }
        )
        self.page = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Quiet)
        context: ssl.SSLContext = server_context(folder / "certificates", {"127.0.0.1"})
        self.page.socket = context.wrap_socket(self.page.socket, server_side=True)
        serve(self.page)
        health.note(folder, uri(self.master), uri(self.page).replace("http", "https"), robots=1)

    def close(self) -> None:
        self.driver.close()
        for server in (self.master, self.page):
            server.shutdown()
            server.server_close()


class Quiet(http.server.BaseHTTPRequestHandler):
    def do_GET(self) -> None:
        self.send_response(200)
        self.end_headers()

    def log_message(self, *_: object) -> None:
        """Say nothing."""


@pytest.fixture
def station(tmp_path: Path) -> Iterator[Station]:
    station = Station(tmp_path)
    yield station
    station.close()


def test_a_station_that_works_is_healthy(station: Station):
    health.check(station.folder)


def test_a_driver_without_its_robot_is_not(station: Station):
    station.driver.close()
    station.driver = Driver("robot unreachable: no answer")
    with pytest.raises(health.Unhealthy, match="/drive_state: robot unreachable: no answer"):
        health.check(station.folder)


def test_a_dead_driver_is_not(station: Station):
    station.driver.close()
    with pytest.raises(health.Unhealthy, match="driver does not answer"):
        health.check(station.folder)


def test_without_a_master_it_is_not(station: Station):
    station.master.shutdown()
    station.master.server_close()
    with pytest.raises(health.Unhealthy, match="ROS master"):
        health.check(station.folder)


def test_without_a_page_it_is_not(station: Station):
    station.page.shutdown()
    station.page.server_close()
    with pytest.raises(health.Unhealthy, match="page does not answer"):
        health.check(station.folder)


class UnixServer(socketserver.UnixStreamServer):
    """Answers every request with one status."""

    status = 200

    def __init__(self, path: Path) -> None:
        server = self

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                self.send_response(server.status)
                self.end_headers()

            def address_string(self) -> str:
                return "a unix socket"

            def log_message(self, format: str, *args: object) -> None:
                pass

        super().__init__(str(path), Handler)


def test_a_page_at_a_unix_socket_is_asked_there(tmp_path: Path):
    with UnixServer(tmp_path / "page.socket") as server:
        serve(server)
        place = f"unix:{server.server_address}"
        health.require_page(place)
        server.status = 502
        with pytest.raises(health.Unhealthy, match="status 502"):
            health.require_page(place)
        server.shutdown()
    with pytest.raises(health.Unhealthy, match="does not answer at unix:"):
        health.require_page(place)


def test_a_station_that_starts_is_not_yet(tmp_path: Path):
    with pytest.raises(health.Unhealthy, match="not up yet"):
        health.check(tmp_path)
    with pytest.raises(health.Unhealthy, match="0 stations"):
        health.station_of(tmp_path)
