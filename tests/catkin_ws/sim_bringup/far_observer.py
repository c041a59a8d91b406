"""Runs on a robot's machine and writes down where it is 20 times a second: time x y theta, by odometry.

far_observer.py rest http://HOST:PORT    or    far_observer.py qi tcp://HOST:PORT
"""

from __future__ import annotations

import json
import sys
import time
import urllib.request
from collections.abc import Callable

import qi


def rest(url: str) -> Callable[[], list[float]]:
    def ask() -> list[float]:
        with urllib.request.urlopen(url + "/data/odometry", timeout=5.0) as answer:
            return json.load(answer)[:3]

    return ask


def naoqi(url: str) -> Callable[[], list[float]]:
    session = qi.Session()

    def ask() -> list[float]:
        if not session.isConnected():
            session.connect(url)
        return list(session.service("ALMotion").getRobotPosition(False))

    return ask


def main() -> None:
    ask = {"rest": rest, "qi": naoqi}[sys.argv[1]](sys.argv[2])
    while True:
        try:
            print(time.time(), *ask(), flush=True)
        except (OSError, RuntimeError) as error:
            print("not yet:", error, flush=True)
        time.sleep(0.05)


if __name__ == "__main__":
    main()
