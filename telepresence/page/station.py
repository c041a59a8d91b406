"""What the page needs of the stations behind it. The ROS side is `catkin_ws/src/pilot_page`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from telepresence.page.entrance import Entrance
from telepresence.page.floor import Floor
from telepresence.page.shared_sound import Take
from telepresence.teleop.lease_link import LeaseLink
from telepresence.teleop.lease_messages import Account
from telepresence.video.images import LatestImage


class Conversation(Protocol):
    """Sound both ways with one robot, and the pilot's face on it."""

    def listen(self, take: Take | None) -> None:
        """Hand the robot's sound to `take`, on any thread, from now on; None: nobody listens."""

    def speak(self, frames: bytes, rate: int, channels: int) -> None:
        """Let the robot play a piece of the pilot's voice: int16 little-endian, interleaved."""

    def show_face(self, jpeg: bytes | None) -> None:
        """Show the robot's people the pilot: a JPEG file, b"" for a covered camera, None for nobody any more."""

    def state(self) -> dict[str, bool]:
        """Return what can be had here now: "speak", "listen", "face", "say"."""


class Station(Protocol):
    """One robot's station."""

    @property
    def picture(self) -> LatestImage:
        """Its newest picture, as `telepresence.video.webrtc.planes_of` makes them."""

    @property
    def conversation(self) -> Conversation:
        """Sound both ways, and the pilot's face."""

    @property
    def floor(self) -> Floor | None:
        """What it sees of the floor; None where it cannot be driven to a place in the picture."""

    def watch(self, wanted: bool) -> None:
        """Take pictures, or take none: nobody looks."""

    def show_who_looks(self, names: list[str]) -> None:
        """Let the robot's surroundings know who looks through it by the page now, each once, sorted: its tablet, the
        windows."""

    def lease_link(self, name: str) -> LeaseLink:
        """Return a way to drive_lease for a window of this name."""

    def state(self) -> dict[str, Any]:
        """Return what the page shows of the robot besides who drives, as JSON's types; ten times a second for each
        browser."""

    async def request(self, action: str, value: Any, account: Account) -> None:
        """Do what a browser asks of the robot besides driving: a row of `commands.REQUESTS`.

        Whether this person may has been checked. Raises ValueError with a sentence for the person.
        """


class Stations(Protocol):
    """The robots of a page, and who may come in."""

    @property
    def robots(self) -> Mapping[str, Station]:
        """Name that people use -> robot, in the order in which the page shows them."""

    @property
    def entrance(self) -> Entrance:
        """Lets people in."""
