"""ALSystem, ALRobotModel, ALServiceManager, ALPreferenceManager, LogManager over the wire."""

import logging


def test_system(naoqi, refused, wait_until):
    system = naoqi.ALSystem
    assert len(system.systemVersion().split(".")) == 4
    assert system.robotName() == "Pepper"
    heard = []
    subscriber = naoqi.ALMemory.subscriber("ALSystem/RobotNameChanged")
    subscriber.signal.connect(heard.append)
    assert system.setRobotName("Salt") is True and system.robotName() == "Salt"
    wait_until(lambda: heard == ["Salt"], "the name was told")
    assert system.setRobotName("no spaces!") is False
    system.setRobotName("Pepper")
    assert system.totalMemory() > system.freeMemory() > 0
    assert system.timezone()
    assert "simulated" in refused(system.reboot)
    assert "simulated" in refused(system.shutdown)


def test_robot_model(naoqi):
    model = naoqi.ALRobotModel
    assert model.getRobotType() == "Pepper" and model.hasLegs() is False and model.hasArms() is True
    assert model._getMicrophoneConfig() == 0
    assert model._getConfigMap()["RobotConfig/Body/Type"] == "Juliette"
    assert 'value="Juliette"' in model.getConfig()


def test_service_manager_stops_clients_services_by_telling_them(naoqi, connect, wait_until, refused):
    class App:
        def hello(self):
            return "hi"

    client = connect()
    client.registerService("MyApp", App())
    manager = naoqi.ALServiceManager
    stopped = []
    manager.serviceStopped.connect(lambda name, reason: stopped.append((name, reason)))
    assert manager.startService("MyApp") is True and manager.isServiceRunning("MyApp") is True
    assert manager.stopService("MyApp") is True
    wait_until(lambda: stopped == [("MyApp", 0)], "the stop was told")
    assert manager.isServiceRunning("MyApp") is False
    manager.restart("MyApp")
    assert manager.isServiceRunning("MyApp") is True
    assert manager.stopService("ALMotion") is False, "the robot's own"
    assert manager.startService("Nothing") is False
    assert "Nothing" in refused(manager.start, "Nothing")
    names = [info["name"] for info in manager.services()]
    assert {"ALMotion", "MyApp"} <= set(names) and manager.service("ALMotion")["running"] is True


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


def test_the_log_is_told_to_listeners(naoqi, wait_until):
    messages = []
    listener = naoqi.LogManager.getListener()
    listener.onLogMessage.connect(messages.append)
    logging.getLogger("pepper_sim.test").warning("the floor is %s", "wet")
    wait_until(lambda: messages, "the message arrived")
    message = messages[0]
    assert message["message"] == "the floor is wet" and message["level"] == 3
    assert message["category"] == "pepper_sim.test"
    listener.setLevel(2)
    logging.getLogger("pepper_sim.test").warning("not told")
    logging.getLogger("pepper_sim.test").error("told")
    wait_until(lambda: len(messages) == 2, "the error arrived")
    assert messages[1]["message"] == "told"
