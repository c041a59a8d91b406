"""The robot's camera to the pilot's screen at 640x480: ages when painted, against a raw socket that moves the bytes.

Ours is the whole way: simulated camera, ALVideoDevice over qi, the driver's camera node, sensor_msgs/Image, the
window's view, painted on a virtual screen. The reference is one process that writes as many bytes at the same rate into
a TCP connection to another, which reads them.
"""

from __future__ import annotations

import contextlib
import os
import socket
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from report import Row, percentile
from ros_graph import private_master, wait_for

from pepper_sim.simulation import Simulation
from telepresence.station import processes

RATE, SIZE = 30, 640 * 480 * 3
WARM_UP, SECONDS = 3.0, 15.0
TURN = 0.5
"""[rad/s]. What a camera sees is painted only when something in it has moved."""


def run() -> list[Row]:
    with private_master() as environment, Simulation(port=0) as simulation, camera_node(simulation.url, environment):
        environment["QT_QPA_PLATFORM"] = "offscreen"
        standing = watch(environment)
        simulation.robot.set_velocity(0.0, 0.0, TURN)
        turning = watch(environment)
    raw = raw_ages()
    return [*rows(*standing, raw, "standing"), *rows(*turning, raw, "turning")]


def rows(ages: list[float], rate: float, raw: list[float], what: str) -> list[Row]:
    middle, late = percentile(ages, 50) * 1e3, percentile(ages, 99) * 1e3
    return [
        Row(f"age when painted, p50, {what}", middle, percentile(raw, 50) * 1e3, "ms", "raw socket"),
        Row(f"age when painted, p99, {what}", late, percentile(raw, 99) * 1e3, "ms", "raw socket"),
        Row(f"age when painted, p50, in periods, {what}", middle, 1e3 / RATE, "ms", "one period"),
        Row(f"pictures painted per second, {what}", rate, RATE, "1/s", "asked for"),
    ]


@contextlib.contextmanager
def camera_node(url: str, environment: dict[str, str], command: Sequence[str] = ()) -> Iterator[None]:
    """The driver's camera node, whose words come after those of `command`."""
    host, _, port = url.removeprefix("tcp://").rpartition(":")
    settings = {"source": 0, "color_space": 11, "resolution": 2, "frame_rate": RATE}
    arguments = [f"_{name}:={value}" for name, value in settings.items()]
    process = processes.start(
        [
            *command,
            "rosrun",
            "pepper_sensors_py",
            "camera.py",
            f"--pip={host}",
            f"--pport={port}",
            "__name:=camera",
            *arguments,
        ],
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=sys.stderr,
    )
    try:
        yield
    finally:
        processes.end(process)


def watch(environment: dict[str, str], command: Sequence[str] = ()) -> tuple[list[float], float]:
    """Ages of the pictures when they were painted [s], and how many different ones per second. The words of the program
    that paints come after those of `command`."""
    program = str(Path(__file__).with_name("media") / "video_screen.py")
    screen = subprocess.Popen(
        [*command, sys.executable, program, "/camera/image_raw"], env=environment, stdout=subprocess.PIPE, text=True
    )
    painted: dict[str, tuple[float, float]] = {}  # stamp -> when first painted, age

    def read() -> None:
        for line in screen.stdout:
            age, stamp = line.split()
            painted.setdefault(stamp, (time.monotonic(), float(age)))

    reader = threading.Thread(target=read, daemon=True)
    reader.start()
    try:
        wait_for(lambda: len(painted) > 5, "the first picture")
        time.sleep(WARM_UP)
        begin = time.monotonic()
        time.sleep(SECONDS)
        taken = [age for at, age in list(painted.values()) if at >= begin]
        return taken, len(taken) / (time.monotonic() - begin)
    finally:
        screen.terminate()
        screen.wait(10)
        reader.join(10)


def raw_ages() -> list[float]:
    """Ages when the last byte of a picture has come from another process [s]."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        sender = subprocess.Popen([sys.executable, __file__, str(server.getsockname()[1])])
        connection, _ = server.accept()
        ages = []
        buffer = bytearray(SIZE)
        try:
            for _ in range(int(RATE * SECONDS)):
                view = memoryview(buffer)
                while view:
                    view = view[connection.recv_into(view) :]
                ages.append(time.time() - struct.unpack_from("<d", buffer)[0])
        finally:
            sender.terminate()
            sender.wait(10)
            connection.close()
    return ages


def send(port: int) -> None:
    noise = bytearray(os.urandom(SIZE))
    with socket.create_connection(("127.0.0.1", port)) as connection, contextlib.suppress(OSError):
        due = time.monotonic()
        while True:
            struct.pack_into("<d", noise, 0, time.time())
            connection.sendall(noise)
            due += 1 / RATE
            time.sleep(max(0.0, due - time.monotonic()))


if __name__ == "__main__":
    send(int(sys.argv[1]))
