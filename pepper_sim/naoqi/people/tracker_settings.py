"""The settings of ALTracker: what follows a target, how near, how fast, and when the target counts as lost."""

from __future__ import annotations

from typing import Any

from pepper_sim.naoqi.motion.move_config import configured_limits, move_config_table
from pepper_sim.naoqi.people.aim import ARMS
from pepper_sim.naoqi.people.pursuit import Pursuit
from pepper_sim.naoqi.service import ServiceError, finite, one_of, remote, shown

MODES = ("Head", "WholeBody", "Move", "Navigate")
EFFECTORS = ("None", *ARMS)
_FARTHEST = 1000.0
_RELATIVE = [-0.5, 0.0, 0.0, 0.1, 0.1, 0.3]


def check_fraction(fraction: float) -> float:
    """Return `fraction` of a top speed if it is one.

    Raises: ServiceError: It is not above 0 and at most 1.
    """
    if not 0.0 < fraction <= 1.0:
        raise ServiceError(f"fractionMaxSpeed must be above 0 and at most 1, got {fraction:g}")
    return fraction


class TrackerSettings:
    """Remote methods of ALTracker."""

    def __init__(self, pursuit: Pursuit) -> None:
        self._pursuit = pursuit
        self.initialize()

    @remote("v()")
    def initialize(self) -> None:
        """Restores all parameters."""
        self._pursuit.reset()
        self._pursuit.relative = list(_RELATIVE)
        self._pursuit.farthest = _FARTHEST
        self._move_config: Any = move_config_table("Default")
        self._acceleration = 12.0

    @remote("v(s)")
    def setMode(self, pMode: str) -> None:
        """Sets what follows the target: "Head", "WholeBody" without the wheels, "Move" or "Navigate"."""
        self._pursuit.set_mode(one_of(pMode, MODES, "pMode"))

    @remote("s()")
    def getMode(self) -> str:
        """Returns what follows the target."""
        return self._pursuit.mode

    @remote("[s]()")
    def getAvailableModes(self) -> list[str]:
        """Lists the modes."""
        return list(MODES)

    @remote("v(s)")
    def setEffector(self, pEffector: str) -> None:
        """Sets which arms point at the target."""
        self._pursuit.effector = one_of(pEffector, EFFECTORS, "pEffector")

    @remote("v(s)")
    def addEffector(self, pEffector: str) -> None:
        """Old name of setEffector."""
        self._pursuit.effector = one_of(pEffector, ARMS, "pEffector")

    @remote("v(s)")
    def removeEffector(self, pEffector: str) -> None:
        """Old form of setEffector("None")."""
        one_of(pEffector, ARMS, "pEffector")
        self._pursuit.effector = "None"

    @remote("s()")
    def getEffector(self) -> str:
        """Returns which arms point at the target."""
        return self._pursuit.effector

    @remote("v(m)")
    def setRelativePosition(self, target: Any) -> None:
        """Sets where to stay, seen from the target: [x, y, θ, and the three tolerances]."""
        if not isinstance(target, list | tuple) or len(target) not in (3, 6):
            raise ServiceError(f"target must be a list of 6 numbers, got {shown(target)}")
        values = [finite(value, f"target[{index}]") for index, value in enumerate(target)]
        self._pursuit.relative = [*values, *_RELATIVE[len(values) :]]

    @remote("m()")
    def getRelativePosition(self) -> list[float]:
        """Returns where to stay, seen from the target."""
        return self._pursuit.relative

    @remote("v(m)")
    def setMoveConfig(self, config: Any) -> None:
        """Sets speeds and accelerations of the base: [[name, value], ...]."""
        self._pursuit.limits = configured_limits(config)
        self._move_config = config

    @remote("m()")
    def getMoveConfig(self) -> Any:
        """Returns speeds and accelerations of the base."""
        return self._move_config

    @remote("v(f)")
    def setMaximumDistanceDetection(self, pMaxDistance: float) -> None:
        """Sets from what distance on a target counts as lost [m]."""
        self._pursuit.farthest = _positive(pMaxDistance, "pMaxDistance")

    @remote("f()")
    def getMaximumDistanceDetection(self) -> float:
        """Returns from what distance on a target counts as lost [m]."""
        return self._pursuit.farthest

    @remote("v(f)")
    def setMaximumVelocity(self, pMaxVelocity: float) -> None:
        """Sets how fast the head follows [rad/s]."""
        self._pursuit.velocity = _positive(pMaxVelocity, "pMaxVelocity")

    @remote("f()")
    def getMaximumVelocity(self) -> float:
        """Returns how fast the head follows [rad/s]."""
        return self._pursuit.velocity

    @remote("v(f)")
    def setMaximumAcceleration(self, pMaxAcceleration: float) -> None:
        """Sets how fast the head speeds up [rad/s²]. Stored only: the head's servos have their own."""
        self._acceleration = _positive(pMaxAcceleration, "pMaxAcceleration")

    @remote("f()")
    def getMaximumAcceleration(self) -> float:
        """Returns how fast the head speeds up [rad/s²]."""
        return self._acceleration

    @remote("v(i)")
    def setTimeOut(self, pTimeMs: int) -> None:
        """Sets after what time an unseen target counts as lost [ms]."""
        self._pursuit.patience = 1e-3 * _positive(pTimeMs, "pTimeMs")

    @remote("i()")
    def getTimeOut(self) -> int:
        """Returns after what time an unseen target counts as lost [ms]."""
        return round(1e3 * self._pursuit.patience)

    @remote("v(b)")
    def toggleSearch(self, pSearch: bool) -> None:
        """Switches the search for a lost target on or off."""
        self._pursuit.searching = pSearch

    @remote("b()")
    def isSearchEnabled(self) -> bool:
        """Whether a lost target is searched for."""
        return self._pursuit.searching

    @remote("v(f)")
    def setSearchFractionMaxSpeed(self, pFractionMaxSpeed: float) -> None:
        """Sets how fast the head searches, 0 to 1."""
        self._pursuit.search_fraction = check_fraction(pFractionMaxSpeed)

    @remote("f()")
    def getSearchFractionMaxSpeed(self) -> float:
        """Returns how fast the head searches."""
        return self._pursuit.search_fraction


def _positive(value: float, argument: str) -> float:
    if value <= 0.0:
        raise ServiceError(f"{argument} must be positive, got {value:g}")
    return value
