"""ALRobotModel: what kind of robot this is."""

from __future__ import annotations

from xml.sax.saxutils import quoteattr

from pepper_sim.naoqi.identity import IDENTITY_KEYS, ROBOT_TYPE
from pepper_sim.naoqi.service import Service, remote


class ALRobotModel(Service):
    """Type and configuration of the robot."""

    name = "ALRobotModel"

    @remote("s()")
    def getRobotType(self) -> str:
        """Returns "Pepper"."""
        return ROBOT_TYPE

    @remote("b()")
    def hasArms(self) -> bool:
        """Whether the robot has arms."""
        return True

    @remote("b()")
    def hasHands(self) -> bool:
        """Whether the robot has hands."""
        return True

    @remote("b()")
    def hasLegs(self) -> bool:
        """Whether the robot walks."""
        return False

    @remote("b()")
    def hasLaser(self) -> bool:
        """Whether the robot has a laser in its head."""
        return False

    @remote("s()")
    def getConfig(self) -> str:
        """Returns the configuration as XML: for each value the key of ALMemory that holds it, and its type."""
        lines = [
            f"  <Preference name={quoteattr(key.rpartition('/')[2])} memoryName={quoteattr(key)}"
            f' description="" value={quoteattr(text)} type="string"/>'
            for key, text in IDENTITY_KEYS.items()
        ]
        return "\n".join(['<ModulePreference name="RobotConfig">', *lines, "</ModulePreference>"])

    @remote("{ss}()")
    def _getConfigMap(self) -> dict[str, str]:
        """Returns the configuration as a map."""
        return dict(IDENTITY_KEYS)

    @remote("i()")
    def _getMicrophoneConfig(self) -> int:
        """Returns the arrangement of the microphones: 1, Pepper's; 0 is NAO's left, right, front, rear."""
        return 1
