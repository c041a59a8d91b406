"""ALMotion: reflexes. Distances in metres.

Defaults and who may switch what: NAOqi 2.8 documentation, reflexes-external-collision and almotion ("deactivation of
safety reflexes").
"""

from __future__ import annotations

from pepper_sim.naoqi.service import ServiceError, one_of, remote, within
from pepper_sim.robot import Pepper
from pepper_sim.services.al_memory import ALMemory

_PROTECTED = ("All", "Move", "Arms", "LArm", "RArm")
_FREE = ("Arms", "LArm", "RArm")
_MAX_DISTANCE = 5.0
_CONSENT = "the owner has not consented on the robot's page to switch this off"


class MotionReflexes:
    """Reflex part of ALMotion."""

    def __init__(self, robot: Pepper, memory: ALMemory) -> None:
        self._robot = robot
        self._memory = memory
        self._arms = {"LArm": True, "RArm": True}
        self._self_collision = {"Arms": True, "LArm": True, "RArm": True}

    @remote("v(sb)")
    def setExternalCollisionProtectionEnabled(self, pName: str, pEnable: bool) -> None:
        """Switches the protection against obstacles on or off. "All" and "Move" stay on without the owner's consent."""
        one_of(pName, _PROTECTED, "pName")
        if pName not in _FREE:
            self._require_consent(pEnable, f"pName '{pName}'")
            self._robot.security.enabled = pEnable
        for arm in self._arms:
            if pName in (arm, "Arms", "All"):
                self._arms[arm] = pEnable

    @remote("b(s)")
    def getExternalCollisionProtectionEnabled(self, pName: str) -> bool:
        """Whether the protection is on; for a group, whether it is on for all of it."""
        one_of(pName, _PROTECTED, "pName")
        states = {"Move": self._robot.security.enabled, **self._arms}
        names = {"All": tuple(states), "Arms": ("LArm", "RArm")}.get(pName, (pName,))
        return all(states[name] for name in names)

    @remote("v(f)")
    def setOrthogonalSecurityDistance(self, securityDistance: float) -> None:
        """Sets the distance kept ahead [m]; a negative one counts as 0."""
        self._robot.security.orthogonal = _distance(securityDistance)

    @remote("f()")
    def getOrthogonalSecurityDistance(self) -> float:
        """Returns the distance kept ahead [m]."""
        return float(self._robot.security.orthogonal)

    @remote("v(f)")
    def setTangentialSecurityDistance(self, securityDistance: float) -> None:
        """Sets the distance kept beside [m]; a negative one counts as 0."""
        self._robot.security.tangential = _distance(securityDistance)

    @remote("f()")
    def getTangentialSecurityDistance(self) -> float:
        """Returns the distance kept beside [m]."""
        return float(self._robot.security.tangential)

    @remote("[f](si)")
    def getChainClosestObstaclePosition(self, pName: str, space: int) -> list[float]:
        """Returns the position of the obstacle nearest to an arm. Nothing on this robot measures it."""
        one_of(pName, ("LArm", "RArm"), "pName")
        one_of(space, (0, 1, 2), "space")
        raise ServiceError(f"no obstacle is known near {pName}")

    @remote("b(sb)")
    def setCollisionProtectionEnabled(self, pChainName: str, pEnable: bool) -> bool:
        """Switches an arm's protection against the robot's own body on or off. Stored only."""
        one_of(pChainName, self._self_collision, "pChainName")
        for arm in ("LArm", "RArm") if pChainName == "Arms" else (pChainName,):
            self._self_collision[arm] = pEnable
        self._self_collision["Arms"] = self._self_collision["LArm"] and self._self_collision["RArm"]
        return True

    @remote("b(s)")
    def getCollisionProtectionEnabled(self, pChainName: str) -> bool:
        """Whether an arm's protection against the robot's own body is on."""
        return self._self_collision[one_of(pChainName, self._self_collision, "pChainName")]

    @remote("m(s)")
    def isCollision(self, pChainName: str) -> str:
        """Whether an arm is near the robot's own body: "none"."""
        one_of(pChainName, self._self_collision, "pChainName")
        return "none"

    @remote("v(b)")
    def setSmartStiffnessEnabled(self, pEnable: bool) -> None:
        """Switches smart stiffness on or off: motors that save power while nothing moves."""
        self._robot.smart_stiffness = pEnable

    @remote("b()")
    def getSmartStiffnessEnabled(self) -> bool:
        """Whether smart stiffness is on."""
        return self._robot.smart_stiffness

    @remote("v(b)")
    def setFallManagerEnabled(self, pEnable: bool) -> None:
        """Switches the fall manager on or off; off only with the owner's consent."""
        self._require_consent(pEnable, "pEnable")
        self._robot.fall_manager = pEnable

    @remote("b()")
    def getFallManagerEnabled(self) -> bool:
        """Whether the fall manager is on."""
        return self._robot.fall_manager

    @remote("v(b)")
    def setDiagnosisEffectEnabled(self, pEnable: bool) -> None:
        """Switches the reaction to a faulty device on or off."""
        self._robot.diagnosis_effect = pEnable

    @remote("b()")
    def getDiagnosisEffectEnabled(self) -> bool:
        """Whether a faulty device keeps the robot from waking up."""
        return self._robot.diagnosis_effect

    @remote("v(b)")
    def setPushRecoveryEnabled(self, pEnable: bool) -> None:
        """Switches push recovery on or off; off only with the owner's consent. Stored only."""
        self._require_consent(pEnable, "pEnable")
        self._robot.push_recovery = pEnable

    @remote("b()")
    def getPushRecoveryEnabled(self) -> bool:
        """Whether push recovery is on."""
        return self._robot.push_recovery

    def _require_consent(self, enable: bool, argument: str) -> None:
        if not enable and not self._robot.consent.given:
            raise ServiceError(f"{argument}: {_CONSENT}")


def _distance(distance: float) -> float:
    """Return a security distance [m] as the robot takes it (NAOqi 2.8 documentation, reflexes-external-collision)."""
    return within(0.0 if distance < 0.0 else distance, 0.0, _MAX_DISTANCE, "securityDistance")
