"""ALMotion's description of the body, its task list and kept switches."""

import pytest


def test_groups_have_the_documented_order(naoqi, refused):
    names = naoqi.ALMotion.getBodyNames
    body = names("Body")
    assert len(body) == 17 and body[0] == "HeadYaw" and body[7] == "LHand" and body[10] == "KneePitch"
    assert names("JointActuators") == body
    assert names("Chains") == ["Head", "LArm", "Leg", "RArm"]
    assert set(body) - set(names("Joints")) == set(names("Actuators")) == {"LHand", "RHand"}
    assert naoqi.ALMotion.getJointNames("Head") == ["HeadYaw", "HeadPitch"]
    assert "Tail" in refused(names, "Tail")


def test_limits(naoqi):
    rows = naoqi.ALMotion.getLimits("Head")
    assert rows[0] == pytest.approx([-2.08567, 2.08567, 7.33998, 5.428], rel=1e-4)
    assert len(naoqi.ALMotion.getLimits("Body")) == 17


def test_robot_config_has_the_fields_that_drivers_read(naoqi):
    names, values = naoqi.ALMotion.getRobotConfig()
    config = dict(zip(names, values, strict=True))
    assert config["Model Type"].startswith("JULIETTE") and config["Number of Arms"] == 2
    assert isinstance(config["Laser"], bool) and isinstance(config["Number of Legs"], int)


def test_mass_cycle_and_summary(naoqi):
    motion = naoqi.ALMotion
    assert motion.getMass("Body") == pytest.approx(28.68, abs=0.01)
    assert motion.getMotionCycleTime() == 20
    assert "HeadYaw" in motion.getSummary()


def test_tasks_are_listed_and_can_be_killed(naoqi, wait_until):
    motion = naoqi.ALMotion
    call = motion.angleInterpolation("HeadYaw", 1.0, 10.0, True, _async=True)
    wait_until(motion.getTaskList, "the task is listed")
    name, number, resources = motion.getTaskList()[0]
    assert name == "angleInterpolation" and resources == ["HeadYaw"]
    assert motion.areResourcesAvailable(["Head"]) is False
    assert motion.areResourcesAvailable(["RArm"]) is True
    assert motion.killTask(number) is True
    call.wait(3000)
    assert call.isFinished() and motion.killTask(number) is False


def test_kill_all_ends_everything(naoqi, wait_until):
    motion = naoqi.ALMotion
    arm = motion.angleInterpolation("RShoulderPitch", 0.5, 10.0, True, _async=True)
    base = motion.moveTo(1.0, 0.0, 0.0, _async=True)
    wait_until(lambda: len(motion.getTaskList()) == 2, "both tasks are listed")
    motion.killAll()
    arm.wait(3000)
    assert base.value(3000) is False and arm.isFinished()


def test_tasks_end_by_resource(naoqi, wait_until, refused):
    motion = naoqi.ALMotion
    base = motion.moveTo(1.0, 0.0, 0.0, _async=True)
    wait_until(motion.getTaskList, "the task is listed")
    motion.killTasksUsingResources(["Base"])
    assert base.value(3000) is False
    assert "resourceNames" in refused(motion.killTasksUsingResources, ["Tail"])


def test_motion_config_is_checked(naoqi, refused):
    naoqi.ALMotion.setMotionConfig([["ENABLE_DCM_LIKE", True]])
    assert "config" in refused(naoqi.ALMotion.setMotionConfig, [["FLY", True]])
