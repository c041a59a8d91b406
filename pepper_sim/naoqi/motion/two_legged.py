"""ALMotion: what only the two-legged robot does. Pepper has these methods and refuses them (NAOqi 2.8 documentation,
control-walk, control-wholebody and control-cartesian: "do not use on Pepper")."""

from __future__ import annotations

from typing import Any, NoReturn

from pepper_sim.naoqi.service import ServiceError, remote


class MotionOfTwoLegs:
    """Footsteps, the whole body's balance, and the inverse kinematics of effectors."""

    # --- footsteps ---------------------------------------------------------------------------------------------------

    @remote("v([s]m[f]b)")
    def setFootSteps(self, legName: list[str], footSteps: Any, timeList: list[float], clearExisting: bool) -> None:
        """Walks given steps. Refused: Pepper has wheels."""
        _refuse()

    @remote("v([s]m[f]b)")
    def setFootStepsWithSpeed(
        self, legName: list[str], footSteps: Any, fractionMaxSpeed: list[float], clearExisting: bool
    ) -> None:
        """Walks given steps. Refused: Pepper has wheels."""
        _refuse()

    @remote("m()")
    def getFootSteps(self) -> Any:
        """Returns the planned steps. Refused: Pepper has wheels."""
        _refuse()

    # --- effectors ---------------------------------------------------------------------------------------------------

    @remote("v(simimb)")
    def positionInterpolation(
        self, effectorName: str, frame: int, path: Any, axisMask: int, durations: Any, isAbsolute: bool
    ) -> None:
        """Moves an effector along a path. Refused on Pepper."""
        _refuse()

    @remote("v(mmmmm)")
    def positionInterpolations(
        self, effectorNames: Any, frames: Any, paths: Any, axisMasks: Any, relativeTimes: Any
    ) -> None:
        """Moves effectors along paths. Refused on Pepper."""
        _refuse()

    @remote("v([s]immmb)", name="positionInterpolations")
    def positionInterpolationsRelative(
        self, effectorNames: list[str], frame: int, paths: Any, axisMasks: Any, relativeTimes: Any, isAbsolute: bool
    ) -> None:
        """Moves effectors along paths. Refused on Pepper."""
        _refuse()

    @remote("v(si[f]fi)")
    def setPosition(
        self, effectorName: str, frame: int, position: list[float], fractionMaxSpeed: float, axisMask: int
    ) -> None:
        """Moves an effector. Refused on Pepper."""
        _refuse()

    @remote("v(mmmfm)")
    def setPositions(
        self, effectorNames: Any, frame: Any, position: Any, fractionMaxSpeed: float, axisMask: Any
    ) -> None:
        """Moves effectors. Refused on Pepper."""
        _refuse()

    @remote("v(si[f]fi)")
    def changePosition(
        self, effectorName: str, frame: int, positionChange: list[float], fractionMaxSpeed: float, axisMask: int
    ) -> None:
        """Moves an effector by a distance. Refused on Pepper."""
        _refuse()

    @remote("v(simimb)")
    def transformInterpolation(
        self, chainName: str, frame: int, path: Any, axisMask: int, duration: Any, isAbsolute: bool
    ) -> None:
        """Moves an effector along transforms. Refused on Pepper."""
        _refuse()

    @remote("v(mmmmm)")
    def transformInterpolations(
        self, effectorNames: Any, frames: Any, paths: Any, axisMasks: Any, relativeTimes: Any
    ) -> None:
        """Moves effectors along transforms. Refused on Pepper."""
        _refuse()

    @remote("v([s]immmb)", name="transformInterpolations")
    def transformInterpolationsRelative(
        self, effectorNames: list[str], frame: int, paths: Any, axisMasks: Any, relativeTimes: Any, isAbsolute: bool
    ) -> None:
        """Moves effectors along transforms. Refused on Pepper."""
        _refuse()

    @remote("v(si[f]fi)")
    def setTransform(
        self, chainName: str, frame: int, transform: list[float], fractionMaxSpeed: float, axisMask: int
    ) -> None:
        """Moves an effector to a transform. Refused on Pepper."""
        _refuse()

    @remote("v(mmmfm)", "v(si[f]fi)")
    def setTransforms(
        self, effectorNames: Any, frame: Any, transform: Any, fractionMaxSpeed: float, axisMask: Any
    ) -> None:
        """Moves effectors to transforms. Refused on Pepper."""
        _refuse()

    @remote("v(si[f]fi)")
    def changeTransform(
        self, chainName: str, frame: int, transform: list[float], fractionMaxSpeed: float, axisMask: int
    ) -> None:
        """Moves an effector by a transform. Refused on Pepper."""
        _refuse()

    # --- balance of the whole body -----------------------------------------------------------------------------------

    @remote("v(b)")
    def wbEnable(self, isEnabled: bool) -> None:
        """Switches the balancer on or off. Refused on Pepper."""
        _refuse()

    @remote("v(ss)")
    def wbFootState(self, stateName: str, supportLeg: str) -> None:
        """Fixes or frees a foot. Refused: Pepper has none."""
        _refuse()

    @remote("v(bs)")
    def wbEnableBalanceConstraint(self, isEnable: bool, supportLeg: str) -> None:
        """Keeps the balance over a foot. Refused: Pepper has none."""
        _refuse()

    @remote("v(sf)")
    def wbGoToBalance(self, supportLeg: str, duration: float) -> None:
        """Balances on a leg. Refused: Pepper has wheels."""
        _refuse()

    @remote("v(sf)")
    def wbGoToBalanceWithSpeed(self, supportLeg: str, fractionMaxSpeed: float) -> None:
        """Balances on a leg. Refused: Pepper has wheels."""
        _refuse()

    @remote("v(sb)")
    def wbEnableEffectorControl(self, effectorName: str, isEnabled: bool) -> None:
        """Controls an effector with the whole body. Refused on Pepper."""
        _refuse()

    @remote("v(sm)")
    def wbSetEffectorControl(self, effectorName: str, targetCoordinate: Any) -> None:
        """Moves an effector with the whole body. Refused on Pepper."""
        _refuse()

    @remote("v(sb)")
    def wbEnableEffectorOptimization(self, effectorName: str, isActive: bool) -> None:
        """Lets an effector help others. Refused on Pepper."""
        _refuse()


def _refuse() -> NoReturn:
    raise ServiceError("not available on this robot")
