"""ALNotificationManager over the wire, and what the robot says when its chest button is pressed."""


def test_a_notification_is_kept_until_it_is_removed(naoqi, refused, wait_until):
    manager, told = naoqi.ALNotificationManager, []
    subscribers = [naoqi.ALMemory.subscriber(event) for event in ("notificationAdded", "notificationRemoved")]
    for subscriber in subscribers:
        subscriber.signal.connect(told.append)
    number = manager.add({"message": "Hello.", "severity": "warning", "removeOnRead": False})
    pairs = dict(manager.notification(number))
    assert pairs == {"id": number, "message": "Hello.", "severity": "warning", "removeOnRead": False}
    assert [["message", "Hello."]] == [pair for pair in manager.notifications()[-1] if pair[0] == "message"]
    assert "severity" in refused(manager.add, [["severity", "terrible"]])
    manager.remove(number)
    assert f"no notification {number}" in refused(manager.remove, number)
    wait_until(lambda: told == [number, number], "both were reported")


def test_the_chest_button_has_them_said_once(naoqi, wait_until):
    manager, said = naoqi.ALNotificationManager, []
    subscriber = naoqi.ALMemory.subscriber("ALTextToSpeech/CurrentSentence")
    subscriber.signal.connect(lambda text: said.append(text) if text else None)
    for entry in manager.notifications():  # of other tests
        manager.remove(dict(entry)["id"])
    manager.add([["message", "One."]])
    always = manager.add([["message", "Two."], ["removeOnRead", False]])
    naoqi.robot.press("ChestButton", True)
    wait_until(lambda: naoqi.ALMemory.getData("ChestButtonPressed") == 1.0, "the button is down")
    naoqi.robot.press("ChestButton", False)
    wait_until(lambda: said == ["One.", "Two."], "both were said")
    assert [dict(entry)["id"] for entry in manager.notifications()] == [always]
    manager.remove(always)
    naoqi.ALTextToSpeech.stopAll()
