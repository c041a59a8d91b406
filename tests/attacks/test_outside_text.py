"""Attacks by texts and numbers that a robot or a stranger sends, as the pilot sees them: each is one, and must fail.

The window is the whole program, on Qt's platform without a screen; what it shows, and where, is looked at in
tests/gui/test_plain_text.py. It lives if it still complains about a message that it cannot use.
"""

from __future__ import annotations

import itertools
import json
import os
import re
import socket
import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from telepresence_ros.pseudo_terminal import Terminal

from telepresence.station import processes
from telepresence.station.ros_master import master_answers

pytestmark = pytest.mark.ros

ROOT = Path(__file__).resolve().parents[2]
PROGRAMS = ROOT / "catkin_ws" / "devel" / "lib"
SOON = 5.0
"""[s] within which the window works after an attack."""
STRANGER = textwrap.dedent("""
    import json, sys, genpy, roslib.message, rospy
    rospy.init_node("stranger", anonymous=True, disable_signals=True)
    publishers = {}
    def publisher(topic, kind):
        if topic not in publishers:
            kind = roslib.message.get_message_class(kind)
            publishers[topic] = rospy.Publisher(topic, kind, queue_size=20, latch=True)
        return publishers[topic]
    for line in sys.stdin:
        word, topic, kind, fields = json.loads(line)
        answer = None
        if word == "publish":
            message = publisher(topic, kind).data_class()
            genpy.message.fill_message_args(message, [fields])
            publisher(topic, kind).publish(message)
        else:
            answer = publisher(topic, kind).get_num_connections()
        print(json.dumps(answer), flush=True)
""")

HTML = "<img src='{}'><b>big</b>"
"""With the name of a pipe into which nobody writes: who opens it waits for ever."""
ESCAPES = "\x1b]0;owned\x07\x1b[2J\x1b[31mred\x1b[8m\x07\x08\x9b31m"
BIDI = "\u202ereversed\u2066\u200f"
HUGE = "W" * 1_000_000
FIELD = "${walltime:"
"""The beginning of a field of ROS's log formatter, which fails at one without an end."""
SAFETY = {"state": "limited", "reason": "something", "allowed": [0.3] * 72, "gap": 1.0, "sector": -1}
LEASE = {"epoch": "1", "pilot": "anna", "window": "/elsewhere", "present": ["anna (pilot)"], "windows": ["/elsewhere"]}
DEVICES = {"microphone": "auto", "speaker": "auto", "microphones": [], "speakers": []}
KINDS = {
    "safety": "telepresence_msgs/SafetyState", "drive/state": "telepresence_msgs/DriveState",
    "drive_state": "std_msgs/String", "voice/state": "std_msgs/String", "careful": "std_msgs/String",
    "voice/settings": "telepresence_msgs/VoiceSettings", "voice/levels": "std_msgs/Float32MultiArray",
    "odom": "nav_msgs/Odometry", "scan": "sensor_msgs/LaserScan", "battery": "sensor_msgs/BatteryState",
    "distance_sensors": "sensor_msgs/PointCloud", "safety_state": "std_msgs/String",
}  # fmt: skip
TEXTS = {"html": HTML, "escapes": ESCAPES, "bidi": BIDI, "a_megabyte": HUGE, "a_log_field": FIELD}


def state(text: str) -> list:
    """A text in every place for one that the window has."""
    return [
        ("safety", {**SAFETY, "state": text, "reason": text}),
        ("drive/state", {**LEASE, "pilot": text, "asking": text, "stopped_by": text, "hold": text, "other": text,
                         "present": [f"{text} (pilot)"] * 3, "windows": ["/a", "/b", text]}),
        ("drive_state", {"data": f"robot unreachable: {text}"}),
        ("drive_state", {"data": text.replace(":", "")}),
        ("voice/state", {"data": text}),
        ("voice/settings", {**DEVICES, "microphone": text, "speakers": [text, text + "2"]}),
        ("careful", {"data": f"unavailable: {text}"}),
        ("safety_state", {"data": f"stopped: {text}"}),
    ]  # fmt: skip


POSE = {"position": {"x": 1e300}, "orientation": {"w": 1.0}}
ABSURD = {
    "sectors_of_another_number": [("safety", {**SAFETY, "sector": 32767, "gap": -1e38})],
    "an_infinite_turn": [("safety", {**SAFETY, "wz": float("inf"), "vx": float("nan")})],
    "no_quaternion_at_the_end_of_the_world": [("odom", {"pose": {"pose": POSE}})],
    "a_speed_of_300_digits": [("odom", {"twist": {"twist": {"linear": {"x": 1e300}}}, "pose": {"pose": {}}})],
    "a_scan_of_a_million_rays": [
        ("scan", {"ranges": [1.0] * 1_000_000, "angle_increment": 1e-6, "range_max": 1e30}),
    ],
    "a_scan_without_angles": [("scan", {"ranges": [1.0] * 9, "angle_min": float("nan"), "range_max": 9.0})],
    "thirty_thousand_beams": [
        ("distance_sensors", {"channels": [{"name": "range", "values": [0.1] * 30_000}]}),
    ],
    "a_battery_of_3e38_volts": [("battery", {"percentage": float("nan"), "voltage": 3e38})],
    "ten_thousand_people": [
        ("drive/state", {**LEASE, "present": ["anna (pilot)"] * 10_000, "windows": ["/a"] * 10_000}),
    ],
    "ten_thousand_microphones": [
        ("voice/settings", {**DEVICES, "microphones": [f"{number}" * 20 for number in range(10_000)]}),
    ],
}  # fmt: skip


