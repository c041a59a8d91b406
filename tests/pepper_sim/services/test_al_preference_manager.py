"""ALPreferenceManager and ALPreferences over the wire."""


def test_preferences(naoqi, refused, wait_until):
    preferences = naoqi.ALPreferenceManager
    added = []
    preferences.preferenceAdded.connect(lambda *values: added.append(values))
    preferences.setValue("test.domain", "colour", "red")
    preferences.setValue("test.domain", "number", 5)
    assert preferences.getValue("test.domain", "colour") == "red"
    assert preferences.getValue("test.domain", "number") is None, "only texts are stored"
    preferences.setValues({"test.domain": {"a": "1", "b": [2]}})
    assert preferences.getValueList("test.domain") == [["colour", "red"], ["a", "1"]]
    assert ["test.domain", "a", "1"] in preferences.getValues()
    wait_until(lambda: added == [("test.domain", "colour", "red"), ("test.domain", "a", "1")], "both were reported")
    preferences.removeValue("test.domain", "a")
    assert "test.domain" in preferences.getDomainList()
    preferences.removeDomainValues("test.domain")
    assert "test.domain" not in preferences.getDomainList()
    assert "512 bytes" in refused(preferences.setValue, "d" * 513, "a", "1")
    preferences.update()


def test_a_file_of_preferences_keeps_its_values_and_their_types(naoqi, simulation):
    written = [["speed", "m/s", 0.5, "Test/Speed"], ["on", "", True], ["colours", "", [["first", "", "red"]]]]
    files, manager, memory = naoqi.ALPreferences, naoqi.ALPreferenceManager, naoqi.ALMemory
    files.writePrefFile("Test", written, False)
    assert simulation.server.catalogue.disk.path("/home/nao/.config/naoqi/Test.xml").is_file()
    assert files.readPrefFile("Test", False) == written
    named = files.readPrefFile("Test", True)
    assert [named[1], named[2][2][0]] == [["on", "", True, "Test/on"], ["first", "", "red", "Test/colours/first"]]
    assert files.saveToMemory(named) is True
    assert memory.getListData(["Test/Speed", "Test/on", "Test/colours/first"]) == [0.5, True, "red"]
    manager.importPrefFile("test", "naoqi", "Test.xml", True)
    assert manager.getValueList("test") == [["colours/first", "red"]], "only texts are stored"
    files.removePrefFile("Test")
    manager.removeDomainValues("test")
