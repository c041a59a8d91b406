"""A driver that asks a Pepper for everything: `python driver.py LIBRARY URL SERVER_PID SECONDS` prints its rates.

Like many drivers of real robots it is one loop: joint states at 50 Hz by 36 calls a cycle; in every fifth cycle a
picture of each of three cameras, laser and sonar; and the microphones' blocks as they come. A cycle that is late is
made up for as rospy.Rate does it: by one period at most.
"""

from __future__ import annotations

import importlib
import json
import os
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent))

from client import processor_time

JOINT_RATE, EVERY = 50.0, 5
"""Cycles a second, and in which of them the slower streams are asked for."""
VGA = 2
CAMERAS = {"front camera": (0, 11), "bottom camera": (1, 11), "depth camera": (2, 17)}
"""Name -> NAOqi's id of camera and colour space: RGB twice, depth in millimetres."""
WARM_UP = 2.0
"""Seconds until the counting begins."""
JOINTS = (
    "HeadYaw HeadPitch LShoulderPitch LShoulderRoll LElbowYaw LElbowRoll LWristYaw LHand HipRoll HipPitch KneePitch "
    "RShoulderPitch RShoulderRoll RElbowYaw RElbowRoll RWristYaw RHand"
).split()
LASER = [
    f"Device/SubDeviceList/Platform/LaserSensor/{side}/Horizontal/Seg{segment:02}/{axis}/Sensor/Value"
    for side in ("Front", "Left", "Right")
    for segment in range(1, 16)
    for axis in "XY"
]
SONAR = [f"Device/SubDeviceList/Platform/{side}/Sonar/Sensor/Value" for side in ("Front", "Back")]


class Microphones:
    """A module that ALAudioDevice sends blocks of sound to."""

    def __init__(self) -> None:
        self.blocks = 0

    def processRemote(self, channels: int, samples: int, stamp: Any, sound: bytes) -> None:
        self.blocks += 1


def joint_states(session: Any) -> Callable[[], object]:
    motion, memory = session.service("ALMotion"), session.service("ALMemory")
    keys = [
        f"Device/SubDeviceList/{joint}/{value}/Sensor/Value"
        for joint in JOINTS
        for value in ("Position", "ElectricCurrent")
    ]
    assert len(keys) + 2 == 36

    def read() -> None:
        motion.getAngles("Body", True)
        motion.getPosition("Torso", 1, True)
        for key in keys:
            memory.getData(key)

    return read


def pictures(session: Any, camera: int, colours: int, name: str) -> Callable[[], object]:
    video = session.service("ALVideoDevice")
    handle = video.subscribeCamera(name, camera, VGA, colours, int(JOINT_RATE / EVERY))

    def read() -> None:
        if video.getImageRemote(handle) is None:
            raise RuntimeError(f"no picture of the {name}")

    return read


def readings(session: Any, keys: list[str]) -> Callable[[], object]:
    memory = session.service("ALMemory")

    def read() -> None:
        if None in memory.getListData(keys):
            raise RuntimeError(f"not every one of {keys[0]} ... is there")

    return read


def drive(session: Any, stop: threading.Event, counted: Counter, cycles: list[float]) -> None:
    """Ask for everything at its rate until `stop` is set; count it, and note how long each cycle's joints take [s]."""
    joints = joint_states(session)
    slower = {name: pictures(session, *which, name.replace(" ", "_")) for name, which in CAMERAS.items()}
    slower |= {"laser": readings(session, LASER), "sonar": readings(session, SONAR)}
    period, cycle, due = 1.0 / JOINT_RATE, 0, time.monotonic()
    while not stop.is_set():
        begin = time.monotonic()
        joints()
        cycles.append(time.monotonic() - begin)
        counted["joint states"] += 1
        if cycle % EVERY == 0:
            for name, read in slower.items():
                read()
                counted[name] += 1
        cycle, due, now = cycle + 1, due + period, time.monotonic()
        if now > due + period:
            due = now
        time.sleep(max(0.0, due - now))


def main() -> None:
    library, url, server, seconds = sys.argv[1], sys.argv[2], int(sys.argv[3]), float(sys.argv[4])
    qi = importlib.import_module(library)
    if library == "qi":
        qi.logging.setLevel(qi.logging.FATAL)
    session = qi.Session()
    session.connect(url)
    session.service("ALSonar").subscribe("driver")
    microphones = Microphones()
    session.registerService("DriverAudio", microphones)
    audio = session.service("ALAudioDevice")
    audio.setClientPreferences("DriverAudio", 48000, 0, 0)
    audio.subscribe("DriverAudio")
    stop, counted, cycles = threading.Event(), Counter(), []
    loop = threading.Thread(target=drive, args=(session, stop, counted, cycles), name="driver")
    loop.start()

    def figures() -> Counter:
        now = Counter(counted)
        now.update({"sound": microphones.blocks})
        now.update({"time": time.monotonic(), "driver": time.process_time(), "robot": processor_time(server)})
        return now

    time.sleep(WARM_UP)
    before, first = figures(), len(cycles)
    time.sleep(seconds)
    after = figures()
    stop.set()
    loop.join(30.0)
    wall = after["time"] - before["time"]
    rates = {name: (after[name] - before[name]) / wall for name in after if name != "time"}
    print(json.dumps({**rates, "cycles": cycles[first:]}), flush=True)
    os._exit(0)  # libqi takes a second to end


if __name__ == "__main__":
    main()
