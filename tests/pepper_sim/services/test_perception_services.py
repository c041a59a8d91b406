"""Services of a robot that perceives nobody: tracker, navigation, dialog, recognition, faces and people."""

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


def test_near_goals_are_driven_to_and_maps_are_missing(naoqi, refused):
    navigation = naoqi.ALNavigation
    assert navigation.navigateTo(0.2, 0.0) is True
    assert naoqi.ALMotion.getRobotPosition(True)[0] == pytest.approx(0.2, abs=0.02)
    assert "3 m" in refused(navigation.navigateTo, 5.0, 0.0)
    for call in (navigation.getRobotPositionInMap, navigation.getMetricalMap, navigation.startLocalization):
        assert "no map" in refused(call)
    assert "exploration" in refused(navigation.explore, 2.0)
    assert navigation.loadExploration("/home/nao/map.explo") is False and not navigation.isLocalizationRunning()
    navigation.stopLocalization()


def test_dialog_keeps_its_topics(naoqi, refused):
    dialog = naoqi.ALDialog
    name = dialog.loadTopicContent("topic: ~greeting()\nlanguage: enu\nu:(hello) hi")
    assert name == "greeting" and dialog.getAllLoadedTopics() == ["greeting"]
    dialog.activateTopic(name)
    dialog.subscribe("test")
    assert dialog.getActivatedTopics() == ["greeting"]
    dialog.setLanguage("French")
    assert dialog.getLanguage() == "French"
    dialog.setLanguage("English")
    dialog.unsubscribe("test")
    dialog.unloadTopic(name)
    assert "topic" in refused(dialog.loadTopicContent, "hello")
    assert "greeting" in refused(dialog.activateTopic, "greeting")
    assert "not found" in refused(dialog.loadTopic, "/home/nao/x.top")


def test_recognition_keeps_its_vocabulary(naoqi, refused):
    recognition = naoqi.ALSpeechRecognition
    recognition.setVocabulary(["yes", "no"], False)
    recognition.subscribe("test")
    assert "pause" in refused(recognition.setVocabulary, ["stop"], False)
    recognition.pause(True)
    recognition.setVocabulary(["stop"], False)
    recognition.pause(False)
    recognition.unsubscribe("test")
    recognition.setLanguage("German")
    assert recognition.getLanguage() == "German"
    recognition.setLanguage("English")
    recognition.setAudioExpression(False)
    recognition.setVisualExpression(False)
    assert "empty" in refused(recognition.setVocabulary, [], False)
    naoqi.ALSoundDetection.setParameter("Sensitivity", 0.5)
    naoqi.ALSoundLocalization.subscribe("test")
    naoqi.ALSoundLocalization.unsubscribe("test")


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
