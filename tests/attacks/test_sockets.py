"""Somebody in the same network, and a web page in the pilot's browser, against the ROS programs of a station that is
meant for this computer alone. The table of sockets is compared by the tests that have a whole station up; here one is
attacked: the master, rosout, and the node that publishes the robot's body.
"""

from __future__ import annotations

import os
import socket
import struct
import subprocess
import urllib.error
import urllib.request
import xmlrpc.client
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from free_ports import free_port

from telepresence.station import processes
from telepresence.station.master_keeper import MasterKeeper
from telepresence.station.ros_master import master_proxy

pytestmark = pytest.mark.ros

ELSEWHERE = "127.0.0.2"
"""Another address of this machine: who listens on all addresses answers here, as he does to the network."""
LAUNCH = Path(__file__).resolve().parents[2] / "catkin_ws/src/rto_description/launch/rto_publisher.launch"
PROGRAMS = ("master", "/rosout", "/rto_publisher")


@pytest.fixture(scope="module")
def programs(tmp_path_factory, wait_until):
    """Program -> its address, of a master as `./stack up` starts it and a launch file."""
    patch = pytest.MonkeyPatch()
    uri = f"http://127.0.0.1:{free_port()}"
    folder = tmp_path_factory.mktemp("ros")
    for name, value in (("ROS_MASTER_URI", uri), ("ROS_IP", "127.0.0.1"), ("ROS_HOME", str(folder))):
        patch.setenv(name, value)
    keeper = MasterKeeper(uri)
    launch = processes.start(
        ["roslaunch", "--wait", str(LAUNCH)],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    try:
        yield {"master": uri, **{n: wait_until(lambda n=n: place(uri, n), f"{n} runs") for n in PROGRAMS[1:]}}
    finally:
        processes.end(launch, patience=10.0)
        keeper.close()
        patch.undo()


def place(uri: str, node: str) -> str | None:
    code, _, found = master_proxy(uri, timeout=5.0).lookupNode("/test", node)
    return found.rstrip("/") if code == 1 else None


def call(method: str, *arguments: object) -> bytes:
    return xmlrpc.client.dumps(("/stranger", *arguments), method).encode()


def answer(address: str, body: bytes, **headers: str) -> bytes | None:
    """What the program answers, None when it refuses. The names of headers have _ for -."""
    names = {name.replace("_", "-"): value for name, value in headers.items()}
    request = urllib.request.Request(address, body, names)
    try:
        with urllib.request.urlopen(request, timeout=10.0) as reply:
            return reply.read()
    except (urllib.error.URLError, OSError):
        return None


@pytest.mark.parametrize("program", PROGRAMS)
def test_a_stranger_speaks_to(programs, program):
    """By another address than loopback: who answers getPid there also answers `shutdown` and hands out topics."""
    port = urlsplit(programs[program]).port
    assert answer(f"http://{ELSEWHERE}:{port}", call("getPid"), Content_Type="text/xml") is None


@pytest.mark.parametrize("program", PROGRAMS)
def test_a_web_page_posts_plain_text_to(programs, program):
    """A browser sends this to 127.0.0.1 for every page, without asking anybody."""
    headers = {"Content_Type": "text/plain", "Origin": "http://page.example", "Sec_Fetch_Site": "cross-site"}
    assert answer(programs[program], call("getPid"), **headers) is None


@pytest.mark.parametrize("program", PROGRAMS)
def test_a_web_page_that_has_renamed_this_computer_asks(programs, program):
    """DNS rebinding: the page's own name leads to 127.0.0.1, so the browser counts the program as its server."""
    headers = {"Content_Type": "text/xml", "Host": "page.example", "Origin": "http://page.example"}
    assert answer(programs[program], call("getPid"), **headers) is None


@pytest.mark.parametrize("kind", ["text/plain", "application/x-www-form-urlencoded", "multipart/form-data"])
def test_a_web_page_turns_the_sign_in_off(programs, kind):
    uri = programs["master"]
    master_proxy(uri, timeout=5.0).setParam("/test", "/sign_in", True)
    answer(uri, call("setParam", "/sign_in", False), Content_Type=kind, Origin="null")
    assert master_proxy(uri, timeout=5.0).getParam("/test", "/sign_in")[2] is True


def test_a_web_page_of_an_old_browser_ends_a_node(programs):
    """Without Origin, which old browsers do not send: a page still cannot send text/xml."""
    assert answer(programs["/rosout"], call("shutdown", "bye"), Content_Type="text/plain") is None
    assert answer(programs["/rosout"], call("getPid"), Content_Type="text/xml") is not None


@pytest.mark.parametrize("program", PROGRAMS)
def test_one_that_dies_while_it_asks_leaves_no_traceback_at(programs, program, wait_until):
    """A kept connection that is reset, as by a program that was killed."""
    body = call("getPid")
    head = f"POST / HTTP/1.1\r\nHost: x\r\nContent-Type: text/xml\r\nContent-Length: {len(body)}\r\n\r\n".encode()
    with socket.create_connection(("127.0.0.1", urlsplit(programs[program]).port)) as caller:
        caller.sendall(head + body)
        assert caller.recv(4096)
        own = str(caller.getsockname()[1])
        caller.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    written = lambda: "".join(file.read_text() for file in Path(os.environ["ROS_HOME"]).rglob("*.log*"))  # noqa: E731
    wait_until(lambda: f"{own})" in written(), "its end is written down")
    assert "Traceback" not in written()
    assert answer(programs[program], body, Content_Type="text/xml")
