"""Attacks on accounts and on the drive lease: by people with an account that is not enough, by programs on the ROS
graph, and by readers of the file of the accounts."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from endings import end_together

from telepresence.station import processes
from telepresence.station.ros_master import master_answers, master_proxy
from telepresence.teleop.accounts import UserError, Users

pytestmark = pytest.mark.ros

ROOT = Path(__file__).resolve().parents[2]
PASSWORD, OTHER_PASSWORD = "correct horse", "battery staple"
AHEAD, ZERO = [0.2, 0.0, 0.0], [0.0, 0.0, 0.0]
PEOPLE = {"anna": ("pilot", 0), "ben": ("pilot", 0), "chief": ("pilot", 5), "will": ("watcher", 0)}
GRACE = 1.0
"""Seconds within which the sessions of a removed account end."""
TRIES = 4
"""The best of so many counts, as other programs hold up those of a busy machine."""


class Graph:
    """A ROS master, drive_lease, and a program of ours that speaks to it."""

    def __init__(self, folder: Path, port: int, wait_until) -> None:
        environment = {
            **os.environ,
            "ROS_MASTER_URI": f"http://127.0.0.1:{port}",
            "ROS_HOME": str(folder / "ros"),
            "ROS_IP": "127.0.0.1",
        }
        self.users = Users(folder / "users.db")
        for name, (role, rank) in PEOPLE.items():
            self.users.add(name, PASSWORD, role, rank)
        quiet = {"env": environment, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        self._programs = [processes.start(["rosmaster", "--core", "-p", str(port)], **quiet)]
        wait_until(lambda: master_answers(environment["ROS_MASTER_URI"]), "the ROS master answers")
        lease = [str(ROOT / "catkin_ws/devel/lib/avatar_gui/drive_lease"), f"_users:={self.users.path}"]
        self._start_lease = lambda: processes.start(lease, **quiet)
        self._programs.append(self._start_lease())
        self.lease = self._programs[-1]
        self.master = master_proxy(environment["ROS_MASTER_URI"], 5.0)
        self._stranger = processes.start(
            [sys.executable, str(Path(__file__).with_name("lease_stranger.py")), str(self.users.path)],
            env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        self._programs.append(self._stranger)
        assert self._answer() == "ready"

    def __getattr__(self, word: str):
        def do(*rest: object) -> object:
            self._stranger.stdin.write(json.dumps([word, *rest]) + "\n")
            self._stranger.stdin.flush()
            return self._answer()

        return do

    def _answer(self) -> object:
        line = self._stranger.stdout.readline()
        assert line, "the attacking program has ended"
        return json.loads(line)

    def drives(self, who: str) -> bool:
        """Whether a window has the robot and it moves; a busy machine may have kept it silent until its lease ended."""
        return self.ask(who, "take")[0] and self.moved() == AHEAD

    def restart_lease(self) -> None:
        """End drive_lease and start it again, as roslaunch does when it ends."""
        processes.end(self.lease, patience=5.0)
        self._programs.append(self._start_lease())
        self.lease = self._programs[-1]

    def close(self) -> None:
        end_together(self._programs)


@pytest.fixture(scope="module")
def graph(tmp_path_factory, free_port, wait_until):
    made = Graph(tmp_path_factory.mktemp("lease"), free_port(), wait_until)
    yield made
    made.close()


@pytest.mark.parametrize(
    "change",
    [
        pytest.param(lambda users: users.remove("mallory"), id="removed"),
        pytest.param(lambda users: users.add("mallory", PASSWORD, "watcher", 1), id="made a watcher"),
        pytest.param(lambda users: users.add("mallory", PASSWORD, "pilot", 0), id="lowered in rank"),
        pytest.param(lambda users: users.add("mallory", OTHER_PASSWORD, "pilot", 1), id="given another password"),
    ],
)
def test_somebody_drives_on_whose_account_is(graph, wait_until, change):
    """The robot stands within a second, and the session is of no use any more."""

    def is_over() -> bool:
        refused = not graph.ask("mallory", "take")[0]
        return refused and graph.moved() == ZERO and graph.state()["pilot"] == ""

    tries: list[float] = []  # s
    try:
        while not any(seconds < GRACE for seconds in tries):
            assert len(tries) < TRIES, f"it stands {tries} s after the change"
            graph.users.add("mallory", PASSWORD, "pilot", 1)
            assert graph.join("mallory", "mallory", PASSWORD)
            assert graph.ask("mallory", "take")[0]
            graph.drive("mallory", *AHEAD)
            wait_until(lambda: graph.drives("mallory"), "the robot drives")
            change(graph.users)
            changed = time.monotonic()
            wait_until(is_over, "the robot stands and the session has ended")
            tries.append(time.monotonic() - changed)
    finally:
        graph.drive("mallory")
        graph.ask("mallory", "leave")


@pytest.mark.parametrize("name", ["anna", "chief"])
def test_a_reader_of_the_accounts_file_takes_the_robot_as(graph, name):
    """Nothing that is stored is as good as a password, alone or together with the public keys of all others."""
    assert not graph.break_in(name)


def test_names_are_tried_out_by_joining(graph):
    """A name that exists is answered as one that does not."""
    assert graph.probe("anna") == graph.probe("nobody")


def test_joins_without_proof_lock_everybody_out(graph):
    """However many join and prove nothing, a pilot joins at once, and the lease keeps its pace meanwhile."""

    def keeps_its_pace() -> bool:
        graph.flood("anna", 400)
        graph.flood("nobody", 100)
        return graph.state()["alive"]

    assert any(keeps_its_pace() for _ in range(TRIES))
    assert graph.join("ben", "ben", PASSWORD)
    assert graph.ask("ben", "leave")[0]


def test_one_watcher_opens_windows_until_nobody_else_can(graph):
    """Windows of one account take places of that account only."""
    for number in range(33):
        graph.join(f"will {number}", "will", PASSWORD) if number < 1 else graph.again(
            "will 0", f"will {number}", "will"
        )
    assert graph.join("ben", "ben", PASSWORD)
    assert graph.ask("ben", "leave")[0]


def test_wrong_passwords_of_somebody_else_lock_the_owner_out(graph):
    """They slow the name down for seconds, not more."""
    for _ in range(5):
        with pytest.raises(UserError):
            graph.users.check("anna", "wrong")
    assert graph.users.check("anna", PASSWORD).name == "anna"


def test_a_pilot_of_the_same_rank_resets_the_red_stop_of_another(graph, wait_until):
    """Who pressed it resets it, or a higher rank."""
    for name in ("anna", "ben"):
        assert graph.join(name, name, PASSWORD)
    assert graph.ask("anna", "stop")[0]
    try:
        assert not graph.ask("ben", "reset_stop")[0]
        wait_until(lambda: graph.state()["stopped_by"] == "anna", "the stop holds")
    finally:
        graph.ask("anna", "reset_stop")
        for name in ("anna", "ben"):
            graph.ask(name, "leave")


def test_a_window_shows_others_control_characters_or_a_megabyte(graph, wait_until):
    """A window's text that is not short and printable reaches no other program, and the lease works on."""
    assert graph.join("ben", "ben", PASSWORD) and graph.ask("ben", "take")[0]
    graph.garble("ben")
    graph.drive("ben", *AHEAD)
    wait_until(lambda: graph.drives("ben"), "the lease works on")
    assert graph.worst_hold() == ""
    graph.drive("ben")
    assert graph.ask("ben", "leave")[0] and graph.lease.poll() is None


def test_signing_in_is_turned_off_by_a_parameter(graph, wait_until):
    """Anybody on the graph sets parameters and ends nodes, which roslaunch starts again."""
    before = graph.state()["epoch"]
    graph.master.setParam("/stranger", "/drive_lease/sign_in", False)
    graph.restart_lease()
    wait_until(lambda: graph.state()["epoch"] != before, "the lease is back")
    assert graph.state()["sign_in"]
