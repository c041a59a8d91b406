"""Names of Pepper's LEDs and of their groups (NAOqi 2.8 documentation, leds_pep and ALLeds).

An LED is "Face/Led/Red/Left/0Deg": place, colour, side, angle. Ears are blue only; the chest group is Pepper's
shoulders.
"""

from __future__ import annotations

COLOURS = ("Red", "Green", "Blue")
_SIDES = ("Left", "Right")
_FACE_ANGLES = range(0, 360, 45)
EAR_STEP = 36
"""Angle between two LEDs of an ear [degrees]."""
_EAR_ANGLES = range(0, 360, EAR_STEP)


def _face(sides: tuple[str, ...] = _SIDES, angles: range | tuple[int, ...] = _FACE_ANGLES) -> list[str]:
    return [f"Face/Led/{colour}/{side}/{angle}Deg" for colour in COLOURS for side in sides for angle in angles]


def _ears(sides: tuple[str, ...] = _SIDES) -> list[str]:
    return [f"Ears/Led/{side}/{angle}Deg" for side in sides for angle in _EAR_ANGLES]


_CHEST = [f"ChestBoard/Led/{colour}" for colour in COLOURS]

LEDS: tuple[str, ...] = (*_face(), *_ears(), *_CHEST)

GROUPS: dict[str, list[str]] = {
    "AllLeds": list(LEDS),
    "FaceLeds": _face(),
    "LeftFaceLeds": _face(("Left",)),
    "RightFaceLeds": _face(("Right",)),
    "EarLeds": _ears(),
    "LeftEarLeds": _ears(("Left",)),
    "RightEarLeds": _ears(("Right",)),
    "ChestLeds": list(_CHEST),
    **{f"FaceLed{index}": _face(angles=(angle,)) for index, angle in enumerate(_FACE_ANGLES)},
    **{f"FaceLedLeft{index}": _face(("Left",), (angle,)) for index, angle in enumerate(_FACE_ANGLES)},
    **{f"FaceLedRight{index}": _face(("Right",), (angle,)) for index, angle in enumerate(_FACE_ANGLES)},
    **{
        f"FaceLeds{side}{colour}": [n for n in _face((side,)) if f"/{colour}/" in n]
        for side in _SIDES
        for colour in COLOURS
    },
    **{f"ChestLeds{colour}": [f"ChestBoard/Led/{colour}"] for colour in COLOURS},
}

RGB: dict[str, tuple[float, float, float]] = {
    "white": (1.0, 1.0, 1.0),
    "red": (1.0, 0.0, 0.0),
    "green": (0.0, 1.0, 0.0),
    "blue": (0.0, 0.0, 1.0),
    "yellow": (1.0, 1.0, 0.0),
    "magenta": (1.0, 0.0, 1.0),
    "cyan": (0.0, 1.0, 1.0),
    "black": (0.0, 0.0, 0.0),
}
"""Colour names of fadeRGB."""


def channel(led: str) -> int:
    """Return the index of an LED's colour in red, green, blue; ears count as blue."""
    return next((index for index, colour in enumerate(COLOURS) if f"/{colour}" in led), 2)


def coloured(led: str) -> bool:
    """Whether an LED is one of three colours at its place."""
    return any(f"/{colour}" in led for colour in COLOURS) and not led.startswith("Ears/")


def angle(led: str) -> int:
    """Return where in its circle an LED is [degrees]; 0 for one that stands alone."""
    digits = led.rpartition("/")[2].removesuffix("Deg")
    return int(digits) if digits.isdigit() else 0
