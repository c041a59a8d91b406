"""What every test may use: free ports, a ROS master of its own, programs that are ended, and a check that all are."""

from __future__ import annotations

import contextlib
import fcntl
import os
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from free_ports import free_port
from hypothesis import HealthCheck, settings

from telepresence.station import processes
from telepresence.station.ros_master import master_answers

# As pepper_sim.naoqi has it: libqi reads it when it is loaded, which may be before that.
os.environ.setdefault("QI_EVENTLOOP_THREAD_MAX_IDLE_DURATION", "1000000000")

# A test says what must hold, not how fast this machine finds examples of it.
settings.register_profile("shared machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("shared machine")

ROOT = Path(__file__).resolve().parent.parent
DEADLINE = 30.0
"""Seconds after which a condition counts as never coming; generous, because the machines are shared."""


def wait_until(condition: Callable[[], object], what: str, timeout: float = DEADLINE) -> object:
    """Poll until `condition()` is true and return its value; fail with `what` after `timeout` seconds."""
    deadline = time.monotonic() + timeout
    while True:
        value = condition()
        if value:
            return value
        if time.monotonic() > deadline:
            pytest.fail(f"{what}: not within {timeout:.0f} s")
        time.sleep(0.02)


CAPACITY = 4
"""Files of tests that run at the same time on two processors: most of their time is waiting for a robot to move."""
COSTS = {"alone": CAPACITY, "station": 3, "x11": 2, "browser": 2}
"""Marker -> how much of the capacity a file with such a test takes; every other file takes 1."""


def _cost(item: pytest.Item) -> int:
    return max((cost for name, cost in COSTS.items() if item.get_closest_marker(name)), default=1)


@pytest.hookimpl(tryfirst=True)  # before pytest-xdist reads the groups
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """A file goes to one worker as a whole, so that its station starts once; the longest files go first, so that none
    of them is left for the end."""
    costs: dict[Path, int] = {}
    starts_ros: set[Path] = set()
    for item in items:
        costs[item.path] = max(costs.get(item.path, 1), _cost(item))
        if item.get_closest_marker("ros"):
            starts_ros.add(item.path)
        item.add_marker(pytest.mark.xdist_group(str(item.path)))
    config.stash[FILE_COSTS] = costs
    if hasattr(config, "workerinput"):
        items.sort(key=lambda item: (-costs[item.path], item.path not in starts_ros))


FILE_COSTS = pytest.StashKey[dict[Path, int]]()


class Turns:
    """Shares the machine between the workers: each file of tests takes its cost of the capacity while it runs.

    Everything is a lock on a file, which the kernel lets go when its worker dies. Whoever waits for room holds the
    queue's lock, so that a file that needs all of the machine is not overtaken for ever.
    """

    def __init__(self, folder: Path) -> None:
        self._queue, *self._places = (
            os.open(folder / name, os.O_RDWR | os.O_CREAT, 0o600) for name in ("queue", *map(str, range(CAPACITY)))
        )
        self._taken: list[int] = []
        self.file: Path | None = None

    def enter(self, file: Path, cost: int) -> None:
        self.file = file
        fcntl.flock(self._queue, fcntl.LOCK_EX)
        while len(self._taken) < cost:
            for place in self._places:
                if place not in self._taken and len(self._taken) < cost:
                    with contextlib.suppress(BlockingIOError):
                        fcntl.flock(place, fcntl.LOCK_EX | fcntl.LOCK_NB)
                        self._taken.append(place)
            if len(self._taken) < cost:
                time.sleep(0.02)
        fcntl.flock(self._queue, fcntl.LOCK_UN)

    def leave(self) -> None:
        self.file = None
        while self._taken:
            fcntl.flock(self._taken.pop(), fcntl.LOCK_UN)


TURNS = pytest.StashKey[Turns]()
LOCKS = pytest.StashKey[tempfile.TemporaryDirectory]()


def pytest_configure(config: pytest.Config) -> None:
    if hasattr(config, "workerinput"):
        config.stash[TURNS] = Turns(Path(config.workerinput["locks"]))
    else:
        config.stash[LOCKS] = tempfile.TemporaryDirectory(prefix="telepresence-tests-")


@pytest.hookimpl(optionalhook=True)  # of pytest-xdist
def pytest_configure_node(node: Any) -> None:
    node.workerinput["locks"] = node.config.stash[LOCKS].name


def pytest_unconfigure(config: pytest.Config) -> None:
    if LOCKS in config.stash:
        config.stash[LOCKS].cleanup()


@pytest.hookimpl(wrapper=True, tryfirst=True)  # around the time limit and the second try
def pytest_runtest_protocol(item: pytest.Item, nextitem: pytest.Item | None) -> Iterator[None]:
    turns = item.config.stash.get(TURNS, None)
    if turns is None:
        return (yield)
    if turns.file != item.path:
        turns.enter(item.path, item.config.stash[FILE_COSTS][item.path])
    try:
        return (yield)
    finally:
        # The station of a file stays up between its tests.
        if nextitem is None or nextitem.path != item.path:
            turns.leave()


@pytest.fixture(name="wait_until", scope="session")
def _wait_until() -> Callable:
    return wait_until


@pytest.fixture(name="free_port", scope="session")
def _free_port() -> Callable[[], int]:
    return free_port


@pytest.fixture(scope="session", autouse=True)
def nothing_remembered() -> None:
    """Windows neither read nor change what the person's own window remembers."""
    os.environ["TELEPRESENCE_SETTINGS"] = "none"


@pytest.fixture(scope="session", autouse=True)
def nothing_left_behind() -> Iterator[None]:
    """After the last test no descendant of ours may live, orphans included."""
    processes.adopt_orphans()
    yield
    left = {pid: _command(pid) for pid in processes.descendants()}
    processes.end_descendants()
    assert not left, f"still running after the tests: {left}"


def _command(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace").strip()
    except OSError:
        return "(ended)"


@pytest.fixture
def run_program() -> Iterator[Callable[..., subprocess.Popen]]:
    """Start a program that is ended after the test."""
    started: list[subprocess.Popen] = []

    def run(*argv: str, **popen) -> subprocess.Popen:
        process = processes.start([str(word) for word in argv], **popen)
        started.append(process)
        return process

    yield run
    for process in reversed(started):
        processes.end(process, patience=10.0)


@pytest.fixture
def ros_environment(
    tmp_path: Path, free_port: Callable[[], int], monkeypatch: pytest.MonkeyPatch
) -> Iterator[dict[str, str]]:
    """Environment of a private ROS graph: own master port, own log folder; the master is not started."""
    monkeypatch.setenv("ROS_MASTER_URI", f"http://127.0.0.1:{free_port()}")
    monkeypatch.setenv("ROS_HOME", str(tmp_path / "ros"))
    monkeypatch.setenv("ROS_IP", "127.0.0.1")
    yield dict(os.environ)


@pytest.fixture
def ros_master(ros_environment: dict[str, str], run_program: Callable, wait_until: Callable) -> dict[str, str]:
    """A bare ROS master; returns the environment in which nodes find it."""
    uri = ros_environment["ROS_MASTER_URI"]
    port = uri.rpartition(":")[2]
    run_program("rosmaster", "--core", "-p", port, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    wait_until(lambda: master_answers(uri), "the ROS master answers")
    return ros_environment
