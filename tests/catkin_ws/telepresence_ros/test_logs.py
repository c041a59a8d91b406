"""Logs of modules without ROS go where rospy's go."""

import http.client
import logging
import subprocess
import sys
import traceback
from pathlib import Path

import pytest
from telepresence_ros.logs import (
    calm_half_connection,
    our_packages,
    renew_latest_link,
    route_logs_to_ros,
    shorten_lost_connection,
)

ROOT = Path(__file__).resolve().parents[3]
SOURCES = [ROOT / "telepresence", *sorted((ROOT / "catkin_ws/src").glob("*/src/*/"))]


def logs(package: Path) -> bool:
    """Whether a module of the package logs by Python's own logging."""
    return any("logging.getLogger(__name__)" in path.read_text() for path in package.rglob("*.py"))


class Kept(logging.Handler):
    def __init__(self):
        super().__init__()
        self.lines = []

    def emit(self, record):
        self.lines.append(record.getMessage())


@pytest.fixture
def rosout(monkeypatch):
    handler = Kept()
    monkeypatch.setattr(logging.getLogger("rosout"), "handlers", [handler])
    for name in our_packages():
        for what in ("handlers", "propagate", "level"):
            monkeypatch.setattr(logging.getLogger(name), what, getattr(logging.getLogger(name), what))
    return handler


@pytest.mark.parametrize("name", ["telepresence", "telepresence_ros"])
def test_what_our_modules_log_is_on_rosout_once(rosout, name):
    route_logs_to_ros()
    logging.getLogger(f"{name}.part").info("the robot answers")
    logging.getLogger(f"{name}.part").debug("a detail")
    logging.getLogger("somebody_else").warning("not of ours")
    assert rosout.lines == ["the robot answers"]


def test_every_package_of_ours_that_logs_is_found_where_catkin_shows_it():
    program = "from telepresence_ros.logs import our_packages; print(*our_packages())"
    shown = str(ROOT / "catkin_ws/devel/lib/python3/dist-packages")
    found = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path.insert(0, {shown!r}); {program}"],
        capture_output=True, text=True, timeout=60, cwd="/",
    )  # fmt: skip
    assert found.returncode == 0, found.stderr
    assert {path.name for path in SOURCES if logs(path)} <= set(found.stdout.split())


@pytest.mark.parametrize(
    ("error", "shortened"),
    [
        (ConnectionResetError("gone"), True),
        (OSError(9, "Bad file descriptor"), True),
        (http.client.RemoteDisconnected("Remote end closed connection"), True),
        (AttributeError("'NoneType' object has no attribute 'buff_size'"), True),
        (AttributeError("'NoneType' object has no attribute 'data'"), False),
        (KeyError("a mistake"), False),
    ],
)
def test_a_node_that_ended_is_one_line_in_the_logs_of_the_others_and_a_mistake_keeps_its_traceback(error, shortened):
    try:
        raise error
    except Exception:
        text = traceback.format_exc()
    record = logging.makeLogRecord({"name": "rospy.internal", "msg": f"Unknown error at 127.0.0.1: {text}"})
    assert shorten_lost_connection(record)
    lines = record.getMessage().strip().splitlines()
    assert (len(lines) == 1) is shortened and "Unknown error at 127.0.0.1" in lines[0] and str(error) in lines[-1]


def test_a_node_whose_master_ends_with_it_leaves_no_traceback(graph):
    program = """
import socket, threading, rospy
from telepresence_ros.logs import route_logs_to_ros
rospy.init_node("last", disable_signals=True)
route_logs_to_ros()
rospy.Publisher("something", rospy.AnyMsg, queue_size=1)
deaf = socket.create_server(("127.0.0.1", 0))
def hang_up():
    while True:
        deaf.accept()[0].close()
threading.Thread(target=hang_up, daemon=True).start()
from rospy.impl import registration
master = f"http://127.0.0.1:{deaf.getsockname()[1]}/"
registration.xmlrpcapi = lambda _uri: registration.xmlrpcclient.ServerProxy(master)
rospy.signal_shutdown("the master ends, too")
"""
    node = graph.run(sys.executable, "-c", program)
    assert node.process.wait(30) == 0
    logs = list(Path(graph.environment["ROS_HOME"]).rglob("last*.log"))
    assert any("unclean shutdown" in path.read_text() for path in logs), "rospy says so"
    assert not any("Traceback" in path.read_text() for path in logs)


def test_a_line_that_could_not_be_reported_without_a_master_is_one_line():
    text = (
        "Unable to report rosout: [Errno 111] Connection refused\nTraceback (most recent call last):\n  File x\n   ^^…"
    )
    record = logging.makeLogRecord({"name": "rospy.rosout", "msg": text})
    assert shorten_lost_connection(record)
    assert record.getMessage() == "Unable to report rosout: [Errno 111] Connection refused"


@pytest.mark.parametrize(("received", "level"), [(0, logging.INFO), (4, logging.WARNING)])
def test_a_subscription_that_was_taken_back_is_no_warning(received, level):
    text = f"connection from sender terminated before handshake header received. {received} bytes were received. Please"
    record = logging.LogRecord("rosout", logging.WARNING, __file__, 1, "Inbound failed: %s", (text,), None)
    assert calm_half_connection(record)
    assert (record.levelno, record.levelname) == (level, logging.getLevelName(level))


def test_nodes_that_start_together_agree_on_the_newest_run(tmp_path):
    latest = tmp_path / "latest"
    for run in ("one", "two", "two"):
        assert renew_latest_link(str(tmp_path / run))
        assert latest.readlink() == tmp_path / run
    latest.unlink()
    latest.mkdir()
    assert not renew_latest_link(str(tmp_path / "three")), "a person's own folder stays"
    assert [path.name for path in tmp_path.iterdir()] == ["latest"]
