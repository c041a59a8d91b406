"""Programs with animations, body language, behaviours and coloured eyes, run unchanged; what they did is seen in the
robot's joints and lights."""

import math
import threading

import choregraphe_files as files
import numpy as np
import pytest


class Recorder:
    """The robot's joints while something runs, from the world itself."""

    def __init__(self, robot):
        self._robot = robot
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self.rows = []

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._over.set()
        self._thread.join()

    def _run(self):
        while not self._over.wait(0.03):
            self.rows.append(self._robot.snapshot().joint_positions)

    def __getitem__(self, joint):
        return np.array([row[joint] for row in self.rows])


def test_greeting(naoqi, run_against_robot):
    with Recorder(naoqi.robot) as joints:
        assert run_against_robot("animations_greeting") == "greeted\n"
    assert joints["RShoulderPitch"].min() < -1.0, "it has pointed to the sky"
    assert joints["RElbowRoll"].max() - joints["RElbowRoll"].min() > 0.5, "it has waved"
    assert joints["HipPitch"].min() < -0.4, "it has bowed"


def test_talk(naoqi, run_against_robot):
    naoqi.ALLeds.off("FaceLeds")
    naoqi.ALSpeakingMovement.setEnabled(True)
    with Recorder(naoqi.robot) as joints:
        assert run_against_robot("animations_talk") == "met you\n"
    arms = [joints[side + "ElbowRoll"] for side in "LR"]
    assert max(np.ptp(arm) for arm in arms) > 0.3, "its arms have spoken"
    assert joints["RElbowRoll"].max() > 1.3, "it has pointed to itself"
    assert naoqi.ALLeds.getIntensity("Face/Led/Green/Left/0Deg") == 1.0


def test_behaviors(naoqi, run_against_robot):
    with Recorder(naoqi.robot) as joints:
        printed = run_against_robot("animations_behaviors").splitlines()
    assert int(printed[0].split()[0]) > 690
    assert printed[1:] == ["running: animations/Stand/Waiting/AirGuitar_1", "still running: 0"]
    assert joints["HeadYaw"].max() > 0.25 and joints["HeadYaw"].min() < -0.25, "it has shaken its head"
    assert joints["LShoulderRoll"].max() > 0.4, "it has held the guitar"
    assert "Behavior not found" in run_against_robot("animations_behaviors", "--run", "no/such")


def test_eyes(naoqi, run_against_robot, monkeypatch, wait_until):
    shown = []
    monkeypatch.setattr(naoqi.robot.lights, "colour", lambda part, *rgb: shown.append(rgb) if part == "eyes" else None)
    assert run_against_robot("animations_eyes") == "left eye: Face/Led/Red/Left/0Deg\n"
    wait_until(lambda: shown[-1] == pytest.approx((1.0, 0.2, 0.0)), "the eyes are orange")


def test_dance(naoqi, simulation, run_against_robot, tmp_path):
    box = files.timeline_box(
        1, [files.curve("HeadYaw", [(10, -45), (25, 40)]), files.curve("RHand", [(20, 0.9)], unit=1)]
    )
    pepper = files.behavior(files.in_turn(box))
    disk = simulation.server.catalogue.disk
    files.package(disk.path("/home/nao/mydances.pkg"), "mydances", {"Pepper/Stand/salsa/behavior.xar": pepper})
    with Recorder(naoqi.robot) as joints:
        printed = run_against_robot("animations_dance", "/home/nao/mydances.pkg", "mydances/[robot]/[posture]/salsa")
    assert printed == "dances: mydances/Pepper/Stand/salsa\nhead: 0.7\n"
    assert joints["HeadYaw"].min() == pytest.approx(math.radians(-45), abs=0.05)
    assert joints["HeadYaw"][-1] == pytest.approx(math.radians(40), abs=0.02)
