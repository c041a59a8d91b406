"""ALDialog over the wire."""


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
