"""Distance sensors: a bundle of rays from one point, cast in one call when the sensor is due.

Rays pass through the robot that carries them and through invisible geoms. A robot has many bodies, and MuJoCo leaves
out only one, or groups of geoms, of which there are six for any number of robots; so a robot's geoms are put into a
group of their own for the length of a cast. In a crowded world so is everything outside the cone of a large bundle:
MuJoCo would try each of its rays on all of them.
"""

from __future__ import annotations

import math

import mujoco
import numpy as np

GROUPS = 6
BLIND_GROUP = 5
"""Rays pass through geoms of this group; no scene uses it for geoms."""
FEW_RAYS = 3
"""Up to this many rays are cast one by one: preparing a bundle costs as much as eight single rays."""

MANY_RAYS, MANY_GEOMS = 10, 300
"""Numbers from which on testing what is in the cone costs less than it saves."""
WIDEST = math.radians(75.0)
"""A wider cone excludes nearly nothing [rad]."""


def fan(angles: np.ndarray) -> np.ndarray:
    """Return unit vectors in the x-y plane at `angles` [rad] from x, counter-clockwise. Shape (n, 3)."""
    angles = np.asarray(angles, float)
    return np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=1)


def cone(half_angle: float, rings: int = 2) -> np.ndarray:
    """Return unit vectors around x that fill a cone: one in the middle, then 6, 12, ... per ring to `half_angle` [rad].

    Returns:
        Shape (1 + 3 * rings * (rings + 1), 3): 19 rays for two rings.
    """
    vectors = [(1.0, 0.0, 0.0)]
    for ring in range(1, rings + 1):
        tilt = half_angle * ring / rings
        for k in range(6 * ring):
            turn = math.tau * k / (6 * ring)
            vectors.append((math.cos(tilt), math.sin(tilt) * math.cos(turn), math.sin(tilt) * math.sin(turn)))
    return np.array(vectors)


class RayBundle:
    """Rays fixed to a site of a robot; they do not see that robot. `cast` needs the world's lock."""

    def __init__(self, model: mujoco.MjModel, site: str, directions: np.ndarray, max_range: float) -> None:
        """
        Args:
            site: Name of the site; rays start there.
            directions: Unit vectors in the site's frame, shape (n, 3).
            max_range: Hits beyond this distance [m] count as misses.
        """
        self.directions = np.ascontiguousarray(directions, float)
        self.max_range = max_range
        self._model = model
        self._site = model.site(site).id
        self._mask = np.ones(GROUPS, np.uint8)
        self._mask[BLIND_GROUP] = 0
        self._own_groups = _groups_of_robot(model, self._site)
        self._usual_groups = self._own_groups.copy()
        self._all_groups = model.geom_group.copy()
        self._cone = _Cone(model, self._site, self.directions, max_range)
        count = len(directions)
        self._geoms = np.empty(count, np.int32)
        self._distances = np.empty(count)
        self._normals = np.empty(3 * count)

    def cast(self, data: mujoco.MjData) -> np.ndarray:
        """Return the distance along each ray [m], shape (n,); infinity where nothing is within `max_range`."""
        self._shoot(data, None)
        return self._finite()

    def cast_echo(self, data: mujoco.MjData, max_incidence: float) -> np.ndarray:
        """Do as `cast`, for a sensor that receives an echo only from surfaces that face it.

        Args:
            max_incidence: Largest angle between ray and surface normal that sends something back [rad].
        """
        vectors = self._shoot(data, self._normals)
        facing = np.abs(np.einsum("ij,ij->i", vectors, self._normals.reshape(-1, 3)))
        distances = self._finite()
        distances[facing < math.cos(max_incidence)] = np.inf
        return distances

    def pose_in_body(self, data: mujoco.MjData, body: int) -> tuple[np.ndarray, np.ndarray]:
        """Return rotation (3, 3) and origin (3,) of the rays' frame in the frame of `body`."""
        frame = data.xmat[body].reshape(3, 3).T
        origin = frame @ (data.site_xpos[self._site] - data.xpos[body])
        return frame @ data.site_xmat[self._site].reshape(3, 3), origin

    def _shoot(self, data: mujoco.MjData, normals: np.ndarray | None) -> np.ndarray:
        vectors = self.directions @ data.site_xmat[self._site].reshape(3, 3).T
        self._own_groups[:] = BLIND_GROUP
        if self._cone.narrows:
            np.copyto(self._model.geom_group, BLIND_GROUP, where=self._cone.outside(data))
        try:
            if normals is None and len(vectors) <= FEW_RAYS:
                self._shoot_singly(data, vectors)
            else:
                self._shoot_together(data, vectors, normals)
        finally:
            if self._cone.narrows:
                self._model.geom_group[:] = self._all_groups
            else:
                self._own_groups[:] = self._usual_groups
        return vectors

    def _shoot_together(self, data: mujoco.MjData, vectors: np.ndarray, normals: np.ndarray | None) -> None:
        mujoco.mj_multiRay(
            self._model,
            data,
            data.site_xpos[self._site],
            vectors.ravel(),
            self._mask,
            True,
            -1,
            self._geoms,
            self._distances,
            normals,
            len(vectors),
            self.max_range,
        )

    def _shoot_singly(self, data: mujoco.MjData, vectors: np.ndarray) -> None:
        origin = data.site_xpos[self._site]
        for i, vector in enumerate(vectors):
            hit = self._geoms[i : i + 1]
            self._distances[i] = mujoco.mj_ray(self._model, data, origin, vector, self._mask, True, -1, hit)

    def _finite(self) -> np.ndarray:
        distances = self._distances.copy()
        distances[(self._geoms < 0) | (distances > self.max_range)] = np.inf
        return distances


