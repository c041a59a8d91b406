"""By one switch, or by eyes alone: the simulated Pepper, by the page, from the bedroom through the door to the sofa.

The real page, lease, driver and safety gate; the way is 5 m, the door 0.9 m wide. The reference of the same run is
somebody who holds keys. A run in which the robot touches anything is an error.
"""

from __future__ import annotations

import contextlib
import json
import math
import socket
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from report import Row
from ros_graph import free_port, private_master, wait_for

from telepresence.station import processes
from telepresence.teleop.accounts import Users

ROOT = Path(__file__).resolve().parents[2]
LAB = ROOT / "tests" / "lab"
PROGRAMS = ROOT / "catkin_ws" / "devel" / "lib"
WAY = [(2.0, -1.72), (0.2, -1.7), (-0.1, 0.3)]
"""In front of the doorway, through it, to the coffee table; the sofa is behind that [m]."""
SOFA = (-0.15, 2.03)
"""Its front edge."""
NEAR = 2.0
"""[m] from which one talks to who sits there."""
FASTER = 3
"""Steps of the speed above the usual one: 0.35 m/s, Pepper's fastest."""
LIMIT = 240.0
"""[s]."""
WAYS = {
    "one switch": {"scanning": True, "scanTime": 0.6, "acting": "step", "step": 0.3},
    "gaze": {"dwelling": True, "dwellTime": 0.8, "acting": "step", "step": 0.3},
}


def run() -> list[Row]:
    from open_page import PASSWORD
    from page_in_process import PageBrowser
    from scripted_pilots import GazeUser, KeyUser, SwitchUser

    with tempfile.TemporaryDirectory() as folder, private_master() as environment, _pepper(environment) as pepper:
        users = Users(Path(folder) / "users.db")
        users.add("anna", PASSWORD, "pilot")
        with _page(environment, Path(folder), users.path) as url:
            browser = PageBrowser(url)
            try:
                by_keys = _drive(browser, pepper, KeyUser(browser), {})
                return [
                    Row(f"to the sofa, {name}", _drive(browser, pepper, user, WAYS[name]), by_keys, "s", "held keys")
                    for name, user in (("one switch", SwitchUser(browser)), ("gaze", GazeUser(browser)))
                ]
            finally:
                browser.close()


def _drive(browser: Any, pepper: Callable[[str], Any], user: Any, settings: dict[str, Any]) -> float:
    """Return the seconds it took."""
    from scripted_pilots import drive

    pepper("restart")
    browser.drive(**settings)
    wait_for(lambda: not browser.text("status").startswith("Connecting"), "the gate's word")
    for _ in range(FASTER):
        browser.press("PageUp")
    took = drive(lambda: pepper("pose"), WAY, user, LIMIT)
    x, y, _ = pepper("pose")
    touched = pepper("touched")
    if touched or math.hypot(x - SOFA[0], y - SOFA[1]) > NEAR:
        raise RuntimeError(f"{type(user).__name__} ends at {x:.2f}, {y:.2f}; touched: {touched}")
    return took


@contextlib.contextmanager
def _pepper(environment: dict[str, str]) -> Iterator[Callable[[str], Any]]:
    """The simulated Pepper and its driver; asked by pepper_in_flat's methods."""
    port = free_port()
    simulator = processes.start(
        [sys.executable, str(LAB / "pepper_in_flat.py"), f"--port={port}"],
        tied=True,
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert simulator.stdout is not None and simulator.stdin is not None
    simulator.stdout.readline()
    drivers = [
        _start(environment, PROGRAMS / "naoqi_driver_py" / name, "--pip=127.0.0.1", f"--pport={port}")
        for name in ("naoqi_joint_states.py", "naoqi_moveto.py")
    ]

    def ask(name: str) -> Any:
        simulator.stdin.write(json.dumps([name, []]) + "\n")
        simulator.stdin.flush()
        return json.loads(simulator.stdout.readline())

    try:
        yield ask
    finally:
        for process in (*drivers, simulator):
            processes.end(process)


@contextlib.contextmanager
def _page(environment: dict[str, str], folder: Path, users: Path) -> Iterator[str]:
    from page_browser import PICTURES

    port = free_port()
    url = f"https://127.0.0.1:{port}/"
    started = [
        _start(environment, PROGRAMS / "avatar_gui" / "drive_lease", f"_users:={users}"),
        _start(environment, Path(sys.executable), "-c", PICTURES),
        _start(
            environment, PROGRAMS / "pilot_page" / "pilot_page",
            "--port", str(port), "--certificates", str(folder / "tls"), "--users", str(users),
        ),
    ]  # fmt: skip
    try:
        wait_for(lambda: _listens(port), "the page")
        yield url
    finally:
        for process in started:
            processes.end(process)


def _start(environment: dict[str, str], program: Path, *words: str) -> subprocess.Popen:
    quiet = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    return processes.start([str(program), *words], tied=True, env=environment, **quiet)


def _listens(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0
