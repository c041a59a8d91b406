"""The way of browsers' windows to drive_lease: ROS services and a topic, seen from an event loop."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import rospy
from telepresence_msgs.msg import DriveCommand, DriveLook
from telepresence_msgs.srv import DriveAsk, DriveAskRequest, DriveJoin, DriveJoinRequest

from telepresence.security.outside_text import clean
from telepresence.teleop.key_agreement import Claim
from telepresence.teleop.lease_messages import SignedCommand
from telepresence.teleop.lease_topics import fill_ask, fill_command, fill_join, fill_look, read_asked, read_joined
from telepresence.teleop.looking import LookCommand

TIMEOUT = 3.0
"""[s] for which a service is looked for, and a call waits for those before it."""
ALWAYS = ("stop", "leave")
"""Requests that are made however late they are: they make nobody drive."""
_THREADS = 4


@dataclass(frozen=True)
class Answer:
    """See `telepresence.teleop.lease_link.Answer`."""

    ok: bool
    text: str = ""
    value: Any = None


class LeaseServices:
    """Shared by all browsers of one robot.

    Args:
        namespace: Of the robot.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop, namespace: str) -> None:
        drive = f"{namespace.rstrip('/')}/drive"
        self._loop = loop
        self._threads = ThreadPoolExecutor(_THREADS, thread_name_prefix="drive_lease")
        self._commands = rospy.Publisher(f"{drive}/command", DriveCommand, queue_size=20, tcp_nodelay=True)
        self._looks = rospy.Publisher(f"{drive}/look", DriveLook, queue_size=20, tcp_nodelay=True)
        self._join = rospy.ServiceProxy(f"{drive}/join", DriveJoin)
        self._ask = rospy.ServiceProxy(f"{drive}/ask", DriveAsk)

    def link(self, name: str) -> LeaseLink:
        """Return the way for one window."""
        return LeaseLink(self, f"{rospy.get_name()}/{name}")

    def send(self, session: str, command: SignedCommand) -> None:
        """Publish a signed command."""
        message = DriveCommand()
        fill_command(message, session, command)
        self._commands.publish(message)

    def send_look(self, session: str, command: LookCommand) -> None:
        """Publish where a window looks, signed."""
        message = DriveLook()
        fill_look(message, session, command)
        self._looks.publish(message)

    def call_join(self, request: DriveJoinRequest, then: Callable[[Answer], None]) -> None:
        """Call drive/join on a thread; `then` runs on the event loop."""
        self._call(self._join, request, read_joined, then, late=False)

    def call_ask(self, request: DriveAskRequest, then: Callable[[Answer], None]) -> None:
        """Call drive/ask on a thread; `then` runs on the event loop."""
        self._call(self._ask, request, read_asked, then, late=request.action in ALWAYS)

    def _call(
        self,
        service: rospy.ServiceProxy,
        request: Any,
        read: Callable[[Any], Any],
        then: Callable[[Answer], None],
        late: bool,
    ) -> None:
        asked = time.monotonic()

        def work() -> None:
            if time.monotonic() - asked > TIMEOUT and not late:  # drive_lease hung; nobody means it any more
                answer = Answer(False, f"{service.resolved_name} did not answer in time. Ask again.")
                self._loop.call_soon_threadsafe(then, answer)
                return
            try:
                service.wait_for_service(TIMEOUT)
                response = service(request)
                answer = Answer(response.ok, clean(response.reason), read(response))
            except (rospy.ROSException, rospy.ServiceException) as error:
                answer = Answer(False, f"{service.resolved_name} did not answer: {clean(error)}")
            self._loop.call_soon_threadsafe(then, answer)

        self._threads.submit(work)


class LeaseLink:
    """See `telepresence.teleop.lease_link.LeaseLink`."""

    def __init__(self, services: LeaseServices, node_name: str) -> None:
        self._services, self.node_name = services, node_name

    def send(self, session: str, command: SignedCommand) -> None:
        self._services.send(session, command)

    def send_look(self, session: str, command: LookCommand) -> None:
        self._services.send_look(session, command)

    def join(self, claim: Claim, session: str, proof: bytes, then: Callable[[Answer], None]) -> None:
        request = DriveJoinRequest()
        fill_join(request, claim, session, proof)
        self._services.call_join(request, then)

    def ask(
        self, session: str, number: int, action: str, to: str, proof: bytes, then: Callable[[Answer], None]
    ) -> None:
        request = DriveAskRequest()
        fill_ask(request, session, number, action, to, proof)
        self._services.call_ask(request, then)
