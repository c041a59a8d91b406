"""The node drive_lease: one pilot at a time. All operator's windows drive through it.

Subscribes: drive/command and drive/look (telepresence_msgs/DriveCommand, DriveLook) of the windows; cmd_vel
            (geometry_msgs/Twist), to know when another program drives past the lease; safety
            (telepresence_msgs/SafetyState), whether a gate that has just come holds the red stop.
Publishes:  cmd_vel (geometry_msgs/Twist), what the pilot's window asks for, and a zero whenever the pilot changes,
            stops or falls silent; head/look (telepresence_msgs/HeadLook), where that window looks; drive/state
            (telepresence_msgs/DriveState, latched); drive/hold (std_msgs/String, latched): why nobody may drive now,
            for keyboard programs; empty when they may.
Services:   drive/join (telepresence_msgs/DriveJoin), drive/ask (telepresence_msgs/DriveAsk).
Calls:      stop_drive, reset_stop (std_srvs/Trigger) of the safety gate, with the red stop.
Arguments:  --sign-in true: check names against the accounts of telepresence.teleop.accounts; false: everybody who asks
            is a pilot. --users FILE: the accounts; default TELEPRESENCE_USERS, else gui/users.db; guests are in the
            file of invitations beside it (telepresence.teleop.invitations). Also _sign_in:= and
            _users:=, but only from the command line: anybody on the graph can set parameters. ~kept, which this node
            sets for the next one if it dies, holds who has pressed the red stop: it can only hold the robot.
"""

from __future__ import annotations

import argparse
import math
import queue
import re
import secrets
import sys
import threading
import time
from collections.abc import Mapping
from pathlib import Path

import rospy
from geometry_msgs.msg import Twist
from std_msgs.msg import String
from std_srvs.srv import Trigger
from telepresence_msgs.msg import DriveCommand, DriveLook, DriveState, HeadLook, SafetyState
from telepresence_msgs.srv import (
    DriveAsk,
    DriveAskRequest,
    DriveAskResponse,
    DriveJoin,
    DriveJoinRequest,
    DriveJoinResponse,
)
from telepresence_ros.kept_state import KeptState
from telepresence_ros.node import Node

from telepresence.geometry import ZERO_VELOCITY as ZERO
from telepresence.geometry import Velocity
from telepresence.security.outside_text import clean_name
from telepresence.security.signing import PROOF
from telepresence.station import priority
from telepresence.switch import switch
from telepresence.teleop.accounts import UserError, Users
from telepresence.teleop.drive_lease import DriveLease, LeaseSnapshot
from telepresence.teleop.invitations import Invitations, beside
from telepresence.teleop.key_agreement import KEY, Claim
from telepresence.teleop.known_accounts import KnownAccounts
from telepresence.teleop.lease_messages import WATCHER, Account, Reply, SignedCommand, sign_joined
from telepresence.teleop.looking import LookCommand, read_look

PERIOD = 0.05
STATE_PERIOD = 0.2
"""Seconds after which an unchanged state is repeated: after a second of silence windows take this node for dead."""
PARTING_TIME = 0.05
"""Seconds allowed for the last zero to be sent: rospy sends from a thread of its own."""
STOP_PATIENCE = 2.0
"""Seconds within which the safety gate's service must be found: it may be starting, and remember a stop."""
STOP_AGAIN = 1.0
"""Seconds after which a gate that does not hold the red stop is asked for it again."""
NO_GATE_PATIENCE = 0.2
"""Seconds, likewise, for a reset while no gate was ever heard: there may be none."""
SILENT_GATE = "The safety gate does not answer, so the robot stays stopped."
GATE_ANSWER = 3.0
"""Seconds for which the safety gate's answer to a reset is waited for; a robot that is out of reach has 2 s for it."""
ACCOUNTS_PERIOD = 0.25
"""Seconds between two looks at the accounts of those who have joined."""
ACCOUNTS_PATIENCE = 1.0
"""Seconds for which accounts may be unreadable, while somebody writes them for example."""
_CALLER = re.compile(r"[A-Za-z0-9_/]{1,200}")
_OWN = re.compile(r"_(sign_in|users):=")


