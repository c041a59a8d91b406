"""ALTracker over the wire: it turns to places. What it follows: tests/pepper_sim/people/test_perception.py."""

import math
import time

import pytest

NAN, NOWHERE = math.nan, [0.0] * 6


def test_looking_at_a_place_turns_the_head(naoqi, refused):
    tracker = naoqi.ALTracker
    tracker.lookAt([1.0, 1.0, 1.0], 2, 0.5)
    yaw, pitch = naoqi.ALMotion.getAngles("Head", True)
    assert yaw == pytest.approx(0.77, abs=0.05) and pitch == pytest.approx(-0.007, abs=0.1)
    assert "frame" in refused(tracker.lookAt, [1.0, 0.0, 1.0], 5, 0.5)
    assert "position" in refused(tracker.lookAt, [1.0], 2, 0.5)
    assert "fractionMaxSpeed" in refused(tracker.lookAt, [1.0, 0.0, 1.0], 2, 0.0)


@pytest.mark.parametrize(
    ("target", "key", "value"),
    [
        ("Test/Target", "Test/Target", lambda stamp: [[NAN] * 6, stamp, 0]),
        ("Test/Target", "Test/Target", lambda stamp: [[1.0, math.inf, 1.0, 0.0, 0.0, 0.0], stamp, 0]),
        ("Test/Target", "Test/Target", lambda stamp: [NOWHERE, [NAN, 0.0, 1.0, 0.0, 0.0, 0.0], stamp, 0]),
        ("Test/Target", "Test/Target", lambda stamp: {"x": 1.0, "stamp": stamp}),
        ("Sound", "ALSoundLocalization/SoundLocated", lambda stamp: dict.fromkeys("stam", stamp)),
        ("Sound", "ALSoundLocalization/SoundLocated", lambda stamp: [stamp, [0.0, NAN, 0.9, 0.0], NOWHERE, NOWHERE]),
        ("Sound", "ALSoundLocalization/SoundLocated", lambda stamp: [stamp, [0.0, 0.0, 0.9, 0.0], NOWHERE, ["here"]]),
        ("Sound", "ALSoundLocalization/SoundLocated", lambda stamp: [stamp, [0.0, 0.0, 0.9, 0.0], NOWHERE, [NAN] * 6]),
    ],
)
def test_a_target_that_is_nowhere_is_lost_and_moves_nothing(naoqi, wait_until, target, key, value):
    tracker, lost = naoqi.ALTracker, []
    subscriber = naoqi.ALMemory.subscriber("ALTracker/TargetLost")
    subscriber.signal.connect(lost.append)
    tracker.registerTarget("Sound", [2.0, 0.1])
    tracker.setMode("Move")
    tracker.toggleSearch(False)
    tracker.setTimeOut(200)
    now = time.time()
    naoqi.ALMemory.raiseEvent(key, value([int(now), int(now % 1 * 1e6)]))
    (tracker.track if target == "Sound" else tracker.trackEvent)(target)
    wait_until(lambda: lost == [target], "it is lost")
    assert tracker.getTargetPosition(1) == []
    assert naoqi.ALMotion.getRobotPosition(True) == pytest.approx([0.0, 0.0, 0.0], abs=0.01)
    tracker.initialize()
    tracker.unregisterAllTargets()
