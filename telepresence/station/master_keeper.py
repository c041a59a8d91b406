"""Runs a ROS master (`telepresence_ros.core`); when it dies or freezes, brings it back with its parameters and nodes.

Our own nodes register again automatically (`telepresence_ros.master_watch`). Others, a person's roscpp nodes for
example, are asked to shut down over their own slave API, and roslaunch (`respawn="true"`) starts them anew.
Everything goes over the documented Master, Parameter Server and Slave APIs: http://wiki.ros.org/ROS/Master_API.
"""

from __future__ import annotations

import contextlib
import http.client
import logging
import os
import signal
import subprocess
import sys
import threading
import time
import xmlrpc.client
from pathlib import Path
from subprocess import DEVNULL
from typing import Any
from urllib.parse import urlparse

from telepresence.station import processes, station_folder, takeover, vitals
from telepresence.station.absence import goes_on
from telepresence.station.adopted import Adopted
from telepresence.station.kept_program import Report
from telepresence.station.restarts import what_next
from telepresence.station.ros_master import ANONYMOUS, RESTARTED, master_answers, master_proxy
from telepresence.station.vitals import Beats, Vitals
from telepresence.temporary_folder import TemporaryFolder

log = logging.getLogger(__name__)

CALLER = "/master_keeper"
START_TIMEOUT = 15.0  # seconds; a cold disk takes several
RETURN_TIMEOUT = 3.0  # seconds within which nodes must register again on their own
RETURN_PERIOD = 0.25  # seconds between two questions who has
ADOPT_TIMEOUT = 2.0  # seconds in which a master that has run before answers, or another one takes its place
REMEMBER_PERIOD = 2.0  # seconds between two questions for what a new master must know
_OF_THE_MASTER_ITSELF = {"run_id", "rosversion", "rosdistro", "roslaunch"}
_ERRORS = (OSError, http.client.HTTPException, xmlrpc.client.Error)


