"""The arithmetic of the faults benchmark, on traces whose answer is known, and the names of processes."""

from __future__ import annotations

import math
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import datetime, timedelta

import pytest
from faults import trial
from faults.bad_link import BadLink
from faults.far_station import entering
from faults.figures import rows, spread, summary, table
from faults.page import PAGE, ROWS, filled, known_rows, summarised
from faults.station import Output, Sayings
from faults.trace import Sample, drive_time, path_length, rest_time, way_ahead
from faults.trial import Outcome
from faults.victims import frozen, process_name, victims

from telepresence.station import processes

PERIOD = 0.02


def trace(velocity: Callable[[float], float], seconds: float = 4.0, turn: float = 0.0) -> list[Sample]:
    """What is recorded of a robot whose velocity ahead is a function of time."""
    x, samples = 0.0, []
    for tick in range(round(seconds / PERIOD)):
        now = tick * PERIOD
        samples.append(Sample(now, x, 0.0, 0.0, velocity(now), abs(velocity(now)), turn))
        x += velocity(now) * PERIOD
    return samples


def braking(now: float) -> float:
    """0.2 m/s until 1.2 s, at rest 0.4 s later, driving again at 3 s."""
    return 0.2 if now >= 3.0 else max(0.0, min(0.2, 0.2 - 0.5 * (now - 1.2)))


def test_rest_is_counted_from_the_fault_to_the_first_stillness_that_lasts():
    assert rest_time(trace(braking), since=1.0) == pytest.approx(0.6, abs=2 * PERIOD)
    stutter = trace(lambda now: 0.0 if 1.0 < now < 1.2 else braking(now))
    assert rest_time(stutter, since=1.0) == pytest.approx(0.6, abs=2 * PERIOD)


def test_who_turns_or_drives_on_or_is_not_seen_does_not_rest():
    assert rest_time(trace(lambda now: 0.2), since=1.0) is None
    assert rest_time(trace(lambda now: 0.0, turn=math.radians(5.0)), since=1.0) is None
    seen = [sample for sample in trace(braking) if sample.time < 1.1 or sample.time > 3.0]
    assert rest_time(seen, since=1.0) is None
    assert rest_time([], since=1.0) is None


def test_who_stands_where_it_stood_before_it_was_not_seen_has_rested_since():
    seen = [sample for sample in trace(braking) if not 1.7 < sample.time < 2.5]
    assert rest_time(seen, since=1.0) == pytest.approx(0.6, abs=2 * PERIOD)
    pushed = [replace(sample, x=sample.x + 0.01) if sample.time > 2.0 else sample for sample in seen]
    assert rest_time(pushed, since=1.0) == pytest.approx(1.5, abs=2 * PERIOD)


def test_back_is_the_first_time_at_speed_after_it():
    assert drive_time(trace(braking), since=1.9, speed=0.1) == pytest.approx(1.1, abs=2 * PERIOD)
    assert drive_time(trace(braking, seconds=2.5), since=1.9, speed=0.1) is None


def test_stale_motion_counts_what_was_driven_and_no_trembling():
    assert path_length(trace(braking), begin=2.0) == pytest.approx(0.2, abs=0.01)
    assert path_length(trace(braking), begin=2.0, end=2.9) == 0.0
    assert path_length(trace(lambda now: 0.005), begin=1.0) == 0.0
    assert way_ahead(trace(lambda now: -0.1 if now < 2.0 else 0.1), begin=1.0) == pytest.approx(0.2, abs=0.01)


def outcome(victim="/driver", **fields) -> Outcome:
    return Outcome("pepper", "pepper", "topic", victim, "kill", **{"told": 0.2, "back": 1.0, "rest": 0.5, **fields})


def test_a_row_says_which_limits_it_breaks():
    assert rows([outcome()])[0].broken == []
    assert rows([outcome(rest=0.65)])[0].broken == ["rest > 0.6"]
    assert rows([outcome(rest=0.65)], load=True)[0].broken == []
    assert rows([outcome(), outcome(back=None, told=None)])[0].broken == ["told > 1", "back > 3"]
    assert rows([outcome(stale=0.002)])[0].broken == ["stale > 0"]
    assert rows([outcome(told=None)])[0].broken == ["told > 1"]
    assert rows([outcome(told=None, harmless=True)])[0].broken == []
    went_on = outcome(rest=None, goes_on=True, release=None, back=0.0)
    assert rows([went_on])[0].broken == ["rest > 0.6"], "it did not stop at the release"


def test_what_never_came_is_never_in_the_table():
    figures = rows([outcome(), outcome(back=None)])
    assert spread([1.0, math.inf])[2] == math.inf
    assert "never" in table(figures) and summary(figures).startswith("0 of 1 rows hold; 2 faults, 0 with stale")


def test_the_page_gets_its_table():
    empty = "# Page\n<!-- faults -->\nyesterday\n<!-- end -->\nrest\n"
    page = filled(empty, rows([outcome(), outcome(back=None)]))
    assert "| pepper | pepper | topic | /driver | kill | 2 | 0.50 0.50 0.50 |" in page and "back > 3 |" in page
    assert "yesterday" not in page and page.endswith("<!-- end -->\nrest\n")
    more = filled(page, rows([outcome(victim="/camera")]))
    assert "| /driver | kill | 2 |" in more and "| /camera | kill | 1 |" in more
    short = summarised(empty, known_rows(more))
    assert "| pepper | topic | 2 | 1 |" in short and "1 of 2 rows hold." in short and "yesterday" not in short
    assert "| /driver |" in short and "| /camera |" not in short, "of the rows those that break a limit"
    again = filled(more, rows([outcome()]))
    assert "| /driver | kill | 1 |" in again and "| /camera |" in again, "a row that was measured again is replaced"
    assert summarised(short, known_rows(again)).partition("2 of 2 rows hold.\n")[2] == "<!-- end -->\nrest\n"


