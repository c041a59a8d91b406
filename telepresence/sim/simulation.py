"""Simulation: one world with any number of robots in it, each behind its own wire.

It also parses the command line's notation for robots, `kind[:name[:port]]`: `pepper`, `pepper:anna`,
`robotino:rto3:8080`, and `robotino*8` for eight of them.
"""

from __future__ import annotations

import contextlib
import inspect
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

from telepresence.sim.camera import Cameras
from telepresence.sim.placement import FreePlaces
from telepresence.sim.scene import build_world
from telepresence.sim.simulated_robot import BodyState, SimulatedRobot, find_kind, read_pose
from telepresence.spare_memory import SpareMemory

_NAME = re.compile(r"[a-z][a-z0-9_]*")


@dataclass(frozen=True)
class RobotRequest:
    """A robot to be simulated.

    Args:
        kind: One of `telepresence.sim.simulated_robot.kinds()`.
        name: Different for every robot of a simulation; also its prefix in the world.
        port: Of its wire; 0 takes a free one.
        options: Settings of its kind.
    """

    kind: str
    name: str
    port: int
    options: Mapping[str, Any] = field(default_factory=dict)


def parse_robots(words: Iterable[str], options: Mapping[str, Mapping[str, Any]] | None = None) -> list[RobotRequest]:
    """Read words of the form `kind[:name[:port]]`, or `kind*count[:name[:port]]` for several that are alike.

    The name is the kind's when none is given, then kind_2, kind_3, ...; the port is the kind's usual one for the first
    robot and a free one for the others. Several that are alike are name_1, name_2, ... on ports that follow each other.

    Args:
        options: Kind or name of a robot -> settings of its kind.
    Raises:
        ValueError: Unknown kind, an invalid count, port or name, or a name that is taken.
    """
    requests: list[RobotRequest] = []
    for word in words:
        kind, _, rest = word.partition(":")
        kind, _, count = kind.partition("*")
        name, _, port = rest.partition(":")
        usual = find_kind(kind).DEFAULT_PORT
        number = _number(word, port, "port", 0, 65535) if port else None
        if count:
            many = _number(word, count, "count", 1, 999)
            entries = [(f"{name or kind}_{i + 1}", number + i if number else 0) for i in range(many)]
        else:
            alike = sum(request.kind == kind for request in requests)
            if number is None:
                number = 0 if alike else usual or 0
            entries = [(name or (f"{kind}_{alike + 1}" if alike else kind), number)]
        for name, number in entries:
            if not _NAME.fullmatch(name):
                raise ValueError(f"{word!r}: a robot's name has small letters, digits and _, and a letter first")
            if name in (request.name for request in requests):
                raise ValueError(f"{word!r}: two robots cannot both be called {name!r}")
            settings = {**(options or {}).get(kind, {}), **(options or {}).get(name, {})}
            requests.append(RobotRequest(kind, name, number, settings))
    return requests


def _number(word: str, text: str, what: str, least: int, most: int) -> int:
    if not (text.isascii() and text.isdigit() and least <= int(text) <= most):
        raise ValueError(f"{word!r}: a {what} is a number from {least} to {most}")
    return int(text)


