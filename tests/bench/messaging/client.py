"""What a client does in the benchmark: `python client.py LIBRARY URL SERVER_PID SCALE` prints its figures as JSON."""

from __future__ import annotations

import importlib
import json
import os
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent))

from server import KEYS, PICTURE

TICKS = os.sysconf("SC_CLK_TCK")
CALLS, PICTURES, LISTS, EVENTS = 3000, 400, 200, 10_000
CLIENTS, POLLS, POLL_RATE = 50, 20, 10.0
"""Clients that poll at once, how often each, and how often a second."""
PATIENCE = 120.0


def processor_time(pid: int) -> float:
    """Seconds that a process has used, to a hundredth."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS


def timed(work: Callable[[], Any], count: int) -> list[float]:
    """Seconds of each of `count` calls, after a few to warm up."""
    for _ in range(max(3, count // 20)):
        work()
    seconds = []
    for _ in range(count):
        begin = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - begin)
    return seconds


def calls(service: Any, count: int) -> dict[str, list[float]]:
    return {"call": timed(service.nothing, count)}


def pictures(service: Any, count: int, server: int) -> dict[str, float]:
    assert len(service.getImageRemote("handle")[6]) == PICTURE
    own, others, begin = time.process_time(), processor_time(server), time.perf_counter()
    for _ in range(count):
        service.getImageRemote("handle")
    wall = time.perf_counter() - begin
    return {
        "pictures": count / wall,
        "picture_client": (time.process_time() - own) / count,
        "picture_server": (processor_time(server) - others) / count,
    }


def lists(service: Any, count: int) -> dict[str, list[float]]:
    assert service.getListData(KEYS)[3] == 1.5
    return {"list": timed(lambda: service.getListData(KEYS), count)}


def events(service: Any, count: int) -> dict[str, float]:
    """Events a second, from the call that has them emitted until the last one's callback."""
    heard, done, lock = 0, threading.Event(), threading.Lock()
    wanted = 1

    def hear(_value: Any) -> None:
        nonlocal heard
        with lock:
            heard += 1
            if heard >= wanted:
                done.set()

    def emit(number: int) -> float:
        nonlocal heard, wanted
        heard, wanted = 0, number
        done.clear()
        begin = time.perf_counter()
        service.count(number)
        if not done.wait(PATIENCE):
            raise RuntimeError(f"{heard} of {number} events came")
        return time.perf_counter() - begin

    link = service.counted.connect(hear)
    emit(count // 20)
    seconds = emit(count)
    service.counted.disconnect(link)
    return {"events": count / seconds}


def polling(qi: Any, url: str, polls: int, server: int) -> dict[str, Any]:
    """Each client asks for 20 keys on a schedule; a call that is late starts late, and its waiting counts."""
    sessions = [qi.Session() for _ in range(CLIENTS)]
    for session in sessions:
        session.connect(url)
    services = [session.service("Robot") for session in sessions]
    delays: list[float] = []
    failures: list[Exception] = []
    own, others, begin = time.process_time(), processor_time(server), time.monotonic() + 0.2

    def poll(number: int) -> None:
        try:
            for turn in range(polls):
                due = begin + (turn + number / CLIENTS) / POLL_RATE
                time.sleep(max(0.0, due - time.monotonic()))
                services[number].getListData(KEYS[:20])
                delays.append(time.monotonic() - due)
        except RuntimeError as error:
            failures.append(error)

    threads = [threading.Thread(target=poll, args=(number,)) for number in range(CLIENTS)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    if failures:
        raise RuntimeError(f"{len(failures)} clients gave up: {failures[0]}")
    return {
        "poll": delays,
        "poll_client": (time.process_time() - own) / len(delays),
        "poll_server": (processor_time(server) - others) / len(delays),
    }


def main() -> None:
    library, url, server, scale = sys.argv[1], sys.argv[2], int(sys.argv[3]), float(sys.argv[4])
    qi = importlib.import_module(library)
    if library == "qi":
        qi.logging.setLevel(qi.logging.FATAL)
    session = qi.Session()
    session.connect(url)
    service = session.service("Robot")

    def share(count: int) -> int:
        return max(20, int(count * scale))

    figures: dict[str, Any] = {}
    for part in (
        lambda: calls(service, share(CALLS)),
        lambda: pictures(service, share(PICTURES), server),
        lambda: lists(service, share(LISTS)),
        lambda: events(service, share(EVENTS)),
        lambda: polling(qi, url, max(3, int(POLLS * scale)), server),
    ):
        figures.update(part())
    print(json.dumps(figures), flush=True)
    os._exit(0)  # libqi takes a second to end


if __name__ == "__main__":
    main()
