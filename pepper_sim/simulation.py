"""A simulated Pepper for any world, with its tablet and its NAOqi server; and a world with one Pepper in it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import mujoco
import numpy as np

from pepper_sim import owner_page
from pepper_sim.body.description import HEADS
from pepper_sim.disk import RobotDisk
from pepper_sim.models import PREFIX, pepper_model
from pepper_sim.posters import parse_poster
from pepper_sim.robot import Pepper
from pepper_sim.server import NaoqiServer
from pepper_sim.sound.loudspeaker_output import LoudspeakerOutput
from pepper_sim.sound.room import Room
from pepper_sim.sound.room_sounds import RoomSounds
from pepper_sim.tablet.tablet import Tablet
from telepresence.sim.camera import Cameras
from telepresence.sim.person_request import PersonRequest, add_people, spawn_origin
from telepresence.sim.scene import RobotModel
from telepresence.sim.simulated_robot import SimulatedRobot
from telepresence.sim.simulation import OneRobotSimulation
from telepresence.sim.world import World
from telepresence.video.images import LatestImage
from telepresence.web.page_auth import page_key
from telepresence.web.server import WebServer

DEFAULT_PORT = 9559
DEFAULT_SCENE = "apartment"


class SimulatedPepper(SimulatedRobot):
    """One Pepper of a world. `robot` and `tablet` exist once it has entered, `server` and `page` once it serves.

    Args:
        speaker: The sound device that plays what the loudspeaker plays; see `telepresence.audio.devices`.
        record_speaker: A WAV file that records what the loudspeaker plays; "" for none.
        room_sound: A sound in the room that the microphones pick up; see `RoomSounds`.
        head: Version of the head: "1.8" has a stereo camera, "1.8a" and the older ones a depth camera.
        dials: It connects to clients whose services it calls, as an ordinary Pepper, instead of calling over the
            connections that they opened.
        owner_consents: Programs may switch safety reflexes off from the start.
        page_port: Of the owner's page, see `pepper_sim.owner_page`; 0 takes a free one, None leaves it out.
        page_address: On which the page listens.
        packages: Files of packages that are installed on it, see `pepper_sim.naoqi.installed_packages`.
        tablet_browser: What shows the tablet's pages, see `Tablet`: "built-in" or "chromium".
        disk: Folder of this machine that is the robot's disk, and is kept; "" for a fresh one that ends with it.
        posters: Pictures, landmarks and QR codes in the scene, as `pepper_sim.posters.parse_poster` reads them.
        people: Who else is in the scene, see `telepresence.sim.person_request`: texts, or one with spaces between them.
        station: Where its charging station stands: "x,y,theta" [m, m, rad] of the docked robot, seen from where it
            starts; "" for none.
    Raises:
        ValueError: A person or the station is invalid.
    """

    DEFAULT_PORT = DEFAULT_PORT
    BASE_FRAME = "base_footprint"

    def __init__(
        self,
        prefix: str = PREFIX,
        offset: tuple[float, float] = (0.0, 0.0),
        speaker: str = "none",
        record_speaker: str = "",
        room_sound: str = "",
        head: str | float = HEADS[0],
        packages: Sequence[str] = (),
        posters: Sequence[str] = (),
        disk: str = "",
        tablet_browser: str = "built-in",
        dials: bool = False,
        owner_consents: bool = False,
        page_port: int | None = None,
        page_address: str = "127.0.0.1",
        people: Sequence[str] = (),
        station: str = "",
    ) -> None:
        self._posters = [parse_poster(text) for text in posters]
        # ROS hands the parameter 1.8 over as a number.
        self._model = pepper_model(
            prefix, offset=offset, head=str(head), station=read_station(station), furnish=self._furnish
        )
        self._output = (speaker, Path(record_speaker) if record_speaker else None)
        self._room_sound = room_sound
        self._tablet_browser = tablet_browser
        self._disk = Path(disk) if disk else None
        self._packages = [Path(package) for package in packages]
        self._dials = dials
        self._owner_consents = owner_consents
        self._page = (page_address, page_port)
        self._page_key = page_key(owner_page.KEY_VARIABLE)
        self.page: WebServer | None = None
        self._people = [PersonRequest.parse(text) for text in (people.split() if isinstance(people, str) else people)]
        self.output: LoudspeakerOutput | None = None
        self.room_sounds: RoomSounds | None = None
        self._seed = 0
        self._start = (0.0, 0.0, 0.0)
        self.robot: Pepper | None = None
        self.tablet: Tablet | None = None
        self.server: NaoqiServer | None = None

    @property
    def model(self) -> RobotModel:
        return self._model

    def _furnish(self, scene: mujoco.MjSpec, start: np.ndarray) -> None:
        for number, poster in enumerate(self._posters):
            poster.put_into(scene, start, f"{self._model.prefix}poster_{number}")
        self._start = spawn_origin(scene, self._model)
        add_people(scene, self._people, self._start, self._person_prefix)

    def enter(self, world: World, cameras: Cameras, seed: int) -> None:
        self._seed = seed
        self.robot = Pepper(world, cameras, self._model.prefix, seed, self._owner_consents)
        world.people.meet(self._model.prefix + self.BASE_FRAME, self._model.prefix + "Head")
        for number, request in enumerate(self._people, 1):
            request.begin(world.people[f"{self._person_prefix}{number}"], self._start)
        self.tablet = Tablet(self.robot.show_on_tablet, self._tablet_browser)

    def serve(self, address: str, port: int) -> None:
        if self.robot is None:
            raise RuntimeError("the robot must enter a world before it can serve")
        disk = RobotDisk(self._disk) if self._disk is not None else None
        self.server = NaoqiServer(self.robot, f"tcp://{address}:{port}", self.tablet, self._seed, disk)
        if self._dials:
            self.server.catalogue.clients.dial()
        for package in self._packages:
            self.server.catalogue.packages.install(package)
        page_address, page_port = self._page
        if page_port is not None:
            self.page = owner_page.serve(self.robot.consent, page_address, page_port, self._page_key)
        room = self.server.catalogue.room
        self.room_sounds = RoomSounds(room.surroundings, self._room_sound)
        self.output = LoudspeakerOutput(room.loudspeaker.track, *self._output)

    @property
    def _person_prefix(self) -> str:
        """What the names of this robot's people begin with: person_1, or anna_person_1 where the robot is anna."""
        own = self._model.prefix.rstrip("/")
        return "person_" if self._model.prefix == PREFIX else f"{own}_person_"

    @property
    def urls(self) -> list[str]:
        return self.server.endpoints if self.server else []

    @property
    def page_url(self) -> str | None:
        """Where the owner finds the robot's page, with the key to it."""
        return owner_page.address_with_key(self.page, self._page_key) if self.page is not None else None

    @property
    def screens(self) -> Mapping[str, Callable[[], LatestImage]]:
        tablet = self.tablet
        return {"tablet": lambda: tablet.image} if tablet is not None else {}

    def say_nearby(self, text: str) -> None:
        if self.room_sounds is not None and self.server is not None:
            self.server.catalogue.room.spoken(text, self.room_sounds.say(text))

    def close(self) -> None:
        for part in (self.page, self.output, self.room_sounds, self.server, self.tablet):
            if part is not None:
                part.close()


def read_station(text: str) -> tuple[float, float, float] | None:
    """Return the pose of a docked robot from "x,y,theta"; None for "".

    Raises:
        ValueError: Not three finite numbers.
    """
    if not text:
        return None
    try:
        x, y, theta = (float(word) for word in text.split(","))
    except ValueError:
        raise ValueError(f"a charging station stands at x,y,theta, got {text!r}") from None
    if not all(map(math.isfinite, (x, y, theta))):
        raise ValueError(f"a charging station stands at finite x,y,theta, got {text!r}")
    return x, y, theta


class Simulation(OneRobotSimulation):
    """A world with one Pepper; the options are those of `SimulatedPepper`.

    Raises:
        CannotListen: The port is taken or the address is not this machine's; an OSError.
    """

    KIND, SCENE = "pepper", DEFAULT_SCENE

    @property
    def tablet(self) -> Tablet:
        return self.simulated.tablet

    @property
    def room(self) -> Room:
        """The sounds around the robot: play into `room.surroundings`, listen to `room.loudspeaker.track`."""
        return self.server.catalogue.room
