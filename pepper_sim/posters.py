"""Posters: pictures, landmarks and QR codes that stand in the scene, for the robot's cameras to see.

mark:85@1.2,0,1.1            landmark 85, 1.2 m ahead of the robot's place at the start, 1.1 m above the floor
code:hello@1.5,0.4,1.2,30    a QR code, 0.4 m to the left, turned by 30 degrees
photo.png@2,0,1.3,0,0.6      a picture file, 0.6 m wide
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import cv2
import mujoco
import numpy as np

from pepper_sim.naoqi.vision import landmarks

DEFAULT_WIDTH = 0.2
_THICKNESS = 0.002
_LARGEST = 512
_MODULE = 8  # pixels per side of a QR code's smallest square
_MARGIN = 4  # of a QR code, in those squares


@dataclass(frozen=True)
class Poster:
    """A picture on a thin plate. It can be seen, is no obstacle, and may be carried elsewhere: a mocap body.

    Args:
        pixels: (height, width, 3) uint8, RGB.
        ahead, left, height: Its centre, from the place where the robot starts, x forward [m].
        turn: Counter-clockwise about the vertical axis; 0 faces the robot [rad].
        width: [m]
    """

    pixels: np.ndarray
    ahead: float
    left: float
    height: float
    turn: float = 0.0
    width: float = DEFAULT_WIDTH

    def put_into(self, spec: mujoco.MjSpec, start: np.ndarray, name: str) -> None:
        """Add it to a scene; `start` is the pose of the robot's place, a homogeneous matrix."""
        rows, columns = self.pixels.shape[:2]
        spec.add_texture(
            name=name,
            type=mujoco.mjtTexture.mjTEXTURE_2D,
            nchannel=3,
            width=columns,
            height=rows,
            data=self.pixels.ravel().tolist(),
        )
        material = spec.add_material(name=name, emission=0.3, specular=0.0, shininess=0.0)
        material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name
        size = [self.width / 2.0, self.width / 2.0 * rows / columns, _THICKNESS / 2.0]
        pose = start @ self._pose()
        quaternion = np.empty(4)
        mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(pose[:3, :3]).ravel())
        plate = spec.worldbody.add_body(name=name, mocap=True, pos=pose[:3, 3], quat=quaternion)
        kind = {"type": mujoco.mjtGeom.mjGEOM_BOX, "size": size, "contype": 0, "conaffinity": 0, "group": 1}
        plate.add_geom(name=name, material=name, **kind)
        plate.add_geom(name=f"{name}_back", pos=(0.0, 0.0, -_THICKNESS), rgba=(0.9, 0.9, 0.9, 1.0), **kind)

    def _pose(self) -> np.ndarray:
        """Return its pose from the robot's place: x is the picture's right, y is up, z comes towards who looks."""
        sine, cosine = math.sin(self.turn), math.cos(self.turn)
        right, up, towards = (sine, -cosine, 0.0), (0.0, 0.0, 1.0), (-cosine, -sine, 0.0)
        pose = np.eye(4)
        pose[:3] = np.stack([right, up, towards, (self.ahead, self.left, self.height)], axis=1)
        return pose


def parse_poster(text: str) -> Poster:
    """Read WHAT@AHEAD,LEFT,HEIGHT[,TURN[,WIDTH]]: metres and degrees; WHAT is mark:NUMBER, code:TEXT or a file.

    Raises:
        ValueError: It is not written so, or the picture cannot be read; the message says which.
    """
    what, _, place = text.rpartition("@")
    try:
        numbers = [float(number) for number in place.split(",")]
    except ValueError:
        numbers = []
    if not what or not 3 <= len(numbers) <= 5 or not all(map(math.isfinite, numbers)):
        raise ValueError(f"a poster is written as WHAT@AHEAD,LEFT,HEIGHT[,TURN[,WIDTH]], got {text!r}")
    ahead, left, height, turn, width = [*numbers, *(0.0, DEFAULT_WIDTH)[len(numbers) - 3 :]]
    if not 0.01 <= width <= 10.0:
        raise ValueError(f"a poster is between 0.01 and 10 m wide, got {width:g}")
    return Poster(_picture(what), ahead, left, height, math.radians(turn), width)


def _picture(what: str) -> np.ndarray:
    kind, _, text = what.partition(":")
    if kind == "mark":
        if not text.isascii() or not text.isdigit():
            raise ValueError(f"a landmark has a number, got {text!r}")
        return landmarks.draw(int(text))
    if kind == "code" and text:
        code = np.pad(np.asarray(cv2.QRCodeEncoder.create().encode(text)), _MARGIN, constant_values=255)
        enlarged = cv2.resize(code, None, fx=_MODULE, fy=_MODULE, interpolation=cv2.INTER_NEAREST)
        return cv2.cvtColor(enlarged, cv2.COLOR_GRAY2RGB)
    pixels = cv2.imread(what, cv2.IMREAD_COLOR) if Path(what).is_file() else None
    if pixels is None:
        raise ValueError(f"the poster's picture {what!r} cannot be read")
    scale = min(1.0, _LARGEST / max(pixels.shape))
    smaller = cv2.resize(pixels, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA) if scale < 1.0 else pixels
    return cv2.cvtColor(smaller, cv2.COLOR_BGR2RGB)
