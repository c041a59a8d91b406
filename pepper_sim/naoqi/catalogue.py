"""Catalogue: makes every service of `pepper_sim.services` for one robot.

A new service is a new file in that folder and nothing else: the catalogue finds its class and reads from the
constructor's annotations what it needs, which are parts of the robot (`Catalogue.__init__` lists them) and other
services.
"""

from __future__ import annotations

import contextlib
import importlib
import inspect
import pkgutil
from typing import Any

from pepper_sim import services
from pepper_sim.disk import RobotDisk
from pepper_sim.naoqi.body_events import BodyEvents
from pepper_sim.naoqi.client_services import ClientServices
from pepper_sim.naoqi.installed_packages import InstalledPackages
from pepper_sim.naoqi.memory_keys import body_keys
from pepper_sim.naoqi.motion.base import MotionBase
from pepper_sim.naoqi.motion.joints import MotionJoints
from pepper_sim.naoqi.motion.stiffness import MotionStiffness
from pepper_sim.naoqi.other_services import OtherServices
from pepper_sim.naoqi.people.population import Population
from pepper_sim.naoqi.service import Service
from pepper_sim.naoqi.tasks import Alarm, Watch, Workers
from pepper_sim.robot import Pepper
from pepper_sim.services.al_leds import ALLeds
from pepper_sim.services.al_memory import ALMemory
from pepper_sim.services.al_motion import ALMotion
from pepper_sim.sound import robot_sounds
from pepper_sim.sound.room import Loudspeaker, Room
from pepper_sim.sound.speech import Voice
from pepper_sim.tablet.tablet import Tablet
from telepresence.naoqi.server import Server

LAST_SPOKEN = "/home/nao/last_spoken.wav"
"""Where the robot's disk holds what was said last."""


class Catalogue:
    """All services of one robot.

    Args:
        server: The server that will offer them; its clients' services are called over it.
        tablet: The tablet behind ALTabletService; without it there is no such service.
        seed: Seed of the microphones' noise.
        disk: The robot's files; without it a fresh disk that ends with the robot.
    Attributes:
        services: Each after the services that it uses.
        room: What the microphones pick up and what the loudspeaker plays.
        disk: The robot's files.
        packages: The packages installed on it.
        clients: Services that clients have registered.
        memory: ALMemory.
        population: The people whom the robot knows of.
    Raises:
        TypeError: The constructor of a service needs something that no robot has.
    """

    def __init__(
        self, robot: Pepper, server: Server, tablet: Tablet | None, seed: int = 0, disk: RobotDisk | None = None
    ) -> None:
        self.disk = disk or RobotDisk()
        robot_sounds.install(self.disk)
        self.packages = InstalledPackages(self.disk)
        self.room = Room(Loudspeaker(), seed)
        self._workers = Workers()
        self._alarm = Alarm()
        self._watch = Watch()
        self.clients = ClientServices(server, self._alarm)
        leds = ALLeds(robot, self._alarm)
        body = {**body_keys(robot.JOINTS), **leds.memory_keys()}
        self.memory = ALMemory(robot.snapshot, body, self.clients, robot.has_snapshot)
        self.clients.on_gone(self.memory.forget_module)
        motion = ALMotion(robot, self.memory, self._watch, self._alarm)
        robot.world.on_reset(motion.restart)
        self.population = Population(robot, self.memory)
        self.services: list[Service] = [leds, self.memory, motion]
        self._parts: dict[type, Any] = {
            Pepper: robot,
            Tablet: tablet,
            RobotDisk: self.disk,
            InstalledPackages: self.packages,
            Room: self.room,
            Voice: Voice(self.room.loudspeaker, self.disk.path(LAST_SPOKEN)),
            ClientServices: self.clients,
            Workers: self._workers,
            Alarm: self._alarm,
            Watch: self._watch,
            MotionBase: motion.base,
            MotionJoints: motion.joints,
            MotionStiffness: motion.stiffness,
            Population: self.population,
            OtherServices: OtherServices(self.services),
            **{type(service): service for service in self.services},
        }
        for service in service_classes():
            self._make(service)
        self.clients.offer(self.services)
        self._events = BodyEvents(robot, self.memory)

    def close(self) -> None:
        """End threads, newest first."""
        with contextlib.ExitStack() as stack:
            closing: list[Any] = [
                self.disk,
                self.clients,
                self._alarm,
                self._watch,
                self._workers,
                *self.services,
                self._events,
                self.population,
            ]
            for part in closing:
                stack.callback(part.close)

    def _make(self, service: type[Service]) -> Service | None:
        """Return the one object of this class, made at the first call; None if the robot lacks a part that it needs."""
        if service not in self._parts:
            arguments = {name: self._part(service, kind) for name, kind in _needs(service).items()}
            if None in arguments.values():
                self._parts[service] = None
            else:
                self._parts[service] = service(**arguments)
                self.services.append(self._parts[service])
        return self._parts[service]

    def _part(self, service: type[Service], kind: Any) -> Any:
        if kind in self._parts:
            return self._parts[kind]
        if isinstance(kind, type) and issubclass(kind, Service):
            return self._make(kind)
        raise TypeError(f"{service.__name__} needs {kind!r}, which is neither a part of the robot nor a service")


def service_classes() -> list[type[Service]]:
    """Return the classes of the services, in the order of their files' names."""
    classes = []
    for file in pkgutil.iter_modules(services.__path__, services.__name__ + "."):
        module = importlib.import_module(file.name)
        classes += [
            value
            for value in vars(module).values()
            if isinstance(value, type) and issubclass(value, Service) and value.__module__ == module.__name__
        ]
    return classes


def _needs(service: type[Service]) -> dict[str, Any]:
    """Return parameter -> type for the constructor's parameters that have no default."""
    parameters = inspect.signature(service, eval_str=True).parameters.values()
    return {parameter.name: parameter.annotation for parameter in parameters if parameter.default is parameter.empty}
