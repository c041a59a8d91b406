"""What the robot does while no command moves it."""

import pytest

from pepper_sim.naoqi.motion import idle


@pytest.fixture(autouse=True)
def _soon(monkeypatch, simulation):
    monkeypatch.setattr(idle, "PATIENCE", 0.4)
    yield
    motion = {service.name: service for service in simulation.server.catalogue.services}["ALMotion"]
    motion._idle.close()


def test_breathing_moves_the_joints_and_gives_way_to_commands(naoqi, wait_until):
    motion = naoqi.ALMotion
    motion.setBreathConfig([["Bpm", 30.0], ["Amplitude", 1.0]])
    motion.setBreathEnabled("Body", True)
    assert (
        motion.getBreathEnabled("Body") and motion.getBreathEnabled("Arms") and not motion.getIdlePostureEnabled("Head")
    )
    still = motion.getAngles("LElbowRoll", False)[0]
    wait_until(lambda: abs(motion.getAngles("LElbowRoll", False)[0] - still) > 0.03, "the chest rises")
    motion.angleInterpolation("LElbowRoll", -1.0, 0.2, True)
    assert motion.getAngles("LElbowRoll", False)[0] == pytest.approx(-1.0, abs=0.01), "nothing was waited for"
    wait_until(lambda: motion.getAngles("LElbowRoll", False)[0] < -1.02, "it breathes on from there")
    motion.setBreathEnabled("Arms", False)
    assert not motion.getBreathEnabled("Body") and motion.getBreathEnabled("Head")
    motion.setBreathEnabled("Body", False)
    wait_until(lambda: not motion.getTaskList(), "the robot is still")


def test_an_idle_chain_comes_back_to_its_posture(naoqi, wait_until):
    motion = naoqi.ALMotion
    motion.setAngles("HeadYaw", 0.1, 1.0)
    motion.setIdlePostureEnabled("Head", True)
    assert motion.getIdlePostureEnabled("Head") and not motion.getIdlePostureEnabled("Body")
    wait_until(lambda: abs(motion.getAngles("HeadYaw", True)[0]) < 0.03, "the head looks ahead")
    motion.setBreathEnabled("Head", True)
    assert not motion.getIdlePostureEnabled("Head"), "the last call decides"
    motion.setBreathEnabled("Head", False)


def test_a_limp_robot_does_not_breathe(naoqi, wait_until):
    motion = naoqi.ALMotion
    motion.setStiffnesses("Head", 0.0)
    motion.setBreathEnabled("Head", True)
    assert motion.getTaskList() == []
    motion.setStiffnesses("Head", 1.0)
    wait_until(motion.getTaskList, "it breathes again")
    motion.setBreathEnabled("Head", False)


def test_wrong_settings_are_refused(naoqi, refused):
    motion = naoqi.ALMotion
    assert "Bpm" in refused(motion.setBreathConfig, [["Bpm", 500.0]])
    assert dict(motion.getBreathConfig())["Bpm"] <= 30.0
    assert "pChain" in refused(motion.setBreathEnabled, "Tail", True)
