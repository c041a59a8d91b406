"""How a window reaches drive_lease: by ROS from the operator's window, through a node from the pilot's page."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from telepresence.teleop.key_agreement import Claim
from telepresence.teleop.lease_messages import SignedCommand
from telepresence.teleop.looking import LookCommand


class Answer(Protocol):
    """What drive_lease has answered.

    Attributes:
        text: Why not, if `ok` is false.
        value: `lease_topics.Joined` or `lease_topics.Asked`; None if nothing was answered.
    """

    @property
    def ok(self) -> bool: ...
    @property
    def text(self) -> str: ...
    @property
    def value(self) -> Any: ...


class LeaseLink(Protocol):
    """The way to drive_lease. What `then` gets comes on the client's own thread."""

    @property
    def node_name(self) -> str:
        """Name by which drive_lease knows this window."""

    def send(self, session: str, command: SignedCommand) -> None: ...

    def send_look(self, session: str, command: LookCommand) -> None: ...

    def join(self, claim: Claim, session: str, proof: bytes, then: Callable[[Any], None]) -> None:
        """Call drive/join; the first time with neither session nor proof."""

    def ask(
        self, session: str, number: int, action: str, to: str, proof: bytes, then: Callable[[Any], None]
    ) -> None: ...
