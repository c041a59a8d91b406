"""OtherServices: the services of the same robot by name, for those that use whichever of them exist."""

from __future__ import annotations

from pepper_sim.naoqi.service import Service


class OtherServices:
    """Finds services when they are needed; while the robot is being made not all are there yet."""

    def __init__(self, services: list[Service]) -> None:
        self._services = services

    def find(self, name: str) -> Service | None:
        """Return the service called `name`; None if this robot has none."""
        return next((service for service in self._services if service.name == name), None)
