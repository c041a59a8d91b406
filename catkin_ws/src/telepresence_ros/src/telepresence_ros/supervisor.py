"""What `telepresence_ros.roslaunch` puts in the place of parts of Debian's roslaunch, which this imports."""

from __future__ import annotations

import telepresence_ros.without_numpy  # noqa: F401  before genpy

# isort: split

import contextlib
import os
import signal
import subprocess
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import roslaunch
import roslaunch.config
import roslaunch.core
import roslaunch.launch
import roslaunch.nodeprocess
import roslaunch.parent
import roslaunch.pmon
from rosgraph.names import load_mappings, ns_join

from telepresence.station import heartbeat, program_registry
from telepresence.station.absence import Absence
from telepresence.station.faults import SOCKET, FaultReporter
from telepresence.station.launch_settings import arguments_of
from telepresence_ros.forked_process import NodeStarter
from telepresence_ros.node_monitor import FAULTS, NodeMonitor
from telepresence_ros.sockets import narrow_sockets
from telepresence_ros.watched_node import WatchedNode

CLOSABLE = "TELEPRESENCE_CLOSABLE"
ENDS_FIRST = "TELEPRESENCE_ENDS_FIRST"
"""Marks a node in a launch file, as Debian's roslaunch knows no such attribute and ignores the mark."""


class Supervisor(roslaunch.parent.ROSLaunchParent):
    """roslaunch's parent, with one more node, which says that everything was started."""

    folder: Path

    def _load_config(self) -> None:
        super()._load_config()
        require_known_arguments(self.roslaunch_files, sys.argv)
        node = roslaunch.core.Node(
            "telepresence_ros", "station_faults", FAULTS.strip("/"), args=str(self.folder / SOCKET), respawn=True
        )
        self.config.add_node(node, verbose=False)
        node.machine = self.config.machines[""]

    def start(self, auto_terminate: bool = True) -> None:
        """Start as the base class does; then end left-over programs that no node of the launch file continues."""
        super().start(auto_terminate)
        names = {ns_join(node.namespace, node.name) for node in self.config.nodes}
        for left in program_registry.everything(self.folder):
            if left.name not in names and left.lives:
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(os.getpgid(left.pid), signal.SIGKILL)
        heartbeat.notify("READY=1")


def require_known_arguments(launch_files: Iterable[str], command_line: Sequence[str]) -> None:
    """Raise roslaunch's RLException when no launch file has an argument that the command line sets: roslaunch itself
    would ignore it."""
    known = set().union(*(arguments_of(Path(launch_file)) for launch_file in launch_files))
    for name in load_mappings(command_line):
        if name not in known and not name.startswith("__"):  # __name, __ns and __log are roslaunch's own
            raise roslaunch.core.RLException(f"there is no argument '{name}'; arguments: {', '.join(sorted(known))}")


def run(folder: Path, station: int | None, starter: NodeStarter, waits: bool = False) -> None:
    """Run roslaunch with the arguments of the command line; takes what `supervise` takes."""
    narrow_sockets()
    supervise(folder, station, starter, waits)
    roslaunch.main()


def supervise(folder: Path, station: int | None, starter: NodeStarter, waits: bool = False) -> None:
    """Replace those parts of roslaunch that start, watch and restart nodes.

    Args:
        folder: Of the station's watch.
        station: Process id of the `./stack up` that has started us, if one has.
        starter: Starts the nodes.
        waits: The nodes go on while that `./stack up` is away (`telepresence.station.absence`).
    """

    def make_process(run_id: str, node: roslaunch.core.Node, master_uri: str, **timeouts: float) -> WatchedNode:
        process: Any = original(run_id, node, master_uri, **timeouts)
        asked = {name for name, value in node.env_args if value == "true"}
        name = ns_join(node.namespace, node.name)
        return WatchedNode(process, name, folder, closable=CLOSABLE in asked, ends_first=ENDS_FIRST in asked)

    original = roslaunch.nodeprocess.create_node_process
    roslaunch.launch.create_node_process = make_process
    roslaunch.nodeprocess.subprocess = SimpleNamespace(Popen=starter.start, PIPE=subprocess.PIPE)
    roslaunch.pmon.ProcessMonitor = NodeMonitor
    NodeMonitor.faults = FaultReporter(folder / SOCKET)
    NodeMonitor.station, NodeMonitor.starter = station, starter
    NodeMonitor.absence = Absence(folder.parent) if station is not None and waits else None
    Supervisor.folder = folder
    if station is not None:
        # The station's master has its parameters and `rosout`. roscore.xml would have them asked for by two commands.
        roslaunch.config.load_roscore = lambda *_arguments, **_options: None
    roslaunch.parent.ROSLaunchParent = Supervisor
