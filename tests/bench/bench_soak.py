"""`./stack bench soak [--hours H | --minutes M]`: a station drives, restarts, is cut and watched; what grows meanwhile?

Writes samples.jsonl as it goes, and at the end (Ctrl-C too) report.md with plots and report.json; `--report FILE` makes
the report again from such a file, also from one of a run that was killed. Needs root, for the network namespaces.
"""

from __future__ import annotations

import argparse
import signal
import subprocess
import sys
import threading
import time
import traceback
from collections.abc import Sequence
from pathlib import Path

from soak import page
from soak.activities import Activities
from soak.record import Recorder
from soak.samples import LogReader, Usage, names, sample
from soak.schedule import ROUND, Event, rounds
from soak.station import Station

from telepresence.station import processes
from telepresence.stop_signals import stop_on

SAMPLES = 1500
"""About so many in a run."""
SHORTEST_PERIOD = 5.0
"""Between two samples [s]."""
TICK = 0.2
PROGRESS_PERIOD = 10.0
LOSS = 0.02
ABOUT = (
    "What crosses the link: NAOqi, REST, the drive server's datagrams, WebRTC, sound, the tablet's page. What does "
    "not: the ROS graph, on the pilot's machine alone."
)


def main(options: Sequence[str]) -> int:
    """Run as the options say, or make a report again; return 1 when a limit is broken, else 0."""
    arguments = parse(options)
    if arguments.report:
        return conclude(arguments.report, arguments.out or arguments.report.parent)
    folder = (arguments.out or Path(f"soak-{time.strftime('%Y%m%d-%H%M')}")).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    stop = threading.Event()
    stop_on(stop, signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    processes.adopt_orphans()
    try:
        Soak(folder, arguments, stop).run()
    except Exception:  # hours of samples are worth a report
        traceback.print_exc()
        conclude(folder / "samples.jsonl", folder)
        return 1
    finally:
        processes.end_descendants()
    return conclude(folder / "samples.jsonl", folder)


def parse(options: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="./stack bench soak", description=__doc__.split("\n", 1)[0])
    length = parser.add_mutually_exclusive_group()
    length.add_argument("--hours", type=float, default=0.0)
    length.add_argument("--minutes", type=float, default=20.0, help="default: 20")
    parser.add_argument("--seed", type=int, default=0, help="seed of the schedule, the sensors' noise and the losses")
    parser.add_argument(
        "--loss", type=float, default=LOSS, help="share of packets lost each way (default: %(default)s)"
    )
    parser.add_argument(
        "--round", type=float, default=ROUND, help="seconds of a round of events (default: %(default)s)"
    )
    parser.add_argument(
        "--no-kills", action="store_true", help="kill nothing: each program's life is as long as the run"
    )
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="default: soak-DATE-TIME here")
    parser.add_argument("--report", type=Path, metavar="FILE", help="only make the report of this samples.jsonl again")
    return parser.parse_args(options)


def conclude(record: Path, folder: Path) -> int:
    """Write the report, say what it says, and return the exit code."""
    findings = page.write(record, folder)
    print(f"\nwritten to {folder / 'report.md'}")
    for line in findings.broken:
        print(f"  limit broken: {line}")
    percent = 100.0 * findings.total.slope / findings.total.level
    print(
        f"  memory grows by {percent:.2f} % an hour, {len(findings.broken)} limits broken, "
        f"{findings.log_written / 1e6:.1f} MB of logs an hour"
    )
    return 1 if findings.broken else 0


