"""The XML-RPC server of a ROS program ends with it. Who may come in: tests/attacks/test_sockets.py."""

import threading

import pytest
import rosgraph.xmlrpc
from telepresence_ros.sockets import narrow_sockets


@pytest.fixture
def narrowed(monkeypatch):
    for name in ("ThreadingXMLRPCServer", "SilenceableXMLRPCRequestHandler"):
        monkeypatch.setattr(rosgraph.xmlrpc, name, getattr(rosgraph.xmlrpc, name))
    monkeypatch.setattr(rosgraph.network, "get_bind_address", rosgraph.network.get_bind_address)
    narrow_sockets()


def test_a_server_that_was_closed_asks_its_socket_no_more(narrowed, wait_until):
    node = rosgraph.xmlrpc.XmlRpcNode(rpc_handler=rosgraph.xmlrpc.XmlRpcHandler())
    serves = threading.Thread(target=node.run, daemon=True)
    serves.start()
    wait_until(lambda: node.uri, "the server serves")
    node.shutdown("the test ends")
    serves.join(10.0)
    assert not serves.is_alive(), "it computes without a pause until the program has ended"
