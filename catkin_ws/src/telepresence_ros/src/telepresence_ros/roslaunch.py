"""Runs Debian's roslaunch as the supervisor of its nodes: `python -m telepresence_ros.roslaunch ARGUMENT ...`.

It takes the arguments of roslaunch and any launch file. What differs:

* a node with respawn="true" that dies or freezes starts again at once (`telepresence_ros.node_monitor`), and so does
  one with <env name="TELEPRESENCE_CLOSABLE" value="true" />, unless it ends with exit code 0: a person has closed it;
* a node with <env name="TELEPRESENCE_ENDS_FIRST" value="true" /> is ended before the others: it brings a robot to rest;
* each such fault is published on /station/faults, by the node station_faults that it starts besides;
* nodes that an earlier one has started in the same station, and that still run, go on;
* nodes that are scripts for this Python are forked, and so start sooner (`telepresence_ros.fork_server`);
* the sockets of this process listen only where they must.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

from telepresence.station import absence
from telepresence.temporary_folder import TemporaryFolder
from telepresence_ros.forked_process import NodeStarter

FOLDER = "TELEPRESENCE_WATCH"
"""Environment variable: the folder of the station's watch. Without it the nodes are not adopted by anybody."""


def main() -> None:
    """Run roslaunch with the arguments of the command line."""
    station = os.getppid() if FOLDER in os.environ else None
    waits = absence.goes_on()
    os.environ.pop(absence.VARIABLE, None)  # nobody starts the stations again that a person starts in a terminal here
    with watch_folder() as folder, contextlib.closing(NodeStarter()) as starter:
        # Imported now: what forks the nodes imports at the same time what they need.
        from telepresence_ros import supervisor

        supervisor.run(folder, station, starter, waits)


@contextlib.contextmanager
def watch_folder() -> Iterator[Path]:
    """The folder of the station's watch, or one of our own until the end."""
    if given := os.environ.pop(FOLDER, ""):  # not for the nodes: a roslaunch that a person starts there is another one
        yield Path(given)
        return
    with TemporaryFolder("telepresence-watch-") as own:
        yield own


if __name__ == "__main__":
    main()
