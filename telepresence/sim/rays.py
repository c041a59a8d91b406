"""Distance sensors: bundles of rays, each from one point and cast in one call, when the sensor is due.

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

from telepresence.sim.rotation import rotation_of

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


class Rays:
    """Bundles of rays from places of one body of a robot; they do not see that robot. `cast` needs the world's lock.

    Attributes:
        origins, directions: Where each ray starts [m] and its unit vector, in the body's frame, shape (n, 3).
        body, others: Number of that body, and of those that can move into the rays; see `Stillness`.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        bundles: Sequence[tuple[str, np.ndarray]],
        max_range: float,
        *,
        all_around: bool = False,
    ) -> None:
        """
        Args:
            bundles: Name of the site where its rays start, and unit vectors in the site's frame, shape (m, 3).
            max_range: Hits beyond this distance [m] count as misses.
            all_around: They point away from the robot in all directions: what is out of reach of all of them is left
                out once, not for each bundle.
        Raises:
            ValueError: The sites are on several bodies.
        """
        sites = [model.site(name) for name, _ in bundles]
        carriers = {int(model.site_bodyid[site.id]) for site in sites}
        if len(carriers) != 1:
            raise ValueError(f"rays of one sensor start at one body, not at {len(carriers)}")
        counts = [len(vectors) for _, vectors in bundles]
        places = np.array([site.pos for site in sites])
        self.max_range = max_range
        self.origins = np.repeat(places, counts, axis=0)
        self.directions = np.concatenate(
            [vectors @ rotation_of(site.quat).T for site, (_, vectors) in zip(sites, bundles, strict=True)]
        )
        self._model, self.body = model, carriers.pop()
        self._obstacles = _Obstacles(model, self.body)
        self.others = self._obstacles.bodies
        self._crowded = all_around or (max(counts) >= MANY_RAYS and self._obstacles.count >= MANY_GEOMS)
        n, first = len(self.directions), np.cumsum([0, *counts])
        # Places, directions, and every corner of the rays' hull: as the body sees them, and turned as the world does.
        ends = self.origins + max_range * self.directions
        corners = [
            np.concatenate([place[None], ends[begin:end]])
            for place, begin, end in zip(places, first[:-1], first[1:], strict=True)
        ]
        self._own = np.concatenate([places, self.directions, *(corners if self._crowded else ())])
        self._turned = np.empty_like(self._own)
        self._places, self._vectors, self._corners = np.split(self._turned, [len(sites), len(sites) + n])
        self._geoms, self._distances, self._normals = np.empty(n, np.int32), np.empty(n), np.empty((n, 3))
        each = [_Bundle(self, i, slice(*first[i : i + 2])) for i in range(len(sites))]
        apart = self._crowded and not all_around
        self._boxed = [[bundle] for bundle in each] if apart else [each]
        self._first_corners = (first[:-1] + np.arange(len(sites))).tolist() if apart else [0]

    def cast(self, data: mujoco.MjData) -> np.ndarray:
        """Return the distance along each ray [m], shape (n,); infinity where nothing is within `max_range`."""
        self._shoot(data, echo=False)
        return np.where((self._geoms < 0) | (self._distances > self.max_range), np.inf, self._distances)

    def cast_echo(self, data: mujoco.MjData, max_incidence: float) -> np.ndarray:
        """Do as `cast`, for a sensor that receives an echo only from surfaces that face it.

        Args:
            max_incidence: Largest angle between ray and surface normal that sends something back [rad].
        """
        self._shoot(data, echo=True)
        facing = np.abs(np.einsum("ij,ij->i", self._vectors, self._normals))
        missed = (self._geoms < 0) | (self._distances > self.max_range) | (facing < math.cos(max_incidence))
        return np.where(missed, np.inf, self._distances)

    def _shoot(self, data: mujoco.MjData, echo: bool) -> None:
        place = data.xpos[self.body]
        np.matmul(self._own, data.xmat[self.body].reshape(3, 3).T, out=self._turned)
        self._places += place
        if self._crowded:
            low = np.minimum.reduceat(self._corners, self._first_corners) + place
            high = np.maximum.reduceat(self._corners, self._first_corners) + place
            hidden = self._obstacles.outside(data, low, high)
        else:
            hidden = self._obstacles.none
        groups = self._model.geom_group
        usual = groups.copy()
        try:
            for unseen, bundles in zip(hidden, self._boxed, strict=True):
                if unseen.all():
                    for bundle in bundles:
                        bundle.geoms[:] = -1
                    continue
                groups[:] = np.where(unseen, BLIND_GROUP, usual)
                for bundle in bundles:
                    bundle.shoot(self._model, data, echo)
        finally:
            groups[:] = usual


