"""ALPeoplePerception, ALFaceDetection and ALFaceCharacteristics over the wire: nobody is there."""

import pytest


def test_nobody_is_recognised(naoqi):
    faces, people = naoqi.ALFaceDetection, naoqi.ALPeoplePerception
    assert faces.learnFace("Ada") is False and faces.getLearnedFacesList() == []
    faces.setRecognitionEnabled(False)
    assert faces.isRecognitionEnabled() is False
    people.subscribe("test")
    people.setMaximumDetectionRange(2.0)
    assert people.getMaximumDetectionRange() == pytest.approx(2.0)
    people.unsubscribe("test")
    assert naoqi.ALMemory.getData("PeoplePerception/PeopleList") == []
    assert naoqi.ALFaceCharacteristics.analyzeFaceCharacteristics(1) is False
