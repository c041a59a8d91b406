"""What a hand on the floor makes of what the safety gate says; times are arguments. The drive itself:
tests/gui/driving/test_floor_drive.py and tests/telepresence/page/test_floor.py."""

import numpy as np
import pytest

from telepresence.station.fault_sentences import SILENT_AFTER
from telepresence.teleop.floor_goal import FloorGoal
from telepresence.teleop.robot_readings import GATE_LIFE, BodyState, CameraView, Lens, Safety

NOW = 100.0
LENS = Lens(fx=525.0, fy=525.0, cx=320.0, cy=240.0, width=640, height=480)
LEVEL = np.array(((0.0, 0.0, 1.0), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0)))


@pytest.mark.parametrize(("allowed", "tone"), [(0.35, "free"), (0.0, "blocked")])
def test_what_the_gate_said_is_shown_no_longer_than_until_it_counts_as_silent(allowed, tone):
    goal = FloorGoal(lambda: CameraView(LENS, LEVEL, np.array((0.0, 0.0, 1.0))), lambda: 0.0)
    goal.body = BodyState(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, "odom", NOW)
    goal.safety = Safety("clear", "", np.full(72, allowed), 1.0, None, 0.0, (0.0, 0.0, 0.0), False, NOW)
    goal.press(320.0, 400.0, NOW)
    goal.find()
    assert goal.tone(NOW + GATE_LIFE - 0.01) == tone
    assert goal.tone(NOW + SILENT_AFTER) == "slow"
