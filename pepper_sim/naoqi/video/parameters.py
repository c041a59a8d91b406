"""ALVideoDevice's camera parameters: ids, ranges, defaults (NAOqi 2.8 documentation, video_2D_pep, video_3D_pep and
video_Stereo_pep)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from pepper_sim.naoqi.service import ServiceError, within

FAILED = 0xDEAD404
"""What getParameter returns for a parameter that the camera does not have."""
RESOLUTION, CAMERA_SELECT = 14, 18
HORIZONTAL_FLIP, VERTICAL_FLIP = 7, 8


@dataclass(frozen=True)
class Parameter:
    """Range, default, and step between the values that are allowed."""

    low: int
    high: int
    default: int
    step: int = 1


PARAMETERS: dict[int, Parameter] = {
    0: Parameter(-255, 255, 0),  # brightness
    1: Parameter(0, 255, 32),  # contrast
    2: Parameter(0, 255, 64),  # saturation
    3: Parameter(-180, 180, 0),  # hue
    6: Parameter(0, 1023, 16),  # gain
    7: Parameter(0, 1, 0),  # horizontal flip
    8: Parameter(0, 1, 0),  # vertical flip
    11: Parameter(0, 1, 1),  # auto exposure
    12: Parameter(0, 1, 1),  # auto white balance
    13: Parameter(0, 1, 1),  # auto gain
    17: Parameter(0, 65535, 32),  # exposure
    24: Parameter(0, 9, 4),  # sharpness
    33: Parameter(-180, 180, 0),  # white balance
    34: Parameter(0, 4, 0),  # backlight compensation
    35: Parameter(0, 1, 0),  # keep alive
    40: Parameter(0, 1, 0),  # auto focus
    43: Parameter(0, 250, 0, step=25),  # focus
}
"""Id -> parameter of the OV5640. The flips change the picture; the others are only stored. Average luminance (39) is
not measured."""

STEREO_PARAMETERS: dict[int, Parameter] = {
    0: Parameter(0, 8, 4),  # brightness
    1: Parameter(0, 8, 4),  # contrast
    2: Parameter(0, 8, 4),  # saturation
    3: Parameter(0, 11, 0),  # hue
    6: Parameter(0, 1024, 16),  # gain; no default is documented
    7: Parameter(0, 1, 0),  # horizontal flip
    8: Parameter(0, 1, 0),  # vertical flip
    11: Parameter(0, 1, 1),  # auto exposure
    12: Parameter(0, 1, 1),  # auto white balance
    17: Parameter(0, 1024, 32),  # exposure; no default is documented
    35: Parameter(0, 1, 0),  # keep alive
}
"""Id -> parameter of the stereo camera, OV4689."""

STEREO_DEPTH_PARAMETERS: dict[int, Parameter] = {
    35: Parameter(0, 1, 0),  # keep alive
    42: Parameter(5, 43, 21, step=2),  # size of the window in which disparities are looked for
}
"""Id -> parameter of the depth that is computed from the stereo camera. They are only stored."""


class CameraParameters:
    """The settings of one camera, which has the parameters `known`."""

    def __init__(self, known: Mapping[int, Parameter] = PARAMETERS) -> None:
        self._known = known
        self._values: dict[int, int] = {}
        self.set_all_defaults()

    def get(self, identity: int) -> int:
        """Return the value, or FAILED for an unknown id."""
        return self._values.get(identity, FAILED)

    def set(self, identity: int, value: int) -> None:
        """Change a value; -1 restores the default.

        Raises: ServiceError: Unknown id, or a value out of range.
        """
        parameter = self.known(identity)
        if value == -1 and parameter.low >= 0:
            value = parameter.default
        within(value, parameter.low, parameter.high, f"newValue of parameter {identity}")
        if (value - parameter.low) % parameter.step:
            raise ServiceError(f"newValue of parameter {identity} must be a multiple of {parameter.step}, got {value}")
        self._values[identity] = value

    def set_default(self, identity: int) -> None:
        """Restore the default of a value.

        Raises: ServiceError: Unknown id.
        """
        self._values[identity] = self.known(identity).default

    def set_all_defaults(self) -> None:
        self._values = {identity: parameter.default for identity, parameter in self._known.items()}

    @property
    def flips(self) -> tuple[bool, bool]:
        """Whether pictures are mirrored left to right, and upside down."""
        return bool(self._values.get(HORIZONTAL_FLIP)), bool(self._values.get(VERTICAL_FLIP))

    def known(self, identity: int) -> Parameter:
        """Return the parameter with this id.

        Raises: ServiceError: The camera has no such parameter.
        """
        if identity not in self._known:
            raise ServiceError(f"parameter {identity} is unknown; known: {', '.join(map(str, self._known))}")
        return self._known[identity]
