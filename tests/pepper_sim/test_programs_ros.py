"""Programs that read and drive the robot as a driver does, run unchanged; what they did is seen in the world."""

import re

import numpy as np
import pytest

SHELF = 0.45
"""How far ahead of base_footprint the robot's sensors see an edge [m]."""


def test_a_logger_of_joints_reads_what_they_do(naoqi, run_against_robot):
    naoqi.ALMotion.setAngles("HeadYaw", 0.3, 1.0)
    logged = run_against_robot("ros_joint_logger", "--seconds", 1.0)
    assert "17 joints" in logged and "finite: True" in logged
    assert 1 < int(re.search(r"(\d+) cycles", logged)[1]) <= 51
    assert float(re.search(r"height (\S+)", logged)[1]) == pytest.approx(0.82, abs=0.1)
    measured = naoqi.robot.snapshot().joint_positions["HeadYaw"]
    assert float(re.search(r"yaw ([-\d.]+)", logged)[1]) == pytest.approx(measured, abs=0.02)


def test_only_the_owners_consent_lets_a_program_drive_up_to_an_edge(naoqi, run_against_robot):
    naoqi.robot.security.update("edge", np.array([[SHELF, y] for y in (-0.1, 0.0, 0.1)]), (0.0, 0.0, 0.0))
    printed = run_against_robot("ros_close_to_shelf")
    assert "protected: \tALMotion::setExternalCollisionProtectionEnabled" in printed and "protection: True" in printed
    assert "arrived: True" not in printed
    stopped = naoqi.robot.truth()[0]
    assert stopped < 0.2, "it kept its distance"

    naoqi.simulation.restart()
    naoqi.robot.security.update("edge", np.array([[SHELF, 0.0]]), (0.0, 0.0, 0.0))
    naoqi.robot.consent.given = True
    printed = run_against_robot("ros_close_to_shelf")
    assert "protection: False" in printed and "arrived: True" in printed
    assert naoqi.robot.truth()[0] == pytest.approx(0.4, abs=0.05)
    assert naoqi.robot.security.enabled, "the program has switched it on again"
