"""Damages NAOqi's messages on their way: `./stack exec python tests/fuzz/fuzz_conversations.py [--messages N]`.

A live server of ours in a process of its own gets the messages of a client, damaged; a live client of ours in a process
of its own gets the answers and events of a server, damaged. After each batch the server must answer an honest call, and
every call of the client must have ended. Memory, threads and descriptors of both are watched. A batch that breaks this
is written to tests/fuzz/found/naoqi-conversation, where a test plays it again from then on.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from typing import NamedTuple

sys.path.extend(str(Path(__file__).resolve().parents[1] / folder) for folder in ("fuzz", "lab", "bench", ".."))

from fuzz_conversation_ends import ClientSide, Found, ServerSide, client

GROWTH = 48.0
"""Memory that an end may need more at its end than after its first tenth [MB]."""


class Row(NamedTuple):
    """How one end fared."""

    side: str
    messages: int
    seconds: float
    connections: int
    grown: float
    threads: int
    descriptors: int


SIDES: dict[str, type[ServerSide] | type[ClientSide]] = {"server": ServerSide, "client": ClientSide}


def fuzz(name: str, messages: int, seed: int, progress: bool = True) -> Row:
    """Damage `messages` messages for one side.

    Raises:
        Found: Something broke.
    """
    side = SIDES[name](seed)
    begin = time.monotonic()
    first: list[tuple[float, int, int]] = []
    shown = 0.0

    def told(done: int) -> None:
        nonlocal shown
        if not first and done >= messages // 10:
            first.append(side.usage())
        if progress and time.monotonic() - shown > 10.0:
            shown = time.monotonic()
            memory, descriptors, threads = side.usage()
            rate = done / (shown - begin + 1e-9)
            line = f"{name}: {done:,} of {messages:,}, {rate:.0f} a second, {memory:.0f} MB"
            print(f"{line}, {threads} threads, {descriptors} descriptors", file=sys.stderr, flush=True)

    try:
        side.run(messages, told)
        seconds = time.monotonic() - begin
        deadline = time.monotonic() + 15.0
        while (last := side.usage())[2] > 8 and time.monotonic() < deadline:
            time.sleep(0.1)
        grown = last[0] - first[0][0]
        if grown > GROWTH:
            raise Found(f"memory has grown by {grown:.0f} MB", b"")
        return Row(name, messages, seconds, side.connections, grown, last[2], last[1])
    finally:
        side.close()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", 1)[1])
    parser.add_argument("--messages", type=int, default=1_000_000, help="messages for each side; default 1000000")
    parser.add_argument("--seed", type=int, default=1, help="seed of the random numbers; default 1")
    parser.add_argument("--side", choices=SIDES, help="only one of them")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the rows to this file")
    parser.add_argument("--client", metavar="URL", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.client:
        client(arguments.client, arguments.seed)
        return 0
    rows, failed = [], False
    for name in [arguments.side] if arguments.side else SIDES:
        try:
            rows.append(fuzz(name, arguments.messages, arguments.seed))
        except Found as found:
            failed = True
            print(f"{name}: {found}" + (f", kept in {found.save(name)}" if found.batch else ""))
    columns = "{:<8} {:>9} {:>7} {:>11} {:>8} {:>7} {:>11}"
    print(columns.format("side", "messages", "per s", "connections", "grown", "threads", "descriptors"))
    for row in rows:
        rate, grown = f"{row.messages / row.seconds:.0f}", f"{row.grown:.1f} MB"
        print(columns.format(row.side, row.messages, rate, row.connections, grown, row.threads, row.descriptors))
    if arguments.json:
        arguments.json.write_text(json.dumps([row._asdict() for row in rows], indent=2) + "\n")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
