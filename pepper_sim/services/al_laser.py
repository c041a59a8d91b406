"""ALLaser: settings of the head laser of older robots. Pepper's lasers in the base are always on and in ALMemory."""

from __future__ import annotations

from pepper_sim.naoqi.service import Module, one_of, remote, within

_ANGLES, _LENGTHS = (-2.35619449, 2.092349795), (20, 5600)  # [rad], [mm] (NAOqi 2.1 documentation, ALLaser)


class ALLaser(Module):
    """Accepts the settings of the head laser; Pepper has none."""

    name = "ALLaser"

    @remote("v()")
    def laserON(self) -> None:
        """Switches the laser on. It is always on."""

    @remote("v()")
    def laserOFF(self) -> None:
        """Switches the laser off. Ignored: the collision protection of the base needs the lasers."""

    @remote("v(ff)")
    def setOpeningAngle(self, angle_min: float, angle_max: float) -> None:
        """Sets the scanned angle [rad]. Checked and ignored."""
        within(angle_min, *_ANGLES, "angle_min")
        within(angle_max, angle_min, _ANGLES[1], "angle_max")

    @remote("v(ii)")
    def setDetectingLength(self, length_min: int, length_max: int) -> None:
        """Sets the range [mm]. Checked and ignored."""
        within(length_min, *_LENGTHS, "length_min")
        within(length_max, length_min, _LENGTHS[1], "length_max")

    @remote("v(s)")
    def setMode(self, mode: str) -> None:
        """Sets the format of the output. Checked and ignored."""
        one_of(mode, ("X_Y", "LENGTH_ANGLE"), "mode")
