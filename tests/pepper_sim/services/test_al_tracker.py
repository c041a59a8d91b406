"""ALTracker over the wire: it turns to places. What it follows: tests/pepper_sim/people/test_perception.py."""

import pytest


def test_looking_at_a_place_turns_the_head(naoqi, refused):
    tracker = naoqi.ALTracker
    tracker.lookAt([1.0, 1.0, 1.0], 2, 0.5)
    yaw, pitch = naoqi.ALMotion.getAngles("Head", True)
    assert yaw == pytest.approx(0.77, abs=0.05) and pitch == pytest.approx(-0.007, abs=0.1)
    assert "frame" in refused(tracker.lookAt, [1.0, 0.0, 1.0], 5, 0.5)
    assert "position" in refused(tracker.lookAt, [1.0], 2, 0.5)
    assert "fractionMaxSpeed" in refused(tracker.lookAt, [1.0, 0.0, 1.0], 2, 0.0)