class Soak:
    """One run: carries out the schedule, samples, writes the record."""

    def __init__(self, folder: Path, arguments: argparse.Namespace, stop: threading.Event) -> None:
        self._folder, self._stop = folder, stop
        self._duration = arguments.hours * 3600.0 or arguments.minutes * 60.0
        self._seed, self._loss, self._round = arguments.seed, arguments.loss, arguments.round
        self._kills = not arguments.no_kills
        self._period = max(SHORTEST_PERIOD, self._duration / SAMPLES)
        told = {"seed": self._seed, "loss": self._loss, "kills": self._kills, "about": ABOUT}
        self._recorder = Recorder(folder / "samples.jsonl", duration=self._duration, **told)
        self._begin = time.monotonic()
        self._counts: dict[str, int] = {}
        self._phase = "start"

    def run(self) -> None:
        """Run until the time is over or somebody stops it."""
        try:
            station = Station(self._folder, self._seed, self._loss, self._note)
            try:
                self._drive(station)
            finally:
                station.close()
        finally:
            self._recorder.close()

    def _drive(self, station: Station) -> None:
        activities = Activities(station, self._note)
        logs = LogReader(*station.logs)
        odometer = self._start_odometer(station)
        programs: dict[str, Usage] = {}
        next_sample = next_progress = 0.0
        started = time.monotonic() - self._begin
        for number, events in enumerate(rounds(self._seed, self._round, self._kills)):
            begin = started + number * self._round
            while not self._stop.wait(TICK):
                now = time.monotonic() - self._begin
                if now > started + self._duration:
                    return
                while events and begin + events[0].at <= now:
                    self._begin_event(activities, events.pop(0))
                if odometer.poll() is not None:
                    odometer = self._start_odometer(station)
                station.look_after()
                if activities.waits:
                    activities.look_after(names(station.pids()))
                if now >= next_sample:
                    programs = sample(station.pids())
                    next_sample = now + self._period
                    logs.read()
                    self._record(now, programs, logs)
                if now >= next_progress:
                    next_progress = now + PROGRESS_PERIOD
                    self._show_progress(now, programs, logs)
                activities.release()
                if now >= begin + self._round:
                    break
            else:
                return

    def _begin_event(self, activities: Activities, event: Event) -> None:
        """Let an event begin; one that fails is noted, counts as a broken limit, and the run goes on."""
        try:
            activities.do(event)
        except (OSError, RuntimeError, subprocess.SubprocessError) as error:
            self._note("event failed", f"{event.kind} {event.what}: {error!r}")

    def _record(self, now: float, programs: dict[str, Usage], logs: LogReader) -> None:
        totals = {
            what: sum(getattr(usage, what) for usage in programs.values())
            for what in ("rss", "pss", "descriptors", "threads")
        }
        self._recorder.sample(
            now,
            programs,
            **totals,
            log_written=logs.written,
            log_size=logs.size(),
            tracebacks=[[*key, count] for key, count in logs.tracebacks.items()],
            metres=self._metres(),
        )

    def _note(self, kind: str, text: str) -> None:
        self._counts[kind] = self._counts.get(kind, 0) + 1
        self._phase = text if kind == "phase" else self._phase
        self._recorder.note(time.monotonic() - self._begin, kind, text)

    def _start_odometer(self, station: Station) -> subprocess.Popen:
        with (self._folder / "odometer.log").open("a") as output:
            program = str(Path(__file__).with_name("soak") / "odometer.py")
            odometer = station.on_pilot(sys.executable, program, stdout=output)
        station.measuring = {odometer.pid}
        return odometer

    def _metres(self) -> list[float]:
        """What the odometer has printed last; a restarted one begins at zero again."""
        total, last = [0.0, 0.0], [0.0, 0.0]
        for line in (self._folder / "odometer.log").read_text().splitlines():
            words = line.split()
            if len(words) != 3:
                continue  # a line that is being written
            values = [float(word) for word in words[1:]]
            if values[0] < last[0] or values[1] < last[1]:
                total = [a + b for a, b in zip(total, last, strict=True)]
            last = values
        return [round(a + b, 1) for a, b in zip(total, last, strict=True)]

    def _show_progress(self, now: float, programs: dict[str, Usage], logs: LogReader) -> None:
        hours = [f"{int(t // 3600)}:{int(t % 3600 // 60):02d}:{int(t % 60):02d}" for t in (now, self._duration)]
        memory = sum(usage.pss for usage in programs.values()) / 1024.0
        metres = " + ".join(f"{each:.0f}" for each in self._metres())
        line = (
            f"soak {hours[0]} of {hours[1]}  {self._phase:<8} {len(programs)} programs  {memory:.0f} MB  {metres} m  "
            f"{self._counts.get('kill', 0)} killed, {self._counts.get('back', 0)} back, "
            f"{self._counts.get('link', 0) // 2} cuts, {sum(logs.tracebacks.values())} tracebacks"
        )
        print(f"\r{line}\033[K" if sys.stdout.isatty() else line, end="" if sys.stdout.isatty() else "\n", flush=True)
