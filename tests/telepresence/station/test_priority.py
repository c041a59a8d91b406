"""What is on the way of a command comes first, as far as that is allowed, and cannot freeze the machine."""

import os
import subprocess
import sys

from telepresence.station import priority

ASK = """
import os, sys, threading
from telepresence.station import priority
got = priority.put_commands_first()
policies = []
thread = threading.Thread(target=lambda: policies.append(os.sched_getscheduler(0)))
thread.start(); thread.join()
print(got, policies[0] == os.SCHED_RR, os.getpriority(os.PRIO_PROCESS, 0) < 0)
"""
RUN_AWAY = """
import os, time
from telepresence.station import priority
priority.put_commands_first()
end = time.monotonic() + 20
while os.sched_getscheduler(0) == os.SCHED_RR and time.monotonic() < end:
    pass
print(os.sched_getscheduler(0) == os.SCHED_OTHER)
"""


def run(code: str, *before: str, **environment: str) -> subprocess.CompletedProcess[str]:
    words = [*before, sys.executable, "-c", code]
    return subprocess.run(words, capture_output=True, text=True, timeout=60, env={**os.environ, **environment})


def test_a_program_gets_what_is_allowed_and_its_threads_too():
    answer = run(ASK)
    assert answer.stdout.strip() in ("SCHED_RR True False", "nice -5 False True", "ordinary False False"), answer.stderr


def test_where_nothing_is_allowed_it_stays_an_ordinary_program():
    if os.geteuid() == 0:
        before = ["setpriv", "--bounding-set=-sys_nice", "--inh-caps=-sys_nice"]
    else:
        before = ["prlimit", "--rtprio=0", "--nice=20"]
    assert run(ASK, *before).stdout == "ordinary False False\n"
    assert run(ASK, TELEPRESENCE_PRIORITY="off").stdout == "ordinary False False\n"


def test_a_thread_that_runs_away_becomes_an_ordinary_one():
    answer = run(RUN_AWAY)
    assert answer.stdout == "True\n", answer.stderr
    if "SCHED_RR" in run(ASK).stdout:
        assert "no real-time priority any more" in answer.stderr


def test_what_nobody_waits_for_steps_back_and_never_forward():
    code = "import os; from telepresence.station import priority; priority.step_back(); print(os.nice(0))"
    assert run(code).stdout == f"{max(priority.BACKGROUND, os.nice(0))}\n"
    assert run(code, "nice", "-n", "15").stdout == f"{min(19, max(15, os.nice(0) + 15))}\n"


def test_to_ask_what_is_allowed_changes_nothing():
    before = os.sched_getscheduler(0), os.nice(0)
    assert priority.allowed() in ("SCHED_RR", "nice -5", "ordinary")
    assert (os.sched_getscheduler(0), os.nice(0)) == before
