"""No event waits longer than 100 ms: with 30 pictures a second and every sensor, and while nobody answers.

The window runs in a process of its own, so that nothing of the tests holds it up. An event sent every 10 ms by a thread
reports how long it waited. A machine that is busy with other things may hold up any process; the best of a few tries is
what the window itself needs.
"""

import socket
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

pytestmark = pytest.mark.alone

LONGEST = 0.1
"""[s]"""
TRIES = 4
PROBE = textwrap.dedent("""
    import os, sys, threading, time
    from pathlib import Path
    import numpy as np
    from PyQt5.QtCore import QObject, QTimer, Qt, pyqtSignal
    from PyQt5.QtWidgets import QApplication, QFrame

    application = QApplication(["window", "-platform", "offscreen"])
    application.setStyle("Fusion")
    from gui import theme
    theme.apply("dark")
    from gui.app.controller import Attach, Controller
    from gui.app.capture import Capture
    from gui.ros.picture import Picture
    from gui.robots import ROBOTS
    from gui.ros.readings import BodyState, Cone, Points, Safety
    from gui.ros.link import RosLink
    from gui.ros.node import RosNode
    from gui.terminal.terminal_view import TerminalView
    from gui.window import OperatorWindow
    from telepresence.teleop.lease_messages import PILOT, Account

    class Probe(QObject):
        sent = pyqtSignal(float)
        def __init__(self):
            super().__init__()
            self.waits = []
            self.sent.connect(lambda at: self.waits.append(time.monotonic() - at), Qt.QueuedConnection)
        def run(self, seconds):
            end = time.monotonic() + seconds
            while time.monotonic() < end:
                self.sent.emit(time.monotonic())
                time.sleep(0.01)
            application.quit()

    pictures = sys.argv[1] == "pictures"
    node, terminal = RosNode(), TerminalView()
    window = OperatorWindow(terminal)
    window.resize(1280, 720)
    link = RosLink(node, ROBOTS["pepper"])
    controller = Controller(window, link, terminal, Attach.NEVER)
    Capture(window, link, Path("."))
    controller.admit(Account("anna", PILOT))
    window.show()
    node.start()
    window.feedButton.setChecked(True)

    noise = np.random.default_rng(0).integers(0, 255, (2, 480, 640, 3), np.uint8)
    angles = np.linspace(-2, 2, 61)
    count = 0
    def feed():
        global count
        count += 1
        now = time.monotonic()
        link.channel("picture").arrived.emit(Picture(noise[count % 2], "rgb8", time.time(), now))
        for reading in (
            BodyState(0.01 * count, 0, 0, 0, 0, 0, 0.2, 0, 0, "odom", now),
            Points("laser", np.stack([np.cos(angles), np.sin(angles)], 1), now),
            Cone("front", 0, 0, 0, 1.0, 1.0, 2.5, now),
            Safety("limited", "because", np.linspace(0, 0.35, 72), 0.5, 3, 0.0, (0.1, 0, 0), False, now),
        ):
            controller.views.show_reading(reading)
    timer = QTimer(interval=33, timerType=Qt.PreciseTimer)
    timer.timeout.connect(feed)
    if pictures:
        timer.start()
    else:
        window.sessionButton.click()
        window.robotPanel.say.emit("hello")
        window.recordButton.click()
        QTimer.singleShot(500, controller.driving.red_stop)
    for _ in range(20):
        application.processEvents()
    probe = Probe()
    QTimer.singleShot(500, lambda: threading.Thread(target=probe.run, args=[2.5], daemon=True).start())
    application.exec_()
    print(max(probe.waits), len(probe.waits), count, flush=True)
    os._exit(0)
""")


def longest_wait(what, environment):
    done = subprocess.run(
        [sys.executable, "-c", PROBE, what], capture_output=True, text=True, timeout=60, env=environment,
        cwd=Path(__file__).resolve().parents[2],
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    longest, events, pictures = done.stdout.split()
    assert int(events) > 100
    return float(longest), int(pictures)


@pytest.fixture
def silent_master(ros_environment):
    """A machine that accepts connections and never answers."""
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen(64)
        yield {**ros_environment, "ROS_MASTER_URI": f"http://127.0.0.1:{listener.getsockname()[1]}"}


def test_thirty_pictures_a_second(ros_environment):
    waits = []
    for _ in range(TRIES):
        longest, pictures = longest_wait("pictures", ros_environment)
        waits.append(longest)
        if longest < LONGEST and pictures > 60:
            return
    pytest.fail(f"events waited up to {waits} s")


def test_a_master_that_does_not_answer(silent_master):
    waits = []
    for _ in range(TRIES):
        waits.append(longest_wait("silence", silent_master)[0])
        if waits[-1] < LONGEST:
            return
    pytest.fail(f"events waited up to {waits} s")
