"""Somebody taps the link that `./stack up` has printed: until the first picture, and until the robot drives.

The whole station of a simulated Pepper with its window, and Chromium without anything of an earlier visit, on the
screen of a laptop and of a phone, all on this machine.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent / "browser"))
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "lab"))

import numpy as np
from faults.topics import TopicReader
from newcomer import SCREENS, Newcomer, Screen
from report import Row, percentile
from ros_graph import wait_for
from whole_station import whole_station

TAPS, DRIVES = 20, 3
MOVED = 0.03
"""[m] from which on the robot counts as driving."""
PICTURE_AIM, DRIVE_AIM = 3.0, 10.0
"""[s]"""


def run() -> list[Row]:
    rows: list[Row] = []
    with whole_station() as station:
        for screen in SCREENS:
            rows += _visit(screen, station.link, station.master)
    return rows


def _visit(screen: Screen, link: str, master: str) -> list[Row]:
    places: list[np.ndarray] = []

    def note(truth: Any) -> None:
        place = truth.pose.pose.position
        places.append(np.array([place.x, place.y]))

    truth = TopicReader(master, "/truth", note)
    newcomer = Newcomer(screen)
    pictures, drives = [], []
    try:
        for visit in range(TAPS):
            newcomer.tap(link)
            tapped = time.monotonic()
            wait_for(lambda: newcomer.first_picture() is not None, "the first picture")
            pictures.append(newcomer.first_picture())
            if visit < DRIVES:
                wait_for(newcomer.is_there, "the robot is free")
                places.clear()
                newcomer.hold_forward()
                wait_for(lambda: places and np.linalg.norm(places[-1] - places[0]) > MOVED, "the robot drives")
                drives.append(time.monotonic() - tapped)
                newcomer.let_go()
    finally:
        newcomer.tools.close()
        truth.close()
    size = f"{screen.name}, {screen.width}x{screen.height}"
    return [
        Row(f"tap to first picture, p50; {size}", percentile(pictures, 50), PICTURE_AIM, "s", "the aim"),
        Row(f"tap to first picture, p95; {size}", percentile(pictures, 95), PICTURE_AIM, "s", "the aim"),
        Row(f"tap to driving, slowest of {DRIVES}; {size}", max(drives), DRIVE_AIM, "s", "the aim"),
    ]
