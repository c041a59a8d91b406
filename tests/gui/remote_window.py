"""A window without a window: the link and the lease of one, driven by commands on standard input. It checks nothing
before it sends, so it is also a window that does not keep to the rules.

usage: python remote_window.py ACCOUNTS NAME PASSWORD
commands, one JSON list a line; each is answered by one JSON value:
  ["drive", vx, vy, wz]   repeat this velocity 20 times a second; ["drive"] ends that
  ["look", manner, yaw, pitch]   the same with a look; ["look"] ends that
  ["floor", frame, fx, width, height, u, v]   drive to what this pixel of a camera shows now; ["floor"] lets go
  ["ask", action, to]     ["steal", session]   send under another window's session from now on
  ["state"]               {"pilot", "mine", "obstacle", "stopped_by", "session", "refused", "ended"}
"""

import json
import sys
import threading
import time
from pathlib import Path

from PyQt5.QtCore import QCoreApplication, QObject, QTimer, pyqtSignal

from gui.driving.floor_drive import FloorDrive
from gui.driving.lease_access import LeaseAccess
from gui.robots import ROBOTS
from gui.ros.link import RosLink
from gui.ros.node import RosNode
from gui.ros.readings import CameraView, Lens
from telepresence.teleop.accounts import Users
from telepresence.teleop.looking import read_look


class Remote(QObject):
    line = pyqtSignal(str)

    def __init__(self, accounts, name, password):
        super().__init__()
        self.node = RosNode()
        self.link = RosLink(self.node, ROBOTS["pepper"])
        self.access = LeaseAccess(self.link)
        self.refused = []
        self.access.refused.connect(self.refused.append)
        self.ended = []
        self.access.ended.connect(self.ended.append)
        self.access.sign_in(Users(Path(accounts)).check(name, password))
        self.velocity = self.direction = None
        self.timer = QTimer(self, interval=50)
        self.timer.timeout.connect(lambda: self.direction and self.access.look(self.direction))
        self.timer.timeout.connect(lambda: self.velocity and self.access.drive(*self.velocity))
        self.timer.start()
        self.hand = FloorDrive(self.view, lambda: 0.0)
        self.hand.velocity.connect(self.access.drive)
        self.refusals = []
        self.hand.refused.connect(self.refusals.append)
        self.link.channel("body").arrived.connect(self.hand.show_reading)
        self.line.connect(self.obey)
        self.node.start()

    def view(self):
        try:
            rotation, place = self.link.place_of(self.lens.frame, "odom", time.time())
        except LookupError as error:
            return str(error)
        return CameraView(self.lens, rotation, place)

    def read(self):
        for line in sys.stdin:
            self.line.emit(line)
        self.line.emit("")

    def obey(self, line):
        if not line:
            QCoreApplication.quit()
            return
        word, *rest = json.loads(line)
        answer = None
        if word == "drive":
            self.velocity = rest
        elif word == "look":
            self.direction = read_look(*rest) if rest else None
        elif word == "floor":
            self.hand.release_all()
            if rest:
                frame, focal, width, height, u, v = rest
                self.lens = Lens(focal, focal, width / 2, height / 2, width, height, frame)
                self.hand.press(u, v)
        elif word == "ask":
            self.access.ask(*rest)
        elif word == "steal":
            self.access.client._session = rest[0]
        else:
            state = self.access.state
            answer = {
                "pilot": state.pilot if state else None,
                "stopped_by": state.stopped_by if state else None,
                "mine": self.access.mine,
                "obstacle": self.access.obstacle(),
                "session": self.access.client.session,
                "refused": self.refused,
                "ended": self.ended,
                "target": self.hand.target,
                "hand": self.refusals,
            }
        print(json.dumps(answer), flush=True)


def main():
    application = QCoreApplication(sys.argv[:1])
    remote = Remote(*sys.argv[1:])
    threading.Thread(target=remote.read, daemon=True).start()
    application.exec_()
    remote.node.close()


if __name__ == "__main__":
    main()
