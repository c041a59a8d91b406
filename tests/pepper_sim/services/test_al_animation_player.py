"""Gestures over the wire, by path, tag and in speech."""

import itertools
import time

import pytest

from pepper_sim.body.description import LIMITS
from pepper_sim.naoqi.motion.gestures import GESTURES, TAGS, playable

HEY = "animations/Stand/Gestures/Hey_1"


def test_a_gesture_moves_and_comes_back(naoqi, wait_until):
    motion, player = naoqi.ALMotion, naoqi.ALAnimationPlayer
    before = motion.getAngles("Body", False)
    call = player.run(HEY, _async=True)
    wait_until(lambda: motion.getAngles("RShoulderPitch", True)[0] < 0.0, "the arm is up")
    call.value(10_000)
    assert motion.getAngles("Body", False) == pytest.approx(before, abs=0.01)


def test_tags(naoqi, refused):
    player = naoqi.ALAnimationPlayer
    begin = time.monotonic()
    player.runTag("yes")
    assert time.monotonic() - begin > 1.0
    player.addTagForAnimations({"agree": ["nowhere", "animations/Stand/Gestures/Yes_1"]})
    player.runTag("agree", _async=True).cancel()
    player.reset()
    assert "agree" in refused(player.runTag, "agree")
    assert "not installed" in refused(player.run, "animations/Stand/Gestures/Nobody_Has_This")
    assert "tagsToAnimations" in refused(player.addTagForAnimations, [1])


def test_speech_starts_a_gesture(naoqi, wait_until):
    naoqi.ALAnimatedSpeech.say(f"^start({HEY}) Hello", _async=True)
    wait_until(lambda: naoqi.ALMotion.getAngles("RShoulderPitch", True)[0] < 0.5, "the arm goes up")
    naoqi.ALTextToSpeech.stopAll()
    naoqi.ALMotion.killAll()


def test_gestures_stay_within_the_limits_and_rise_in_time():
    assert set(TAGS.values()) <= set(GESTURES)
    for gesture in GESTURES.values():
        for joint, knots in playable(gesture, dict.fromkeys(LIMITS, 0.3)).items():
            times = [moment for moment, _ in knots]
            assert times == sorted(set(times)) and times[0] > 0
            for (t0, a0), (t1, a1) in itertools.pairwise(knots):
                assert 1.5 * abs(a1 - a0) / (t1 - t0) < LIMITS[joint].velocity
            assert all(LIMITS[joint].lower <= angle <= LIMITS[joint].upper for _, angle in knots[:-1])
