"""The lights of Pepper's body that the cameras of the world see."""

from __future__ import annotations

from telepresence.geometry import require_finite
from telepresence.sim.world import World

LIGHTS = ("eyes", "shoulders")


class Lights:
    """The eyes and the shoulders of one robot, whose names in the world begin with `prefix`."""

    def __init__(self, world: World, prefix: str) -> None:
        self._world = world
        self._prefix = prefix

    def colour(self, part: str, red: float, green: float, blue: float) -> None:
        """Colour the "eyes" or the "shoulders"; 0...1 each, clipped. It shows from the next picture on.

        Raises:
            ValueError: No such light, or a value that is not finite.
        """
        if part not in LIGHTS:
            raise ValueError(f"Pepper has no light {part!r}; lights: {', '.join(LIGHTS)}")
        require_finite("colour", (red, green, blue))
        with self._world.locked():
            material = self._world.model.material(self._prefix + part)
            material.rgba[:3] = [min(max(value, 0.0), 1.0) for value in (red, green, blue)]
