"""ALSystem over the wire."""


def test_system(naoqi, refused, wait_until):
    system = naoqi.ALSystem
    assert len(system.systemVersion().split(".")) == 4
    assert system.robotName() == "Pepper"
    received = []
    subscriber = naoqi.ALMemory.subscriber("ALSystem/RobotNameChanged")
    subscriber.signal.connect(received.append)
    assert system.setRobotName("Salt") is True and system.robotName() == "Salt"
    wait_until(lambda: received == ["Salt"], "the name was reported")
    assert system.setRobotName("no spaces!") is False
    system.setRobotName("Pepper")
    assert system.totalMemory() > system.freeMemory() > 0
    assert system.timezone()
    assert "simulated" in refused(system.reboot)
    assert "simulated" in refused(system.shutdown)
