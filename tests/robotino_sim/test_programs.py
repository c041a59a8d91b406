"""Programs in the style of those that people write for a Robotino, run unchanged; their effect is seen in the world."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

PROGRAMS = Path(__file__).parent / "programs"


@pytest.fixture
def run_against_robot(simulation, client) -> Callable[..., str]:
    """Run `programs/NAME.py` to its end and return what it printed."""

    def run(name: str, *arguments: str) -> str:
        words = [sys.executable, PROGRAMS / f"{name}.py", "--url", simulation.url, *arguments]
        ended = subprocess.run(words, capture_output=True, text=True, timeout=60.0)
        assert ended.returncode == 0, f"{ended.stdout}\n{ended.stderr}"
        return ended.stdout

    return run


def test_a_gripper_on_relays_and_outputs(simulation, run_against_robot):
    printed = run_against_robot("robotino_gripper").splitlines()
    assert [line for line in printed if not line.endswith(" 200")] == [
        "closed: [True, False] True",
        "opened: [False, True] False",
    ]
    outputs = simulation.robot.inputs_outputs
    assert outputs.relays == [False, True] and not any(outputs.digital_outputs)


def test_a_patrol_by_pose_and_odometry(simulation, run_against_robot):
    before = simulation.robot.truth()
    printed = run_against_robot("robotino_patrol", "--distance", "0.2")
    after = simulation.robot.truth()
    assert "web page: text/html" in printed and "no Festool charger" in printed
    assert "poses: True ['errphi', 'errx', 'erry', 'phi', 'seq', 'x', 'y']" in printed
    assert float(printed.split("driven ")[1].split()[0]) >= 0.2
    assert after[0] - before[0] == pytest.approx(0.2, abs=0.15) and after[0] - before[0] > 0.1
