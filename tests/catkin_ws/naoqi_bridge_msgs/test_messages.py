"""The fields are those of naoqi_bridge_msgs 0.0.9: programs and recordings that were made with it must fit.

A message's md5 sum covers names, types and order of its fields and its constants, not the comments. The expected sums
are those that generators printed for the original package.
"""

from __future__ import annotations

import subprocess
import sys

import pytest

SUMS = {
    "msg.AudioBuffer": "50f300aa63f3c1b2f3d3173329165316",
    "msg.Bumper": "89965a81ab868825f18d59365e28ddaf",
    "msg.HandTouch": "d8d5c81c96dbe6a9e8e5d80beb70299d",
    "msg.HeadTouch": "b75165bf9dfed26d50ad4e3162304225",
    "msg.JointAnglesWithSpeed": "052ca11f74a00ad6745dfff6ebc2b4d8",
    "msg.MemoryPairFloat": "92d055a3f1d6bfad2125c6cb81fe007f",
    "msg.RobotInfo": "cc8c56c1600e9f458ce3f2626800e77f",
    "srv.OrthogonalSecurityDistanceRequest": "69e9b81707b13ae1b2bceacbb0d41137",
}


@pytest.fixture(scope="module")
def sums(workspace_environment) -> dict[str, str]:
    program = (
        "import importlib, sys\n"
        "for word in sys.argv[1:]:\n"
        "    module, name = word.split('.')\n"
        "    print(word, getattr(importlib.import_module('naoqi_bridge_msgs.' + module), name)._md5sum)\n"
    )
    found = subprocess.run(
        [sys.executable, "-c", program, *SUMS], env=workspace_environment, check=True, capture_output=True, text=True
    )
    return dict(line.split() for line in found.stdout.splitlines())


@pytest.mark.parametrize("name", SUMS)
def test_message_is_the_original_one(sums, name):
    assert sums[name] == SUMS[name]
