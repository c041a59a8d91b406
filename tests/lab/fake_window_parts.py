"""What the operator's window is joined to, without ROS and without xterm: the same signals, and what was asked."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from PyQt5.QtCore import QObject, QTimer, pyqtSignal
from PyQt5.QtWidgets import QFrame

from gui.robots import ROBOTS
from gui.ros.channels import Answer, Channel
from gui.ros.link_state import LinkState
from gui.ros.picture import Picture
from telepresence.geometry import Velocity
from telepresence.security.signing import PROOF
from telepresence.teleop.drive_lease import DriveLease
from telepresence.teleop.key_agreement import Claim
from telepresence.teleop.lease_messages import PILOT, Account, Reply, sign_joined, sign_reply
from telepresence.teleop.lease_topics import Asked, Joined, LeaseState
from telepresence.teleop.lease_windows import Window

RUNNING = {"master": True, "joined": True, "driver": True, "feed": True}
"""What `FakeLink.become` takes for a robot whose programs run."""


def picture(age: float = 0.0, encoding: str = "rgb8", channels: int = 3) -> Picture:
    return Picture(np.full((48, 64, channels), 99, np.uint8), encoding, time.time(), time.monotonic() - age)


def begun(link: FakeLink) -> dict[str, bool]:
    """What of the conversation was last asked for."""
    return {name: values[0] for name, *values in link.called if name in ("show_page", "conversation")}


class FakeLink(QObject):
    """The signals of RosLink, and what was asked of it."""

    state_changed = pyqtSignal(object)
    looked = pyqtSignal()
    trouble = pyqtSignal(str)

    def __init__(self, robot: str = "pepper") -> None:
        super().__init__()
        self.robot = ROBOTS[robot]
        self.feed = "/robot/image"
        self.state = LinkState("http://127.0.0.1:11311")
        self.channels = {row.channel: Channel(row) for row in self.robot.incoming}
        self.node_name = "/gui_ros_node"
        self.open = True
        self.lease = {
            "epoch": "1", "sign_in": False, "pilot": "anna", "window": self.node_name, "asking": "", "stopped_by": "",
            "hold": "", "other": "", "velocity": Velocity(0.0, 0.0, 0.0),
            "present": (("anna (pilot)", self.node_name),),
        }  # fmt: skip
        self.repeats = QTimer(self)
        """drive_lease repeats what it has said, as the real one does, until this is stopped."""
        self.repeats.setInterval(200)
        self.repeats.timeout.connect(self.report_lease)
        self.drive_lease = DriveLease(lambda name: Account(name, PILOT))
        self.windows: dict[str, Window] = {}
        """Who has joined, by session."""
        self.replies: dict[str, Reply] = {}
        """Action -> what drive_lease answers; otherwise it agrees."""
        self.sent: list[tuple] = []
        self.unheard: set[str] = set()
        """What nobody subscribes to."""
        self.called: list[tuple] = []
        self.slow: set[str] = set()
        """Services that do not answer by themselves: who waits for them is in `waiting`."""
        self.waiting: list[Callable[[Answer], None]] = []
        self.published = {"picture", "laser", "battery", "safety", "page", "voice_state"}
        self.tidied: list[float] = []
        self.looks = 0
        self.connected = {"picture": 1}
        """Channel -> how many publish it."""

    def become(self, **changes: bool) -> None:
        self.state = LinkState(self.state.master_uri, **changes)
        self.state_changed.emit(self.state)
        self.looked.emit()
        if self.state.joined and self.state.driver and "lease" in self.channels:
            self.report_lease()

    @property
    def picture(self) -> object:
        """Emit here what the camera shows."""
        return self.channels["picture"].arrived

    @property
    def watching(self) -> bool:
        return self.channels["picture"].wanted

    @property
    def driven(self) -> list[tuple[float, float, float]]:
        """Velocities that were sent, zeros past the lease among them."""
        velocities = []
        for name, *values in self.sent:
            if name == "zero":
                velocities.append((0.0, 0.0, 0.0))
            elif name == "command" and values[1].velocity is not None:
                velocities.append(tuple(values[1].velocity))
        return velocities

    @property
    def movements(self) -> list[int]:
        """The values that were sent on movement_command."""
        return [values[0] for name, *values in self.sent if name == "movement"]

    @property
    def asked(self) -> list[str]:
        """What was asked of drive_lease."""
        return [values[2] for name, *values in self.called if name == "ask"]

    def report_lease(self, **changes: object) -> None:
        """drive_lease says who drives: this window, unless changed."""
        self.lease.update(changes)
        self.repeats.start()
        self.channels["lease"].arrived.emit(LeaseState(**self.lease, arrived=time.monotonic()))

    def channel(self, name: str) -> Channel:
        return self.channels[name]

    def has(self, name: str) -> bool:
        outgoing = {row.channel for row in self.robot.outgoing}
        return name in self.channels or name in outgoing or name in {row.name for row in self.robot.services}

    def place_of(self, frame: str, seen_from: str, stamp: float) -> tuple:
        """A level camera one metre above the origin, looking along x."""
        return np.array(((0.0, 0.0, 1.0), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0))), np.array((0.0, 0.0, 1.0))

    def resolve(self, name: str) -> str:
        return name if name.startswith("/") else f"/{name}"

    def service_name(self, name: str) -> str:
        return f"/{next(row.service for row in self.robot.services if row.name == name)}"

    def watch(self, name: str, wanted: bool) -> None:
        self.channels[name].wanted = wanted

    def send(self, name: str, *values: object) -> bool:
        self.sent.append((name, *values))
        return True

    def is_heard(self, name: str) -> bool:
        return name not in self.unheard

    def call(
        self,
        name: str,
        *values: object,
        then: Callable[[Answer], None] = lambda answer: None,
        patient: bool = False,
        signed_out: bool = False,
    ) -> None:
        if not (self.open or signed_out):
            then(Answer(False, "Sign in first."))
            return
        self.called.append((name, *values))
        if name in self.slow:
            self.waiting.append(then)
        elif name == "join":
            then(self._join(*values))
        elif name == "ask" and values[0] in self.windows:
            reply = self.replies.get(values[2], Reply(True))
            proof = sign_reply(self.windows[values[0]].key, values[1], reply)
            then(Answer(reply.ok, reply.reason, Asked(reply.ended, proof)))
        elif name == "ask":
            then(Answer(False, "This robot does not know this window.", Asked(False, bytes(PROOF))))
        else:
            then(Answer(True))

    def _join(self, claim: Claim, session: str = "", proof: bytes = b"") -> Answer:
        """Answer as drive_lease does; every session stays."""
        if not session:
            offer = self.drive_lease.offer(claim, 0.0)
            return Answer(True, "", Joined(offer.session, offer.key, b""))
        window = self.drive_lease.prove(claim, session, proof, 0.0)
        if isinstance(window, Reply):
            return Answer(False, window.reason, Joined("", b"", b""))
        self.windows[session] = window
        return Answer(True, "", Joined("", b"", sign_joined(window.key)))

    @property
    def found(self) -> frozenset[str]:
        return frozenset(self.published) if self.state.driver else frozenset()

    def publishers(self, name: str) -> int:
        return self.connected.get(name, 0)

    def look_now(self) -> None:
        self.looks += 1

    def tidy_master(self, seconds: float) -> None:
        self.tidied.append(seconds)

    def set_open(self, wanted: bool) -> None:
        self.open = wanted


class FakeTerminal(QFrame):
    """The signals of TerminalView, and what was typed."""

    ready = pyqtSignal()
    refused = pyqtSignal(str)
    typed = pyqtSignal(str)
    busy = pyqtSignal(str)
    ended = pyqtSignal(str)
    focus_changed = pyqtSignal(bool)
    failed = pyqtSignal(str, str, str)
    stop_typed = pyqtSignal()

    def __init__(self) -> None:
        super().__init__()
        self.has_keyboard = False
        self.lines: list[tuple[str, str]] = []
        self.interrupted: list[str] = []
        self.running = ""
        self.denied, self.started = "", False

    def start(self) -> None:
        self.started = True

    def deny(self, reason: str) -> None:
        self.denied = reason

    def type_line(self, line: str | Callable[[], str], window: str = "session", otherwise: str | None = None) -> None:
        if self.running and otherwise is not None:
            self.busy.emit(otherwise)
            return
        try:
            self.lines.append((window, line if isinstance(line, str) else line()))
        except ValueError as error:
            self.refused.emit(str(error))

    def end_program(self, window: str = "session") -> None:
        self.interrupted.append(window)

    def give_keyboard_back(self) -> None:
        if self.has_keyboard:
            self.has_keyboard = False
            self.focus_changed.emit(False)

    def take_keyboard(self) -> None:
        self.has_keyboard = True
        self.focus_changed.emit(True)
