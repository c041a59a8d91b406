"""Which velocities rto_drive_link hands on; ROS, the link and the clock are replaced."""

from __future__ import annotations

from unittest.mock import MagicMock

import pytest
from geometry_msgs.msg import Twist
from rto_node import drive_link_node

REPLACED = ("rospy", "Node", "DriveLink", "KeptState", "CarefulSwitch", "Diagnostics")


class Listener:
    """The node's ears, and what it has told the robot."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self._callbacks = {}
        for name in REPLACED:
            monkeypatch.setattr(drive_link_node, name, MagicMock())
        monkeypatch.setattr(drive_link_node, "time", MagicMock(monotonic=lambda: self._now))
        monkeypatch.setattr(drive_link_node, "subscribe_velocities", self._subscribe)
        self._now = 0.0
        drive_link_node.DriveLinkNode()
        self._link = drive_link_node.DriveLink.return_value
        self.lose_master = drive_link_node.Node.call_args.kwargs["on_master_lost"]

    def _subscribe(self, topic, callback, *_others) -> None:
        self._callbacks[topic] = callback

    def hear(self, now: float, topic: str, vx: float) -> bool:
        """Whether a velocity that comes `now` [s] is handed on; if it is not, the robot is let go of."""
        self._now = now
        self._link.reset_mock()
        twist = Twist()
        twist.linear.x = vx
        self._callbacks[topic](twist)
        handed_on, let_go = self._link.drive.called, self._link.release.called
        assert handed_on is not let_go
        return handed_on


@pytest.fixture
def listener(monkeypatch):
    return Listener(monkeypatch)


@pytest.mark.parametrize(("cut", "other"), [("safe_cmd_vel", "cmd_vel"), ("cmd_vel", "safe_cmd_vel")])
@pytest.mark.parametrize("talks", [False, True], ids=["alone", "beside a program that talks all the time"])
def test_commands_that_the_network_held_up_are_not_believed(listener, cut, other, talks):
    steady = [0.1 * i for i in range(100)]
    burst = [13.0 + 0.001 * i for i in range(30)]
    heard = [(now, cut) for now in (*steady, *burst)]
    if talks:
        heard += [(0.05 + 0.1 * i, other) for i in range(140)]
    believed = {cut: [], other: []}
    for now, topic in sorted(heard):
        if listener.hear(now, topic, 0.2):
            believed[topic].append(now)
    assert believed[cut] == [*steady, *burst[:2]], "the first two of a burst could be two programs"
    assert len(believed[other]) == 140 * talks, "and the other program is heard"


@pytest.mark.parametrize("topic", ["safe_cmd_vel", "cmd_vel"])
def test_after_a_lost_master_neither_topic_is_believed_at_once(listener, topic):
    assert listener.hear(1.0, topic, 0.2)
    listener.lose_master()
    assert not listener.hear(1.1, topic, 0.2)
    assert listener.hear(1.5, topic, 0.2)
