"""Curved and repeated shapes of Robotino's body, made from numbers; our own shapes within the published outline."""

from __future__ import annotations

import math
from collections.abc import Sequence

import mujoco
import numpy as np

from robotino_sim.infrared import COUNT, MOUNTING_HEIGHT
from robotino_sim.kinematics import WHEEL_RADIUS

Profile = Sequence[tuple[float, float]]
Mesh = tuple[np.ndarray, np.ndarray]
"""Vertices (n, 3) [m] and triangles (m, 3), counter-clockwise seen from outside."""

SEGMENTS = 48
"""Flat pieces around a full turn."""

# Profiles: (radius, height) [m], from the bottom over the outside to the top.
BUMPER: Profile = (
    *((0.196, 0.030), (0.216, 0.033), (0.2235, 0.039), (0.2266, 0.048), (0.2266, 0.067), (0.2235, 0.077)),
    (0.212, 0.085),
)
BODY: Profile = ((0.205, 0.083), (0.2165, 0.088), (0.219, 0.094), (0.2165, 0.150), (0.2155, 0.152))
STRIPE: Profile = ((0.2155, 0.152), (0.2158, 0.1525), (0.2152, 0.1615), (0.2148, 0.162))
BODY_TOP: Profile = ((0.2148, 0.162), (0.2125, 0.176), (0.207, 0.182), (0.200, 0.1835))
DECK: Profile = ((0.200, 0.1835), (0.0, 0.1835))
PAN: Profile = ((0.0, 0.040), (0.205, 0.040))
# Steep enough to stay below what the camera sees.
LID: Profile = (
    *((0.0, 0.228), (0.199, 0.228), (0.208, 0.230), (0.2125, 0.236), (0.2125, 0.248), (0.209, 0.2545)),
    *((0.205, 0.2575), (0.146, 0.2855), (0.141, 0.2870), (0.135, 0.2875), (0.0, 0.2875)),
)
PLATE: Profile = ((0.132, 0.287), (0.132, 0.2905), (0.1305, 0.2915), (0.0, 0.2915))
CORE_RADIUS, CORE_OFFSET = 0.11, -0.055
WHEEL_WIDTH, ROLLERS = 0.034, 10


def add_shells(spec: mujoco.MjSpec) -> None:
    """Add the meshes that `robotino.xml` names."""
    _add(spec, "bumper_ring", lathe(BUMPER))
    _add(spec, "body", join(lathe(BODY), lathe(BODY_TOP)))
    _add(spec, "stripe", lathe(STRIPE))
    _add(spec, "deck", join(lathe(DECK), lathe(PAN)))
    _add(spec, "lid", lathe(LID))
    _add(spec, "plate", lathe(PLATE))
    core = ((CORE_RADIUS, 0.183), (CORE_RADIUS, 0.229))
    _add(spec, "core", moved(lathe(core), (CORE_OFFSET, 0.0, 0.0)))
    _add(spec, "wheel", _wheel())
    holes = [(0.030 * i, 0.030 * j) for i in range(-3, 4) for j in range(-4, 5)]
    disc = lathe(((0.0045, 0.0), (0.0, 0.0)), 8)
    inside = [(x, y) for x, y in holes if math.hypot(x, y) < 0.122 and -0.07 < x < 0.065]
    _add(spec, "plate_holes", join(*(moved(disc, (x, y, 0.2917)) for x, y in inside)))
    _add(spec, "infrared_housings", _around(box(0.2225, 0.2275, 0.024, 0.0085)))
    lens = moved(box(0.2225, 0.2285, 0.0065, 0.0055), (0.0, -0.0125, 0.0))
    _add(spec, "infrared_lenses", _around(join(lens, moved(lens, (0.0, 0.025, 0.0)))))


