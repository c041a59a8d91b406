"""Runs a ROS master (`telepresence_ros.core`) and brings it back when it dies, with its parameters and nodes.

Our own nodes register again automatically (`telepresence_ros.master_watch`). Others, a person's roscpp nodes for
example, are asked to shut down over their own slave API, and roslaunch (`respawn="true"`) starts them anew.
Everything goes over the documented Master, Parameter Server and Slave APIs: http://wiki.ros.org/ROS/Master_API.
"""

from __future__ import annotations

import http.client
import logging
import re
import signal
import sys
import threading
import time
import xmlrpc.client
from subprocess import DEVNULL
from typing import Any
from urllib.parse import urlparse

from telepresence.station import processes
from telepresence.station.ros_master import master_answers, master_proxy

log = logging.getLogger(__name__)

CALLER = "/master_keeper"
START_TIMEOUT = 15.0  # seconds; a cold disk takes several
RETURN_TIMEOUT = 3.0  # seconds within which nodes must register again on their own
PERIOD = 0.25
REMEMBER_PERIOD = 2.0
_OF_THE_MASTER_ITSELF = {"run_id", "rosversion", "rosdistro", "roslaunch"}
_TOOL = re.compile(r"_\d+(_\d+)?$")  # anonymous names: rostopic, rosnode, a person's scripts
_ERRORS = (OSError, http.client.HTTPException, xmlrpc.client.Error)


class MasterKeeper:
    """Keeps a ROS master alive at `uri` (http://host:port) until closed.

    Raises:
        RuntimeError: No master answers within 15 s of starting one.
    """

    def __init__(self, uri: str) -> None:
        self.uri = uri
        self.restarts = 0
        self._parameters: dict = {}
        self._nodes: dict[str, str] = {}
        self._missing: dict[str, str] = {}
        self._revived_at = 0.0
        self._children: list[int] = []
        self._stop = threading.Event()
        self._start_master()
        self._thread = threading.Thread(target=self._run, name="master-keeper", daemon=True)
        self._thread.start()

    @property
    def pid(self) -> int:
        """Process id of the roscore that runs now."""
        return self._process.pid

    @property
    def remembered_nodes(self) -> frozenset[str]:
        """Names of the nodes that will be looked for after a restart."""
        return frozenset(self._nodes)

    def close(self) -> None:
        self._stop.set()
        self._thread.join(timeout=START_TIMEOUT)
        processes.end(self._process)

    def _start_master(self) -> None:
        port = urlparse(self.uri).port or 11311
        # Tied to the thread that calls: to the main thread, or to ours, which ends in `close`, as roscore then does.
        command = [sys.executable, "-m", "telepresence_ros.core", "-p", str(port)]
        self._process = processes.start(command, tied=True, stdin=DEVNULL, stdout=DEVNULL, stderr=DEVNULL)
        deadline = time.monotonic() + START_TIMEOUT
        while not master_answers(self.uri):
            if self._process.poll() is not None or time.monotonic() > deadline:
                raise RuntimeError(f"roscore did not start on port {port}; is the port taken? Try:  ./stack doctor")
            self._stop.wait(0.05)

    def _run(self) -> None:
        remember_at = 0.0
        while not self._stop.wait(PERIOD):
            if self._process.poll() is not None or not master_answers(self.uri, timeout=1.0):
                if not self._stop.is_set():
                    self._revive()
            elif time.monotonic() > remember_at:
                self._remember()
                remember_at = time.monotonic() + REMEMBER_PERIOD
            if self._missing:
                self._restart_strangers()

    def _remember(self) -> None:
        try:
            master: Any = master_proxy(self.uri, timeout=1.0)  # XML-RPC answers have no types
            state = master.getSystemState(CALLER)[2]
            names = {node for group in state for _, nodes in group for node in nodes if not _TOOL.search(node)}
            nodes = {name: master.lookupNode(CALLER, name)[2] for name in names if name != "/rosout"}
            parameters = master.getParam(CALLER, "/")[2]
        except _ERRORS as error:
            log.debug("the master did not answer while it was asked for its state: %s", error)
            return
        self._children = processes.descendants(self._process.pid)
        self._nodes = {name: uri for name, uri in nodes.items() if uri}
        self._parameters = {key: value for key, value in parameters.items() if key not in _OF_THE_MASTER_ITSELF}

    def _revive(self) -> None:
        log.warning("roscore died; starting it again")
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
            return
        self._missing, self._revived_at = self._missing | self._nodes, time.monotonic()
        self.restarts += 1
        log.warning("roscore is back")

    def _restart_strangers(self) -> None:
        """Shut down nodes that have not registered again in time; roslaunch respawns them. Called again and again, as
        the new master may die, too, while they are waited for."""
        for name in list(self._missing):
            try:
                master: Any = master_proxy(self.uri, timeout=1.0)  # XML-RPC answers have no types
                if master.lookupNode(CALLER, name)[0] == 1:
                    del self._missing[name]
            except _ERRORS:
                return
        if time.monotonic() < self._revived_at + RETURN_TIMEOUT:
            return
        for name, uri in self._missing.items():
            log.info("%s does not know the new master; asking it to restart", name)
            try:
                master_proxy(uri, timeout=1.0).shutdown(CALLER, "the ROS master was restarted")
            except _ERRORS:
                continue  # it is gone already
        self._missing = {}