class MasterKeeper:
    """Keeps a ROS master alive at `uri` (http://host:port) until closed: when it dies or freezes it starts again.

    Args:
        folder: For the socket where it beats; a temporary one by default.
        report: Gets each fault.
        station: Folder of a station that may have a master already, with which to go on; a new one is noted there.

    Raises:
        RuntimeError: No master answers within 15 s of starting one.
    """

    _process: subprocess.Popen | Adopted

    def __init__(
        self,
        uri: str,
        folder: Path | None = None,
        report: Report = lambda *fault: None,
        station: Path | None = None,
    ) -> None:
        self.uri = uri
        self._report, self._station = report, station
        self._end = contextlib.ExitStack()
        self._folder = folder or self._end.enter_context(TemporaryFolder("telepresence-master-"))
        self._beats = Beats(self._folder / "master")
        self.restarts = 0
        self.adopted = False
        """Whether it went on with a master that ran, and that knows its parameters."""
        self._reviving, self._revivals = False, 0
        self._parameters: dict = {}
        self._nodes: dict[str, str] = {}
        self._missing: dict[str, str] = {}
        self._revived_at = 0.0
        self._children: list[int] = []
        self._stop = threading.Event()
        self._start_master(takeover.adopted(station, takeover.MASTER) if station is not None else None)
        self._threads = [
            threading.Thread(target=self._watch, name="master-keeper", daemon=True),
            threading.Thread(target=self._remember_always, name="master-memory", daemon=True),
        ]
        for thread in self._threads:
            thread.start()

    @property
    def pid(self) -> int:
        """Process id of the roscore that runs now."""
        return self._process.pid

    def close(self) -> None:
        self._stop.set()
        for thread in self._threads:
            thread.join(timeout=START_TIMEOUT)
        processes.end(self._process)
        self._beats.close()
        self._end.close()

    def _start_master(self, running: Adopted | None = None) -> None:
        port = urlparse(self.uri).port or 11311
        # Tied to the thread that calls: to the main thread, or to ours, which ends in `close`, as roscore then does.
        command = [sys.executable, "-P", "-m", "telepresence_ros.core", "-p", str(port), "--watch", str(self._folder)]
        environment = {**os.environ, "NOTIFY_SOCKET": str(self._beats.path)}
        if running is not None and not master_answers(self.uri, timeout=ADOPT_TIMEOUT):
            running.kill()
            running.wait()
            running = None
        self.adopted = running is not None
        self._process = running or processes.start(
            command, tied=not goes_on(), stdin=DEVNULL, stdout=DEVNULL, stderr=DEVNULL, env=environment
        )
        if self._station is not None:
            takeover.note(self._station, takeover.MASTER, self._process.pid)
        self._vitals = Vitals(self._process.pid, self._beats)
        deadline = time.monotonic() + START_TIMEOUT
        while self._end_another() or not master_answers(self.uri):
            if self._process.poll() is not None or time.monotonic() > deadline:
                raise RuntimeError(f"roscore did not start on port {port}; is the port taken? Try:  ./stack doctor")
            self._stop.wait(0.05)

    def _end_another(self) -> bool:
        """End a master at our address that a program below us has started, and say whether there was one. A plain
        roslaunch does that in a terminal of the station when it finds none: it would keep ours from coming back."""
        try:
            pid = master_proxy(self.uri).getPid(CALLER)[2]
        except _ERRORS:
            return False
        if pid == self._process.pid:
            return False
        if pid not in processes.descendants() and not (self._station and station_folder.belongs(pid, self._station)):
            return False
        log.warning("a program in the station has started a roscore of its own meanwhile, which is ended")
        return processes.send(pid, signal.SIGKILL)

    def _watch(self) -> None:
        looked = time.monotonic()
        while not self._stop.wait(vitals.PERIOD):
            elapsed, looked = time.monotonic() - looked, time.monotonic()
            if self._vitals.froze(elapsed):
                self._process.kill()
                self._revive("froze")
            elif (code := self._process.poll()) is not None:
                self._revive(vitals.cause(code))

    def _remember_always(self) -> None:
        remember_at = 0.0
        while not self._stop.is_set():
            if self._missing:
                self._restart_strangers()
            elif time.monotonic() >= remember_at:
                self._remember()
                remember_at = time.monotonic() + REMEMBER_PERIOD
            self._stop.wait(RETURN_PERIOD)

    def _remember(self) -> None:
        revivals = self._revivals
        try:
            master: Any = master_proxy(self.uri, timeout=1.0)  # XML-RPC answers have no types
            state = master.getSystemState(CALLER)[2]
            names = {node for group in state for _, nodes in group for node in nodes if not ANONYMOUS.search(node)}
            nodes = {name: master.lookupNode(CALLER, name)[2] for name in names if name != "/rosout"}
            parameters = master.getParam(CALLER, "/")[2]
        except _ERRORS as error:
            log.debug("the master did not answer while it was asked for its state: %s", error)
            return
        if self._reviving or self._missing or self._revivals != revivals:
            return  # what a new master knows before everybody has registered again
        self._children = processes.descendants(self._process.pid)
        self._nodes = {name: uri for name, uri in nodes.items() if uri}
        self._parameters = {key: value for key, value in parameters.items() if key not in _OF_THE_MASTER_ITSELF}

    def _revive(self, what: str) -> None:
        self._reviving, self._revivals = True, self._revivals + 1
        log.warning("roscore %s; it starts again", what)
        self._report("rosmaster", what, what_next(0.0))
        processes.end(self._process, patience=1.0)
        # A killed core leaves its rosout, which holds the name.
        for pid in self._children:
            processes.send(pid, signal.SIGKILL)
        try:
            self._start_master()
            master = master_proxy(self.uri, timeout=2.0)
            for key, value in self._parameters.items():
                master.setParam(CALLER, f"/{key}", value)
        except (RuntimeError, *_ERRORS) as error:
            log.error("roscore could not be brought back, trying again: %s", error)
            self._process.kill()  # one that knows half of the parameters is no help
            return
        self._missing, self._revived_at = self._missing | self._nodes, time.monotonic()
        self._reviving = False
        self.restarts += 1
        log.warning("roscore is back")

    def _restart_strangers(self) -> None:
        """Shut down nodes that have not registered again in time; roslaunch respawns them. Called again and again, as
        the new master may die, too, while they are waited for."""
        missing = self._missing  # another one after another restart
        for name in list(missing):
            try:
                master: Any = master_proxy(self.uri, timeout=1.0)  # XML-RPC answers have no types
                if master.lookupNode(CALLER, name)[0] == 1:
                    del missing[name]
            except _ERRORS:
                return
        if missing is not self._missing or time.monotonic() < self._revived_at + RETURN_TIMEOUT:
            return
        for name, uri in missing.items():
            log.info("%s does not know the new master; asking it to restart", name)
            try:
                master_proxy(uri, timeout=1.0).shutdown(CALLER, RESTARTED)
            except _ERRORS:
                continue  # it is gone already
        if missing is self._missing:
            self._missing = {}
