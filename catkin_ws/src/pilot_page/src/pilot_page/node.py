"""The node pilot_page: the page by which any browser sees through the robots and drives them.

For each robot, in its namespace:
Subscribes: its pictures (sensor_msgs/Image) while somebody looks; drive/state (telepresence_msgs/DriveState);
            safety (telepresence_msgs/SafetyState); its battery (sensor_msgs/BatteryState).
And /station/faults (telepresence_msgs/Fault).
Publishes:  drive/command (telepresence_msgs/DriveCommand): one window of drive_lease for every browser.
            looking (std_msgs/String, latched): who looks through the robot by the page, a name each line.
Calls:      drive/join, drive/ask.
Listens:    HTTPS on one tcp port; WebRTC on udp ports that the kernel gives.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import socket
import ssl
import sys
import threading
from functools import partial
from pathlib import Path

import rospy
from telepresence_ros.node import Node

from pilot_page.lease_services import LeaseServices
from pilot_page.robot_station import RobotStation, robot_kind
from telepresence import ports
from telepresence.page.app import PilotPage
from telepresence.page.certificate import fingerprint, names_of, own_context, server_context
from telepresence.page.entrance import Entrance
from telepresence.page.proxy import Proxy
from telepresence.page.relays import Relays
from telepresence.page.serving import serving
from telepresence.station.container_image import page_host
from telepresence.station.pilot_page import PILOT_PAGE_KEY, SITE, page_folder
from telepresence.switch import switch
from telepresence.teleop.accounts import Users
from telepresence.teleop.invitations import Invitations, beside
from telepresence.teleop.lease_topics import LeaseState
from telepresence.teleop.robot_kinds import KINDS
from telepresence.web.listener import listener, unix_listener


class PageNode:
    """Joins ROS, on threads of its own, and the page, on an event loop.

    Args:
        options: Of the command line, see `parse`.
    """

    def __init__(self, options: argparse.Namespace) -> None:
        self._node = Node("pilot_page")
        self._options = options
        users = Users(Path(options.users) if options.users else None)
        self.entrance = Entrance(
            users, Invitations(beside(users.path)), options.sign_in, os.environ.get(PILOT_PAGE_KEY, "")
        )
        self._loop = asyncio.new_event_loop()
        self.robots: dict[str, RobotStation] = {}
        for word in options.robots:
            kind = robot_kind(word)
            services = LeaseServices(self._loop, kind.namespace)
            self.robots[kind.title] = RobotStation(kind, services, partial(self._on_lease, kind.title))
        folder = Path(options.certificates)
        secret = Path(options.turn_secret) if options.turn_secret else None
        self._certificate = Path(options.certificate) if options.certificate else None
        names = names_of(self._certificate) if self._certificate else []
        relays = Relays.read(options.servers, secret)
        self._name = names[0] if names else page_host(options.address, "").partition(":")[0]
        self._proxy = Proxy(options.url, options.proxy) if options.proxy else None
        self._page = PilotPage(self, options.address, relays, [*names, self._name], folder, self._proxy)
        for station in self.robots.values():
            station.start()

    def run(self) -> int:
        """Serve until the node is shut down; return the exit code."""
        return self._node.run(self._serve)

    def _on_lease(self, robot: str, state: LeaseState) -> None:
        self._loop.call_soon_threadsafe(self._page.receive, robot, state)

    def _serve(self) -> None:
        asyncio.set_event_loop(self._loop)
        self._loop.run_until_complete(self._serve_until_stopped())

    async def _serve_until_stopped(self) -> None:
        try:
            listening, tls, url = self._listen()
        except OSError as error:
            rospy.logfatal("the page cannot be served: %s", error)
            return
        async with serving(self._page.application(), self._page.admission, listening, tls) as taking:
            self.entrance.invitations.set_page(os.environ.get(SITE) or url)
            beats = threading.Thread(target=self._beat, daemon=True)
            beats.start()
            while not self._node.stop.is_set():
                await asyncio.sleep(0.05)
                if taking.done():
                    await taking  # raises what it has failed with

    def _listen(self) -> tuple[socket.socket, ssl.SSLContext | None, str]:
        """Return where browsers come in, and how they reach the page. Raises OSError."""
        options = self._options
        if self._proxy is not None and self._proxy.socket:
            waiting = unix_listener(Path(self._proxy.socket))
            rospy.loginfo("the pilot's page: %s", self._proxy.url)
            return waiting, None, self._proxy.url
        folder = Path(options.certificates)
        if self._certificate is not None:
            context = own_context(self._certificate, Path(options.key) if options.key else None)
        else:
            context = server_context(folder, {options.address, self._name})
        listening = listener(options.address, options.port, send_buffer=None)
        port = listening.getsockname()[1]
        place = f"{self._name}:{port}" if self._certificate else page_host(options.address, str(port))
        rospy.loginfo("the pilot's page: https://%s/  certificate SHA-256 %s", place,
                      fingerprint(self._certificate or folder / "page.crt"))  # fmt: skip
        return listening, context, self._proxy.url if self._proxy is not None else f"https://{place}/"

    def _beat(self) -> None:
        """Count as frozen when the event loop does not turn: it carries everybody's commands."""
        for _ in self._node.cycles(0.1):
            asyncio.run_coroutine_threadsafe(asyncio.sleep(0), self._loop).result()


def parse(argv: list[str]) -> argparse.Namespace:
    """Return what a command line says."""
    parser = argparse.ArgumentParser(prog="pilot_page", description="The pilot's page.")
    parser.add_argument(
        "--robots",
        nargs="+",
        default=["pepper"],
        type=_robot,
        metavar="KIND[:NAMESPACE[:TOPIC]]",
        help=f"what can be driven, where its topics and where its pictures are: {', '.join(KINDS)}",
    )
    parser.add_argument("--address", default="127.0.0.1", help="address of this machine where the page is")
    parser.add_argument("--port", type=int, default=ports.PILOT_PAGE, help="its tcp port; default %(default)s")
    parser.add_argument(
        "--sign-in", type=switch, default=True, metavar="true|false", help="people need an account; default true"
    )
    parser.add_argument(
        "--users", default="", metavar="FILE", help="the accounts; default TELEPRESENCE_USERS or gui/users.db"
    )
    parser.add_argument("--servers", nargs="*", default=[], metavar="URI", help="stun:, turn: and turns:HOST[:PORT]")
    parser.add_argument("--turn-secret", default="", metavar="FILE", help="the relay's static-auth-secret")
    parser.add_argument("--certificate", default="", metavar="FILE", help="PEM with its chain; default: one of our own")
    parser.add_argument("--key", default="", metavar="FILE", help="key of --certificate, where it is not in that file")
    parser.add_argument(
        "--certificates", default="", help="folder for certificate, sign-ins and audit; default in the home's .config"
    )
    parser.add_argument("--url", default="", help="how browsers reach the page by a proxy: https://HOST[:PORT]/ROBOT/")
    parser.add_argument("--proxy", default="", metavar="unix:FILE|ADDRESS", help="where the proxy's requests come from")
    options = parser.parse_args([word for word in argv if ":=" not in word])
    options.certificates = str(page_folder(options.certificates))
    return options


def _robot(word: str) -> str:
    try:
        robot_kind(word)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    return word


def main() -> int:
    """Run the node; the exit code."""
    return PageNode(parse(sys.argv[1:])).run()
