"""ALServiceManager over the wire."""


def test_clients_services_are_stopped_by_a_signal(naoqi, connect, wait_until, refused):
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
    wait_until(lambda: stopped == [("MyApp", 0)], "the stop was reported")
    assert manager.isServiceRunning("MyApp") is False
    manager.restart("MyApp")
    assert manager.isServiceRunning("MyApp") is True
    assert manager.stopService("ALMotion") is False, "the robot's own"
    assert manager.startService("Nothing") is False
    assert "Nothing" in refused(manager.start, "Nothing")
    names = [info["name"] for info in manager.services()]
    assert {"ALMotion", "MyApp"} <= set(names) and manager.service("ALMotion")["running"] is True
