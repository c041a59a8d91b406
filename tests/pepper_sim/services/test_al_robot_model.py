"""ALRobotModel over the wire."""

import xml.etree.ElementTree as ElementTree


def test_robot_model(naoqi):
    model = naoqi.ALRobotModel
    assert model.getRobotType() == "Pepper" and model.hasLegs() is False and model.hasArms() is True
    assert model._getMicrophoneConfig() == 1
    assert model._getConfigMap()["RobotConfig/Body/Type"] == "Juliette"
    (body,) = ElementTree.fromstring(model.getConfig()).findall("*[@memoryName='RobotConfig/Body/Type']")
    assert body.attrib == {
        "name": "Type", "memoryName": "RobotConfig/Body/Type", "description": "", "value": "Juliette", "type": "string"
    }  # fmt: skip
