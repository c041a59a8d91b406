"""Kills and freezes every process of a station while it drives, spoils the link to its robot, says what came of it.

What is measured comes from the simulator, over a connection of its own that no program of the station carries: where
the robot truly is, 50 times a second. What the station says about itself: its topics and its window.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import re
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from faults.far_station import FarStation, wait_ready
from faults.figures import Figures, limits, rows, summary, table
from faults.link_trial import FAULTS, KEYS, strike_link
from faults.page import read
from faults.pilots import Pilot, TerminalPilot, TopicPilot, WindowPilot
from faults.station import STATIONS, Station
from faults.trial import NOBODY, NotReady, Outcome, Run, strike, wait

from telepresence.station import processes

WAYS = ("topic", "terminal", "window")
KINDS = ("kill", "freeze")
PARTS = ("processes", "link")
RECOVERY = 15.0
"""A station that is not complete again after so long is brought up anew [s]."""
TRIES = 2
"""A victim whose fault could not be measured is tried on so many stations."""


def parse(argv: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="./stack bench faults",
        description=__doc__,
        epilog="In pieces: --robot, --by, --fault and --only choose a part; each part writes a JSON of its own, and "
        "--show FILE ... prints the table of several.",
    )
    parser.add_argument("--robot", choices=STATIONS, action="append", help="the station; default all three")
    parser.add_argument("--by", choices=WAYS, action="append", help="how it is driven; default all three ways")
    parser.add_argument("--fault", choices=KINDS, action="append", help="default both")
    parser.add_argument("--times", type=int, default=5, metavar="N", help="repetitions of each fault; default 5")
    parser.add_argument("--quick", action="store_true", help="each fault once")
    parser.add_argument("--only", metavar="PATTERN", help="processes whose name has this in it (regular expression)")
    parser.add_argument("--part", choices=PARTS, action="append", help="processes or the link; default both")
    parser.add_argument(
        "--link-times", type=int, default=25, metavar="N", help="repetitions of each fault of the link; default 25"
    )
    parser.add_argument("--service", action="store_true", help="systemd keeps the station: ./stack service")
    parser.add_argument("--load", action="store_true", help="other programs keep every processor busy")
    parser.add_argument("--list", action="store_true", help="bring up the station, print its processes, end")
    parser.add_argument("--json", type=Path, metavar="FILE", help="every fault and every row, written as it goes")
    parser.add_argument("--traces", type=Path, metavar="FOLDER", help="where the robot was, a table for every fault")
    parser.add_argument("--show", type=Path, nargs="+", metavar="FILE", help="print the table of these JSON files")
    arguments = parser.parse_args(argv)
    if arguments.service and "terminal" in (arguments.by or ()):
        parser.error("--service: what systemd starts has no terminal")
    if arguments.traces:
        arguments.traces.mkdir(parents=True, exist_ok=True)
    if arguments.quick:
        arguments.times = arguments.link_times = 1
    return arguments


def main(argv: list[str]) -> int:
    arguments = parse(argv)
    if arguments.show:
        report([row for path in arguments.show for row in read(path)])
        return 0
    processes.adopt_orphans()
    for request in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(request, signal.default_int_handler)
    bench = Bench(arguments)
    hogs: list[subprocess.Popen] = []
    try:
        if arguments.load:
            words = [sys.executable, "-c", "while True: pass"]
            hogs += [processes.start(words, tied=True) for _ in range(os.cpu_count() or 1)]
        for kind in arguments.robot or STATIONS:
            ways = [by for by in arguments.by or WAYS if not (arguments.service and by == "terminal")]
            for by in ways if "processes" in (arguments.part or PARTS) else ():
                bench.sweep(kind, by)
        for kind in arguments.robot or STATIONS:
            if kind != "both" and "link" in (arguments.part or PARTS):
                bench.sweep_link(kind)
    except KeyboardInterrupt:
        print("stopped; what was measured so far:", flush=True)
    finally:
        bench.close()
        for hog in hogs:
            hog.kill()
        processes.end_descendants()
    report(rows(bench.outcomes, arguments.load))
    return 0


def report(figures: list[Figures]) -> None:
    if figures:
        print(limits(any(row.load for row in figures)), table(figures) + summary(figures), sep="\n\n", flush=True)


class Bench:
    """The stations, one after the other, and what was measured on them."""

    def __init__(self, arguments: argparse.Namespace) -> None:
        self.arguments = arguments
        self.outcomes: list[Outcome] = []
        self._random = random.Random(1)
        self._folder = tempfile.TemporaryDirectory(prefix="bench-faults-")
        self._station: Station | None = None
        self._far: FarStation | None = None
        self._pilots: list[Pilot] = []
        self._runs: list[Run] = []
        self._began = time.monotonic()

    def sweep(self, kind: str, by: str) -> None:
        """Every process of a station, each kind of fault, so often as was asked."""
        self._bring_up(kind, by)
        assert self._station is not None
        names = list(self._station.victims())
        if self.arguments.list:
            print(f"{kind}, driven by {by}:", *(f"  {name}" for name in names), sep="\n", flush=True)
            return
        chosen = [name for name in names if re.search(self.arguments.only or "", name)]
        jobs = [(NOBODY, "release"), *((name, fault) for name in chosen for fault in self.arguments.fault or KINDS)]
        for number, (name, fault) in enumerate(jobs, 1):
            # The terminal of a station with both drives Pepper.
            for index in range(1 if by == "terminal" else len(STATIONS[kind])):
                for turn in range(self.arguments.times):
                    self._progress(f"{kind} by {by}, {number}/{len(jobs)}: {fault} {name}, {turn + 1}")
                    self._measure(kind, by, index, name, fault)
        self._take_down()

    def sweep_link(self, kind: str) -> None:
        """Every fault of the link between a robot and its pilot."""
        jobs = [(fault, key) for fault in FAULTS for key in KEYS if re.search(self.arguments.only or "", fault)]
        for turn in range(self.arguments.link_times):
            for fault, key in jobs:
                self._progress(f"{kind}'s link, {turn + 1}/{self.arguments.link_times}: {fault}, key {key}")
                self._measure_link(kind, fault, key)
        self._take_down()

    def _measure_link(self, kind: str, fault: str, key: str) -> None:
        for _ in range(TRIES):
            try:
                if self._far is None:
                    self._take_down()
                    self._far = FarStation(kind, Path(tempfile.mkdtemp(dir=self._folder.name)))
                    wait_ready(self._far)
                far = self._far
                run = Run(far, far.robot, far.pilot, far.restarter, self._random, self.arguments.traces)
                self._keep(strike_link(run, fault, key))
                return
            except (NotReady, RuntimeError, BrokenPipeError) as error:
                self._progress(f"  again on another station: {error}")
                self._take_down()
        self._progress(f"  {fault} could not be measured")

    def _keep(self, outcome: Outcome) -> None:
        self.outcomes.append(outcome)
        self._progress("  " + describe(outcome))
        self._write()

    def _measure(self, kind: str, by: str, index: int, name: str, fault: str) -> None:
        for _ in range(TRIES):
            try:
                if self._station is None or not wait(self._station.complete, RECOVERY):
                    self._bring_up(kind, by)
                assert self._station is not None
                run, pid = self._runs[index], {NOBODY: 0, **self._station.victims()}.get(name)
                if pid is None:
                    self._progress(f"  {name} is not there any more")
                    self._take_down()
                    continue
                outcome = strike(run, name, pid, fault)
            except (NotReady, RuntimeError, BrokenPipeError) as error:
                self._progress(f"  again on another station: {error}")
                self._take_down()
                continue
            self._keep(outcome)
            if not self._station.running:
                self._progress(f"  the station has ended; it said last:\n{self._station.last_lines()}")
            return
        self._progress(f"  {fault} {name} could not be measured")

    def _bring_up(self, kind: str, by: str) -> None:
        self._take_down()
        folder = Path(tempfile.mkdtemp(dir=self._folder.name))
        self._station = station = Station(kind, by, folder, self.arguments.service)
        station.wait_ready()
        for robot in station.robots:
            topic = TopicPilot(station.environment, robot.command, robot.speed)
            self._pilots.append(topic)
            pilot: Pilot = topic
            if by == "terminal" and not self._runs:
                pilot = TerminalPilot(station, robot)
            elif by == "window":
                pilot = WindowPilot(station, robot)
            if pilot is not topic:
                self._pilots.append(pilot)
            self._runs.append(Run(station, robot, pilot, topic, self._random, self.arguments.traces))

    def _take_down(self) -> None:
        for pilot in self._pilots:
            pilot.close()
        self._pilots, self._runs = [], []
        if self._station is not None:
            self._station.close()
            self._station = None
        if self._far is not None:
            self._far.close()
            self._far = None

    def _progress(self, text: str) -> None:
        print(f"{time.monotonic() - self._began:6.0f} s  {text}", flush=True)

    def _write(self) -> None:
        if self.arguments.json:
            figures = rows(self.outcomes, self.arguments.load)
            record = {
                "load": self.arguments.load,
                "limits": limits(self.arguments.load),
                "summary": summary(figures),
                "rows": [row.as_dict() for row in figures],
                "faults": [outcome.as_dict() for outcome in self.outcomes],
            }
            self.arguments.json.write_text(json.dumps(record, indent=1))

    def close(self) -> None:
        self._take_down()
        self._folder.cleanup()


def describe(outcome: Outcome) -> str:
    """One line about one fault."""

    def seconds(value: float | None) -> str:
        return "never" if value is None else f"{value:.2f} s"

    if outcome.goes_on:
        rest = f"goes on, rest {seconds(outcome.release)} after release"
    elif outcome.gone:
        rest = f"gone, back {seconds(outcome.back)}"
    else:
        rest = f"rest {seconds(outcome.rest)}, back {seconds(outcome.back)}"
    told = f"{seconds(outcome.told)} {outcome.where}: {outcome.said}" if outcome.told is not None else "never"
    note = f" ({outcome.note})" if outcome.note else ""
    return f"{rest}, stale {outcome.stale * 1e3:.0f} mm, told {told}{note}"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
