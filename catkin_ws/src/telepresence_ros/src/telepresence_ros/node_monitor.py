"""roslaunch's monitor, watching more closely: who dies or freezes starts again at once.

Debian's monitor looks ten times a second who has died, waits `respawn_delay`, and knows nothing of freezing. This one
is woken by a death (pidfd_open(2)), and looks every 0.05 s who froze (`telepresence.station.vitals`). A program that
dies again and again starts later and later, and only then `respawn_delay` counts: as the shortest pause. `required`
means what it means in roslaunch.
"""

from __future__ import annotations

import os
import select
import signal
import time

from roslaunch import pmon
from roslaunch.core import RLException, printerrlog, printlog_bold

from telepresence.station import heartbeat
from telepresence.station.absence import Absence
from telepresence.station.faults import FaultReporter
from telepresence.station.restarts import LONGEST_PAUSE, Restarts, what_next
from telepresence.station.vitals import PERIOD, start_time, state
from telepresence_ros.forked_process import NodeStarter
from telepresence_ros.watched_node import WatchedNode

ENDING_TIMEOUT = 15.0
"""Seconds in which all nodes end at the latest: so long no beat of ours is due."""
FAULTS = "/station_faults"
"""The node that publishes faults; ended when all others have ended, as what ends them may be one."""
STATION = "stack up"
"""What `./stack up` is called in faults."""
FORK_SERVER = "fork_server"
"""And what forks the nodes."""


