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


def test_ros_ip_of_loopback_is_right_unless_nodes_run_elsewhere(monkeypatch, capsys):
    class Elsewhere(socket.socket):
        def connect(self, address):
            """Sends nothing: a datagram socket only chooses a route."""

        def getsockname(self):
            return ("192.168.0.5", 1234)

    monkeypatch.setattr(doctor.socket, "socket", Elsewhere)
    monkeypatch.setenv("ROS_IP", "127.0.0.1")
    ((fine, what, _),) = doctor.towards("192.168.0.1", 80)
    assert fine and "192.168.0.5" in what
    assert "For nodes elsewhere: docs/remote.md" in capsys.readouterr().out
    monkeypatch.setenv("ROS_IP", "192.168.0.5")
    assert list(doctor.towards("192.168.0.1", 80))
    assert "elsewhere" not in capsys.readouterr().out


def test_a_master_elsewhere_that_does_not_answer_is_an_error(monkeypatch, capsys):
    monkeypatch.setenv("ROS_MASTER_URI", "http://192.0.2.1:11311")

    def refuse(*_arguments, **_options):
        raise TimeoutError

    monkeypatch.setattr(doctor.socket, "create_connection", refuse)
    fine, what, cure = next(doctor.master())
    assert not fine and "192.0.2.1" in what and "unset ROS_MASTER_URI" in cure
    for here in ("localhost", "127.0.1.1", "[::1]"):
        monkeypatch.setenv("ROS_MASTER_URI", f"http://{here}:11311")
        assert all(each[0] for each in doctor.master())
        assert "./stack up starts one" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("release", "fine"),
    [
        ('PRETTY_NAME="LMDE 6"\nID=linuxmint\nVERSION_CODENAME=faye\nDEBIAN_CODENAME=bookworm\n', True),
        ('PRETTY_NAME="Ubuntu 22.04"\nVERSION_CODENAME=jammy\n', False),
        (None, False),
    ],
)
def test_the_system_is_debian_12_or_made_from_it(monkeypatch, tmp_path, release, fine):
    if release is not None:
        (tmp_path / "os-release").write_text(release)
    monkeypatch.setattr(doctor, "OS_RELEASE", tmp_path / "os-release")
    ((found, _, remedy),) = doctor.system()
    assert found is fine and "docs/container.md" in remedy


def test_a_container_without_its_hosts_network_is_named(monkeypatch, capsys):
    monkeypatch.setattr(doctor, "in_image", lambda: True)
    monkeypatch.setenv("ROS_IP", "127.0.0.1")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as here:
        here.bind(("127.0.0.1", 0))
        assert next(doctor.towards("127.0.0.1", here.getsockname()[1]))[0]
    assert "--network host" not in capsys.readouterr().out, "a robot inside"

    class Bridge(socket.socket):
        def connect(self, address):
            """Sends nothing: a datagram socket only chooses a route."""

        def getsockname(self):
            return ("10.88.0.3", 1234)

    monkeypatch.setattr(doctor.socket, "socket", Bridge)
    fine, what, _ = next(doctor.towards("192.168.0.1", 9559))
    assert fine and "10.88.0.3" in what and "--network host" in capsys.readouterr().out


def test_ros_for_other_machines_needs_the_firewall_rules(monkeypatch, capsys):
    monkeypatch.delenv("ROS_HOSTNAME", raising=False)
    monkeypatch.setenv("ROS_IP", "127.0.0.1")
    assert list(doctor.protection()) == [] and "reached from this machine only" in capsys.readouterr().out
    monkeypatch.setenv("ROS_IP", "10.8.0.1")
    fine, what, cure = next(doctor.protection())
    assert not fine and "10.8.0.1" in what and "not loaded" in cure and "firewall.nft" in cure


def test_who_does_not_answer_is_explained(free_port):
    fine, _, cure = next(doctor.robot(f"127.0.0.1:{free_port()}"))
    assert not fine and "refuses" in cure
    fine, _, cure = next(doctor.robot("a" * 70 + ".invalid"))  # refused here, without asking anybody
    assert not fine and cure


def answering(line: bytes | None):
    """Answer one connection as an ssh server does: with a line, or with silence (None)."""
    listener = socket.create_server(("127.0.0.1", 0))

    def answer() -> None:
        connection, _ = listener.accept()
        with connection:
            if line is not None:
                connection.sendall(line)
            else:
                connection.recv(1)  # until the doctor has had enough
        listener.close()

    threading.Thread(target=answer, daemon=True).start()
    return listener.getsockname()[1]


def test_ssh_is_asked_for_its_first_line(capsys, monkeypatch, free_port):
    assert doctor.ssh("127.0.0.1", answering(b"SSH-2.0-OpenSSH_7.6p1 Ubuntu-4\r\n"))
    assert "✓ ssh 127.0.0.1: SSH-2.0-OpenSSH_7.6p1 Ubuntu-4\n" in capsys.readouterr().out
    monkeypatch.setattr(doctor, "SSH_TIMEOUT", 0.2)
    for port, words in (
        (answering(b"HTTP/1.1 400 Bad Request\r\n"), "something else answers"),
        (answering(b""), "hangs up at once"),
        (answering(None), "ssh sometimes needs a nudge:  ping 127.0.0.1  and try again"),
        (free_port(), "no ssh server runs there"),
    ):
        assert not doctor.ssh("127.0.0.1", port)
        text = capsys.readouterr().out
        assert words in text and "attach a display and a keyboard" in text


def test_the_systems_ping_is_used_where_there_is_one(capsys, monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    assert not doctor.ping("192.168.0.1")
    assert "ping: not installed here (sudo apt install iputils-ping)" in capsys.readouterr().out
    program = tmp_path / "ping"
    program.write_text('#!/bin/sh\n[ "$5" = 192.168.0.1 ] || { echo "ping: $5: No address" >&2; exit 2; }\n')
    program.chmod(0o755)
    assert doctor.ping("192.168.0.1")
    assert "✓ ping 192.168.0.1: it answers" in capsys.readouterr().out
    assert not doctor.ping("192.168.0.2")
    assert "- ping 192.168.0.2: ping: 192.168.0.2: No address. Switched off" in capsys.readouterr().out


def test_a_robot_elsewhere_is_pinged_before_ssh_is_asked(monkeypatch):
    asked = []
    monkeypatch.setattr(doctor, "ping", lambda host: asked.append(f"ping {host}"))
    monkeypatch.setattr(doctor, "ssh", lambda host: asked.append(f"ssh {host}"))
    monkeypatch.setattr(doctor, "connect_time", lambda host, port: asked.append(f"tcp {port}") or 0.01)
    for check in ("towards", "robot_clock"):
        monkeypatch.setattr(doctor, check, lambda host, port: iter(()))
    list(doctor.robot("192.0.2.1:80"))
    assert asked[:3] == ["ping 192.0.2.1", "ssh 192.0.2.1", "tcp 80"]
