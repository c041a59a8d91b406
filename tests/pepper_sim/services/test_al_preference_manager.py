"""ALPreferenceManager over the wire."""


def test_preferences(naoqi, refused):
    preferences = naoqi.ALPreferenceManager
    preferences.setValue("test.domain", "colour", [1, "red"])
    assert preferences.getValue("test.domain", "colour") == [1, "red"]
    assert preferences.getValue("test.domain", "nothing") is None
    preferences.setValues("test.domain", [["a", 1]])
    assert ["a", 1] in preferences.getValueList("test.domain")
    assert "test.domain" in preferences.getDomainList()
    preferences.removeValue("test.domain", "a")
    preferences.removeDomainValues("test.domain")
    assert "test.domain" not in preferences.getDomainList()
    assert "values" in refused(preferences.setValues, "test.domain", "x")
    preferences.update()
