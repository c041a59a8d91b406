"""Keyboard driving as a ROS node: keys from the terminal it was started in, velocities on cmd_vel.

Publishes: cmd_vel (geometry_msgs/Twist), repeated while a key is latched, silent half a second after a stop.
Subscribes: cmd_vel and safe_cmd_vel beside it, to let go when another input (the window's drive pad or Stop button)
            begins to drive; safety_state beside them, as what a safety gate sends on cmd_vel is no other input;
            drive/hold (std_msgs/String, latched), same namespace: as long as drive_lease says why nobody may drive,
            keys don't.
Parameters: ~speed 0.2 m/s, ~turn 0.5 rad/s, ~speed_limit 0.55 m/s, ~turn_limit 2.0 rad/s, ~key_timeout 0 s (latched
until the next key), ~repeat_rate 10 Hz (0: only when a key is pressed; else at least 4, for a robot stops when it has
received nothing for 0.5 s). The telepresence report starts at 0.5 m/s and 1.0 rad/s, which is brisk among people, and
publishes once for each key; as there:  _speed:=0.5 _turn:=1.0 _repeat_rate:=0
Option:     --give-way: wait while another program has this node's name, instead of throwing it out; see
            `telepresence_ros.namesake`.
"""

from __future__ import annotations

import math
import sys
import threading
import time

import rosgraph
import rospy
from geometry_msgs.msg import Twist
from std_msgs.msg import String
from telepresence_ros.gate_names import GateNames
from telepresence_ros.node import Node, stop_on_signals
from telepresence_ros.other_senders import subscribe_to_others
from telepresence_ros.sender_watch import moves

from telepresence.security.outside_text import clean
from telepresence.station import priority
from twist_keyboard.keys import HELP, HELP_EVERY, LatchedKeys, Velocity
from twist_keyboard.other_inputs import OtherInputs
from twist_keyboard.terminal import PARTING_TIME, HungUp, KeyTerminal, clock, say

NAME = "teleop_twist_keyboard"
IDLE_PERIOD = 0.1


def main() -> int:
    """Run the node; the exit code."""
    master_lost = threading.Event()
    # It waits for a master as long as it takes: people open the terminal for the keys first.
    node = Node(
        NAME,
        on_master_lost=master_lost.set,
        stop=stop_on_signals(threading.Event()),
        master_timeout=math.inf,
    )
    try:
        keys = LatchedKeys(
            rospy.get_param("~speed", 0.2),
            rospy.get_param("~turn", 0.5),
            rospy.get_param("~speed_limit", 0.55),
            rospy.get_param("~turn_limit", 2.0),
            rospy.get_param("~key_timeout", 0.0),
        )
        keyboard = KeyboardNode(keys, rospy.get_param("~repeat_rate", 10.0), node.stop, master_lost)
    except (ValueError, TypeError) as error:
        print(f"teleop_twist_keyboard: wrong parameter: {error}", file=sys.stderr, flush=True)
        return 1
    priority.put_commands_first()
    keyboard.run()
    node.shut_down("keyboard driving ended")
    return 0


