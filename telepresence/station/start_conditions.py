"""What `./stack up` makes sure of before it starts anything: room to write, enough descriptors, no other station, no
stranger who reaches ROS.

What can be helped is helped and said; for the rest a RuntimeError says what to do.
"""

from __future__ import annotations

import http.client
import os
import resource
import shutil
import sys
import tempfile
import threading
import time
import xmlrpc.client
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from telepresence.station import firewall
from telepresence.station.listening_sockets import listening
from telepresence.station.own_addresses import is_ours
from telepresence.station.ros_master import master_answers, master_proxy

LEAST_ROOM = 64 * 1024 * 1024
"""[bytes] for temporary files: the virtual display's screen, the tablet's browser, the simulated robot's disk."""
LEAST_LOG_ROOM = 16 * 1024 * 1024
"""[bytes] for logs of a few hours."""
DESCRIPTORS = 1024
"""Open files and sockets of one program: the usual limit, of which the master of both robots needs a fifth."""
ONE_PER_STATION = ("/robot_control_node", "/gui_ros_node")
"""Nodes of which every station has one; a second one on the same master would end the first."""
RUN_ID_PATIENCE = 3.0
"""Seconds within which a starting roscore must set its run_id."""
_NO_ANSWER = (OSError, http.client.HTTPException, xmlrpc.client.Error)


def require_no_station(uri: str) -> None:
    """Raise RuntimeError when a station lives at this ROS master: nodes of the same names would end its nodes."""
    if not master_answers(uri, timeout=1.0):
        return
    master: Any = master_proxy(uri, timeout=1.0)  # XML-RPC answers have no types
    for name in ONE_PER_STATION:
        try:
            code, _, address = master.lookupNode("/stack_up", name)
            if code != 1 or master_proxy(address, timeout=1.0).getPid("/stack_up")[0] != 1:
                continue
        except _NO_ANSWER:  # registered by a program that is dead
            continue
        raise RuntimeError(
            f"another station runs at the ROS master {uri} ({name} answers), and goes on undisturbed. End it there "
            "with Ctrl-C, or give this one a master of its own:  ROS_MASTER_URI=http://localhost:11312 ./stack up ...  "
            "(docs/faults.md, A second station)"
        )


def require_master_here(uri: str) -> None:
    """Raise RuntimeError when the ROS master would have to run on another machine, and none answers there: the one that
    is started here would not be found; or when the address is none."""
    try:
        parts = urlsplit(uri)
        host, complete = parts.hostname, parts.scheme == "http" and bool(parts.port)
    except ValueError:
        host, complete = "", False
    if not host or not complete:
        raise RuntimeError(
            f"ROS_MASTER_URI is '{uri}', and not of the form http://HOST:PORT, as http://localhost:11311 is"
        )
    if not is_ours(host) and not master_answers(uri, timeout=1.0):
        raise RuntimeError(
            f"ROS_MASTER_URI is {uri}, which is another machine, and no ROS master answers there. To run everything "
            "here:  unset ROS_MASTER_URI  (a line in ~/.bashrc may set it)"
        )


def require_protection(firewall_setting: str | None) -> None:
    """Raise RuntimeError when other machines reach ROS and the firewall rules are not loaded, unless the person says
    `firewall:=mine`: who reaches a ROS master or node may do everything that the pilot may."""
    if firewall_setting not in (None, "mine"):
        raise RuntimeError(f"firewall:={firewall_setting}: mine is the only value; without it ours is looked for")
    address = firewall.announced_address()
    if address is None or firewall_setting == "mine":
        return
    problem = firewall.problem()
    if problem is not None:
        raise RuntimeError(
            f"ROS would listen on {address}, where whoever reaches it drives the robot without a password, and "
            f"{problem}. Load them, with your interface and the addresses of your robots:\n"
            f"  {firewall.advice()}\n"
            "or add  firewall:=mine  if rules of your own do the same, or drive without other machines:  unset ROS_IP "
            "ROS_HOSTNAME.  docs/remote.md says more"
        )


