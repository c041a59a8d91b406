"""`./stack bench naoqi [--rounds N] [--json FILE] [--resets | --driver]`: NAOqi's messaging, by us and by the vendor.

Four pairs, each client and each server in a process of its own, in turn round after round; the figures are medians of
the rounds, so that a busy moment of the machine does not fall on one pair. The reference is libqi at both ends. All
pairs send the same bytes: a picture is a tuple of declared types, for libqi's Python sends no raw data in a dynamic.
At the end a driver asks the simulated Pepper for everything at once, by either library: `messaging/driver.py`.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from messaging.resets import reset_rounds
from report import Row, percentile, table

from telepresence.station import processes

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
VENDOR, OURS = "qi", "telepresence.naoqi"
LABELS = {VENDOR: "libqi", OURS: "ours"}
PAIRS = [(VENDOR, VENDOR), (OURS, OURS), (VENDOR, OURS), (OURS, VENDOR)]
"""Client and server; the first is the reference."""
REFERENCE = "libqi to libqi"
PATIENCE = 300.0
DRIVER_S = 20.0
"""How long a driver asks for everything [s]."""
RATES = {
    "joint states": 50.0,
    **dict.fromkeys(("front camera", "bottom camera", "depth camera", "laser", "sonar"), 10.0),
}
"""Stream of the driver -> wanted [Hz]."""
METRICS = {
    "bare call, p50": ("call", 50, 1e3, "ms"),
    "bare call, p90": ("call", 90, 1e3, "ms"),
    "bare call, p99": ("call", 99, 1e3, "ms"),
    "time per 640x480 picture": ("pictures", None, -1e3, "ms"),
    "processor per picture, client": ("picture_client", None, 1e3, "ms"),
    "processor per picture, server": ("picture_server", None, 1e3, "ms"),
    "getListData of 500 keys, p50": ("list", 50, 1e3, "ms"),
    "getListData of 500 keys, p99": ("list", 99, 1e3, "ms"),
    "time per event": ("events", None, -1e6, "us"),
    "50 clients polling, p50": ("poll", 50, 1e3, "ms"),
    "50 clients polling, p99": ("poll", 99, 1e3, "ms"),
    "processor per poll, both ends": ("poll_client+poll_server", None, 1e3, "ms"),
}
"""Metric -> the client's figure, percentile, factor (negative: of the inverse) and unit. Less is better in each."""


def main(options: Sequence[str]) -> int:
    """Measure, print the table, and write it; 1 when resets were asked for and one round failed."""
    arguments = parse(options)
    processes.adopt_orphans()
    try:
        if arguments.resets:
            return resets(arguments)
        rows = [] if arguments.driver else measure(arguments.rounds, arguments.scale)
        rows += measure_driver(DRIVER_S * arguments.scale)
    finally:
        processes.end_descendants()
    print(table(rows))
    if arguments.json:
        write(arguments.json, {"naoqi": [row.as_dict() for row in rows]})
    return 0


