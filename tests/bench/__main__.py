"""`./stack bench [NAME ...] [--json FILE] [--out FOLDER]`: ours against a peer or the physical limit, in one run."""

from __future__ import annotations

import argparse
import importlib
import json
import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from report import Row, table

import telepresence.sim  # noqa: F401  chooses OpenGL without a screen before anybody imports mujoco
from telepresence.station import processes

# The vendor's library warns where benchmarks' clients print figures; its log 1 is for fatal errors alone.
os.environ.setdefault("QI_LOG_LEVEL", "1")

BENCHMARKS = {
    "sim": "steps per second and real-time factor with servers, sensors and two cameras",
    "camera": "pictures through the wire: rate, freshness, cost",
    "video": "the robot's camera to the pilot's screen: age when painted, rate",
    "mjpeg": "the pilot's picture for many viewers, slow and stalled ones among them",
    "audio": "mouth to ear each way at once, ten minutes; loss, jitter and a cut",
    "teleop": "key press in a terminal to ALMotion's setpoint",
    "load": "key to setpoint, rest, age of the picture, start while all processors are busy; with, without priorities",
    "bandwidth": "what each wire between pilot and robot takes of the network",
    "fleet": "robots in one world: how many at real time, what each costs, where the time goes",
    "rest": "Robotino's web server under 300 requests a second, the world in real time",
    "webrtc": "age of Robotino's pictures by WebRTC, against a frame period and MJPEG",
    "access": "the pilot's page by one switch and by gaze: from the bedroom through the door to the sofa, no contact",
    "page": "the pilot's page in Chromium: age of the picture, key to setpoint, what viewers cost",
    "station": "processor and memory of each program of the Pepper station, at rest and on the way",
    "startup": "./stack up to the first picture in the window",
    "newcomer": "tap on the printed link to the first picture in the pilot's page, and to driving",
    "control": "by the clock or by odometry, with the gate or without, two gaits: time, error, work, slips, falls",
    "safety": "collisions, share of the command passed, escapes; against no gate, the bubble and uniform scaling",
}

PROGRAMS = {
    "faults": "kills and freezes every process while it drives, cuts the link: rest, told, back, stale motion",
    "soak": "hours of driving, restarts, cuts and viewers: what grows, and which tracebacks come",
    "naoqi": "NAOqi's messaging, ours and libqi's at each end: calls, pictures, lists, events; a driver; resets",
}
"""Benchmarks with a command line of their own, never among all: they take hours, or need `qi` and the processors."""

DRAWS = {"control", "safety", "startup"}
"""Benchmarks that can write a record and pictures into a folder."""


def main() -> int:
    if sys.argv[1:2] and sys.argv[1] in PROGRAMS:
        return importlib.import_module(f"bench_{sys.argv[1]}").main(sys.argv[2:])
    parser = argparse.ArgumentParser(
        prog="./stack bench",
        description="Ours against a peer or the physical limit, measured in the same run. Quote the ratios: the "
        "absolute figures are those of this machine now.",
        epilog="benchmarks:  "
        + ";  ".join(f"{name}: {about}" for name, about in BENCHMARKS.items())
        + ".  Alone, with arguments of their own (--help):  "
        + ";  ".join(f"{name}: {about}" for name, about in PROGRAMS.items()),
    )
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"any of {', '.join(BENCHMARKS)}; default all")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the rows to this file")
    parser.add_argument(
        "--out", type=Path, metavar="FOLDER", help="control, safety, startup: records and pictures go here"
    )
    arguments = parser.parse_args()
    unknown = set(arguments.names) - BENCHMARKS.keys()
    if unknown:
        parser.error(f"no benchmark named {', '.join(sorted(unknown))}; there are {', '.join(BENCHMARKS)}")

    processes.adopt_orphans()
    results: dict[str, list[Row]] = {}
    try:
        for name in arguments.names or BENCHMARKS:
            print(f"{name}: {BENCHMARKS[name]} ...", flush=True)
            benchmark = importlib.import_module(f"bench_{name}")
            results[name] = benchmark.run(arguments.out) if name in DRAWS else benchmark.run()
            print(table(results[name]), flush=True)
    finally:
        processes.end_descendants()
    if arguments.json:
        arguments.json.write_text(json.dumps({k: [row.as_dict() for row in v] for k, v in results.items()}, indent=2))
        print(f"written to {arguments.json}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
