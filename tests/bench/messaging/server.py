"""A robot's services for the benchmark, by the library named: `python server.py LIBRARY` prints its address."""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Callable
from typing import Any

PICTURE = 640 * 480 * 3
KEYS = [f"Device/SubDeviceList/Joint{number}/Position/Sensor/Value" for number in range(500)]


def typed(parameters: str, result: str) -> Callable:
    def mark(method: Callable) -> Callable:
        method.__qi_signature__, method.__qi_return_signature__ = parameters, result
        return method

    return mark


def robot(qi: Any) -> Any:
    pixels = bytes(PICTURE)
    values = {key: number * 0.5 for number, key in enumerate(KEYS)}

    @qi.multiThreaded()
    class Robot:
        def __init__(self) -> None:
            self.counted = qi.Signal("(m)")

        @typed("()", "v")
        def nothing(self) -> None:
            """A bare call."""

        @typed("(s)", "(iiiiiirfffff)")
        def getImageRemote(self, handle: str) -> tuple:
            return (640, 480, 3, 11, 0, 0, pixels, 0.0, 0.5, 0.4, -0.5, -0.4)

        @typed("(m)", "m")
        def getListData(self, keys: list) -> list:
            return [values[key] for key in keys]

        @typed("(i)", "v")
        def count(self, events: int) -> None:
            for number in range(events):
                self.counted(number)

    return Robot()


def main() -> None:
    qi = importlib.import_module(sys.argv[1])
    if sys.argv[1] == "qi":
        qi.logging.setLevel(qi.logging.FATAL)
    session = qi.Session()
    session.listenStandalone("tcp://127.0.0.1:0")
    session.registerService("Robot", robot(qi))
    print(next(url for url in session.endpoints() if "127.0.0.1" in url), flush=True)
    sys.stdin.read()
    os._exit(0)  # libqi takes a second to end


if __name__ == "__main__":
    main()
