"""What every test may use: free ports, a ROS master of its own, programs that are ended, and a check that all are."""

from __future__ import annotations

import contextlib
import gc
import os
import signal
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import forked_programs
import naoqi_clients
import pytest
import vendors_qi
import work_sharing
from free_ports import free_port
from hypothesis import HealthCheck, settings
from private_master import start_master
from waiting import wait_until

from telepresence.station import processes

# Containers run the tests as root; a station of a test must end with the test, whoever runs it.
os.environ.setdefault("TELEPRESENCE_AS_ROOT", "1")
# Tests that nohup has started ignore hang-ups, those in a script's background ignore Ctrl-C, and so would every program
# that they start: each would take ten seconds to end.
signal.signal(signal.SIGHUP, signal.SIG_DFL)
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
# The vendor's library, the stranger of many tests, reads these when it is loaded: its log 1 is for fatal errors alone;
# its threads stay, because it ends idle ones with an exception that aborts the process once a server has been closed.
os.environ.setdefault("QI_LOG_LEVEL", "1")
os.environ.setdefault("QI_EVENTLOOP_THREAD_MAX_IDLE_DURATION", "1000000000")

# A test says what must hold, not how fast this machine finds examples of it.
settings.register_profile(
    "shared machine", deadline=None, max_examples=40, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("shared machine")

ROOT = Path(__file__).resolve().parent.parent
EVIDENCE = 4000
"""Characters, the last ones, of what is printed of each thing that a test which was run again had captured or noted."""


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--naoqi-client",
        choices=[*naoqi_clients.MODULES],
        default=naoqi_clients.DEFAULT,
        help="what the tests of the simulated Pepper connect with: the vendor's library or ours",
    )


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Say why tests were run again: what passes then is a defect nevertheless, and would leave no trace."""
    for report in terminalreporter.stats.get("rerun", ()):
        terminalreporter.section(f"run again: {report.nodeid}, after its {report.when}")
        report.toterminal(terminalreporter._tw)
        for name, content in report.sections:
            terminalreporter.section(name, "-")
            terminalreporter.line(content.rstrip()[-EVIDENCE:])


class CutOff:
    """What is to come of a run that is cut off: each failure is named when it happens, because there is no summary, and
    no program is left that a worker had started; these have sessions of their own, which Ctrl-C does not reach."""

    def __init__(self, config: pytest.Config) -> None:
        self._config = config

    def pytest_unconfigure(self) -> None:
        workers = self._config.pluginmanager.get_plugin("dsession")
        if workers is None or workers.nodemanager is None:  # there were no workers
            return
        mark = f"PYTEST_XDIST_TESTRUNUID={workers.nodemanager.testrunuid}".encode()
        for environment in Path("/proc").glob("[0-9]*/environ"):
            with contextlib.suppress(OSError):  # it has ended, or is somebody else's
                if mark in environment.read_bytes().split(b"\0"):
                    processes.send(int(environment.parent.name), signal.SIGKILL)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.outcome in ("failed", "rerun"):
            terminal = self._config.pluginmanager.get_plugin("terminalreporter")
            crash = getattr(report.longrepr, "reprcrash", None)
            reason = (crash.message if crash else report.longreprtext).partition("\n")[0]
            terminal.write_line(f"\n{report.nodeid} {report.outcome} in its {report.when}: {reason}")


def pytest_configure(config: pytest.Config) -> None:
    config.pluginmanager.register(vendors_qi)
    config.pluginmanager.register(work_sharing)
    if not hasattr(config, "workerinput"):
        config.pluginmanager.register(CutOff(config))


def pytest_runtest_logfinish() -> None:
    """Collect garbage between tests, and so on Qt's thread, where tests with widgets have ended Python's own way."""
    if not gc.isenabled():
        gc.collect(1)


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


@pytest.fixture(autouse=True)
def still_an_ordinary_program() -> Iterator[None]:
    """A test that puts itself first does so for all that come after it, and for every program that they start."""
    before = os.sched_getscheduler(0)
    yield
    after = os.sched_getscheduler(0)
    if after != before:
        os.sched_setscheduler(0, before, os.sched_param(0))
        pytest.fail("this test changed the priority of the process that runs the tests")


@pytest.fixture(scope="session", autouse=True)
def nothing_left_behind() -> Iterator[None]:
    """After the last test no descendant of ours may live, orphans included."""
    processes.adopt_orphans()
    yield
    forked_programs.end()
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
        process = forked_programs.start([str(word) for word in argv], **popen)
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
    """A ROS master; returns the environment in which nodes find it."""
    start_master(ros_environment["ROS_MASTER_URI"], run_program, wait_until)
    return ros_environment