class _Bundle:
    """Rays from one place, as parts of the arrays of all."""

    def __init__(self, rays: Rays, number: int, part: slice) -> None:
        self.geoms = rays._geoms[part]
        self._place, self._reach = rays._places[number], rays.max_range
        self._vectors, self._distances = rays._vectors[part], rays._distances[part]
        self._flat, self._normals = self._vectors.reshape(-1), rays._normals[part].reshape(-1)
        self._hits = [self.geoms[i : i + 1] for i in range(len(self.geoms))]

    def shoot(self, model: mujoco.MjModel, data: mujoco.MjData, echo: bool) -> None:
        """What the rays hit, and where, is written into the arrays; with `echo` the surfaces' normals, too."""
        if not echo and len(self.geoms) <= FEW_RAYS:
            for i, hit in enumerate(self._hits):
                self._distances[i] = mujoco.mj_ray(model, data, self._place, self._vectors[i], _SEEN, True, -1, hit)
            return
        mujoco.mj_multiRay(
            *(model, data, self._place, self._flat, _SEEN, True, -1, self.geoms, self._distances),
            *(self._normals if echo else None, len(self.geoms), self._reach),
        )


class _Obstacles:
    """What can stop the rays of a robot, which goes by a body of it; and boxes around it, along the axes of the world:
    what lies outside the box around some rays is not hit.

    Those of the scene are measured once; a geom that can move has the box around its sphere, wherever it turns.

    Attributes:
        none: True for what never stops them, shape (1, ngeom).
        count: How many do.
        bodies: Numbers of those of theirs that can move.
    """

    def __init__(self, model: mujoco.MjModel, body: int) -> None:
        self._model = model
        roots = model.body_rootid[model.geom_bodyid]
        robot = model.body_rootid[body]
        stands = model.body_weldid[model.geom_bodyid] == 0  # the room, and people
        solid = (model.geom_contype | model.geom_conaffinity) != 0
        seen = (stands | solid) & ((roots != robot) | (roots == 0))  # a sensor of the scene sees the scene
        fixed = stands & (model.body_mocapid[roots] < 0)
        self.none, self.count = ~seen[None], int(seen.sum())
        self._fixed, self._moving = np.flatnonzero(seen & fixed), np.flatnonzero(seen & ~fixed)
        self.bodies = np.unique(model.geom_bodyid[self._moving])
        self._reaches = _radii(model)[self._moving]
        self._low, self._high = np.empty((2, 3, 0))

    def outside(self, data: mujoco.MjData, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """Return for each box, from `low` to `high` (k, 3) [m], and each geom whether they have nothing in common,
        shape (k, ngeom); true for what never stops rays."""
        if not self._low.size:
            self._measure(data)
        places = data.geom_xpos[self._moving].T
        self._low[:, self._moving] = places - self._reaches
        self._high[:, self._moving] = places + self._reaches
        apart = (self._low > high[:, :, None]) | (self._high < low[:, :, None])
        return apart[:, 0] | apart[:, 1] | apart[:, 2]

    def _measure(self, data: mujoco.MjData) -> None:
        model, radii = self._model, _radii(self._model)
        self._low = np.full((3, model.ngeom), np.inf)  # what is never seen is outside of every box
        self._high = -self._low
        for geom in self._fixed:
            place, rotation = data.geom_xpos[geom], data.geom_xmat[geom].reshape(3, 3)
            if np.isfinite(radii[geom]):
                middle = place + rotation @ model.geom_aabb[geom, :3]
                half = np.abs(rotation) @ model.geom_aabb[geom, 3:] + _HAIR
                self._low[:, geom], self._high[:, geom] = middle - half, middle + half
            else:  # a plane: everything below it, if it is level
                self._low[:, geom], self._high[:, geom] = -np.inf, np.inf
                if rotation[2, 2] == 1.0:
                    self._high[2, geom] = place[2] + _HAIR


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
