"""Keyboard driving as a ROS node: keys from the terminal it was started in, velocities on one topic.

Publishes:  safe_cmd_vel where a safety gate listens, else cmd_vel (geometry_msgs/Twist; see `drive_topic`): 10 Hz while
            a key is held, zeros for a moment afterwards, then nothing.
Subscribes: drive/hold (std_msgs/String) beside it: as long as drive_lease says why nobody may drive, keys don't.
Parameters: ~scale_linear, ~scale_angular (1.0): factors of 0.05 m/s and 0.5 rad/s; ~gate (true): false drives on
            cmd_vel even where there is a gate; ~keys (usual): guide for Q, E and speeds as in the guide's window.
"""

from __future__ import annotations

import logging
import math
import sys
import threading
import time

import rospy
from telepresence_ros.node import Node, stop_on_signals
from twist_keyboard.terminal import PARTING_TIME, HungUp, KeyTerminal, clock, say

from rto_teleop.drive_topic import DriveTopic
from rto_teleop.keys import DRIVING_KEYS, HELD_TOGETHER, TYPED_IN_TURN, HeldKeys
from rto_teleop.x_keyboard import XKeyboard
from telepresence.geometry import ZERO_VELOCITY, Velocity

log = logging.getLogger(__name__)

PERIOD = 0.1
"""Seconds between two velocities while a key is held."""
WATCH_PERIOD = 0.05
"""Seconds between two looks at which keys are held, where that can be seen."""
LONGEST_PAUSE = 0.5
"""Seconds between two turns after which this program was stopped (Ctrl-Z, SIGSTOP) or the machine slept: the robot has
been standing since, and what was typed meanwhile must not move it."""
REMINDER = 5.0
"""Seconds between two sentences about why keys move nothing."""


def main(name: str = "rto_teleop_keyboard", topic: str = "cmd_vel") -> int:
    """Run the node called `name`, which publishes on `topic`; the exit code."""
    master_lost = threading.Event()
    node = Node(name, on_master_lost=master_lost.set, stop=stop_on_signals(threading.Event()))
    try:
        keys = HeldKeys(
            float(rospy.get_param("~scale_linear", 1.0)),
            float(rospy.get_param("~scale_angular", 1.0)),
            str(rospy.get_param("~keys", "usual")),
        )
    except ValueError as error:
        print(f"{name}: wrong parameter: {error}", file=sys.stderr)
        return 1
    KeyboardNode(keys, DriveTopic(topic, _own_names(), say), node.stop, master_lost).run()
    node.shut_down("keyboard driving ended")
    return 0


class KeyboardNode:
    """Joins keys and topic. `stop` ends `run`; the robot stops when `master_lost` is set."""

    def __init__(self, keys: HeldKeys, topic: DriveTopic, stop: threading.Event, master_lost: threading.Event) -> None:
        self._keys = keys
        self._topic = topic
        self._reminded = -math.inf
        self._x = _open_x_keyboard()
        self._window = 0  # that the held keys were typed into
        self._stop = stop
        self._driving = False
        self._master_lost = master_lost
        self._turned = math.inf

    def run(self) -> None:
        """Drive until the terminal hangs up, a signal comes or ROS shuts this node down."""
        if sys.stdin is None or not sys.stdin.isatty():
            say(f"There is no terminal here to read keys from. In a terminal:  rosrun {_own_names()}")
            self._stop.wait()
            return
        try:
            threading.Thread(target=self._topic.watch, args=(self._stop,), name="drive-topic", daemon=True).start()
            with KeyTerminal(sys.stdin.fileno()) as terminal:
                say(self._keys.help(HELD_TOGETHER if self._x else TYPED_IN_TURN))
                say(self._keys.describe())
                while not self._stop.is_set():
                    self._turn(terminal)
        except HungUp as error:
            say(f"{error}; the robot stops")
        finally:
            if self._driving:
                self._publish(ZERO_VELOCITY)
                time.sleep(PARTING_TIME)

    def _turn(self, terminal: KeyTerminal) -> None:
        if not terminal.in_foreground():
            self._keys.release(clock())
            self._send()
            self._stop.wait(PERIOD)
            if terminal.in_foreground():
                terminal.resume()
            self._turned = clock()
            return
        before = self._keys.describe()
        typed = terminal.read_keys(WATCH_PERIOD if self._keys.watched else PERIOD)
        before_that, self._turned = self._turned, clock()
        if self._turned - before_that > LONGEST_PAUSE:
            terminal.resume()
            self._keys.release(self._turned)
            typed = []
        if typed or self._keys.watched:
            self._take(typed, clock())
            self._check_way(clock())
        if self._master_lost.is_set():
            self._master_lost.clear()
            self._keys.release(clock())
            say("The ROS master does not answer: the robot stops.")
        if self._keys.describe() != before:
            say(self._keys.describe())
        self._send()

    def _take(self, typed: list[str], now: float) -> None:
        """Take the keys that were typed, and of the X server which ones are held."""
        down, window = self._held_keys()
        for key in typed:
            held = key.lower() in down
            if held and not self._keys.watched:
                self._window = window
            self._keys.press(key, now, held)
        # Keys that are held while another window has the keyboard are not meant for this one.
        self._keys.observe(down if window == self._window else frozenset(), now)

    def _held_keys(self) -> tuple[frozenset[str], int]:
        """Return the held keys and the window that has the keyboard; no keys without an X server."""
        if self._x is not None:
            try:
                return self._x.held()
            except OSError as error:
                self._x.close()
                self._x = None
                say(f"{error}: several keys at once must be typed in turn from now on.")
        return frozenset(), 0

    def _check_way(self, now: float) -> None:
        """Stop while nobody may drive, and say why keys move nothing."""
        reason = f"The robot stays: {self._topic.hold}" if self._topic.hold else self._topic.problem
        if self._topic.hold:
            self._keys.release(now)
        if reason and now - self._reminded > REMINDER:
            self._reminded = now
            say(reason)

    def _send(self) -> None:
        velocity = self._keys.command(clock())
        self._driving = velocity is not None and any(velocity)
        if velocity is not None:
            self._publish(velocity)

    def _publish(self, velocity: Velocity) -> None:
        try:
            self._topic.publish(velocity)
        except rospy.ROSException:
            self._stop.set()  # the topic was closed: this node is being shut down


def _open_x_keyboard() -> XKeyboard | None:
    try:
        return XKeyboard(DRIVING_KEYS)
    except OSError as error:
        log.debug("the terminal alone says what is typed: %s", error)
        return None


def _own_names() -> str:
    """Return what a person types after rosrun."""
    program = rospy.get_name().rpartition("/")[2]
    return f"{'rto_safe_teleop' if program.startswith('safe') else 'rto_teleop'} {program}"