class LeaseNode:
    """Joins the lease, which decides who drives, and the topics.

    Args:
        sign_in: Whether names are checked; otherwise everybody but a guest is a pilot.
        users: The accounts; the invitations of guests are beside them.
    """

    def __init__(self, sign_in: bool, users: Users) -> None:
        self._node = Node("drive_lease")
        self._sign_in = sign_in
        self._known = KnownAccounts(users if sign_in else None, Invitations(beside(users.path)))
        self._lease = DriveLease(self._find_account, self._known.of_lease(())[0])
        self._kept = KeptState()
        if name := clean_name(self._kept.text("stopped_by")):
            self._lease.keep_stop(self._find_account(name) or Account(name, WATCHER))
        self._epoch = secrets.token_hex(4)
        self._lock = threading.Lock()  # protects the lease: callbacks come on threads of their own
        self._state, self._state_due = DriveState(), 0.0
        self._velocities = rospy.Publisher("cmd_vel", Twist, queue_size=1)
        self._states = rospy.Publisher("drive/state", DriveState, queue_size=1, latch=True)
        self._holds = rospy.Publisher("drive/hold", String, queue_size=1, latch=True)
        self._holds.publish("")
        # More than one: every window's command counts, not only the newest of them all.
        self._commands = rospy.Subscriber(
            "drive/command", DriveCommand, self._on_command, queue_size=20, tcp_nodelay=True
        )
        self._looks = rospy.Publisher("head/look", HeadLook, queue_size=1, tcp_nodelay=True)
        rospy.Subscriber("drive/look", DriveLook, self._on_look, queue_size=20, tcp_nodelay=True)
        self._connected: set[str] = set()
        self._unsure_gate = False
        """Whether a gate may not know of the red stop: it was just pressed, or the gate has just come."""
        self._gate: dict[str, str] = {}
        """The header of the connection to the gate, another one for every connection."""
        self._stop_asked = -math.inf
        self._gate_turn = threading.Lock()  # held from the look whether a request still counts to the gate's answer
        rospy.Subscriber("safety", SafetyState, self._on_safety, queue_size=1, tcp_nodelay=True)
        rospy.Subscriber("cmd_vel", Twist, self._on_other, queue_size=5, tcp_nodelay=True)
        rospy.Service("drive/join", DriveJoin, self._on_join)
        rospy.Service("drive/ask", DriveAsk, self._on_ask)

    def run(self) -> int:
        """Run until the node is shut down, then send a zero; return the exit code."""
        threading.Thread(target=self._watch_accounts, name="accounts", daemon=True).start()
        return self._kept.forget_after(self._node.run(self._loop))

    def _loop(self) -> None:
        for now in self._node.cycles(PERIOD):
            lost = self._lost_windows()
            with self._lock:
                zeros = [self._lease.lost(node, now) for node in lost]
                velocity = next(filter(None, zeros), None) or self._lease.tick(now)
                state = self._lease.state(now)
            self._publish(velocity)
            self._report(state, now)
        self._publish(ZERO)
        time.sleep(PARTING_TIME)

    def _lost_windows(self) -> set[str]:
        """Return the nodes whose connection has closed since the last call.

        The kernel closes it when a process is killed, and rospy then drops it from this list, of which its public
        interface gives only the length.
        """
        connected = {connection.callerid_pub for connection in self._commands.impl.connections or ()}
        lost, self._connected = self._connected - connected, connected
        return lost

    def _watch_accounts(self) -> None:
        """End the sessions of accounts that are removed or changed, and keep who has pressed the red stop, beside the
        loop: a file and the ROS master may keep us waiting."""
        read_at = time.monotonic()
        while not self._node.stop.wait(ACCOUNTS_PERIOD):
            self._kept.keep(lambda: {"stopped_by": self._stopped_by()})
            with self._lock:
                sessions, names = self._lease.sessions(), self._lease.names()
            now = time.monotonic()
            accounts: Mapping[str, Account] = {}
            try:
                key, accounts = self._known.of_lease(names)
                self._lease.set_private(key)
                read_at = now
            except UserError as error:
                if now - read_at < ACCOUNTS_PATIENCE:
                    continue
                rospy.logerr_throttle(10.0, str(error))  # nobody is known any more
            with self._lock:
                self._lease.revise(sessions, accounts, time.monotonic())

    def _find_account(self, name: str) -> Account | None:
        try:
            return self._known.find(name)
        except UserError as error:
            rospy.logerr("%s", error)
            return None

    def _on_command(self, message: DriveCommand) -> None:
        velocity = Velocity(message.vx, message.vy, message.wz) if message.driving else None
        command = SignedCommand(message.number, message.sent, velocity, message.hold, message.proof)
        with self._lock:
            answer = self._lease.receive(message.session, command, time.monotonic())
        self._publish(answer)

    def _on_look(self, message: DriveLook) -> None:
        try:
            look = read_look(message.manner, message.yaw, message.pitch)
        except ValueError as error:
            rospy.logwarn_throttle(10.0, "drive/look: %s", error)  # no window of ours sends such
            return
        command = LookCommand(message.number, message.sent, look, message.proof)
        with self._lock:
            wanted = self._lease.look(message.session, command, time.monotonic())
        if wanted is not None:
            self._looks.publish(HeadLook(*wanted))

    def _on_other(self, message: Twist) -> None:
        caller = message._connection_header.get("callerid", "")
        if not _CALLER.fullmatch(caller):
            caller = "an unnamed program"
        if caller in (rospy.get_name(), self._gate.get("callerid")):  # a gate that was started later, on our cmd_vel
            return
        velocity = Velocity(message.linear.x, message.linear.y, message.angular.z)
        with self._lock:
            answer = self._lease.receive_other(caller, velocity, time.monotonic())
        self._publish(answer)

    def _on_safety(self, message: SafetyState) -> None:
        """A red stop lasts until a person resets it. A gate whose program has started again knows nothing of it, and
        would let programs through that drive past the lease: it is asked again. One that has held it since was reset by
        somebody who may."""
        if message._connection_header is not self._gate:
            self._gate, self._unsure_gate = message._connection_header, True
        now = time.monotonic()
        if message.state == SafetyState.STOPPED:
            self._unsure_gate = False
        elif message.state != SafetyState.FAULT and self._unsure_gate and now > self._stop_asked + STOP_AGAIN:
            if self._stopped_by():
                rospy.logwarn_throttle(10.0, "the safety gate does not hold the red stop: it is asked for it again")
                self._stop_asked = now
                self._at_gate("stop_drive", STOP_PATIENCE, again=True)

    def _stopped_by(self) -> str:
        with self._lock:
            return self._lease.state(time.monotonic()).stopped_by

    def _on_join(self, request: DriveJoinRequest) -> DriveJoinResponse:
        claim, now = Claim(request.name, request.window, bytes(request.key)), time.monotonic()
        if not request.session:
            offer = self._lease.offer(claim, now)
            return DriveJoinResponse(
                bool(offer.session), offer.reason, offer.session, offer.key or bytes(KEY), bytes(PROOF)
            )
        # Beside the lease: the accounts are a file, and a stranger's many proofs must not delay the pilot's commands.
        proven = self._lease.prove(claim, request.session, bytes(request.proof), now)
        if isinstance(proven, Reply):
            return DriveJoinResponse(False, proven.reason, "", bytes(KEY), bytes(PROOF))
        with self._lock:
            reply = self._lease.admit(proven, now)
        proof = sign_joined(proven.key) if reply.ok else bytes(PROOF)
        return DriveJoinResponse(reply.ok, reply.reason, "", bytes(KEY), proof)

    def _on_ask(self, request: DriveAskRequest) -> DriveAskResponse:
        now = time.monotonic()
        with self._lock:
            reply = self._lease.ask(
                request.session, request.number, request.action, request.to, bytes(request.proof), now
            )
            velocity, state = self._lease.tick(now), self._lease.state(now)
        if reply.ok and request.action == "stop":
            self._unsure_gate, self._stop_asked = True, now
        self._publish(velocity)
        self._report(state, now)
        if reply.ok and request.action == "stop":
            self._at_gate("stop_drive", STOP_PATIENCE)
        elif reply.ok and request.action == "reset_stop":
            reply = self._gate_lets_go()
        with self._lock:
            proof = self._lease.sign(request.session, request.number, reply)
        return DriveAskResponse(reply.ok, reply.reason, reply.ended, proof)

    def _gate_lets_go(self) -> Reply:
        """What the safety gate answers to a reset. Where there is no gate, nothing else holds the robot."""
        patience = STOP_PATIENCE if self._gate else NO_GATE_PATIENCE
        try:
            refusal = self._at_gate("reset_stop", patience).get(timeout=GATE_ANSWER)
        except queue.Empty:
            refusal = SILENT_GATE
        return Reply(not refusal, refusal)

    def _at_gate(self, service: str, patience: float, again: bool = False) -> queue.SimpleQueue[str]:
        """Have the safety gate stop the robot, which also holds against programs that drive past the lease, or let it
        go; return where its refusal will be, empty for none. Again: a stop that may have been reset at the gate
        meanwhile, and whose failure was said already."""
        answers: queue.SimpleQueue[str] = queue.SimpleQueue()
        log = rospy.logdebug if again else rospy.logwarn

        def call() -> None:
            refusal = ""
            try:
                rospy.wait_for_service(service, timeout=patience)
                refusal = self._ask_in_turn(service, again)
            except (rospy.ROSException, rospy.ServiceException) as error:
                refusal = SILENT_GATE if service == "reset_stop" and self._gate else ""
                log("%s was not done by the safety gate: %s", service, error)
            if refusal:
                log("%s was refused by the safety gate: %s", service, refusal)
            answers.put(refusal)

        threading.Thread(target=call, name=service, daemon=True).start()
        return answers

    def _ask_in_turn(self, service: str, again: bool) -> str:
        """Ask the gate, unless somebody has stopped or reset the robot meanwhile so that this no longer counts; return
        its refusal."""
        resets = service == "reset_stop"
        in_turn = self._gate_turn.acquire(timeout=GATE_ANSWER)
        try:
            if bool(self._stopped_by()) == resets or (again and not self._unsure_gate):
                return ""
            if resets and not in_turn:
                return SILENT_GATE  # a stop goes ahead without its turn; a reset might follow one
            answer = rospy.ServiceProxy(service, Trigger)()
            return "" if answer.success else answer.message or "The safety gate refuses."
        finally:
            if resets:
                self._unsure_gate = True  # somebody may have pressed it meanwhile
            if in_turn:
                self._gate_turn.release()

    def _publish(self, velocity: Velocity | None) -> None:
        if velocity is None:
            return
        message = Twist()
        message.linear.x, message.linear.y, message.angular.z = velocity
        try:
            self._velocities.publish(message)
        except rospy.ROSException:
            self._node.stop.set()  # the topic was closed: this node is being shut down

    def _report(self, state: LeaseSnapshot, now: float) -> None:
        message = DriveState(
            epoch=self._epoch,
            sign_in=self._sign_in,
            pilot=state.pilot,
            window=state.window,
            asking=state.asking,
            stopped_by=state.stopped_by,
            hold=state.hold,
            other=state.other,
            vx=state.velocity.vx,
            vy=state.velocity.vy,
            wz=state.velocity.wz,
            present=list(state.present),
            windows=list(state.windows),
        )
        if message.hold != self._state.hold:
            self._holds.publish(message.hold)
        if message != self._state or now >= self._state_due:
            self._state, self._state_due = message, now + STATE_PERIOD
            self._states.publish(message)


def parse(argv: list[str]) -> argparse.Namespace:
    """Return `sign_in` and `users` of a command line, in which ROS's own spelling for parameters counts too."""
    parser = argparse.ArgumentParser(prog="drive_lease", description="Which window drives.")
    parser.add_argument("--sign-in", type=switch, default=True, metavar="true|false", help="check names; default true")
    parser.add_argument("--users", default="", metavar="FILE", help="default TELEPRESENCE_USERS, else gui/users.db")
    words = [f"--{word[1:].replace('sign_in', 'sign-in', 1).replace(':=', '=', 1)}" if _OWN.match(word) else word
             for word in argv]  # fmt: skip
    return parser.parse_args([word for word in words if ":=" not in word])


def main() -> int:
    """Run the node; the exit code."""
    arguments = parse(sys.argv[1:])
    priority.put_commands_first()
    try:
        return LeaseNode(arguments.sign_in, Users(Path(arguments.users) if arguments.users else None)).run()
    except UserError as error:
        print(f"drive_lease: {error}", file=sys.stderr)
        return 1