def test_the_pages_agree_with_each_other():
    found = known_rows(ROWS.read_text())
    assert found and summarised(PAGE.read_text(), found) == PAGE.read_text()


def test_processes_have_the_names_that_people_use():
    node = ["/usr/bin/python3", "/ws/lib/avatar_gui/drive_lease", "__name:=drive_lease", "__log:=x.log"]
    assert process_name(node, {"ROS_NAMESPACE": "/rto3"}) == "/rto3/drive_lease"
    assert process_name(node, {}) == "/drive_lease"
    assert process_name(["python", "-m", "telepresence.station", "up"], {}) == "telepresence.station"
    assert process_name(["/usr/bin/python3", "-u", "/opt/roslaunch", "x.launch"], {}) == "roslaunch"
    assert process_name(["Xvfb", ":7"], {}) == "Xvfb"


def test_the_display_is_still_known_after_a_master_has_come_back_many_times():
    """Without it nobody pressed a key any more, and the robot was said never to drive again."""
    output = Output()
    output.add("               There is no display here, so the window is on a virtual one (:7).\n")
    for number in range(1000):
        output.add(f"[INFO] [{number}.0]: registering /naoqi_driver with a new master\n")
    assert output.display == ":7"
    assert len(output.lines) < 1000


def test_what_a_window_shows_has_the_time_at_which_it_was_shown_however_late_it_is_read():
    sayings, now = Sayings(), time.monotonic()
    shown = datetime.now() - timedelta(seconds=4.0)
    sayings.window(f"{shown.isoformat(' ', 'milliseconds')} Pepper, warn: The sound program froze.")
    sayings.window(f"{shown.isoformat(' ', 'milliseconds')} Pepper, good: It works.")
    (said,) = sayings.since(now - 10.0)
    assert (said.where, said.text) == ("window", "The sound program froze.")
    assert now - said.time == pytest.approx(4.0, abs=0.5)


def test_victims_are_found_in_the_process_tree_and_seen_to_freeze():
    program = "import subprocess\nfor _ in 'ab': subprocess.Popen(['sleep', '60'])\nprint(1, flush=True); input()"
    parent = processes.start([sys.executable, "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    try:
        parent.stdout.readline()
        # Linux closes the files of execve(2)'s caller before the new program has a command line.
        trial.wait(lambda: len(victims(parent.pid)) == 3, 10.0)
        found = victims(parent.pid)
        assert list(found)[1:] == ["sleep", "sleep#2"] and found[next(iter(found))] == parent.pid
        assert not frozen(found["sleep"])
        os.kill(found["sleep"], signal.SIGSTOP)
        assert trial.wait(lambda: frozen(found["sleep"]), 10.0)
    finally:
        for pid in found.values():
            processes.send(pid, signal.SIGKILL)
        parent.communicate(timeout=10.0)


def test_a_reset_link_ends_connections_at_both_ends_and_takes_new_ones():
    link = BadLink()
    try:
        listener = on(link.robot, lambda: socket.create_server((link.robot.address, 0)))
        address = listener.getsockname()
        ends = connected(link, address, listener)
        link.reset()
        for end in ends:
            end.settimeout(5.0)
            with pytest.raises(ConnectionResetError):
                while True:
                    end.sendall(b"on")
                    end.recv(10)
        connected(link, address, listener)
    finally:
        link.close()


def test_a_stalled_link_delivers_late_and_in_order_and_a_cut_one_nothing():
    link = BadLink()
    try:
        receiver = on(link.robot, lambda: socket.socket(type=socket.SOCK_DGRAM))
        on(link.robot, lambda: receiver.bind((link.robot.address, 0)))
        receiver.settimeout(0.2)
        sender = on(link.pilot, lambda: socket.socket(type=socket.SOCK_DGRAM))
        sender.connect(receiver.getsockname())
        link.stalled = True
        for number in range(3):
            sender.send(bytes([number]))
        with pytest.raises(TimeoutError):
            receiver.recv(10)
        link.stalled = False
        receiver.settimeout(10.0)
        assert [receiver.recv(10)[0] for _ in range(3)] == [0, 1, 2]
        receiver.settimeout(0.2)
        link.cut = True
        sender.send(b"lost")
        with pytest.raises(TimeoutError):
            receiver.recv(10)
    finally:
        link.close()


def on(machine, make: Callable):
    """What `make` returns on a thread that is on that machine."""

    def there():
        entering(machine)()
        return make()

    with ThreadPoolExecutor(1) as executor:
        return executor.submit(there).result(10.0)


def connected(link: BadLink, address, listener: socket.socket) -> tuple[socket.socket, socket.socket]:
    """Both ends of a connection over the link, which has carried something."""
    near = on(link.pilot, lambda: socket.create_connection(address, timeout=5.0))
    far, _ = listener.accept()
    near.sendall(b"hello")
    assert far.recv(10) == b"hello"
    return near, far


def test_a_program_that_is_continued_at_once_stays_not_frozen():
    program = processes.start([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    try:
        program.send_signal(signal.SIGSTOP)
        assert trial.stays_frozen(program.pid)
        program.send_signal(signal.SIGCONT)
        assert not trial.stays_frozen(program.pid)
    finally:
        processes.end(program)
    assert trial.stays_frozen(program.pid), "one that has died of it was not continued"
