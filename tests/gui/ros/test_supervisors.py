"""A roslaunch that was killed is told from one that has ended. The master is a real XML-RPC server with one method."""

import socket
import threading
from xmlrpc.server import SimpleXMLRPCServer

import pytest

from gui.ros.supervisors import Supervisors


@pytest.fixture
def master():
    """A master whose parameter is a dictionary."""
    server = SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False)
    server.listed = {}
    answer = lambda _caller, name: [1, "", server.listed] if server.listed else [-1, f"no {name}", 0]  # noqa: E731
    server.register_function(answer, "getParam")
    threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True).start()
    yield server
    server.shutdown()
    server.server_close()


@pytest.fixture
def look(master):
    supervisors = Supervisors()
    return lambda: supervisors.lost(f"http://127.0.0.1:{master.server_address[1]}", "/window", 5.0)


def start(master, name):
    listener = socket.create_server(("127.0.0.1", 0))
    master.listed[name] = f"http://127.0.0.1:{listener.getsockname()[1]}/"
    return listener


def test_one_that_is_killed_is_missed_until_another_starts(master, look):
    assert not look(), "there is none"
    with start(master, "first"), start(master, "keyboard"):
        assert not look()
    del master.listed["keyboard"]  # this one has said goodbye
    assert look() and look()
    with start(master, "second"):
        assert not look() and not look()


def test_one_that_was_killed_before_is_nobodys_loss(master, look):
    start(master, "old").close()
    assert not look()
    with start(master, "new"):
        assert not look()
        del master.listed["new"]
        assert not look()
