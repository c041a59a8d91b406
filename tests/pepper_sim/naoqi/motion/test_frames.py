"""Positions and transforms against the published geometry."""

import numpy as np
import pytest

TORSO, WORLD, ROBOT = 0, 1, 2


def test_zero_posture_has_the_published_geometry(naoqi):
    """Figures: ros-naoqi/pepper_robot's URDF, re-rooted at the floor."""
    motion = naoqi.ALMotion
    motion.angleInterpolation("Body", [0.0] * 17, 1.5, True)
    assert motion.getPosition("Torso", ROBOT, True)[:3] == pytest.approx([0.0, 0.0, 0.820], abs=0.01)
    assert motion.getPosition("Head", ROBOT, True)[:3] == pytest.approx([-0.038, 0.0, 0.990], abs=0.01)
    assert motion.getPosition("CameraTop", ROBOT, True)[2] == pytest.approx(1.153, abs=0.01)
    hand = motion.getPosition("LArm", TORSO, True)
    wrist = motion.getPosition("LWristYaw", TORSO, True)
    assert hand[0] - wrist[0] == pytest.approx(0.0695, abs=0.01)
    assert wrist[:2] == pytest.approx([0.272, 0.165], abs=0.02)


def test_position_and_transform_agree(naoqi):
    motion = naoqi.ALMotion
    matrix = np.array(motion.getTransform("RArm", ROBOT, True)).reshape(4, 4)
    x, y, z, *_ = motion.getPosition("RArm", ROBOT, True)
    assert matrix[:3, 3] == pytest.approx([x, y, z], abs=0.01)
    assert matrix[:3, :3] @ matrix[:3, :3].T == pytest.approx(np.eye(3), abs=1e-5)
    assert matrix[3] == pytest.approx([0, 0, 0, 1])


def test_the_world_frame_is_odometry(naoqi):
    motion = naoqi.ALMotion
    motion.moveTo(0.2, 0.0, 0.3)
    x, y, _, _, _, yaw = motion.getPosition("Torso", WORLD, True)
    assert [x, y, yaw] == pytest.approx(motion.getRobotPosition(True), abs=0.02)


def test_the_leg_stands_on_the_floor_and_a_frame_is_its_own_origin(naoqi):
    motion = naoqi.ALMotion
    assert motion.getPosition("Leg", ROBOT, True) == pytest.approx([0] * 6, abs=1e-6)
    assert motion.getPosition("Torso", TORSO, True) == pytest.approx([0] * 6, abs=1e-6)


def test_every_named_sensor_has_a_place(naoqi):
    motion = naoqi.ALMotion
    names = motion.getSensorNames()
    assert {"CameraTop", "CameraBottom", "CameraDepth"} <= set(names) and "CameraStereo" not in names
    for name in [*names, *motion.getBodyNames("Body")]:
        assert len(motion.getPosition(name, TORSO, True)) == 6


def test_unknown_names_and_frames_are_refused(naoqi, refused):
    assert "Tail" in refused(naoqi.ALMotion.getPosition, "Tail", 0, True)
    assert "space" in refused(naoqi.ALMotion.getTransform, "Head", 3, True)


def test_masses_and_their_centres(naoqi, refused):
    motion = naoqi.ALMotion
    chains = sum(motion.getMass(chain) for chain in ("Head", "LArm", "RArm", "Leg", "Torso"))
    assert motion.getMass("Body") == pytest.approx(chains, abs=0.05)
    assert motion.getMass("HeadPitch") < motion.getMass("Head") < motion.getMass("Body")
    x, y, z = motion.getCOM("Body", ROBOT, True)
    assert abs(x) < 0.05 and abs(y) < 0.01 and 0.2 < z < 0.5
    before = motion.getCOM("RArm", TORSO, False)
    motion.angleInterpolation("RShoulderPitch", 0.0, 0.5, True)
    assert motion.getCOM("RArm", TORSO, False)[0] > before[0] + 0.1, "the arm is stretched forward"
    assert "pName" in refused(motion.getMass, "Tail") and "pSpace" in refused(motion.getCOM, "Body", 3, True)


def test_the_support_polygon_moves_with_the_wheels(naoqi, refused):
    motion = naoqi.ALMotion
    start = np.array(motion.getSupportPolygon(ROBOT, True))
    assert len(start) == 3
    sides = start[1:] - start[0]
    assert np.linalg.det(sides) > 0.05, "counter-clockwise"
    motion.moveTo(0.2, 0.0, 0.0)
    assert np.array(motion.getSupportPolygon(WORLD, True)) == pytest.approx(start + np.array([0.2, 0.0]), abs=0.02)
    assert "pFrame" in refused(motion.getSupportPolygon, TORSO, True)
