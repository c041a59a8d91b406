"""A robot with a key and its pilots: who has the key sees and talks, and the others learn what is missing."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from rto_node.robot_sound import RobotSound
from rto_node.webrtc_camera import WebrtcCamera

from telepresence.security.robot_key import RobotKey

pytestmark = pytest.mark.slow

HOST = "127.0.0.1"
SERVICES = {
    "camera": ("--source", "test", "--rate", "15", "--size", "160x120"),
    "sound": ("--microphone", "none", "--speaker", "none"),
}


@pytest.fixture(scope="module")
def robot(run_onboard: Callable, tmp_path_factory: pytest.TempPathFactory) -> tuple[RobotKey, dict]:
    """Its key, and its programs by name."""
    path = tmp_path_factory.mktemp("robot") / "robot.key"
    key = RobotKey.make(path)
    return key, {role: run_onboard(role, "--port", "0", "--key", str(path), *rest) for role, rest in SERVICES.items()}


@pytest.fixture
def ask(robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable]:
    """A pilot with that key, or none, asks for pictures or for a conversation."""
    closing: list = []

    def ask(role: str, key: RobotKey | None) -> WebrtcCamera | RobotSound:
        monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
        if key is not None:
            key.store(HOST)
        address = f"{HOST}:{robot[1][role].port}"
        if role == "camera":
            client = WebrtcCamera(address)
            client.want(True)
        else:
            client = RobotSound(address, lambda _: None).start()
        closing.append(client)
        return client

    yield ask
    for each in closing:
        each.close()


@pytest.mark.parametrize("role", SERVICES)
def test_who_has_the_key_sees_and_talks(role: str, robot, ask: Callable, wait_until: Callable) -> None:
    client = ask(role, robot[0])
    wait_until(lambda: client.connections and not client.problem, f"a connection; {client.problem}")
    client.close()
    again = ask(role, robot[0])
    wait_until(lambda: again.connections and not again.problem, "and another one: the first has given its place back")


@pytest.mark.parametrize("role", SERVICES)
def test_who_has_none_learns_what_is_missing(role: str, ask: Callable, wait_until: Callable) -> None:
    client = ask(role, None)
    wait_until(lambda: f"wants its key: ./stack pair {HOST}" in client.problem, "what to do")
    RobotKey.parse("ab" * 32).store(HOST)
    wait_until(
        lambda: f"another key than this machine: ./stack pair {HOST}" in client.problem, "that it is a wrong one"
    )


def test_a_robot_elsewhere_gets_nothing_without_a_key(tmp_path: Path, monkeypatch, wait_until: Callable) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    client = WebrtcCamera("192.0.2.7")  # nobody's: RFC 5737
    try:
        client.want(True)
        wait_until(lambda: client.problem == "there is no key for the robot at 192.0.2.7: ./stack pair 192.0.2.7", "so")
    finally:
        client.close()
