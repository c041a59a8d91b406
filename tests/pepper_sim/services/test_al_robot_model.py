"""ALRobotModel over the wire."""


def test_robot_model(naoqi):
    model = naoqi.ALRobotModel
    assert model.getRobotType() == "Pepper" and model.hasLegs() is False and model.hasArms() is True
    assert model._getMicrophoneConfig() == 1
    assert model._getConfigMap()["RobotConfig/Body/Type"] == "Juliette"
    assert 'value="Juliette"' in model.getConfig()
