"""Fixtures of the tests of what runs on the robot."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator
from pathlib import Path

import pytest
from onboard_pepper import OnboardServer

from telepresence.security.robot_key import RobotKey

ROBOT = Path(__file__).resolve().parents[4] / "catkin_ws" / "src" / "naoqi_driver_py" / "robot"


@pytest.fixture(scope="module")
def maker():
    spec = importlib.util.spec_from_file_location("make_drive_server", ROBOT / "make_drive_server.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def folder(maker, tmp_path_factory) -> Path:
    made = tmp_path_factory.mktemp("pepper") / "onboard"
    assert maker.main([str(made)]) == 0
    return made


@pytest.fixture
def start(folder) -> Iterator:
    started: list[OnboardServer] = []

    def run(url: str, *options: str, **environment: str) -> OnboardServer:
        started.append(OnboardServer(folder, url, *options, **environment))
        return started[-1]

    yield run
    assert [each.end() for each in started] == [0] * len(started)


@pytest.fixture
def key(folder) -> RobotKey:
    return RobotKey.read(folder / "robot.key")