def lathe(profile: Profile, segments: int = SEGMENTS) -> Mesh:
    """Return the surface of revolution of `profile` around z, open where the profile is."""
    rings = []
    for radius, height in profile:
        angles = np.arange(segments) * math.tau / segments
        rings.append(np.column_stack([radius * np.cos(angles), radius * np.sin(angles), np.full(segments, height)]))
    faces = []
    for ring in range(len(profile) - 1):
        for k in range(segments):
            a, b = ring * segments + k, ring * segments + (k + 1) % segments
            c, d = a + segments, b + segments
            if profile[ring][0] > 0.0:
                faces.append((a, b, c))
            if profile[ring + 1][0] > 0.0:
                faces.append((b, d, c))
    return np.vstack(rings), np.array(faces)


def box(near: float, far: float, half_width: float, half_height: float) -> Mesh:
    """Return a block along x from `near` to `far`, centred on the x axis [m]."""
    y, z = half_width, half_height
    corners = np.array([(x, sy * y, sz * z) for x in (near, far) for sy in (-1, 1) for sz in (-1, 1)])
    quads = ((4, 6, 7, 5), (0, 1, 3, 2), (0, 4, 5, 1), (2, 3, 7, 6), (1, 5, 7, 3), (0, 2, 6, 4))
    return corners, np.array([face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))])


def join(*meshes: Mesh) -> Mesh:
    """Join several meshes into one."""
    offsets = np.cumsum([0] + [len(vertices) for vertices, _ in meshes[:-1]])
    return (
        np.vstack([vertices for vertices, _ in meshes]),
        np.vstack([faces + offset for (_, faces), offset in zip(meshes, offsets, strict=True)]),
    )


def moved(mesh: Mesh, by: tuple[float, float, float], turn: float = 0.0) -> Mesh:
    """Return the mesh turned about z by `turn` [rad], then moved [m]."""
    c, s = math.cos(turn), math.sin(turn)
    rotation = np.array([(c, s, 0.0), (-s, c, 0.0), (0.0, 0.0, 1.0)])
    return mesh[0] @ rotation + np.array(by), mesh[1]


def _around(mesh: Mesh) -> Mesh:
    """Repeat the mesh at every infrared sensor."""
    return join(*(moved(mesh, (0.0, 0.0, MOUNTING_HEIGHT), math.tau * i / COUNT) for i in range(COUNT)))


def _wheel() -> Mesh:
    """Return an omni wheel with its axle along x: a drum whose rim is wavy from the rollers."""
    spokes = 6 * ROLLERS
    rings = []
    for x, scale in ((-0.5, 0.80), (-0.5, 0.93), (0.0, 1.0), (0.5, 0.93), (0.5, 0.80)):
        angles = np.arange(spokes) * math.tau / spokes
        wave = WHEEL_RADIUS * scale * (0.97 + 0.03 * np.abs(np.cos(0.5 * ROLLERS * angles)))
        rings.append(np.column_stack([np.full(spokes, x * WHEEL_WIDTH), wave * np.cos(angles), wave * np.sin(angles)]))
    faces = []
    for ring in range(len(rings) - 1):
        for k in range(spokes):
            a, b = ring * spokes + k, ring * spokes + (k + 1) % spokes
            faces += [(a, b, a + spokes), (b, b + spokes, a + spokes)]
    hubs = np.array([(-0.5 * WHEEL_WIDTH, 0.0, 0.0), (0.5 * WHEEL_WIDTH, 0.0, 0.0)])
    left, right, last = 5 * spokes, 5 * spokes + 1, 4 * spokes
    faces += [(left, (k + 1) % spokes, k) for k in range(spokes)]
    faces += [(right, last + k, last + (k + 1) % spokes) for k in range(spokes)]
    return np.vstack([*rings, hubs]), np.array(faces)


def _add(spec: mujoco.MjSpec, name: str, mesh: Mesh) -> None:
    vertices, faces = mesh
    spec.add_mesh(
        name=name,
        uservert=vertices.ravel(),
        userface=faces.ravel(),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
    )
