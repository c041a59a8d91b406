"""What a browser's connection carries besides pictures and commands: sound both ways, and the pilot's face."""

from __future__ import annotations

from typing import Any

from aiortc import RTCPeerConnection

from telepresence.page.browser_face import BrowserFace
from telepresence.page.browser_sound import BrowserSound
from telepresence.page.browser_window import BrowserWindow
from telepresence.page.shared_sound import SharedSound
from telepresence.page.station import Conversation
from telepresence.video.webrtc import release_early

ACTIONS = ("listen", "face")
"""Rows of `commands.REQUESTS` that the connection itself carries out."""


class RobotConversation:
    """One robot's sound and tablet for all browsers. Belongs to one event loop."""

    def __init__(self, station: Conversation) -> None:
        release_early()  # a lost packet of a microphone is not waited for
        self._station = station
        self.sound = SharedSound(station.listen)

    def browser(self, window: BrowserWindow) -> BrowserConversation:
        """Return the part of one more connection."""
        return BrowserConversation(self.sound, self._station, window)


class BrowserConversation:
    """The sound and face of one connection. All of it belongs to one event loop.

    Only who has the robot speaks through it and is seen on it, whatever the page sends.

    Args:
        sound: Of the robot.
        conversation: Of the robot's station.
        window: The browser's way to drive.
    """

    def __init__(self, sound: SharedSound, conversation: Conversation, window: BrowserWindow) -> None:
        self._conversation, self._window = conversation, window
        self._sound = BrowserSound(sound, conversation.speak, lambda: window.mine)
        self._face = BrowserFace(conversation.show_face, lambda: window.mine)

    def join(self, peer: RTCPeerConnection) -> None:
        """Take the places of an offer that are meant for this: the first sound, and the second picture."""
        sounds, pictures = (
            [each for each in peer.getTransceivers() if each.kind == kind] for kind in ("audio", "video")
        )
        for place in (*sounds[1:], *pictures[2:]):
            place.direction = "inactive"  # nobody would take what comes there
        for place in pictures[:1]:
            place.direction = "sendonly"
        if sounds:
            self._sound.join(sounds[0])
        if len(pictures) > 1:
            self._face.join(pictures[1])

    def check(self) -> None:
        """Look whether this browser still has the robot; ten times a second, and once it is connected."""
        self._sound.check()
        self._face.check()

    def describe(self) -> dict[str, Any]:
        """Return what the page shows of it, as JSON's types."""
        own = {
            "listens": self._sound.listens,
            "speaks": self._sound.speaks,
            "shows": self._face.wanted,
            "seen": self._face.live,
        }
        return self._conversation.state() | own

    def ask(self, action: str, value: bool) -> None:
        """Do what the page asks for: `listen` or `face`."""
        if action == "listen":
            self._sound.listens = value
        else:
            self._face.want(value)

    def close(self) -> None:
        """The connection is over."""
        self._sound.close()
        self._face.close()
