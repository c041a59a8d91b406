"""Which programs the processors serve first when other programs keep them busy. Standard library only.

What is on the way of a command, from the pilot's machine to the wheels, asks for the real-time class SCHED_RR with the
lowest priority in it (sched(7)): it waits for no ordinary program. Where that is not allowed it asks for a negative
niceness, and where that is not allowed either it stays as it is. What nobody waits for (recording, the page with the
window's picture) steps back.

A real-time thread that runs away would freeze a machine. So one that computes for `RUNAWAY` seconds without waiting
for anything loses its class (RLIMIT_RTTIME, SIGXCPU, getrlimit(2)), and one that cannot even notice that is killed.

Who may use SCHED_RR: a user with RLIMIT_RTPRIO of at least `PRIORITY`, that is `@GROUP - rtprio 5` in a file of
/etc/security/limits.d or `LimitRTPRIO=5` in a systemd unit, and root.
"""

from __future__ import annotations

import contextlib
import gc
import os
import resource
import signal
import sys
from types import FrameType

PRIORITY = 1
"""Priority for SCHED_RR, 1 to 99: lower than any of the system's own real-time threads, including those for sound."""
ALLOWED = 5
"""What RLIMIT_RTPRIO is to be set to; others on the machine may want to be above us."""
NICENESS = -5
"""Where SCHED_RR is not allowed."""
BACKGROUND = 10
"""Niceness of what nobody waits for."""
RUNAWAY = 0.5
"""Seconds of computing without a wait after which a real-time thread becomes an ordinary one."""
KILLED = 2.0
"""Seconds of it after which its program is killed: it could not even notice that."""
SWITCH_INTERVAL = 0.001
"""Seconds after which a Python thread lets another one have the interpreter: with several threads computing, the one
that has a command waits for them so long at most; Python's own is 0.005."""
_NOBODY = 65534
_RLIMIT_RTTIME = 15
"""linux/resource.h; in microseconds. Python's resource module has no name for it."""
OFF = "TELEPRESENCE_PRIORITY"
"""Environment variable; with the value "off" everything stays an ordinary program."""


def put_commands_first() -> str:
    """Make this program one that is on the way of a command: call it at the start, on the main thread. Threads, and
    programs, that it starts afterwards are the same.

    The objects that exist now are taken out of garbage collection too: to go through those of rospy and its messages
    takes tens of milliseconds, in which no command is served.

    Returns:
        What was allowed: "SCHED_RR", "nice -5" or "ordinary".
    """
    sys.setswitchinterval(SWITCH_INTERVAL)
    exempt_from_collection()
    if os.environ.get(OFF) == "off":
        return "ordinary"
    _limit_runaways()
    return put_thread_first()


def exempt_from_collection() -> None:
    """Take the objects that exist now out of garbage collection."""
    gc.collect()
    gc.freeze()
    gc.collect()  # or Python goes on counting them, and looks through new objects only when there are a quarter as many


def put_thread_first(children_too: bool = True) -> str:
    """Put the calling thread first; see `put_commands_first`. Where that was not called, the thread must itself pause
    when it is late: nothing else ends it.

    Args:
        children_too: Threads and programs that this one starts are the same.
    """
    if os.environ.get(OFF) == "off":
        return "ordinary"
    try:
        policy = os.SCHED_RR if children_too else os.SCHED_RR | os.SCHED_RESET_ON_FORK
        os.sched_setscheduler(0, policy, os.sched_param(PRIORITY))
    except (OSError, ValueError):  # EPERM: not allowed, or the control group has no real-time share
        try:
            os.setpriority(os.PRIO_PROCESS, 0, NICENESS)
        except OSError:
            return "ordinary"
        return f"nice {NICENESS}"
    return "SCHED_RR"


def step_back() -> None:
    """Let the calling program, or thread, wait for all others."""
    with contextlib.suppress(OSError):  # it has stepped back further already
        os.setpriority(os.PRIO_PROCESS, 0, max(BACKGROUND, os.getpriority(os.PRIO_PROCESS, 0)))


def allow() -> None:
    """Allow SCHED_RR and a negative niceness to what this process becomes: for root, who then becomes another user."""
    for limit, value in ((resource.RLIMIT_RTPRIO, ALLOWED), (resource.RLIMIT_NICE, 20 - NICENESS)):
        soft, hard = resource.getrlimit(limit)
        with contextlib.suppress(OSError, ValueError):  # root of a container may not
            resource.setrlimit(limit, (max(soft, value), max(hard, value)))


def allowed() -> str:
    """Return what a program of this user would get, see `put_commands_first`; nothing changes."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:  # in a process of its own: an ordinary program could not go back to its niceness
        if os.geteuid() == 0:  # as the station does
            allow()
            os.setuid(_NOBODY)
        os.write(writer, put_thread_first().encode())
        os._exit(0)
    os.close(writer)
    with os.fdopen(reader) as answer:
        found = answer.read()
    os.waitpid(child, 0)
    return found


def _limit_runaways() -> None:
    signal.signal(signal.SIGXCPU, _become_ordinary)
    _, hard = resource.getrlimit(_RLIMIT_RTTIME)
    wanted = int(KILLED * 1e6) if hard == resource.RLIM_INFINITY else hard
    resource.setrlimit(_RLIMIT_RTTIME, (min(int(RUNAWAY * 1e6), wanted), wanted))


def _become_ordinary(_signal: int, _frame: FrameType | None) -> None:
    """Take the real-time class from every thread of this process."""
    for thread in os.listdir("/proc/self/task"):
        with contextlib.suppress(ProcessLookupError):  # it has just ended
            os.sched_setscheduler(int(thread), os.SCHED_OTHER, os.sched_param(0))
    print(f"a thread computed for {RUNAWAY:g} s without a pause: no real-time priority any more", file=sys.stderr)