class Simulation:
    """Runs from construction until `close`.

    Args:
        robots: The robots of the world; those of one kind start side by side.
        scene: Name of a scene, see `telepresence.sim.scene.scene_names`.
        seed: Start of every random sequence.
        address: Where all wires listen.
        start: False leaves the world standing, for programs that step it themselves.
    Raises:
        ValueError: Unknown scene, kind, or setting of a kind; no room for so many robots.
        OSError: A port is taken or the address is not this machine's.
    """

    def __init__(
        self,
        robots: Iterable[RobotRequest],
        scene: str,
        seed: int = 0,
        address: str = "127.0.0.1",
        *,
        start: bool = True,
    ) -> None:
        requests = list(robots)
        self.robots: dict[str, SimulatedRobot] = {}
        """The robots by name."""
        places = FreePlaces(scene) if len(requests) > 1 else None
        for request in requests:
            self.robots[request.name] = _make(request, places)
        with contextlib.ExitStack() as stack:
            self.world = build_world(scene, [robot.model for robot in self.robots.values()], seed)
            stack.callback(self.world.close)
            self.cameras = Cameras(self.world)
            stack.callback(self.cameras.close)
            for robot in self.robots.values():
                stack.callback(robot.close)
                robot.enter(self.world, self.cameras, seed)
            # Before anybody can connect: clients give a robot that listens half a second to answer.
            self.cameras.wait_ready()
            if start:
                self.world.start()
            for request in requests:
                self.robots[request.name].serve(address, request.port)
            stack.callback(SpareMemory().close)
            self._stack = stack.pop_all()

    @property
    def urls(self) -> list[str]:
        """All addresses to announce, robot by robot."""
        return [url for robot in self.robots.values() for url in robot.urls]

    @property
    def failure(self) -> str:
        """Why the simulation cannot continue and has to be restarted; "" while it runs."""
        return "" if self.world.running else "the simulated world has stopped"

    def truth(self, name: str) -> BodyState:
        """Return the true pose and velocity of the robot called `name`.

        Raises:
            KeyError: There is no such robot.
        """
        return read_pose(self.world, self.robots[name].model.prefix)

    def restart(self) -> None:
        """Return everything to the start; clients stay connected."""
        self.world.reset()

    def close(self) -> None:
        """End wires, cameras and world, in this order. Calling it again does nothing."""
        self._stack.close()

    def __enter__(self) -> Simulation:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class OneRobotSimulation(Simulation):
    """A world with one robot, of the kind that the subclass names. Runs from construction until `close`.

    Args:
        scene: Name of a scene, see `telepresence.sim.scene.scene_names`; by default the kind's own.
        seed: Start of every random sequence.
        address, port: Where its wire listens; by default the port of the real one, 0 takes a free one, see `url`.
        start: False leaves the world standing, for programs that step it themselves.
        options: Settings of the kind.
    Raises:
        ValueError: Unknown scene, or a setting that its kind does not take.
        OSError: The port is taken, the address is not this machine's, or a file of a setting cannot be used.
    """

    KIND: ClassVar[str]
    SCENE: ClassVar[str]

    def __init__(
        self,
        scene: str = "",
        seed: int = 0,
        address: str = "127.0.0.1",
        port: int | None = None,
        *,
        start: bool = True,
        **options: Any,
    ) -> None:
        usual = find_kind(self.KIND).DEFAULT_PORT or 0
        request = RobotRequest(self.KIND, self.KIND, usual if port is None else port, options)
        super().__init__([request], scene or self.SCENE, seed, address, start=start)

    @property
    def simulated(self) -> Any:
        """The robot with everything that belongs to it, see its kind."""
        return self.robots[self.KIND]

    @property
    def robot(self) -> Any:
        """Its body: setpoints in, snapshots out, in SI units."""
        return self.simulated.robot

    @property
    def server(self) -> Any:
        """Its wire."""
        return self.simulated.server

    @property
    def url(self) -> str:
        """Where clients connect, without a slash at the end: the first address."""
        return self.urls[0]


def _make(request: RobotRequest, places: FreePlaces | None) -> SimulatedRobot:
    kind, prefix = find_kind(request.kind), f"{request.name}/"
    known = set(inspect.signature(kind).parameters) - {"prefix", "offset"}
    if unknown := set(request.options) - known:
        settings = ", ".join(sorted(known)) or "none"
        raise ValueError(f"a {request.kind} has no setting {min(unknown)!r}; settings: {settings}")
    robot = kind(prefix, **request.options)
    offset = places.find(robot.model.spawn) if places else (0.0, 0.0)
    return robot if offset == (0.0, 0.0) else kind(prefix, offset, **request.options)