class Lab:
    """A ROS master, and a stranger who publishes what he likes."""

    def __init__(self, folder: Path, free_port: Callable, wait_until: Callable) -> None:
        port = free_port()
        self.wait_until = wait_until
        self.pipe = folder / "pipe"
        os.mkfifo(self.pipe)
        self.environment = {
            **os.environ, "ROS_MASTER_URI": f"http://127.0.0.1:{port}", "ROS_IP": "127.0.0.1",
            "ROS_HOME": str(folder), "QT_QPA_PLATFORM": "offscreen",
        }  # fmt: skip
        self.environment.pop("DISPLAY", None)
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        self._master = processes.start(["rosmaster", "--core", "-p", str(port)], env=self.environment, **quiet)
        wait_until(lambda: master_answers(self.environment["ROS_MASTER_URI"]), "the master answers")
        self._stranger = processes.start(
            [sys.executable, "-c", STRANGER], env=self.environment, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        )  # fmt: skip

    def publish(self, topic: str, kind: str, fields: dict) -> None:
        self._ask("publish", topic, kind, fields)

    def listeners(self, topic: str, kind: str) -> int:
        return self._ask("listeners", topic, kind, {})

    def _ask(self, *words: object) -> int:
        self._stranger.stdin.write(json.dumps(words) + "\n")
        self._stranger.stdin.flush()
        return json.loads(self._stranger.stdout.readline())

    def close(self) -> None:
        self._stranger.stdin.close()
        for process in (self._stranger, self._master):
            processes.end(process)


class Window:
    """The window of a Robotino as a process of its own; one that an attack has frozen or ended is opened again."""

    def __init__(self, lab: Lab) -> None:
        self._lab, self._tokens = lab, itertools.count(3)
        self._open()

    def _open(self) -> None:
        self.output, self.worked = "", True
        self.process = processes.start(
            [sys.executable, "-m", "gui", "--profile", "robotino", "--no-sign-in", "--no-attach", "--tell"],
            env=self._lab.environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, cwd=ROOT,
        )  # fmt: skip
        threading.Thread(target=self._read, args=(self.process,), daemon=True).start()
        for name, kind in KINDS.items():
            if name not in ("safety_state",):
                self._lab.wait_until(
                    lambda name=name, kind=kind: self._lab.listeners(f"/rto3/{name}", kind), f"it listens to {name}"
                )

    def _read(self, process: subprocess.Popen) -> None:
        while data := os.read(process.stdout.fileno(), 65536):
            if process is self.process:
                self.output += data.decode(errors="replace")

    def works(self, patience: float) -> bool:
        """Whether it complains about a message that it cannot use; two topics in turn, for each has its pace."""
        token, deadline = next(self._tokens), time.monotonic() + patience
        if token % 2:
            question, sign = ("voice/levels", {"data": [1.0] * token}), f"two levels are needed, not {token}."
        else:
            question, sign = ("careful", {"data": f"token{token}"}), f"'token{token}'"
        while sign not in self.output and time.monotonic() < deadline and self.process.poll() is None:
            self.publish(*question)
            asked = time.monotonic()
            while sign not in self.output and time.monotonic() < asked + 0.2:
                time.sleep(0.01)
        self.worked = sign in self.output
        return self.worked

    def publish(self, name: str, fields: dict) -> None:
        self._lab.publish(f"/rto3/{name}", KINDS[name], fields)

    def revive(self) -> None:
        """Open it again if the attack before has frozen or ended it."""
        if self.worked:
            return
        for name, fields in state("ordinary"):
            self.publish(name, fields)
        self.publish("odom", {"pose": {"pose": {"orientation": {"w": 1.0}}}})
        if not self.works(SOON):
            processes.send(self.process.pid, 9)
            self.process.wait()
            self._open()

    def close(self) -> None:
        processes.end(self.process)


@pytest.fixture(scope="module")
def lab(tmp_path_factory, free_port, wait_until) -> Iterator[Lab]:
    lab = Lab(tmp_path_factory.mktemp("texts"), free_port, wait_until)
    yield lab
    lab.close()


@pytest.fixture(scope="module")
def window(lab) -> Iterator[Window]:
    window = Window(lab)
    yield window
    window.close()


def attack(window: Window, messages: list) -> str:
    """Send these; what the window prints until it works again. It has to, soon."""
    window.revive()
    before = len(window.output)
    for name, fields in messages:
        window.publish(name, fields)
    assert window.works(SOON), "the window is frozen, or has ended"
    return window.output[before:]