class NodeMonitor(pmon.ProcessMonitor):
    """Watches the nodes from a thread of its own, as roslaunch wants it, and reports faults."""

    faults: FaultReporter | None = None
    """Where faults go."""
    starter: NodeStarter | None = None
    """What starts the nodes."""
    station: int | None = None
    """Process id of the `./stack up` that started us; None: we were started alone."""
    absence: Absence | None = None
    """Of that `./stack up`, where another one takes its place and the nodes go on meanwhile."""

    def __init__(self, name: str = "NodeMonitor") -> None:
        super().__init__(name)
        self._restarts: dict[pmon.Process, Restarts] = {}
        self._due: dict[pmon.Process, float] = {}
        self._station_stands = False

    def _run(self) -> None:
        """Watch until the end; the base class calls this in the thread, and ends all nodes afterwards."""
        looked = time.monotonic()
        while not self.is_shutdown:
            heartbeat.beat()
            for number in pmon._signal_list:
                if signal.getsignal(number) != pmon.rl_signal:
                    self.reacquire_signals.add(number)
            now = time.monotonic()
            self._look_at_station()
            self._look_at_starter()
            self._poll(now, now - looked)
            looked = now
            for process in [process for process, due in self._due.items() if due <= now]:
                self._start_again(process)
            if self.faults is not None:
                self.faults.flush()
            self._wait(PERIOD)
        heartbeat.beat(within=ENDING_TIMEOUT)
        if self._lost_station() and self.faults is not None:
            self.faults.report(STATION, "died", "takes everything with it")  # the kernel has interrupted us

    def _post_run(self) -> None:
        """End all nodes, in tens, those first that bring a robot to rest: it shall not drive until the others have
        ended."""
        with self.plock:
            nodes = [process for process in self.procs if isinstance(process, WatchedNode)]
            self.core_procs += [node for node in nodes if node.node == FAULTS]  # they come last, one by one
            self.procs.sort(key=lambda process: isinstance(process, WatchedNode) and process.ends_first)
        super()._post_run()  # goes through the others backwards

    def _look_at_station(self) -> None:
        """Report that who started us was stopped. It is for others to end it (systemd): the nodes need us, not it. End
        when it has died and nobody has started another one."""
        if self.absence is not None and self.station is not None and not start_time(self.station):
            self.station = self.absence.owner or self.station
        stands = self.station is not None and state(self.station) == "T"
        if stands and not self._station_stands and self.faults is not None:
            self.faults.report(STATION, "froze", "is not waited for: everything goes on")
        self._station_stands = stands
        if self.absence is not None:
            if self.absence.begins() and self.faults is not None:
                self.faults.report(STATION, "died", what_next(0.0))
            if self.absence.too_long():
                self.is_shutdown = True

    def _lost_station(self) -> bool:
        """Whether the station that started us has died. The kernel says so when its first thread has ended; as long as
        another one has not, it is our parent still."""
        if self.absence is not None:
            return self.absence.too_long()
        return self.station is not None and (os.getppid() != self.station or not start_time(self.station))

    def _look_at_starter(self) -> None:
        """Report that what forks the nodes died or froze; the nodes themselves go on."""
        found = self.starter.poll() if self.starter is not None else None
        if found is not None and self.faults is not None:
            self.faults.report(FORK_SERVER, *found)

    def _poll(self, now: float, elapsed: float) -> None:
        with self.plock:
            processes = self.procs[:]
        for process in processes:
            if self.is_shutdown:
                return
            if process in self._due:
                continue
            if not process.is_alive():
                self._on_death(process, now)
            elif process.respawn and isinstance(process, WatchedNode) and process.froze(elapsed):
                process.kill_frozen()
                if not process.is_alive():
                    self._on_death(process, now)

    def _on_death(self, process: pmon.Process, now: float) -> None:
        for listener in self.listeners:
            listener.process_died(process.name, process.exit_code)
        if process.required:
            line = "=" * 80
            printerrlog(
                f"{line}REQUIRED process [{process.name}] has died!\n{process.get_exit_description()}\n"
                f"Initiating shutdown!\n{line}"
            )
            self._report(process, "everything ends")
            self.is_shutdown = True
        elif process.respawn and not _was_closed(process):
            self._bury(process)
            restarts = self._restarts.setdefault(process, Restarts())
            pause = restarts.died(now)
            if pause:
                pause = max(pause, process.respawn_delay)
            self._due[process] = now + pause
            then = what_next(pause)
            if restarts.worth_a_line:
                keeps = ": it keeps dying, and no more is said about it" if restarts.quick_deaths == 2 else ""
                printerrlog(f"[{process.name}] {_cause(process)}; {then}{keeps}")
            self._report(process, then)
        else:
            say = printerrlog if process.exit_code else printlog_bold
            say(f"[{process.name}] {process.get_exit_description()}")
            if process.exit_code:
                self._report(process, "stays away")
            self._bury(process)
            self.unregister(process)
            with self.plock:
                self.dead_list.append(pmon.DeadProcess(process))
            if self._registrations_complete and not self.procs:
                printlog_bold("all processes on machine have died, roslaunch will exit")
                self.is_shutdown = True

    def _start_again(self, process: pmon.Process) -> None:
        if self.is_shutdown:
            return
        now = time.monotonic()
        self._restarts[process].started(now)
        try:
            process.start()
            del self._due[process]
        except (OSError, RLException) as error:
            printerrlog(f"[{process.name}] cannot be started, trying again: {error}")
            self._due[process] = now + LONGEST_PAUSE

    def _bury(self, process: pmon.Process) -> None:
        process.bury() if isinstance(process, WatchedNode) else process.stop([])

    def _report(self, process: pmon.Process, then: str) -> None:
        if self.faults is not None:
            name = process.node if isinstance(process, WatchedNode) else process.name
            self.faults.report(name, _cause(process), then)

    def _wait(self, timeout: float) -> None:
        """Wait for a death, at most `timeout` seconds and until the next start is due."""
        deaths = select.poll()
        with self.plock:
            for process in self.procs:
                if isinstance(process, WatchedNode) and process.descriptor is not None and process not in self._due:
                    deaths.register(process.descriptor, select.POLLIN)
        if self._due:
            timeout = min(timeout, max(0.0, min(self._due.values()) - time.monotonic()))
        deaths.poll(timeout * 1000.0)


def _was_closed(process: pmon.Process) -> bool:
    return isinstance(process, WatchedNode) and process.was_closed


def _cause(process: pmon.Process) -> str:
    return process.cause if isinstance(process, WatchedNode) else "died"