class _Cone:
    """The cone that holds a bundle's rays, and which geoms are not in it."""

    def __init__(self, model: mujoco.MjModel, site: int, directions: np.ndarray, reach: float) -> None:
        self._site = site
        axis = directions.sum(axis=0)
        length = float(np.linalg.norm(axis))
        self._axis = axis / length if length > 0.0 else axis
        half_angle = math.acos(max(-1.0, min(1.0, float((directions @ self._axis).min()))))
        self.narrows = len(directions) >= MANY_RAYS and model.ngeom >= MANY_GEOMS and half_angle <= WIDEST
        """Whether the test is worth its time."""
        self._cos, self._sin = math.cos(half_angle), math.sin(half_angle)
        # Radius of the sphere around a geom [m], and a hair; a plane has none.
        self._radii = np.where(model.geom_rbound > 0.0, model.geom_rbound + 1e-6, np.inf)
        self._reaches = (reach + self._radii) ** 2

    def outside(self, data: mujoco.MjData) -> np.ndarray:
        """Return for each geom whether all rays miss it: its sphere is out of reach or outside the cone."""
        away = data.geom_xpos - data.site_xpos[self._site]
        along = away @ (data.site_xmat[self._site].reshape(3, 3) @ self._axis)
        squares = np.einsum("ij,ij->i", away, away)
        across = np.sqrt(np.maximum(squares - along * along, 0.0))
        return (across * self._cos - along * self._sin > self._radii) | (squares > self._reaches)


def _groups_of_robot(model: mujoco.MjModel, site: int) -> np.ndarray:
    """Return the groups of all geoms of the robot that carries `site`, as a view into the model; empty for a site of
    the scene. MuJoCo numbers the geoms of one tree of bodies in a row."""
    robot = model.body_rootid[model.site_bodyid[site]]
    if robot == 0:
        return model.geom_group[:0]
    own = np.flatnonzero(model.body_rootid[model.geom_bodyid] == robot)
    return model.geom_group[own[0] : own[-1] + 1] if len(own) else model.geom_group[:0]


def add_noise(
    distances: np.ndarray,
    rng: np.random.Generator,
    *,
    sigma: float,
    proportional: float = 0.0,
    resolution: float = 0.0,
    minimum: float = 0.0,
) -> np.ndarray:
    """Return what a sensor reads instead of the true distances; infinite ones stay infinite.

    Args:
        sigma: Standard deviation at distance zero [m].
        proportional: Standard deviation per metre of distance, added to `sigma`.
        resolution: Readings are multiples of this [m]; 0 for none.
        minimum: Smaller distances read as this [m].
    """
    read = distances + (sigma + proportional * np.where(np.isfinite(distances), distances, 0.0)) * rng.standard_normal(
        len(distances)
    )
    if resolution:
        read = np.round(read / resolution) * resolution
    return np.maximum(read, minimum)