class KeyboardNode:
    """Joins the keys and the topic.

    Args:
        keys: The latched command.
        repeat_rate: Publications per second while a key is latched [Hz]; 0: one per key.
        stop: Set by others to end `run`.
        master_lost: Set by others when the ROS master does not answer any more: the robot stops.
    Raises:
        ValueError: The rate is too low to keep a robot driving, or not a number.
    """

    def __init__(
        self, keys: LatchedKeys, repeat_rate: float, stop: threading.Event, master_lost: threading.Event
    ) -> None:
        if not (repeat_rate == 0 or 4.0 <= repeat_rate <= 100.0):
            raise ValueError(f"repeat_rate must be 0 or 4 to 100 Hz; it is {repeat_rate}")
        self._keys = keys
        self._repeats = repeat_rate != 0
        self._period = 1.0 / repeat_rate if self._repeats else IDLE_PERIOD
        self._stop = stop
        self._master_lost = master_lost
        self._taken_over = threading.Event()
        self._inputs = OtherInputs()
        self._motion, self._speed_keys = keys.describe_motion(), 0
        beside = rosgraph.names.namespace(rospy.resolve_name("cmd_vel"))
        self._gates = GateNames(beside)
        for topic in {rospy.resolve_name("cmd_vel"), f"{beside}safe_cmd_vel"}:
            subscribe_to_others(topic, Twist, self._receive)
        self._publisher = rospy.Publisher("cmd_vel", Twist, queue_size=1)
        self._hold = ""
        self._holds = rospy.Subscriber(f"{beside}drive/hold", String, self._on_hold, queue_size=1, tcp_nodelay=True)
        rospy.on_shutdown(self._end)

    def run(self) -> None:
        """Drive until the terminal hangs up, a signal comes or ROS shuts this node down."""
        if sys.stdin is None or not sys.stdin.isatty():
            say("Keyboard driving has no terminal here, so it does nothing. In a terminal, run:")
            say("  roslaunch teleop_twist_keyboard teleop.launch")
            self._stop.wait()
            return
        try:
            with KeyTerminal(sys.stdin.fileno()) as terminal:
                say(HELP)
                say(self._keys.describe_speeds())
                self._serve(terminal)
        except HungUp as error:
            say(f"{error}; the robot stops")
        finally:
            self._end()

    def _serve(self, terminal: KeyTerminal) -> None:
        next_at = now = clock()
        while not self._stop.is_set():
            pressed = self._read(terminal, next_at - now)
            now = clock()
            self._yield_to_others(now)
            for key in pressed:
                self._keys.press(key, now)
            self._obey_hold(now)
            if pressed or now >= next_at:
                # On the grid of the last time, unless a key has just been answered or the machine was busy.
                next_at = now + self._period if pressed or now > next_at + self._period else next_at + self._period
                was_moving = self._keys.moving
                velocity = self._keys.command(now)
                if velocity is not None and (self._repeats or pressed or was_moving != self._keys.moving):
                    self._publish(velocity)
                self._say_state()

    def _read(self, terminal: KeyTerminal, timeout: float) -> list[str]:
        if terminal.in_foreground():
            return terminal.read_keys(max(0.0, timeout))
        if self._keys.moving:
            self._publish(Velocity())
            self._keys.release(clock())
        while not terminal.in_foreground() and not self._stop.wait(IDLE_PERIOD):
            velocity = self._keys.command(clock())
            if velocity is not None:
                self._publish(velocity)
        if not self._stop.is_set():
            terminal.resume()
            say("This job has the terminal back: keys drive again.")
        return []

    def _yield_to_others(self, now: float) -> None:
        if self._master_lost.is_set():
            self._master_lost.clear()
            if self._keys.moving:
                self._keys.release(now)
                say("The ROS master does not answer: the robot stops. Press a key again when it is back.")
        if self._taken_over.is_set():
            self._taken_over.clear()
            if self._keys.moving:
                say("Another input drives now; press a key to take over again.")
            self._keys.let_go()
            self._motion = self._keys.describe_motion()

    def _obey_hold(self, now: float) -> None:
        # What a node said that is gone since does not count.
        if self._hold and self._keys.moving and self._holds.get_num_connections():
            self._keys.release(now)
            say(f"The robot stays: {self._hold}")

    def _on_hold(self, message: String) -> None:
        """Take the new reason; called on rospy's thread."""
        self._hold = clean(message.data)

    def _receive(self, message: Twist) -> None:
        """Let go when another node drives or stops the robot; called on rospy's thread."""
        if self._gates.sent(message):
            return
        if self._inputs.take_over(message._connection_header["callerid"], moves(message), clock()):
            self._taken_over.set()

    def _publish(self, velocity: Velocity) -> None:
        message = Twist()
        message.linear.x, message.linear.y, message.linear.z = velocity.vx, velocity.vy, velocity.vz
        message.angular.z = velocity.wz
        try:
            self._publisher.publish(message)
        except rospy.ROSException:
            self._stop.set()  # the topic was closed: this node is being shut down

    def _end(self) -> None:
        """One zero if the robot was driving. Also called by rospy, before it closes the topics (rosnode kill)."""
        self._stop.set()
        if self._keys.moving:
            self._keys.let_go()
            self._publish(Velocity())
            time.sleep(PARTING_TIME)

    def _say_state(self) -> None:
        """Print what has changed, and after every fifteenth speed key the help."""
        motion, pressed = self._keys.describe_motion(), self._keys.speed_keys
        if motion != self._motion:
            self._motion = motion
            say(motion)
        if pressed != self._speed_keys:
            say(self._keys.describe_speeds())
            if pressed // HELP_EVERY != self._speed_keys // HELP_EVERY:
                say(HELP)
            self._speed_keys = pressed
