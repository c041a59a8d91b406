"""Distance sensors: a bundle of rays from one point, cast in one call when the sensor is due.

Rays pass through the robot that carries them, and see others as the hulls that can be run into, not as the many parts
that are painted there. MuJoCo leaves out only one body, or groups of geoms, of which there are six for any number of
robots; so what rays pass through is put into a group of its own for the length of a cast. In a crowded world so is
everything outside the box around the rays: MuJoCo would try each of them on all geoms.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import mujoco
import numpy as np

GROUPS = 6
BLIND_GROUP = 5
"""Rays pass through geoms of this group; no scene uses it for geoms."""
FEW_RAYS = 3
"""Up to this many rays are cast one by one: preparing a bundle costs as much as eight single rays."""

MANY_RAYS, MANY_GEOMS = 10, 100
"""Numbers from which on finding what is in the box costs less than it saves."""
_SEEN = np.array([group != BLIND_GROUP for group in range(GROUPS)], np.uint8)
_HAIR = 1e-6
"""Added to every size [m], against rounding."""


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
    """Rays fixed to a site of a robot; they do not see that robot. `cast` needs the world's lock.

    Attributes:
        bodies: Numbers of the one that carries the site, and of those that can move into the rays; see `Stillness`.
    """

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
        self._others = _Others(model, self._site)
        self.bodies = self._others.bodies
        self._crowded = len(directions) >= MANY_RAYS and self._others.count >= MANY_GEOMS
        count = len(directions)
        self._geoms = np.empty(count, np.int32)
        self._distances = np.empty(count)
        self._normals = np.empty(3 * count)

    def cast(self, data: mujoco.MjData) -> np.ndarray:
        """Return the distance along each ray [m], shape (n,); infinity where nothing is within `max_range`."""
        self._shoot(data, None)
        return _finite(self._distances, self._geoms, self.max_range)

    def cast_echo(self, data: mujoco.MjData, max_incidence: float) -> np.ndarray:
        """Do as `cast`, for a sensor that receives an echo only from surfaces that face it.

        Args:
            max_incidence: Largest angle between ray and surface normal that sends something back [rad].
        """
        vectors = self._shoot(data, self._normals)
        facing = np.abs(np.einsum("ij,ij->i", vectors, self._normals.reshape(-1, 3)))
        distances = _finite(self._distances, self._geoms, self.max_range)
        distances[facing < math.cos(max_incidence)] = np.inf
        return distances

    def _shoot(self, data: mujoco.MjData, normals: np.ndarray | None) -> np.ndarray:
        origin = data.site_xpos[self._site]
        vectors = self.directions @ data.site_xmat[self._site].reshape(3, 3).T
        if self._crowded:
            ends = self.max_range * vectors
            low, high = np.minimum(ends.min(axis=0), 0.0), np.maximum(ends.max(axis=0), 0.0)
            hidden = self._others.outside(data, origin + low, origin + high)
        else:
            hidden = self._others.none
        with _Hidden(self._model, hidden):
            if normals is None and len(vectors) <= FEW_RAYS:
                for i, vector in enumerate(vectors):
                    hit = self._geoms[i : i + 1]
                    self._distances[i] = mujoco.mj_ray(self._model, data, origin, vector, _SEEN, True, -1, hit)
            else:
                _shoot_together(
                    *(self._model, data, origin, vectors, self._geoms, self._distances, normals, self.max_range)
                )
        return vectors


class RayRing:
    """Bundles of rays all around a robot and away from it, all alike. `cast` needs the world's lock.

    What is out of reach of all of them is left out once; with nothing in reach, no ray is cast.

    Attributes:
        bodies: As of `RayBundle`.
    """

    def __init__(self, model: mujoco.MjModel, sites: Sequence[str], directions: np.ndarray, max_range: float) -> None:
        """
        Args:
            sites: Names of the sites, all on one body.
            directions: Unit vectors in each site's frame, shape (n, 3).
            max_range: Hits beyond this distance [m] count as misses.
        """
        self._model = model
        self._directions = directions
        self._max_range = max_range
        self._sites = np.array([model.site(name).id for name in sites])
        self._others = _Others(model, int(self._sites[0]))
        self.bodies = self._others.bodies
        self._geoms = np.empty((len(sites), len(directions)), np.int32)
        self._distances = np.empty((len(sites), len(directions)))

    def cast(self, data: mujoco.MjData) -> np.ndarray:
        """Return the distance along each ray [m], shape (sites, n); infinity where nothing is within `max_range`."""
        origins = data.site_xpos[self._sites]
        frames = data.site_xmat[self._sites].reshape(-1, 3, 3)
        vectors = self._directions @ frames.transpose(0, 2, 1)
        ends = (origins[:, None] + self._max_range * vectors).reshape(-1, 3)
        outside = self._others.outside(data, ends.min(axis=0), ends.max(axis=0))  # they point outward
        if outside.all():
            return np.full(self._distances.shape, np.inf)
        with _Hidden(self._model, outside):
            for bundle in zip(origins, vectors, self._geoms, self._distances):  # noqa: B905 Python 3.9
                _shoot_together(self._model, data, *bundle, None, self._max_range)
        return _finite(self._distances, self._geoms, self._max_range)


class _Hidden:
    """While it is entered, rays pass through some geoms (ngeom,) bool."""

    def __init__(self, model: mujoco.MjModel, which: np.ndarray) -> None:
        self._groups, self._which = model.geom_group, which

    def __enter__(self) -> None:
        self._usual = self._groups.copy()
        np.copyto(self._groups, BLIND_GROUP, where=self._which)

    def __exit__(self, *_: object) -> None:
        self._groups[:] = self._usual


class _Others:
    """What can stop the rays of a robot, which goes by a site of it; and boxes around it, along the axes of the world:
    what lies outside the box around some rays is not hit.

    Those of the scene are measured once; a geom that can move has the box around its sphere, wherever it turns.

    Attributes:
        none: (ngeom,) bool; true for what never stops them.
        count: How many do.
        bodies: Numbers of the one that carries the site, and of those of the others that can move.
    """

    def __init__(self, model: mujoco.MjModel, site: int) -> None:
        self._model = model
        roots = model.body_rootid[model.geom_bodyid]
        robot = model.body_rootid[model.site_bodyid[site]]
        stands = model.body_weldid[model.geom_bodyid] == 0  # the room, and people
        solid = (model.geom_contype | model.geom_conaffinity) != 0
        seen = (stands | solid) & ((roots != robot) | (roots == 0))  # a sensor of the scene sees the scene
        fixed = stands & (model.body_mocapid[roots] < 0)
        self.none, self.count = ~seen, int(seen.sum())
        self._outside = self.none.copy()
        self._fixed, self._moving = np.flatnonzero(seen & fixed), np.flatnonzero(seen & ~fixed)
        self._order = np.concatenate([self._fixed, self._moving])
        self.bodies = np.append(np.unique(model.geom_bodyid[self._moving]), model.site_bodyid[site])
        self._reaches = _radii(model)[self._moving]
        self._low, self._high = np.empty((2, 3, 0))

    def outside(self, data: mujoco.MjData, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """Return for each geom whether its box and the one from `low` to `high` (3,) [m] have nothing in common; true
        for what never stops rays."""
        if not self._low.size:
            self._measure(data)
        places, moving = data.geom_xpos[self._moving].T, slice(len(self._fixed), None)
        np.subtract(places, self._reaches, out=self._low[:, moving])
        np.add(places, self._reaches, out=self._high[:, moving])
        apart = (self._low > high[:, None]) | (self._high < low[:, None])
        self._outside[self._order] = apart[0] | apart[1] | apart[2]
        return self._outside

    def _measure(self, data: mujoco.MjData) -> None:
        model, radii = self._model, _radii(self._model)
        self._low, self._high = np.empty((2, 3, len(self._order)))
        for i, geom in enumerate(self._fixed):
            place, rotation = data.geom_xpos[geom], data.geom_xmat[geom].reshape(3, 3)
            if np.isfinite(radii[geom]):
                middle = place + rotation @ model.geom_aabb[geom, :3]
                half = np.abs(rotation) @ model.geom_aabb[geom, 3:] + _HAIR
                self._low[:, i], self._high[:, i] = middle - half, middle + half
            else:  # a plane: everything below it, if it is level
                self._low[:, i], self._high[:, i] = -np.inf, np.inf
                if rotation[2, 2] == 1.0:
                    self._high[2, i] = place[2] + _HAIR


def _shoot_together(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    origin: np.ndarray,
    vectors: np.ndarray,
    geoms: np.ndarray,
    distances: np.ndarray,
    normals: np.ndarray | None,
    reach: float,
) -> None:
    """Cast rays from one point; what they hit, and where, is written into the arrays."""
    mujoco.mj_multiRay(
        *(model, data, origin, vectors.ravel(), _SEEN, True, -1, geoms, distances, normals, len(vectors), reach)
    )


def _finite(distances: np.ndarray, geoms: np.ndarray, reach: float) -> np.ndarray:
    return np.where((geoms < 0) | (distances > reach), np.inf, distances)


def _radii(model: mujoco.MjModel) -> np.ndarray:
    """Return the radius of the sphere around each geom [m], and a hair; a plane has none: infinity."""
    return np.where(model.geom_rbound > 0.0, model.geom_rbound + _HAIR, np.inf)


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
