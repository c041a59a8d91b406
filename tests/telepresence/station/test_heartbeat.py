"""Signs of life: what a program sends to who watches it. The sender is a program of its own: it reads its environment
when it starts."""

import os
import socket
import subprocess
import sys

import pytest

from telepresence.station import heartbeat


@pytest.fixture
def watcher(tmp_path):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        listener.bind(str(tmp_path / "beats"))
        listener.settimeout(10)
        yield listener


def run(program: str, address: str, **environment: str) -> str:
    program = "import os, threading, time\nfrom telepresence.station.heartbeat import beat, rest\n" + program
    result = subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, "NOTIFY_SOCKET": address, **environment},
        capture_output=True,
        text=True,
        check=True,
    )
    assert result.stderr == ""
    return result.stdout


def sent(watcher: socket.socket) -> list[str]:
    watcher.setblocking(False)
    found = []
    while True:
        try:
            found.append(watcher.recv(4096).decode())
        except BlockingIOError:
            return found


def test_a_beat_is_one_datagram_and_children_are_not_watched_in_its_name(watcher):
    output = run("for _ in range(1000): beat()\nprint('NOTIFY_SOCKET' in os.environ)", watcher.getsockname())
    # A thousand beats take a few milliseconds; on a busy machine perhaps a few tenths of a second.
    assert set(sent(watcher)) == {"WATCHDOG=1"}
    assert output == "False\n"


def test_beats_are_bounded(watcher):
    run("end = time.monotonic() + 0.25\nwhile time.monotonic() < end: beat()", watcher.getsockname())
    assert 1 <= len(sent(watcher)) <= 3


def test_a_call_that_may_wait_is_announced_at_once_as_systemd_wants_it(watcher):
    run("beat()\nbeat(within=3)", watcher.getsockname())
    first, second = sent(watcher)
    assert first == "WATCHDOG=1"
    word, microseconds = second.splitlines()[1].split("=")
    assert (word, int(microseconds)) == ("WATCHDOG_USEC", 3_000_000)


def test_of_two_loops_both_must_work(watcher):
    run(
        "thread = threading.Thread(target=beat, args=(0.01,))\nthread.start()\nthread.join()\ntime.sleep(0.3)\nbeat()",
        watcher.getsockname(),
    )
    assert len(sent(watcher)) == 1, "the other loop is late: this one must not speak for it"


def test_a_loop_that_ended_in_order_is_not_waited_for(watcher):
    loop = "def loop():\n beat(0.01)\n rest()\n"
    run(
        f"{loop}thread = threading.Thread(target=loop)\nthread.start()\nthread.join()\ntime.sleep(0.3)\nbeat()",
        watcher.getsockname(),
    )
    assert len(sent(watcher)) == 2


@pytest.mark.parametrize("address", ["", "@nobody", "/nobody/listens"])
def test_without_a_watcher_nothing_happens(address):
    assert run("beat()\nprint('works')", address) == "works\n"


def test_a_full_queue_does_not_hold_the_program_up(watcher):
    assert run("for _ in range(3):\n for n in range(9): beat(within=n + 1)\nprint('works')", watcher.getsockname())


def test_the_watcher_is_told_less_often_than_it_becomes_impatient():
    assert heartbeat.PERIOD < heartbeat.WITHIN / 3
