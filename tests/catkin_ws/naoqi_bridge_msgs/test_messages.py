"""The fields are those of naoqi_bridge_msgs 0.0.9: programs and recordings that were made with it must fit.

A message's md5 sum covers names, types and order of its fields and its constants, not the comments. The expected sums
are those that other generators (rosserial, roslisp, rosnodejs) printed for the original package; of
FloatArrayStamped none was found.
"""

from __future__ import annotations

import subprocess
import sys

import pytest

NAMES = {
    "msg": (
        "AudioBuffer BodyROI BoolStamped Bumper EventStamped FaceROI FadeRGB FloatArrayStamped FloatStamped HandTouch "
        "HeadTouch IntArrayStamped IntStamped JointAngleTrajectory JointAnglesWithSpeed MemoryList MemoryPairFloat "
        "MemoryPairInt MemoryPairString PoseWithConfidenceStamped RobotInfo SoundLocated StatusChangeStamped "
        "StringArrayStamped StringStamped WordRecognized"
    ),
    "srv": (
        "CmdPoseService CmdVelService GetBodyROI GetFacesROI GetFloat GetInstalledBehaviors GetRobotInfo GetString "
        "GetTruepose OrthogonalSecurityDistance SetArmsEnabled SetFloat SetString SetTransform "
        "TangentialSecurityDistance"
    ),
    "action": (
        "Blink BodyPose BodyPoseWithSpeed FollowPath JointAnglesWithSpeed JointTrajectory RunBehavior "
        "SetSpeechVocabulary SpeechWithFeedback"
    ),
}
SUMS = {
    "msg.AudioBuffer": "50f300aa63f3c1b2f3d3173329165316",
    "msg.BlinkFeedback": "6f1f94fb3eb06412264f6e0c5e72cfab",
    "msg.BodyPoseAction": "bc58fd1218bb64624b76dca7ad8a5a81",
    "msg.BodyPoseWithSpeedAction": "8843d4cb535c2767e978466b886561fb",
    "msg.BodyROI": "a9f6bf2f53b2585ecc0ff57bd4a21df4",
    "msg.Bumper": "89965a81ab868825f18d59365e28ddaf",
    "msg.EventStamped": "da9da7dab2e8376f0a588b6d053ac972",
    "msg.FaceROI": "a9f6bf2f53b2585ecc0ff57bd4a21df4",
    "msg.FollowPathAction": "98958d560f45913f6e3143ad99e2fcf0",
    "msg.HandTouch": "d8d5c81c96dbe6a9e8e5d80beb70299d",
    "msg.HeadTouch": "b75165bf9dfed26d50ad4e3162304225",
    "msg.IntArrayStamped": "1ce4762ce13f3d9e1f17586acc253067",
    "msg.JointAnglesWithSpeed": "052ca11f74a00ad6745dfff6ebc2b4d8",
    "msg.JointAnglesWithSpeedAction": "efd2f7ac88847414fd26aacf32f993a5",
    "msg.JointTrajectoryAction": "a88e50dd366fa304954dd433b5706bd8",
    "msg.MemoryPairFloat": "92d055a3f1d6bfad2125c6cb81fe007f",
    "msg.PoseWithConfidenceStamped": "7503bfd0de35644d373258ab08dd1e84",
    "msg.RobotInfo": "cc8c56c1600e9f458ce3f2626800e77f",
    "msg.RunBehaviorAction": "a6a26afb8ff0902c5587c8bfbdc46892",
    "msg.SetSpeechVocabularyAction": "737441a71b3375ccf5219f84239ade13",
    "msg.SoundLocated": "884a2810157403bbdabfb1011c851b42",
    "msg.SpeechWithFeedbackAction": "3a7530648ec5a63553b8765e8b88e951",
    "msg.StatusChangeStamped": "631ab2246eca82d839e3a99b76567775",
    "msg.StringArrayStamped": "17b6e4aa81015d95bcd2b08039bd6bda",
    "srv.CmdPoseService": "271cb12677c4cd9bccbc642cd9258d1f",
    "srv.CmdVelService": "a787b2802160dcc7fe02d089e10afe56",
    "srv.GetBodyROI": "ecc2963facbb989a955948135b6e21fd",
    "srv.GetFacesROI": "7123975ed3d5d1cde8b35e6736592769",
    "srv.GetFloat": "3cf398eaca21304d20b13c76cecbddea",
    "srv.GetTruepose": "4f3e0bbe7a24e1f929488cd1970222d3",
    "srv.OrthogonalSecurityDistanceRequest": "69e9b81707b13ae1b2bceacbb0d41137",
    "srv.SetArmsEnabledRequest": "4da9069facca935244c3405e288ba555",
    "srv.SetFloat": "96fbe2a49585a736ad8b4a31afbaf099",
    "srv.SetStringRequest": "992ce8a1687cec8c8bd883ec73ca41d1",
    "srv.SetStringResponse": "358e233cde0c8a8bcfea4ce193f8fc15",
    "srv.SetTransform": "67035ddf415a9bb64191f0e45b060e35",
    "srv.TangentialSecurityDistanceRequest": "b07653f2626a354d4219619fffc76403",
}


@pytest.fixture(scope="module")
def sums(workspace_environment) -> dict[str, str]:
    program = (
        "import importlib\n"
        "for module in ('msg', 'srv'):\n"
        "    for name, kind in vars(importlib.import_module('naoqi_bridge_msgs.' + module)).items():\n"
        "        if hasattr(kind, '_md5sum'):\n"
        "            print(f'{module}.{name}', kind._md5sum)\n"
    )
    found = subprocess.run(
        [sys.executable, "-c", program], env=workspace_environment, check=True, capture_output=True, text=True
    )
    return dict(line.split() for line in found.stdout.splitlines())


@pytest.mark.parametrize("name", SUMS)
def test_message_is_the_original_one(sums, name):
    assert sums[name] == SUMS[name]


def test_package_has_the_types_of_the_original_and_no_other(sums):
    parts = ("Action", "ActionFeedback", "ActionGoal", "ActionResult", "Feedback", "Goal", "Result")
    expected = {f"msg.{name}" for name in NAMES["msg"].split()}
    expected |= {f"msg.{name}{part}" for name in NAMES["action"].split() for part in parts}
    expected |= {f"srv.{name}{part}" for name in NAMES["srv"].split() for part in ("", "Request", "Response")}
    assert set(sums) == expected
