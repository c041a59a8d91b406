"""Frozen or only slow: programs that are stopped, hang, work without beating, or get no processor."""

import os
import signal
import subprocess
import sys
import time

import pytest

from telepresence.station import vitals
from telepresence.station.restarts import LONGEST_PAUSE, STEADY_AFTER, Restarts, what_next
from telepresence.station.vitals import LONGEST_STEP, PERIOD, Beats, Vitals

BEGIN = "import os, time, threading\nfrom telepresence.station.heartbeat import beat\nbeat()\n"
BEATING = "\nwhile True:\n beat()\n time.sleep(0.05)"
HANGING = "\nthreading.Event().wait()"
WORKING = "\nwhile True: pass"


class Patient:
    """A program and who watches it. Time is what the watcher says, so that nothing depends on this machine's load."""

    def __init__(self, path, program: str, *prefix: str) -> None:
        self.beats = Beats(path)
        self.process = subprocess.Popen(
            [*prefix, sys.executable, "-c", program], env={**os.environ, "NOTIFY_SOCKET": str(path)}
        )
        self.vitals = Vitals(self.process.pid, self.beats)

    def seconds_until_frozen(self, longest: float) -> float:
        """Look every PERIOD for at most `longest` seconds; infinity when it is not frozen then."""
        for number in range(round(longest / PERIOD)):
            if self.vitals.froze(PERIOD):
                assert self.process.poll() is None, f"it ended: {self.process.returncode}"
                return number * PERIOD
            time.sleep(PERIOD)
        return float("inf")

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        self.beats.close()


@pytest.fixture
def patient(tmp_path, wait_until):
    opened = []

    def open_patient(program: str, *prefix: str) -> Patient:
        found = Patient(tmp_path / "beats", program, *prefix)
        opened.append(found)
        if "beat()" in program:
            wait_until(lambda: not found.vitals.froze(0.0) and found.vitals.beater, "it has beaten")
        return found

    yield open_patient
    for each in opened:
        each.close()


def assert_frozen_within(least: float, most: float, patient, program: str) -> None:
    """Of four tries one must be: a program, and who looks how much it has worked, may be held up now and then."""
    tries = []
    while not any(least <= seconds <= most for seconds in tries):
        assert len(tries) < 4, f"frozen after {tries} s"
        opened = patient(program)
        tries.append(opened.seconds_until_frozen(3.0))
        opened.close()


def test_a_stopped_program_is_frozen_at_once_whether_it_beats_or_not(patient, wait_until):
    silent = patient("import time\ntime.sleep(60)")
    assert not silent.vitals.froze(PERIOD)
    silent.process.send_signal(signal.SIGSTOP)
    wait_until(lambda: vitals.state(silent.process.pid) == "T", "it is stopped")
    assert silent.vitals.froze(0.0)


def test_a_program_that_hangs_is_frozen_and_one_that_never_beat_is_not(patient):
    hanging = patient(BEGIN + HANGING)
    assert 0.4 <= hanging.seconds_until_frozen(3.0) <= 1.0
    hanging.close()
    assert patient("import time\ntime.sleep(60)").seconds_until_frozen(0.8) == float("inf")


def test_a_program_that_works_without_beating_gets_time_and_not_for_ever(patient, monkeypatch):
    monkeypatch.setattr(vitals, "PATIENCE", 0.5)
    assert_frozen_within(0.9, 1.5, patient, BEGIN + WORKING)


def test_background_threads_do_not_hide_a_loop_that_hangs(patient):
    thread = "\nthreading.Thread(target=lambda: [time.sleep(0.1) for _ in iter(int, 1)], daemon=True).start()"
    assert_frozen_within(0.0, 1.0, patient, BEGIN + thread + HANGING)


def test_a_loop_that_waits_as_announced_is_not_frozen(patient):
    assert patient(BEGIN + "beat(within=2.0)" + HANGING).seconds_until_frozen(1.2) == float("inf")


def test_both_processors_busy_restart_nothing(patient):
    starved = patient(BEGIN + BEATING, "chrt", "--idle", "0")  # runs when nobody else wants to
    others = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(3 * (os.cpu_count() or 1))]
    try:
        assert starved.seconds_until_frozen(1.5) == float("inf")
    finally:
        for other in others:
            other.kill()
            other.wait()


def test_a_watcher_that_was_kept_waiting_itself_blames_nobody(patient):
    hanging = patient(BEGIN + HANGING)
    assert not hanging.vitals.froze(60.0)
    assert LONGEST_STEP < 0.5


def test_a_child_does_not_beat_for_its_parent(patient, tmp_path):
    address = str(tmp_path / "beats")
    child = (
        f"import socket, time\ns = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)\n"
        f"while True:\n s.sendto(b'WATCHDOG=1', {address!r})\n time.sleep(0.05)"
    )
    program = f"\nimport subprocess, sys\nchild = subprocess.Popen([sys.executable, '-c', {child!r}])"
    parent = patient(BEGIN + program + HANGING, "setsid")
    try:
        assert parent.seconds_until_frozen(3.0) <= 1.5
    finally:
        os.killpg(parent.process.pid, signal.SIGKILL)


def test_start_times_tell_processes_of_the_same_number_apart():
    first = subprocess.Popen(["sleep", "60"])
    assert vitals.start_time(first.pid) > vitals.start_time(1) >= 0
    first.kill()
    first.wait()
    assert vitals.start_time(first.pid) == 0


def test_a_program_that_dies_again_and_again_waits_longer_and_longer():
    restarts, now, pauses = Restarts(), 100.0, []
    for _ in range(9):
        restarts.started(now)
        now += 0.1
        pauses.append(restarts.died(now))
        now += pauses[-1]
    assert pauses[0] == 0.0
    assert pauses == sorted(pauses) and pauses[-1] == pauses[-2] == LONGEST_PAUSE
    assert not restarts.worth_a_line
    restarts.started(now)
    assert restarts.died(now + STEADY_AFTER + 1.0) == 0.0 and restarts.worth_a_line


def test_what_happens_next_in_words():
    assert (what_next(0.0), what_next(0.5)) == ("starts again", "starts again in 0.5 s")