@pytest.mark.parametrize("kind", TEXTS)
def test_a_text_of_a_robot_freezes_the_window_or_takes_its_terminal(lab, window, kind):
    """Shown as it is, or cut; what is printed has no control characters."""
    said = attack(window, state(TEXTS[kind].replace("{}", str(lab.pipe))))
    assert "Traceback" not in said
    assert not re.search("[\x00-\x09\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]", said)
    assert len(said) < 20_000


@pytest.mark.parametrize("kind", ABSURD)
def test_absurd_numbers_freeze_the_window(window, kind):
    """A plain line says that the message cannot be used, if it cannot."""
    assert "Traceback" not in attack(window, ABSURD[kind])


def test_bad_messages_fill_the_windows_log(window):
    """Whatever comes, a topic makes one line a second at most."""
    began = time.monotonic()
    said = attack(window, [("careful", {"data": f"bad {number}"}) for number in range(300)])
    assert said.count("is no state of the careful scan") <= 3 + time.monotonic() - began


# --- terminals ---

CONTROLS = re.compile("\x1b\\]|\x1b\\[2J|\x1b\\[31m|\x9b|\x07|\u202e")
"""What the attacks of this file send; a keyboard program itself sends none of it."""


def typed_into(lab: Lab, *argv: str) -> Terminal:
    return Terminal(*argv, env=lab.environment)


@pytest.mark.parametrize(
    "program", ["teleop_twist_keyboard/teleop_twist_keyboard.py", "rto_teleop/rto_teleop_keyboard"]
)
def test_a_reason_takes_the_terminal_of_a_keyboard_program(lab, wait_until, program):
    """Why nobody may drive is told by drive/hold, which anybody in the graph can publish."""
    lab.publish("/drive/hold", "std_msgs/String", {"data": f"because {ESCAPES}{BIDI}"})
    terminal = typed_into(lab, str(PROGRAMS / program))
    try:
        wait_until(lambda: lab.listeners("/drive/hold", "std_msgs/String"), "it listens")

        def refused() -> bool:
            terminal.type("i")
            time.sleep(0.1)  # as long as a key is held
            return "The robot stays: because" in terminal.seen

        wait_until(refused, "it says why it does not drive")
        assert not CONTROLS.search(terminal.seen)
    finally:
        terminal.close()
        lab.publish("/drive/hold", "std_msgs/String", {"data": ""})


NODE = textwrap.dedent("""
    import logging, rospy
    from std_msgs.msg import String
    from telepresence_ros.node import Node
    node = Node("driver")
    log = logging.getLogger("telepresence.driver")
    def complain(message):
        log.warning("the robot says: %s", message.data)
        try:
            raise RuntimeError(message.data)
        except RuntimeError:
            rospy.logerr("it failed", exc_info=True)
        print("logged", flush=True)
    rospy.Subscriber("said", String, complain)
    node.run(node.stop.wait)
""")


@pytest.fixture(scope="module")
def driver(lab) -> Iterator[Terminal]:
    terminal = Terminal(sys.executable, "-c", NODE, env=lab.environment)
    lab.wait_until(lambda: lab.listeners("/said", "std_msgs/String"), "the node listens")
    yield terminal
    terminal.close()


@pytest.mark.parametrize("kind", ["escapes", "bidi", "a_log_field"])
def test_what_a_robot_says_takes_the_terminal_of_a_node_that_logs_it(lab, driver, kind):
    """A log line is plain text, and none ends the node."""
    before = len(driver.seen)
    lab.publish("/said", "std_msgs/String", {"data": TEXTS[kind]})
    lab.wait_until(lambda: "logged" in driver.seen[before:], "it has logged", timeout=SOON)
    assert not CONTROLS.search(driver.seen[before:].replace("\x1b[0m", "").replace("\x1b[31m[", "["))


DOCTOR = "import sys; from telepresence.station import doctor; {}"


def answering(reply: bytes) -> tuple[socket.socket, int]:
    listener = socket.create_server(("127.0.0.1", 0))

    def serve() -> None:
        connection, _ = listener.accept()
        with connection:
            connection.sendall(reply)

    threading.Thread(target=serve, daemon=True).start()
    return listener, listener.getsockname()[1]


@pytest.mark.parametrize(
    ("check", "reply"),
    [
        ("doctor.ssh('127.0.0.1', {port})", b"SSH-2.0-\x1b[2J\x1b]0;owned\x07\r\n"),
        (
            "doctor.report(lambda: doctor.robot_clock('127.0.0.1', {port}))",
            b"HTTP/1.1 200 OK\r\nDate: \x1b[2J\x9b31m\r\nContent-Length: 0\r\n\r\n",
        ),
        ("doctor.report(lambda: doctor.robot_clock('127.0.0.1', {port}))", b"\x1b[2J\x07 nothing like HTTP\r\n\r\n"),
    ],
    ids=["its_ssh_server", "its_date", "its_web_server"],
)
def test_a_robot_takes_the_terminal_of_the_doctor(check, reply):
    listener, port = answering(reply)
    with listener:
        done = subprocess.run(
            [sys.executable, "-c", DOCTOR.format(check.format(port=port))],
            capture_output=True, text=True, timeout=30, cwd=ROOT,
        )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout and not CONTROLS.search(done.stdout)
