"""Attacks by pictures, on the running programs that decode or show them: each test is one, and must fail.

The programs may have at most `MEMORY` of address space, so that an attack that gets through does not take the machine
along; none may need more than `GROWTH` for a picture. After each attack an ordinary picture has to come through soon.
"""

from __future__ import annotations

import http.server
import json
import os
import secrets
import signal
import struct
import subprocess
import sys
import textwrap
import threading
import time
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest

from telepresence.station import processes
from telepresence.station.ros_master import master_answers

pytestmark = pytest.mark.ros

ROOT = Path(__file__).resolve().parents[2]
PROGRAMS = ROOT / "catkin_ws" / "devel" / "lib"
MEMORY, GROWTH = 6 << 30, 300 << 20
"""Address space of an attacked program, and what it may grow by [B]."""
SOON = 4.0
"""[s] within which the next ordinary picture is there; a bomb holds a decoder up for longer."""
PUBLISHER = textwrap.dedent("""
    import json, sys, rospy
    from sensor_msgs.msg import CompressedImage, Image
    rospy.init_node("stranger", anonymous=True, disable_signals=True)
    film = rospy.Publisher("/film/compressed", CompressedImage, queue_size=5)
    raw = rospy.Publisher("/raw", Image, queue_size=5)
    sizes, compressed = [], []
    rospy.Subscriber("/image_raw", Image, lambda message: sizes.append([message.width, message.height]))
    rospy.Subscriber("/image_raw/compressed", CompressedImage, lambda message: compressed.append(len(message.data)))
    for line in sys.stdin:
        words = json.loads(line)
        answer = None
        if words[0] == "film":
            film.publish(CompressedImage(format="jpeg", data=bytes.fromhex(words[1])))
        elif words[0] == "raw":
            image = Image()
            for name, value in words[1].items():
                setattr(image, name, bytes.fromhex(value) if name == "data" else value)
            raw.publish(image)
        elif words[0] == "listeners":
            answer = [film.get_num_connections(), raw.get_num_connections()]
        else:
            answer = [sizes[:], compressed[:]]
            del sizes[:], compressed[:]
        print(json.dumps(answer), flush=True)
""")

NOISE = cv2.GaussianBlur(np.random.default_rng(0).integers(0, 255, (48, 64, 3), np.uint8), (5, 5), 2)


def jpeg(pixels: np.ndarray = NOISE, *options: int) -> bytes:
    return cv2.imencode(".jpg", pixels, options)[1].tobytes()


def claiming(width: int, height: int, data: bytes) -> bytes:
    """The file with another size in its frame."""
    at = next(data.find(bytes((0xFF, marker))) for marker in (0xC0, 0xC2) if bytes((0xFF, marker)) in data)
    return data[: at + 5] + struct.pack(">HH", height, width) + data[at + 9 :]


def scans(count: int) -> bytes:
    """A progressive file of 4096x2048 that goes over its picture again and again."""
    data = jpeg(np.zeros((2048, 4096), np.uint8), cv2.IMWRITE_JPEG_PROGRESSIVE, 1)
    last = data.rfind(b"\xff\xda")
    return data[:-2] + data[last:-2] * count + b"\xff\xd9"


def in_disguise(ending: str) -> bytes:
    """A picture that is no JPEG."""
    return cv2.imencode(ending, np.full((76, 122, 3), 90, np.uint8))[1].tobytes()


