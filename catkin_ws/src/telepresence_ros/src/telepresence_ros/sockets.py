"""Where the sockets of our ROS programs listen, whom their XML-RPC servers refuse, and how these end.

rospy, rosmaster and roslaunch listen on every address of the machine unless ROS_IP or ROS_HOSTNAME is loopback, and
answer every web page: a browser sends a POST with plain text to 127.0.0.1 for whoever asks. `narrow_sockets` changes
both in the process that calls it: sockets listen on the address that the node announces, and nowhere else; requests
of browsers are refused. Servers that are closed end, too. Debian's files stay as they are.
"""

from __future__ import annotations

import errno
import ipaddress
import logging
import socket
from http import HTTPStatus
from typing import Any

import rosgraph.network
import rosgraph.xmlrpc

_all_or_loopback = rosgraph.network.get_bind_address
_PlainHandler: Any = rosgraph.xmlrpc.SilenceableXMLRPCRequestHandler
_PlainServer: Any = rosgraph.xmlrpc.ThreadingXMLRPCServer


class RefusesBrowsers(_PlainHandler):
    """Answers ROS programs and no web page.

    A browser names the page in `Origin`, with every POST. Without asking first, which nobody here answers, a page
    cannot send `text/xml` to another site either; that is what all XML-RPC libraries of ROS send. A program that dies
    while it asks is a line in the log, not a traceback: nothing has failed here.
    """

    def handle(self) -> None:
        try:
            super().handle()
        except ConnectionError as error:
            logging.getLogger("xmlrpc").info("whoever asked from %s has gone: %s", self.client_address, error)

    def do_POST(self) -> None:
        kind = self.headers.get("Content-Type", "").partition(";")[0].strip().lower()
        if self.headers.get("Origin") is not None or self.headers.get("Sec-Fetch-Site") or kind != "text/xml":
            self.close_connection = True
            self.send_error(HTTPStatus.FORBIDDEN, "for programs of ROS, not for web pages")
            return
        super().do_POST()


class EndsWhenClosed(_PlainServer):
    """An XML-RPC server whose loop ends when somebody closes it.

    rosgraph only closes its socket, and socketserver's loop asks a closed socket again and again, as fast as it can,
    until the program has ended. In programs with the real-time class that kept everybody else from both processors for
    a second, while they ended.
    """

    def service_actions(self) -> None:
        """Called after each turn of the loop."""
        super().service_actions()
        if self.socket.fileno() < 0:
            raise OSError(errno.EBADF, "the server was closed")


def bind_address(address: str | None = None) -> str:
    """Return the address that sockets listen on: the one that is announced (`address`, else ROS_IP or ROS_HOSTNAME).

    All addresses, as ROS has it, when none is announced, or one that this machine does not have itself: behind address
    translation, or a host name that means loopback here and another address elsewhere.
    """
    usual = str(_all_or_loopback(address))
    announced = address or rosgraph.network.get_address_override()
    if usual != "0.0.0.0" or not announced:
        return usual
    try:
        found = socket.gethostbyname(announced)
        if ipaddress.ip_address(found).is_loopback:
            return usual
        with socket.socket() as probe:
            probe.bind((found, 0))
    except OSError as error:
        if error.errno in (None, errno.EADDRNOTAVAIL) or isinstance(error, socket.gaierror):
            return usual
        raise
    return found


def narrow_sockets() -> None:
    """Narrow every socket that ROS opens in this process from now on. Call it before `rospy.init_node`; may be
    repeated."""
    rosgraph.network.get_bind_address = bind_address
    rosgraph.xmlrpc.SilenceableXMLRPCRequestHandler = RefusesBrowsers
    rosgraph.xmlrpc.ThreadingXMLRPCServer = EndsWhenClosed
