"""ALMotion's reflexes."""

import pytest


def test_distances_act_on_the_robot(naoqi, refused):
    motion = naoqi.ALMotion
    assert motion.getOrthogonalSecurityDistance() == pytest.approx(0.4)
    assert motion.getTangentialSecurityDistance() == pytest.approx(0.1)
    motion.setOrthogonalSecurityDistance(0.2)
    motion.setTangentialSecurityDistance(0.05)
    assert naoqi.robot.security.orthogonal == pytest.approx(0.2)
    assert motion.getTangentialSecurityDistance() == pytest.approx(0.05)
    motion.setOrthogonalSecurityDistance(-1.0)
    motion.setTangentialSecurityDistance(-0.01)
    assert motion.getOrthogonalSecurityDistance() == motion.getTangentialSecurityDistance() == 0.0
    for method in (motion.setOrthogonalSecurityDistance, motion.setTangentialSecurityDistance):
        assert "securityDistance" in refused(method, 100.0)
        refused(method, float("nan"))
    motion.setOrthogonalSecurityDistance(0.4)
    motion.setTangentialSecurityDistance(0.1)


def test_protection_of_the_base_needs_consent_that_of_the_arms_does_not(naoqi, refused):
    motion = naoqi.ALMotion
    for name in ("All", "Move"):
        assert "consent" in refused(motion.setExternalCollisionProtectionEnabled, name, False)
    assert naoqi.robot.security.enabled
    motion.setExternalCollisionProtectionEnabled("Arms", False)
    assert motion.getExternalCollisionProtectionEnabled("LArm") is False
    assert motion.getExternalCollisionProtectionEnabled("All") is False
    assert motion.getExternalCollisionProtectionEnabled("Move") is True
    motion.setExternalCollisionProtectionEnabled("All", True)
    assert motion.getExternalCollisionProtectionEnabled("All") is True
    assert "pName" in refused(motion.setExternalCollisionProtectionEnabled, "Tail", True)


def test_switches_that_need_consent(naoqi, refused):
    motion = naoqi.ALMotion
    assert "consent" in refused(motion.setFallManagerEnabled, False)
    assert "consent" in refused(motion.setPushRecoveryEnabled, False)
    assert motion.getFallManagerEnabled() and motion.getPushRecoveryEnabled()


def test_switches_that_are_kept(naoqi, refused):
    motion = naoqi.ALMotion
    motion.setSmartStiffnessEnabled(False)
    motion.setDiagnosisEffectEnabled(False)
    assert not motion.getSmartStiffnessEnabled() and not motion.getDiagnosisEffectEnabled()
    assert motion.setCollisionProtectionEnabled("Arms", False) is True
    assert motion.getCollisionProtectionEnabled("LArm") is False
    motion.setCollisionProtectionEnabled("Arms", True)
    assert motion.getCollisionProtectionEnabled("Arms") is True
    assert "pChainName" in refused(motion.setCollisionProtectionEnabled, "Head", True)
    assert "LArm" in refused(motion.getChainClosestObstaclePosition, "LArm", 0)
    motion.setSmartStiffnessEnabled(True)
    motion.setDiagnosisEffectEnabled(True)