ORDINARY = jpeg()
BOMBS = {
    "689_bytes_that_claim_a_gigapixel": claiming(32000, 32000, ORDINARY[:687] + b"\xff\xd9"),
    "a_gigapixel_in_progressive_scans": claiming(32000, 32000, jpeg(NOISE, cv2.IMWRITE_JPEG_PROGRESSIVE, 1)),
    "two_thousand_scans": scans(2000),
    "a_strip_of_65500_by_16000": claiming(65500, 16000, ORDINARY),
}
DISGUISED = {
    ending[1:]: in_disguise(ending) for ending in (".png", ".webp", ".tiff", ".bmp", ".ppm", ".jp2", ".gif", ".avif")
}
DAMAGED = {
    "nothing": b"",
    "a_start_alone": b"\xff\xd8",
    "headers_alone": ORDINARY[: ORDINARY.find(b"\xff\xda")],
    "half_of_it": ORDINARY[: len(ORDINARY) // 2],
    "no_pixels": claiming(0, 0, ORDINARY),
    "ten_megabytes_of_zeros": bytes(10 << 20),
    "a_comment_without_end": b"\xff\xd8" + (b"\xff\xfe\xff\xff" + bytes(65533)) * 100,
}


class Lab:
    """A ROS master, somebody who publishes pictures, a camera of a robot, and the programs that look at them."""

    def __init__(self, folder: Path, free_port: Callable, wait_until: Callable) -> None:
        port = free_port()
        self.wait_until = wait_until
        self.environment = {
            **os.environ, "ROS_MASTER_URI": f"http://127.0.0.1:{port}", "ROS_IP": "127.0.0.1",
            "ROS_HOME": str(folder), "DISPLAY": "",
        }  # fmt: skip
        self.folder, self.logs = folder, {}
        self._started: list[subprocess.Popen] = []
        self.start("rosmaster", "rosmaster", "--core", "-p", str(port))
        wait_until(lambda: master_answers(self.environment["ROS_MASTER_URI"]), "the master answers")
        self.publisher = processes.start(
            [sys.executable, "-c", PUBLISHER], env=self.environment, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        )  # fmt: skip
        self._started.append(self.publisher)

    def start(self, name: str, *argv: str) -> subprocess.Popen:
        self.logs[name] = self.folder / f"{name}.log"
        limit = [] if name == "rosmaster" else ["prlimit", f"--as={MEMORY}"]
        with self.logs[name].open("ab") as log:
            process = processes.start(
                [*limit, *argv], env=self.environment, stdout=log, stderr=subprocess.STDOUT
            )  # fmt: skip
        self._started.append(process)
        return process

    def attack(self, name: str, *argv: str) -> Attacked:
        return Attacked(self, name, argv)

    def say(self, *words: object) -> object:
        self.publisher.stdin.write(json.dumps(words) + "\n")
        self.publisher.stdin.flush()
        return json.loads(self.publisher.stdout.readline())

    def close(self) -> None:
        self.publisher.stdin.close()
        for process in self._started[1:]:
            processes.send(process.pid, signal.SIGTERM)
        for process in reversed(self._started):
            processes.end(process)


class Attacked:
    """A program that is attacked; one that an attack has ended is started again for the next attack."""

    def __init__(self, lab: Lab, name: str, argv: tuple[str, ...]) -> None:
        self.name, self.process = name, lab.start(name, *argv)
        self._lab, self._argv = lab, argv

    def revive(self) -> None:
        if self.process.poll() is not None:
            self.process = self._lab.start(self.name, *self._argv)


@pytest.fixture(scope="module")
def lab(tmp_path_factory, free_port, wait_until) -> Iterator[Lab]:
    lab = Lab(tmp_path_factory.mktemp("pictures"), free_port, wait_until)
    yield lab
    lab.close()


def peak(process: subprocess.Popen) -> int:
    """The largest memory that the process had [B]; it begins anew at each call."""
    lines = Path(f"/proc/{process.pid}/status").read_text().splitlines()
    most = next(int(line.split()[1]) << 10 for line in lines if line.startswith("VmHWM"))
    Path(f"/proc/{process.pid}/clear_refs").write_text("5")
    return most


def survives(lab: Lab, attacked: Attacked, attack: Callable, works: Callable) -> None:
    """After the attack the program shows the next ordinary picture soon, with little memory and no traceback."""
    attacked.revive()
    works(SOON * 5)
    process, log = attacked.process, lab.logs[attacked.name]
    peak(process)
    before, seen = peak(process), log.stat().st_size
    attack()
    began = time.monotonic()
    works(SOON)
    assert process.poll() is None, "it has ended"
    said = log.read_bytes()[seen:].decode(errors="replace")
    assert peak(process) - before < GROWTH, "it took memory"
    assert "Traceback" not in said, said[-500:]
    assert time.monotonic() - began < SOON


# --- the film of a session: sensor_msgs/CompressedImage from any node ---


@pytest.fixture(scope="module")
def film(lab) -> tuple[Attacked, Path]:
    target = lab.folder / "film.mp4"
    attacked = lab.attack("film", str(PROGRAMS / "avatar_gui" / "record_film"), "/film/compressed", str(target))
    lab.wait_until(lambda: lab.say("listeners")[0], "the film's program listens")
    return attacked, target


def films(lab: Lab, target: Path) -> Callable[[float], None]:
    def works(patience: float) -> None:
        size = target.stat().st_size if target.exists() else 0
        deadline = time.monotonic() + patience
        while not target.exists() or target.stat().st_size == size:
            assert time.monotonic() < deadline, "nothing is filmed any more"
            lab.say("film", ORDINARY.hex())
            time.sleep(0.01)

    return works


def show_film(lab: Lab, data: bytes) -> None:
    lab.say("film", data.hex())
    time.sleep(0.1)  # else the next picture replaces it


@pytest.mark.parametrize("bomb", BOMBS)
def test_a_picture_bomb_stops_the_film_or_eats_memory(lab, film, bomb):
    """A few hundred bytes cost neither gigabytes nor seconds, and the film goes on."""
    attacked, target = film
    survives(lab, attacked, lambda: show_film(lab, BOMBS[bomb]), films(lab, target))


def test_a_damaged_picture_ends_the_film(lab, film):
    attacked, target = film
    survives(lab, attacked, lambda: [show_film(lab, data) for data in DAMAGED.values()], films(lab, target))


# --- the driver of Robotino's camera: what the robot's web server answers to GET /cam0 ---


class Camera(http.server.BaseHTTPRequestHandler):
    """Answers with the picture that the attack wants, or an ordinary one."""

    picture = ORDINARY
    protocol_version = "HTTP/1.1"

    def do_GET(self) -> None:
        data = Camera.picture
        self.send_response(200)
        self.send_header("Content-Type", "image/jpeg")
        self.send_header("Content-Length", str(len(data)))
        self.end_headers()
        self.wfile.write(data)

    def log_message(self, *_: object) -> None:
        """Nothing."""


@pytest.fixture(scope="module")
def camera(lab) -> Iterator[Attacked]:
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Camera)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    yield lab.attack(
        "camera", str(PROGRAMS / "rto_node" / "rto_camera_node"), "--hostname", f"127.0.0.1:{server.server_port}"
    )
    server.shutdown()
    server.server_close()