def parse(options: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="./stack bench naoqi", description=__doc__.split("\n\n", 1)[1])
    parser.add_argument("--rounds", type=int, default=5, help="rounds (default: %(default)s, two minutes)")
    parser.add_argument(
        "--scale", type=float, default=1.0, metavar="X", help="X times as many calls in a round (default: %(default)s)"
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the rows to this file")
    parser.add_argument(
        "--resets",
        action="store_true",
        help="instead: ten thousand connections reset before they are accepted, then how soon a new client is served; "
        "a hundred times in a row",
    )
    parser.add_argument("--driver", action="store_true", help="only the driver that asks for everything at once")
    parser.add_argument("--times", type=int, default=100, help="with --resets: how often (default: %(default)s)")
    parser.add_argument("--count", type=int, default=10_000, help="with --resets: connections (default: %(default)s)")
    return parser.parse_args(options)


def measure(rounds: int, scale: float) -> list[Row]:
    figures: dict[tuple[str, str], list[dict]] = {pair: [] for pair in PAIRS}
    for number in range(rounds):
        for client, server in PAIRS:
            print(
                f"round {number + 1} of {rounds}: {LABELS[client]} to {LABELS[server]} ...", file=sys.stderr, flush=True
            )
            figures[client, server].append(one(client, server, scale))
    return [
        Row(
            f"{metric}: {LABELS[pair[0]]} to {LABELS[pair[1]]}",
            figure(metric, figures[pair]),
            figure(metric, figures[PAIRS[0]]),
            METRICS[metric][3],
            REFERENCE,
        )
        for metric in METRICS
        for pair in PAIRS[1:]
    ]


def measure_driver(seconds: float) -> list[Row]:
    """Return what a driver gets of each stream that it asks the simulated Pepper for, against what it asked for."""
    rows = []
    for library in (VENDOR, OURS):
        print(f"driver of {LABELS[library]} ...", file=sys.stderr, flush=True)
        with serving("pepper_sim", "--port=0", "--scene=apartment") as (url, process):
            found = run_client("driver.py", library, url, process.pid, seconds)
        name = f"driver of {LABELS[library]}"
        rows += [Row(f"{name}: {stream}", found[stream], wanted, "Hz", "asked for") for stream, wanted in RATES.items()]
        for percent in (50, 90):
            took = percentile(found["cycles"], percent) * 1e3
            rows.append(Row(f"{name}: 36 calls for joint states, p{percent}", took, 20.0, "ms", "period"))
        rows.append(Row(f"{name}: processor of the robot", 100.0 * found["robot"], 100.0, "%", "one core"))
    return rows


def figure(metric: str, rounds: Sequence[dict]) -> float:
    """The median of the rounds."""
    names, percent, factor, _unit = METRICS[metric]
    values = []
    for each in rounds:
        value = sum(percentile(each[name], percent) if percent else each[name] for name in names.split("+"))
        values.append(value * factor if factor > 0 else -factor / value)
    return statistics.median(values)


def one(client: str, server: str, scale: float) -> dict:
    """What a client of one library measures at a server of another."""
    with serving(str(HERE / "messaging" / "server.py"), server) as (url, process):
        return run_client("client.py", client, url, process.pid, scale)


def run_client(program: str, library: str, url: str, server: int, amount: float) -> dict:
    """What a client of one library prints as JSON."""
    command = [sys.executable, HERE / "messaging" / program, library, url, str(server), str(amount)]
    ended = subprocess.run(command, env=environment(), capture_output=True, text=True, timeout=PATIENCE)
    lines = ended.stdout.splitlines()
    if ended.returncode or not lines:
        raise RuntimeError(f"{program} of {LABELS[library]}: {ended.stderr.strip()[-2000:]}")
    return json.loads(lines[-1])


@contextmanager
def serving(program: str, *arguments: str) -> Iterator[tuple[str, subprocess.Popen]]:
    """A program that serves NAOqi, a file or a module: its address and its process."""
    module = () if program.endswith(".py") else ("-m",)
    process = processes.start(
        [sys.executable, *module, program, *arguments],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment(),
    )  # fmt: skip
    try:
        for line in process.stdout:
            if (found := line.rpartition(" ")[2].strip()).startswith("tcp://"):
                break
        else:
            raise RuntimeError(f"{program} {' '.join(arguments)} did not start")
        yield found, process
    finally:
        process.stdin.close()
        if not module:  # the benchmark's own server ends with its input
            with suppress(subprocess.TimeoutExpired):
                process.wait(5.0)
        processes.end(process)
        process.stdout.close()


def environment() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(ROOT)}


def resets(arguments: argparse.Namespace) -> int:
    """Reset connections, our server in a process of its own, and print and write what came of it."""
    begin = time.monotonic()
    with serving(str(HERE / "messaging" / "server.py"), OURS) as (url, process):
        figures = reset_rounds(url, process.pid, arguments.times, arguments.count)
    rows = [
        Row("connected and reset", sum(figures.connected), arguments.times * arguments.count, "", "asked for"),
        Row("served within a second", figures.in_time, arguments.times, "rounds", "rounds"),
        Row("new client served, p50", percentile(figures.seconds, 50), 1.0, "s", "limit"),
        Row("new client served, longest", max(figures.seconds), 1.0, "s", "limit"),
        Row("memory after, against after the first round", figures.memory[-1], figures.memory[0], "MB", "first round"),
        Row("descriptors after", figures.descriptors[-1], figures.descriptors[0], "", "first round"),
        Row("threads after", figures.threads[-1], figures.threads[0], "", "first round"),
    ]
    print(table(rows))
    print(f"{arguments.times * arguments.count:,} resets in {time.monotonic() - begin:.0f} s")
    if arguments.json:
        write(arguments.json, {"naoqi resets": [row.as_dict() for row in rows]})
    return 0 if figures.in_time == arguments.times else 1


def write(path: Path, rows: dict) -> None:
    path.write_text(json.dumps(rows, indent=2) + "\n")
    print(f"written to {path}")
