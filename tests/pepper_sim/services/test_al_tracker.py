"""ALTracker over the wire: it turns to places and never finds a target."""

import pytest


def test_looking_at_a_place_turns_the_head(naoqi, refused):
    tracker = naoqi.ALTracker
    tracker.lookAt([1.0, 1.0, 1.0], 2, 0.5)
    yaw, pitch = naoqi.ALMotion.getAngles("Head", True)
    assert yaw == pytest.approx(0.77, abs=0.05) and pitch == pytest.approx(-0.007, abs=0.1)
    assert "frame" in refused(tracker.lookAt, [1.0, 0.0, 1.0], 5, 0.5)
    assert "position" in refused(tracker.lookAt, [1.0], 2, 0.5)
    assert "fractionMaxSpeed" in refused(tracker.lookAt, [1.0, 0.0, 1.0], 2, 0.0)


def test_targets_are_kept_and_never_found(naoqi, refused):
    tracker = naoqi.ALTracker
    tracker.registerTarget("Face", 0.1)
    assert tracker.getRegisteredTargets() == ["Face"]
    tracker.setMode("Move")
    tracker.track("Face")
    assert tracker.isActive() and tracker.getActiveTarget() == "Face" and tracker.isTargetLost()
    assert tracker.getTargetPosition(2) == [] and tracker.getMode() == "Move"
    tracker.stopTracker()
    tracker.unregisterAllTargets()
    assert not tracker.isActive()
    assert "Ghost" in refused(tracker.registerTarget, "Ghost", 1)
    assert "Face" in refused(tracker.track, "Face")
    tracker.setMode("Head")