def shows(lab: Lab) -> Callable[[float], None]:
    def works(patience: float) -> None:
        Camera.picture = ORDINARY
        lab.say("seen")
        lab.wait_until(lambda: [64, 48] in lab.say("seen")[0], "ordinary pictures come through", timeout=patience)

    return works


def feed(lab: Lab, data: bytes) -> list:
    """Have the robot's camera show this for a while; what the driver published meanwhile."""
    lab.say("seen")
    Camera.picture = data
    time.sleep(0.25)  # three pictures at 15 Hz
    return lab.say("seen")


@pytest.mark.parametrize("bomb", BOMBS)
def test_a_robots_camera_sends_a_picture_bomb(lab, camera, bomb):
    survives(lab, camera, lambda: feed(lab, BOMBS[bomb]), shows(lab))


@pytest.mark.parametrize("kind", DISGUISED)
def test_a_robots_camera_has_another_decoder_run(lab, camera, kind):
    """Whatever is no JPEG is not decoded: each further decoder is one more to attack. Nor is it passed on as a JPEG."""
    camera.revive()
    shows(lab)(SOON * 5)
    sizes, compressed = feed(lab, DISGUISED[kind])
    assert [122, 76] not in sizes and len(DISGUISED[kind]) not in compressed
    shows(lab)(SOON)


def test_a_robots_camera_sends_damaged_pictures(lab, camera):
    survives(lab, camera, lambda: [feed(lab, data) for data in DAMAGED.values()], shows(lab))


# --- the page of rob_cam: sensor_msgs/Image from any node ---

PIXELS = bytes(range(256)) * 9
GOOD = {"width": 16, "height": 16, "encoding": "rgb8", "step": 48, "data": PIXELS[:768].hex()}
ABSURD = {
    "no_pixels": {**GOOD, "width": 0, "height": 0, "step": 0, "data": ""},
    "no_columns": {**GOOD, "width": 0, "step": 0},
    "four_billion_rows_of_nothing": {**GOOD, "width": 0, "height": 2**32 - 1, "step": 0, "data": ""},
    "four_billion_columns": {**GOOD, "width": 2**32 - 1, "step": 2**32 - 1},
    "a_step_of_four_billion": {**GOOD, "step": 2**32 - 1},
    "too_little_data": {**GOOD, "data": "00"},
    "an_unknown_encoding": {**GOOD, "encoding": "\x1b[2J" + "x" * 100_000},
    "a_depth_of_infinities": {**GOOD, "encoding": "32FC1", "step": 64, "data": ("0000807f" * 256)},
}


def test_absurd_raw_pictures_stop_the_page_with_the_robots_picture(lab, free_port):
    """One after the other; each is left out with one plain line."""
    port, key = free_port(), secrets.token_hex(16)
    lab.environment["TELEPRESENCE_PAGE_KEY"] = key
    program = str(PROGRAMS / "telepresence_1" / "rob_cam.py")
    page = lab.attack("page", program, "_image:=/raw", f"_port:={port}", "__name:=page")
    lab.wait_until(lambda: lab.say("listeners")[1], "the page's program listens")

    def works(patience: float) -> None:
        def live() -> bool:
            lab.say("raw", GOOD)
            try:
                with urllib.request.urlopen(f"http://127.0.0.1:{port}/frame.jpg?k={key}", timeout=2) as answer:
                    data = answer.read()
            except OSError:
                return False
            shown = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
            return shown is not None and shown.shape == (16, 16, 3)

        lab.wait_until(live, "ordinary pictures come through", timeout=patience)

    for absurd in ABSURD.values():
        survives(lab, page, lambda absurd=absurd: lab.say("raw", absurd), works)
    assert b"\x1b[2J" not in lab.logs["page"].read_bytes()
