"""A program on the ROS graph that speaks to drive_lease as it likes: as windows that have a password, and as strangers
that have none.

usage: python lease_stranger.py ACCOUNTS
commands, one JSON list a line; each is answered by one JSON value:
  ["join", who, name, password]      join as somebody, as the window `who`; answers whether it has joined
  ["break_in", name]                 try to join and to take the robot with all that the file of the accounts holds
  ["again", who, other, name]        join once more with the password of the window `who`
  ["ask", who, action, to]           answers [ok, reason]
  ["drive", who, vx, vy, wz]         repeat this velocity 20 times a second; without a velocity: end that
  ["probe", name]                    what a join without a password is told: a list of answers
  ["flood", name, count]             join so often and prove nothing
  ["garble", who]                    send genuine commands whose text is none: control characters, a megabyte
  ["moved"], ["state"]               newest velocity on cmd_vel; newest drive/state: {"pilot", "stopped_by", "epoch", …}
  ["worst_hold"]                     the beginning of a reason in drive/state that was long or not printable
"""

import contextlib
import dataclasses
import itertools
import json
import secrets
import sqlite3
import sys
import threading
import time
from pathlib import Path

import rospy
from geometry_msgs.msg import Twist
from telepresence_msgs.msg import DriveCommand, DriveState
from telepresence_msgs.srv import DriveAsk, DriveJoin

from telepresence.geometry import Velocity
from telepresence.teleop.accounts import Users
from telepresence.teleop.key_agreement import Credential, WindowSide, public_key
from telepresence.teleop.lease_messages import SignedCommand, sign_command, sign_join, sign_request


class Window:
    """A window, genuine or not: what it joins with decides."""

    def __init__(self, stranger, name, secret):
        self.stranger = stranger
        self.node = f"/window_{next(stranger.count)}"
        self.session, self.key, self.reason = "", b"", ""
        self.number = self.asked = 0
        self.velocity, self.hold = None, ""
        side = WindowSide(name, self.node, secret)
        offer = stranger.join(name, self.node, side.claim.key, "", bytes(16))
        key = side.session_key(offer.session, offer.key)
        answer = stranger.join(name, self.node, side.claim.key, offer.session, sign_join(key))
        self.reason = answer.reason
        if answer.ok:
            self.session, self.key = offer.session, key

    def ask(self, action, to=""):
        if not self.session:
            return [False, self.reason]
        self.asked += 1
        answer = self.stranger.ask(self.session, self.asked, action, to, sign_request(self.key, self.asked, action, to))
        return [answer.ok, answer.reason]

    def send(self):
        self.number += 1
        velocity = None if self.velocity is None else Velocity(*self.velocity)
        command = SignedCommand(self.number, time.monotonic(), velocity, self.hold)
        command = dataclasses.replace(command, proof=sign_command(self.key, command))
        message = DriveCommand(session=self.session, number=command.number, sent=command.sent, hold=command.hold)
        message.driving, message.proof = command.velocity is not None, command.proof
        message.vx, message.vy, message.wz = command.velocity or (0.0, 0.0, 0.0)
        self.stranger.commands.publish(message)


class Stranger:
    def __init__(self, accounts):
        self.accounts = Path(accounts)
        self.count = itertools.count()
        self.states = 0
        self.windows = {}
        self.velocity, self.newest, self.heard, self.worst = [0.0] * 3, None, 0.0, ""
        rospy.init_node("stranger", disable_signals=True)
        self.commands = rospy.Publisher("drive/command", DriveCommand, queue_size=50)
        rospy.Subscriber("cmd_vel", Twist, self.on_velocity)
        rospy.Subscriber("drive/state", DriveState, self.on_state)
        rospy.wait_for_service("drive/ask", 30.0)
        self.join = rospy.ServiceProxy("drive/join", DriveJoin, persistent=True)
        self.ask = rospy.ServiceProxy("drive/ask", DriveAsk, persistent=True)
        threading.Thread(target=self.repeat, daemon=True).start()

    def on_velocity(self, message):
        self.velocity = [message.linear.x, message.linear.y, message.angular.z]

    def on_state(self, message):
        self.newest, self.heard = message, time.monotonic()
        self.states += 1
        if len(message.hold) > 1000 or not message.hold.isprintable():
            self.worst = message.hold[:20]

    def repeat(self):
        while not rospy.is_shutdown():
            for window in list(self.windows.values()):
                if window.session:
                    window.send()
            time.sleep(0.05)

    def do_join(self, who, name, password):
        account = Users(self.accounts).check(name, password)
        window = Window(self, name, account.credential)
        window.secret = account.credential
        self.windows[who] = window
        return bool(window.session)

    def do_again(self, who, other, name):
        self.windows[other] = Window(self, name, self.windows[who].secret)

    def do_break_in(self, name):
        with contextlib.closing(sqlite3.connect(self.accounts)) as database:
            tables = [row[0] for row in database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")]
            rows = [row for table in tables for row in database.execute(f"SELECT * FROM {table}")]
        blobs = sorted({cell for row in rows for cell in row if isinstance(cell, bytes)})
        keys = [blob for blob in blobs if len(blob) == 32]
        lease = [*keys, *map(public_key, keys)]
        windows = [Window(self, name, Credential(own, theirs)) for own in keys for theirs in lease]
        return any(window.ask("take")[0] for window in windows)

    def do_ask(self, who, action, to=""):
        return self.windows[who].ask(action, to)

    def do_drive(self, who, *velocity):
        self.windows[who].velocity = velocity or None

    def do_probe(self, name):
        offer = self.join(name, "/stranger", public_key(bytes(32)), "", bytes(16))
        answers = [offer, self.join(name, "/stranger", public_key(bytes(32)), offer.session, bytes(16))]
        return [[answer.ok, answer.reason.replace(name, "NAME"), len(answer.session) > 0] for answer in answers]

    def do_flood(self, name, count):
        for _ in range(count):
            node, key = f"/stranger_{next(self.count)}", secrets.token_bytes(32)
            offer = self.join(name, node, key, "", bytes(16))
            self.join(name, node, key, offer.session, bytes(16))

    def do_garble(self, who):
        window = self.windows[who]
        for window.hold in ("\x1b]0;x\x07", "x" * 1_000_000, ""):
            number = window.number
            self.wait(lambda number=number: window.number > number + 1, "`repeat` sends it")
            self.states = 0
            self.wait(lambda: self.states > 1, "what was shown of it came")

    def wait(self, condition, what):
        deadline = time.monotonic() + 20.0
        while not condition():
            if time.monotonic() > deadline:
                raise TimeoutError(what)
            time.sleep(0.01)

    def do_moved(self):
        return self.velocity

    def do_worst_hold(self):
        return self.worst

    def do_state(self):
        state = self.newest
        return {
            "pilot": state.pilot if state else None,
            "epoch": state.epoch if state else None,
            "sign_in": state.sign_in if state else None,
            "stopped_by": state.stopped_by if state else None,
            "alive": time.monotonic() - self.heard < 0.6,
        }


def main():
    stranger = Stranger(sys.argv[1])
    print(json.dumps("ready"), flush=True)
    for line in sys.stdin:
        word, *rest = json.loads(line)
        print(json.dumps(getattr(stranger, f"do_{word}")(*rest)), flush=True)


if __name__ == "__main__":
    main()
