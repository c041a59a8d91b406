"""What the station keeps running starts again after death and freezing, and says so."""

import os
import signal
import subprocess
import sys
import time

import pytest

from telepresence.station import processes, restarts, vitals
from telepresence.station.faults import FaultListener, FaultReporter
from telepresence.station.kept_program import KeptProgram
from telepresence.station.vitals import PERIOD, Beats

BEATING = "import time\nfrom telepresence.station.heartbeat import beat\nwhile True:\n beat()\n time.sleep(0.02)"


@pytest.fixture
def kept(tmp_path):
    """A program that beats, and the faults that were reported of it."""
    beats = Beats(tmp_path / "beats")
    faults = []

    def start() -> subprocess.Popen:
        environment = {**os.environ, "NOTIFY_SOCKET": str(beats.path)}
        return processes.start([sys.executable, "-c", BEATING], env=environment)

    program = KeptProgram("worker", start, lambda *fault: faults.append(fault), beats, lambda code: code >= 0)
    yield program, faults
    program.close(patience=5.0)


def test_what_dies_or_freezes_starts_again(kept, wait_until):
    program, faults = kept
    first = program.pid
    os.kill(first, signal.SIGKILL)
    wait_until(lambda: program.poll(PERIOD) is None and program.pid != first, "it starts again")
    second = program.pid
    os.kill(second, signal.SIGSTOP)
    wait_until(lambda: program.poll(PERIOD) is None and program.pid != second, "it starts again once more")
    assert faults[0] == ("worker", "died: signal 9", "starts again")
    assert faults[1][:2] == ("worker", "froze")
    assert vitals.start_time(second) == 0


def test_what_was_asked_to_end_stays_away(wait_until):
    program = KeptProgram("short", lambda: processes.start(["false"]), pytest.fail, ended=lambda code: code >= 0)
    assert wait_until(lambda: program.poll(PERIOD), "it ends") == 1


def test_what_cannot_be_started_is_tried_again_later(wait_until):
    attempts = []

    def start() -> subprocess.Popen:
        attempts.append(time.monotonic())
        if len(attempts) > 1:
            raise RuntimeError("there is no display")
        return processes.start(["false"])

    program = KeptProgram("hopeless", start, lambda *fault: None)
    wait_until(lambda: program.poll(PERIOD) is None and len(attempts) == 2, "it is tried again")
    for _ in range(5):
        assert program.poll(PERIOD) is None
    assert len(attempts) == 2


def test_what_never_does_what_it_is_for_waits_longer_and_longer_however_long_it_tries(monkeypatch, wait_until):
    monkeypatch.setattr(restarts, "STEADY_AFTER", 0.0)
    faults = []
    program = KeptProgram(
        "hopeless", lambda: processes.start(["false"]), lambda *fault: faults.append(fault[2]), ready=lambda: False
    )
    wait_until(lambda: program.poll(PERIOD) is None and len(faults) == 3, "it dies three times")
    assert faults == ["starts again", "starts again in 0.5 s", "starts again in 1 s"]


def test_faults_wait_for_a_listener_and_come_in_their_order(tmp_path):
    reporter = FaultReporter(tmp_path / "faults")
    reporter.report("/first", "froze", "starts again")
    listener = FaultListener(tmp_path / "faults")
    reporter.report("/second", "died: signal 9", "starts again in 2 s")
    found = [listener.next(5.0), listener.next(5.0)]
    assert [(fault.program, fault.next) for fault in found] == [
        ("/first", "starts again"),
        ("/second", "starts again in 2 s"),
    ]
    assert listener.next(0.01) is None
    listener.close()
    reporter.close()


def test_orphans_are_collected_and_other_peoples_children_are_not(wait_until):
    child = subprocess.Popen(["true"])
    wait_until(lambda: vitals.state(child.pid) == "Z", "it has ended")
    processes.reap_orphans({child.pid})
    assert child.wait() == 0
    orphan = subprocess.Popen(["true"])
    wait_until(lambda: vitals.state(orphan.pid) == "Z", "it has ended")
    processes.reap_orphans(set())
    assert vitals.state(orphan.pid) == ""
    orphan.wait()