def exposure(uri: str) -> str:
    """Return a line that says on which ports a roscore that somebody else started listens on every address of this
    machine; empty when on none."""
    master: Any = master_proxy(uri, timeout=1.0)  # XML-RPC answers have no types
    _, _, rosout = master.lookupNode("/stack_up", "/rosout")
    ports = {urlsplit(address).port for address in (uri, rosout)}
    open_ports = sorted({found.port for found in listening().values() if found.everywhere} & {*filter(None, ports)})
    if not open_ports:
        return ""
    return (
        f"It listens on every address of this machine (port {', '.join(map(str, open_ports))}): whoever is in the "
        "network can reach it. End it, and ./stack up starts one that is only reached from here.\n"
    )


def require_roscore(uri: str, stop: threading.Event) -> None:
    """Raise RuntimeError when a bare rosmaster runs at `uri`: roslaunch would wait for its run_id for ever."""
    deadline = time.monotonic() + RUN_ID_PATIENCE
    master: Any = master_proxy(uri, timeout=1.0)  # XML-RPC answers have no types
    while master.getParam("/stack_up", "/run_id")[0] != 1 and not stop.wait(0.1):
        if time.monotonic() > deadline:
            raise RuntimeError(
                f"the ROS master at {uri} is a bare rosmaster, without the run_id that roscore gives it and that "
                "roslaunch waits for. Run roscore instead, or:  rosparam set /run_id $(uuidgen)"
            )


def require_room() -> None:
    """Raise RuntimeError when temporary files cannot be written, or have no room."""
    folder = tempfile.gettempdir()
    free = shutil.disk_usage(folder).free
    if free < LEAST_ROOM:
        raise RuntimeError(
            f"the disk is full: {free >> 20} MB are free in {folder}, and {LEAST_ROOM >> 20} MB are needed. Remove "
            "something, or name another folder:  TMPDIR=FOLDER ./stack up ..."
        )


def choose_log_folder(otherwise: Path) -> str:
    """Have ROS write its logs to `otherwise` when its own folder cannot be written; return what to say about it."""
    home = Path(os.environ.get("ROS_HOME") or Path.home() / ".ros").expanduser()
    folder = Path(os.environ.get("ROS_LOG_DIR") or home / "log").expanduser()
    problem = _problem(folder)
    if not problem:
        return ""
    os.environ["ROS_LOG_DIR"] = str(otherwise)
    if not home.is_dir():  # roslaunch starts every node there
        otherwise.mkdir(parents=True, exist_ok=True, mode=0o700)
        os.environ["ROS_HOME"] = str(otherwise)
    return (
        f"Logs cannot be written to {folder}: {problem}. They go to {otherwise} and are gone when the station ends; "
        "recordings, accounts and settings may not be saved either."
    )


def raise_descriptor_limit() -> str:
    """Allow this process, and what it starts, more open files if they are few; return what to say when they stay so."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft >= DESCRIPTORS or soft == resource.RLIM_INFINITY:
        return ""
    possible = DESCRIPTORS if hard == resource.RLIM_INFINITY else min(DESCRIPTORS, hard)
    resource.setrlimit(resource.RLIMIT_NOFILE, (possible, hard))
    if possible == DESCRIPTORS:
        return ""
    return f"Each program may open only {possible} files; with many viewers that is too few:  ulimit -n {DESCRIPTORS}"


def _problem(folder: Path) -> str:
    """Return why nothing can be written to a folder, which is made; empty when it can."""
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        with tempfile.TemporaryFile(dir=folder):
            free = shutil.disk_usage(folder).free
    except OSError as error:
        return error.strerror or str(error)
    return "" if free >= LEAST_LOG_ROOM else f"the disk is full, {free >> 20} MB are free"


def say_all(*sentences: str) -> None:
    """Print those that are not empty."""
    for sentence in filter(None, sentences):
        print(f"stack up: {sentence}", file=sys.stderr, flush=True)
