"""What the launch files tell `voice`."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
URL = "tcp://0.0.0.0:9561"
LAUNCH_FILES = (
    "launch/pepper.launch",
    "launch/both.launch",
    "catkin_ws/src/pepper_bringup/launch/tele_pepper.launch",
    "catkin_ws/src/pepper_bringup/launch/tele_pepper_ros.launch",
    "catkin_ws/src/telepresence_1/launch/voice.launch",
)


@pytest.mark.parametrize("file", LAUNCH_FILES)
def test_where_the_robot_may_connect_reaches_the_node(workspace_environment, file):
    words = ["roslaunch", "--dump-params", str(ROOT / file), f"qi_listen_url:={URL}"]
    done = subprocess.run(words, env=workspace_environment, capture_output=True, text=True, check=True, timeout=60)
    assert f"/voice/qi_listen_url: {URL}" in done.stdout.splitlines()
