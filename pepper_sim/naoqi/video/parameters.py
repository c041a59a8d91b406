"""ALVideoDevice's camera parameters: ids, ranges, defaults of the OV5640 (NAOqi 2.8 documentation, video_2D_pep)."""

from __future__ import annotations

from dataclasses import dataclass

from pepper_sim.naoqi.service import ServiceError, within

FAILED = 0xDEAD404
"""What getParameter returns for a parameter that the camera does not have."""
RESOLUTION, FRAME_RATE, CAMERA_SELECT = 14, 15, 18
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
"""Id -> parameter. The flips change the picture; the others are only stored. Average luminance (39) is not measured."""


class CameraParameters:
    """The settings of one camera."""

    def __init__(self) -> None:
        self._values: dict[int, int] = {}
        self.set_all_defaults()

    def get(self, identity: int) -> int:
        """Return the value, or FAILED for an unknown id."""
        return self._values.get(identity, FAILED)

    def set(self, identity: int, value: int) -> None:
        """Change a value; -1 restores the default.

        Raises: ServiceError: Unknown id, or a value out of range.
        """
        parameter = known_parameter(identity)
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
        self._values[identity] = known_parameter(identity).default

    def set_all_defaults(self) -> None:
        self._values = {identity: parameter.default for identity, parameter in PARAMETERS.items()}

    @property
    def flips(self) -> tuple[bool, bool]:
        """Whether pictures are mirrored left to right, and upside down."""
        return bool(self._values[HORIZONTAL_FLIP]), bool(self._values[VERTICAL_FLIP])


def known_parameter(identity: int) -> Parameter:
    """Return the parameter with this id.

    Raises: ServiceError: The cameras have no such parameter.
    """
    if identity not in PARAMETERS:
        raise ServiceError(f"parameter {identity} is unknown; known: {', '.join(map(str, PARAMETERS))}")
    return PARAMETERS[identity]
