"""ALSpeechRecognition, ALSoundDetection and ALSoundLocalization over the wire."""


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
