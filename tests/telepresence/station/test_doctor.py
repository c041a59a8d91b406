"""The doctor's questions about the way to a robot, against sockets that answer as robots do."""

from __future__ import annotations

import http.server
import socket
import threading
import time

import pytest

from telepresence.station import doctor


class Handler(http.server.BaseHTTPRequestHandler):
    """Knows no page but says the time, as a Robotino does."""

    ahead = 0.0

    def date_time_string(self, timestamp=None):
        return super().date_time_string(time.time() + self.ahead)

    def log_message(self, *_):
        """Log nothing."""


@pytest.fixture
def web_robot():
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield server
    server.shutdown()
    thread.join()
    server.server_close()


def test_a_robot_that_answers_is_timed(web_robot):
    port = web_robot.server_address[1]
    findings = list(doctor.robot(f"127.0.0.1:{port}"))
    assert all(fine for fine, _, _ in findings)
    assert any("round trip" in what for _, what, _ in findings)


def test_the_clock_of_its_web_server_is_compared(web_robot, monkeypatch):
    port = web_robot.server_address[1]
    assert next(doctor.robot_clock("127.0.0.1", port))[0]
    monkeypatch.setattr(Handler, "ahead", -3600.0)
    fine, what, _ = next(doctor.robot_clock("127.0.0.1", port))
    assert not fine and "clock: -36" in what


def test_ros_ip_of_loopback_is_refused_for_a_robot_elsewhere(monkeypatch):
    class Elsewhere(socket.socket):
        def connect(self, address):
            """Sends nothing: a datagram socket only chooses a route."""

        def getsockname(self):
            return ("192.168.0.5", 1234)

    monkeypatch.setattr(doctor.socket, "socket", Elsewhere)
    monkeypatch.setenv("ROS_IP", "127.0.0.1")
    fine, _, cure = next(doctor.towards("192.168.0.1", 80))
    assert not fine and "export ROS_IP=192.168.0.5" in cure
    monkeypatch.setenv("ROS_IP", "192.168.0.5")
    assert next(doctor.towards("192.168.0.1", 80))[0]


def test_who_does_not_answer_is_explained(free_port):
    fine, _, cure = next(doctor.robot(f"127.0.0.1:{free_port()}"))
    assert not fine and "refuses" in cure
    fine, _, cure = next(doctor.robot("a" * 70 + ".invalid"))  # refused here, without asking anybody
    assert not fine and cure
