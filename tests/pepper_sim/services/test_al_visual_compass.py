"""ALVisualCompass over the wire; in the empty room its pictures hold nothing to recognize."""

import math

import pytest


def test_a_reference_is_kept_and_nothing_is_invented(naoqi):
    compass, memory = naoqi.ALVisualCompass, naoqi.ALMemory
    compass.setResolution(0)
    assert compass.getReferenceImage() is None
    assert compass.setCurrentImageAsReference() is True
    assert memory.getData("VisualCompass/NewReferenceImageSet") is True
    width, height, layers, space, *_, pixels, camera = compass.getReferenceImage()[:8]
    assert (width, height, layers, space, camera) == (160, 120, 3, 11, 0) and len(pixels) == width * height * layers
    assert compass.getMatchingQuality() == [0.0, 0]


def test_a_move_turns_drives_and_turns(naoqi):
    compass = naoqi.ALVisualCompass
    compass.moveTo(0.2, 0.1, 0.3)
    compass.waitUntilTargetReached()
    x, y, _, _, _, yaw = naoqi.robot.truth()
    assert math.dist((x, y), (0.2, 0.1)) < 0.04 and yaw == pytest.approx(0.3, abs=0.05)
    assert naoqi.ALMemory.getData("VisualCompass/MoveAbort") is False
