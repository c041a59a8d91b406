"""`rosrun naoqi_driver_py naoqi_driver.py`: what it understands, and what it says without a robot. That rosrun finds it
and that it drives a robot is seen in test_body_topics.py."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from naoqi_driver.whole_driver import LAUNCH, read_command_line

SCRIPT = Path(__file__).resolve().parents[3] / "catkin_ws/src/naoqi_driver_py/scripts/naoqi_driver.py"


@pytest.fixture(autouse=True)
def _no_address(monkeypatch):
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(SCRIPT.parents[2]))
    for name in ("NAO_IP", "NAO_PORT"):
        monkeypatch.delenv(name, raising=False)


@pytest.mark.parametrize(
    ("words", "url", "settings"),
    [
        (["--pip", "10.0.0.7"], "tcp://10.0.0.7:9559", ["nao_ip:=10.0.0.7", "nao_port:=9559"]),
        (["--pip=10.0.0.7", "--pport=9560"], "tcp://10.0.0.7:9560", ["nao_ip:=10.0.0.7", "nao_port:=9560"]),
        (["--qi-url", "tcp://10.0.0.7:9560"], "tcp://10.0.0.7:9560", ["nao_ip:=tcp://10.0.0.7:9560", "nao_port:=9559"]),
        (["_pip:=pepper.local", "_pport:=1"], "tcp://pepper.local:1", ["nao_ip:=pepper.local", "nao_port:=1"]),
        (
            ["--pip", "10.0.0.7", "_safety:=false", "__name:=driver"],
            "tcp://10.0.0.7:9559",
            ["safety:=false", "nao_ip:=10.0.0.7", "nao_port:=9559"],
        ),
    ],
)
def test_the_address_may_be_said_in_every_way_that_drivers_know(words, url, settings):
    command, address = read_command_line(words)
    assert address.url == url and command == [*LAUNCH, *settings]


def test_an_address_of_the_environment_is_used(monkeypatch):
    monkeypatch.setenv("NAO_IP", "10.0.0.8")
    assert read_command_line([])[1].url == "tcp://10.0.0.8:9559"


def test_a_mistyped_argument_is_refused_with_those_that_there_are(capsys):
    with pytest.raises(SystemExit):
        read_command_line(["--pip", "10.0.0.7", "_wake_upp:=false"])
    said = capsys.readouterr().err
    assert "there is no argument '_wake_upp'; arguments: _base_frame_id, " in said and "_wake_up," in said


def test_the_words_of_the_former_driver_are_no_mistakes():
    words = ["_roscore_ip:=10.0.0.1", "_network_interface:=eth0", "_force_python:=true", "_nao_ip:=10.0.0.7"]
    command, _ = read_command_line(["--pip", "10.0.0.7", *words])
    assert "network_interface:=eth0" in command


def run(environment: dict[str, str], *arguments: str) -> tuple[int, str]:
    done = subprocess.run([SCRIPT, *arguments], env=environment, capture_output=True, text=True, timeout=60.0)
    return done.returncode, done.stderr


def test_without_a_robot_it_says_so(workspace_environment, free_port):
    code, said = run(workspace_environment)
    assert code == 2 and "which robot? --pip ADDRESS" in said
    port = free_port()
    code, said = run(workspace_environment, "--pip", "127.0.0.1", "--pport", str(port))
    assert code == 1 and f"no robot answers at tcp://127.0.0.1:{port}: " in said and "Traceback" not in said
