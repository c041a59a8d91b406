"""Robotino's keyboard, turn by turn, at a real pseudo-terminal; no ROS graph."""

from __future__ import annotations

import os
import pty
import threading
import time
from types import SimpleNamespace

import pytest
from rto_teleop import keyboard
from rto_teleop.keyboard import LONGEST_PAUSE, KeyboardNode
from rto_teleop.keys import HeldKeys
from twist_keyboard.terminal import KeyTerminal

pytestmark = pytest.mark.ros


class Desk:
    """A keyboard node, whose turns are made one by one, and what it has published."""

    def __init__(self, terminal: KeyTerminal, hands: int) -> None:
        self.sent: list = []
        topic = SimpleNamespace(publish=self.sent.append, hold="", problem="")
        self.node = KeyboardNode(HeldKeys(1.0, 1.0, "usual"), topic, threading.Event(), threading.Event())
        self._terminal, self._hands = terminal, hands

    def type(self, keys: str) -> None:
        os.write(self._hands, keys.encode())

    def turn(self) -> None:
        self.node._turn(self._terminal)

    @property
    def drives(self) -> bool:
        return bool(self.sent) and any(self.sent[-1])


@pytest.fixture
def desk(monkeypatch):
    monkeypatch.setattr(keyboard, "_open_x_keyboard", lambda: None)
    hands, screen = pty.openpty()
    with KeyTerminal(screen) as terminal:
        yield Desk(terminal, hands)
    os.close(hands)
    os.close(screen)


def test_what_was_typed_to_a_program_that_was_stopped_moves_nothing(desk):
    desk.type("w")
    desk.turn()
    assert desk.drives
    desk.type("wwww")
    desk.node._turned -= 1.1 * LONGEST_PAUSE  # it was stopped for so long
    desk.turn()
    assert not desk.drives
    for _ in range(3):
        desk.turn()
        assert not desk.drives, "nor later"
    desk.type("w")
    desk.turn()
    assert desk.drives, "a new key drives again"


def test_what_was_held_when_the_machine_fell_asleep_moves_nothing(desk, monkeypatch):
    desk.type("w")
    desk.turn()
    assert desk.drives
    # Linux: CLOCK_MONOTONIC stands still while the machine sleeps, CLOCK_BOOTTIME goes on.
    awake, clock_gettime = time.monotonic(), time.clock_gettime
    asleep = {time.CLOCK_BOOTTIME: 3600.0}
    monkeypatch.setattr(time, "monotonic", lambda: awake)
    monkeypatch.setattr(time, "clock_gettime", lambda which: clock_gettime(which) + asleep.get(which, 0.0))
    desk.type("w")
    desk.turn()
    assert not desk.drives
