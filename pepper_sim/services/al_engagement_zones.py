"""ALEngagementZones: how near people are, in three zones around the robot.

Zone 1 is nearer than the first distance and within the angle, zone 2 nearer than the second; all else is zone 3.
Source: NAOqi 2.8 documentation, ALEngagementZones.
"""

from __future__ import annotations

import math
from typing import Any

from pepper_sim.naoqi.people.extractor import PeopleExtractor
from pepper_sim.naoqi.people.population import Look, Population
from pepper_sim.naoqi.people.targets import seen_from
from pepper_sim.naoqi.service import ServiceError, finite, remote, shown
from pepper_sim.services.al_memory import ALMemory

FIRST_DISTANCE, SECOND_DISTANCE, ANGLE = 1.5, 2.5, 90.0
"""Defaults [m, m, degrees]."""
_ZONES = (1, 2, 3)
_UNKNOWN = 0
_MOVEMENTS = "MovementDetection/MovementInfo"


class ALEngagementZones(PeopleExtractor):
    """Sorts people by how near they are."""

    name = "ALEngagementZones"
    events = (
        *(f"EngagementZones/{limit}Updated" for limit in ("LimitAngle", "FirstLimitDistance", "SecondLimitDistance")),
        *("EngagementZones/PeopleInZonesUpdated", "EngagementZones/MovementsInZonesUpdated"),
        *("EngagementZones/PersonApproached", "EngagementZones/PersonMovedAway"),
        *(f"EngagementZones/PersonEnteredZone{zone}" for zone in _ZONES),
    )

    def __init__(self, memory: ALMemory, population: Population) -> None:
        super().__init__(memory, population)
        self._first, self._second, self._angle = FIRST_DISTANCE, SECOND_DISTANCE, ANGLE
        self._people: dict[int, int] = {}
        self._movements: Any = None
        for zone in _ZONES:
            memory.store(f"EngagementZones/PeopleInZone{zone}", [])
            memory.store(f"EngagementZones/LastMovementsInZone{zone}", [])

    @remote("i(fff)")
    def computeEngagementZone(self, x: float, y: float, z: float) -> int:
        """Returns the zone of a place in FRAME_ROBOT [m]."""
        if math.hypot(x, y) > 0.0 and abs(math.degrees(math.atan2(y, x))) > 0.5 * self._angle:
            return 3
        distance = math.hypot(x, y)
        return 1 if distance <= self._first else 2 if distance <= self._second else 3

    @remote("i(fffm)", name="computeEngagementZone")
    def computeEngagementZoneInImage(
        self, xAngle: float, yAngle: float, distance: float, cameraPositionRobot: Any
    ) -> int:
        """Returns the zone of what is seen at angles [rad] and a distance [m] from a camera of that Position6D."""
        if not isinstance(cameraPositionRobot, list | tuple) or len(cameraPositionRobot) != 6:
            raise ServiceError(f"cameraPositionRobot must be a Position6D, got {shown(cameraPositionRobot)}")
        camera = [finite(value, "cameraPositionRobot") for value in cameraPositionRobot]
        return self.computeEngagementZone(*seen_from(camera, xAngle, yAngle, distance))

    @remote("f()")
    def getFirstLimitDistance(self) -> float:
        """Returns where zone 1 ends [m]."""
        return self._first

    @remote("b(f)")
    def setFirstLimitDistance(self, distance: float) -> bool:
        """Sets where zone 1 ends [m]; true if it is positive and nearer than where zone 2 ends."""
        if not 0.0 < distance < self._second:
            return False
        self._first = distance
        self.memory.announce("EngagementZones/FirstLimitDistanceUpdated", distance)
        return True

    @remote("f()")
    def getSecondLimitDistance(self) -> float:
        """Returns where zone 2 ends [m]."""
        return self._second

    @remote("b(f)")
    def setSecondLimitDistance(self, distance: float) -> bool:
        """Sets where zone 2 ends [m]; true if it is farther than where zone 1 ends."""
        if not distance > self._first:
            return False
        self._second = distance
        self.memory.announce("EngagementZones/SecondLimitDistanceUpdated", distance)
        return True

    @remote("f()")
    def getLimitAngle(self) -> float:
        """Returns how wide zones 1 and 2 are [degrees]."""
        return self._angle

    @remote("b(f)")
    def setLimitAngle(self, angle: float) -> bool:
        """Sets how wide zones 1 and 2 are, 0 to 180 degrees; true if it was."""
        if not 0.0 <= angle <= 180.0:
            return False
        self._angle = angle
        self.memory.announce("EngagementZones/LimitAngleUpdated", math.radians(angle))
        return True

    def update(self, look: Look) -> None:
        before, self._people = self._people, {}
        for known in look.known:
            zone = self.computeEngagementZone(*known.last.in_robot) if known.visible else before.get(known.number, 0)
            self._people[known.number] = zone
            self._population.write(known, "EngagementZone", zone)
            self._report(known.number, before.get(known.number, _UNKNOWN), zone)
        if before != self._people:
            for zone in _ZONES:
                inside = [number for number, its in self._people.items() if its == zone]
                self.memory.store(f"EngagementZones/PeopleInZone{zone}", inside)
            self.memory.announce("EngagementZones/PeopleInZonesUpdated", [])
        self._sort_movements()

    def _report(self, number: int, before: int, zone: int) -> None:
        if zone in (before, _UNKNOWN):
            return
        self.memory.announce(f"EngagementZones/PersonEnteredZone{zone}", number)
        if before != _UNKNOWN:
            moved = "Approached" if zone < before else "MovedAway"
            self.memory.announce(f"EngagementZones/Person{moved}", number)

    def _sort_movements(self) -> None:
        """Sort what ALMovementDetection saw last: [stamp, [[centre, ..., distance], ...], pose, pose, camera]."""
        movements = self.memory.read(_MOVEMENTS)
        if movements == self._movements or not isinstance(movements, list) or len(movements) != 5:
            return
        self._movements = movements
        stamp, clusters, torso, robot, camera = movements
        zones: dict[int, list] = {zone: [] for zone in _ZONES}
        for cluster in clusters:
            (x, y), distance = cluster[0], cluster[-1]
            zones[self.computeEngagementZone(*seen_from(robot, x, y, distance))].append(cluster)
        for zone, inside in zones.items():
            self.memory.store(
                f"EngagementZones/LastMovementsInZone{zone}", [stamp, inside, torso, robot, camera] if inside else []
            )
        self.memory.announce("EngagementZones/MovementsInZonesUpdated", [])
