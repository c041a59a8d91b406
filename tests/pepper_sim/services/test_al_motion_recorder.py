"""ALMotionRecorder over the wire; a person's hands move the robot and press its buttons."""

import time

import pytest


def _press(naoqi, part, wait_until, stored):
    """Press a part until that is seen: to a busy robot, a finger that was off for only a moment was never off."""

    def pressed_again():
        naoqi.robot.press(part, False)
        wait_until(lambda: not any(naoqi.robot.snapshot().bumpers.values()), f"{part} was released")
        naoqi.robot.press(part, True)
        patience = time.monotonic() + 5.0
        while not stored() and time.monotonic() < patience:
            time.sleep(0.02)
        return stored()

    wait_until(pressed_again, f"the press of {part} was seen")
    naoqi.robot.press(part, False)


def test_poses_are_stored_by_the_bumper_and_can_be_played(naoqi, simulation, wait_until):
    motion, recorder = naoqi.ALMotion, naoqi.ALMotionRecorder
    poses = {service.name: service for service in simulation.server.catalogue.services}["ALMotionRecorder"]
    recorder.startInteractiveRecording(["Head"], 2, False, 1)
    _press(naoqi, "RightBumper", wait_until, lambda: motion.getStiffnesses("Head") == [0.0, 0.0])
    _press(naoqi, "RightBumper", wait_until, lambda: motion.getStiffnesses("Head") == [1.0, 1.0])
    motion.angleInterpolation("Head", [0.4, -0.1], 0.3, True)
    _press(naoqi, "LeftBumper", wait_until, lambda: len(poses._poses) == 1)
    motion.angleInterpolation("Head", [-0.2, 0.1], 0.3, True)
    _press(naoqi, "LeftBumper", wait_until, lambda: len(poses._poses) == 2)
    joints, times, angles = recorder.stopAndGetRecording()
    assert joints == ["HeadYaw", "HeadPitch"] and angles[0] == pytest.approx([0.4, -0.2], abs=0.03)
    assert times[0] == times[1] and 0.0 < times[0][0] < times[0][1]
    motion.angleInterpolation(joints, angles, times, True)
    assert motion.getAngles("Head", True) == pytest.approx([-0.2, 0.1], abs=0.03)


@pytest.fixture(autouse=True)
def _ended(naoqi):
    yield
    naoqi.ALMotionRecorder.stopAndGetRecording()


def test_periodic_recording_ends_by_itself(naoqi, refused, wait_until):
    recorder = naoqi.ALMotionRecorder
    recorder.startPeriodicRecording(["HeadYaw"], 3, False, 0.05, ["LHand"], [[[0.1]], [[[0.9]]]])
    assert "already" in refused(recorder.startPeriodicRecording, ["HeadYaw"], 3, True, 0.05, [], [])
    wait_until(lambda: naoqi.ALMotion.getAngles("LHand", True)[0] > 0.85, "the hand was moved meanwhile")
    wait_until(lambda: len(recorder.stopAndGetRecording()[1][0]) > 0, "poses were stored")
