"""People that are put into a scene at a user's request, in the notation `kind@x,y[;x,y...][,heading]`.

`standing@1.5,0` stands 1.5 m in front of where the robot starts and faces it; `seated@2,1` sits on a stool;
`waving@1.5,-0.5` waves; `walking@2,-1;2,1` walks to and fro. Coordinates are those of the robot at its start: x ahead,
y left [m]; a third number turns the person, counter-clockwise from the robot's own heading [degrees].
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from telepresence.sim.people import FIGURES, Person
from telepresence.sim.scene import RobotModel

KINDS = {
    "standing": "person_standing",
    "walking": "person_standing",
    "waving": "person_standing",
    "seated": "person_seated",
}
"""What is asked for -> the figure that does it."""
_MODELS = Path(__file__).parent / "scenes" / "parts" / "figures.xml"
_PARTS = ("", "_arm", "_head")
_STOOL = (0.19, 0.19, 0.225)


@dataclass(frozen=True)
class PersonRequest:
    """One person to be put into a scene.

    Args:
        kind: One of `KINDS`.
        points: Where the person stands, or the way [m], in the robot's frame at its start.
        heading: [rad] in that frame; None: towards the robot.
    """

    kind: str
    points: tuple[tuple[float, float], ...]
    heading: float | None = None

    @classmethod
    def parse(cls, text: str) -> PersonRequest:
        """Read `kind@x,y[;x,y...][,heading]`.

        Raises:
            ValueError: It is not of that form; the message names the kinds.
        """
        kind, _, places = text.partition("@")
        usage = f"{text!r} is no person: write KIND@X,Y or KIND@X,Y,DEGREES or walking@X,Y;X,Y with KIND {_KINDS}"
        try:
            rows = [[float(number) for number in place.split(",")] for place in places.split(";")]
        except ValueError:
            raise ValueError(usage) from None
        turned = len(rows) == 1 and len(rows[0]) == 3
        points = tuple((row[0], row[1]) for row in rows if len(row) == 2 or turned)
        walks = kind == "walking"
        if kind not in KINDS or len(points) != len(rows) or walks != (len(points) > 1):
            raise ValueError(usage)
        if not all(math.isfinite(number) for row in rows for number in row):
            raise ValueError(usage)
        return cls(kind, points, math.radians(rows[0][2]) if turned else None)

    def start_heading(self) -> float:
        """Return where the person looks at the start [rad]: along the way, as asked for, or to the robot."""
        (x, y), *others = self.points
        if others:
            return math.atan2(others[0][1] - y, others[0][0] - x)
        return math.atan2(-y, -x) if self.heading is None else self.heading

    def begin(self, person: Person, origin: tuple[float, float, float]) -> None:
        """Let the person do what was asked for; `origin` is where the robot starts (x, y [m], heading [rad])."""
        person.watch_robots(True)
        if len(self.points) > 1:
            person.walk([_at(origin, x, y) for x, y in (*self.points[1:], self.points[0])])
        person.wave(self.kind == "waving")
        person.begin_with_this()


_KINDS = ", ".join(KINDS)


def add_people(
    spec: mujoco.MjSpec, requests: Sequence[PersonRequest], origin: tuple[float, float, float], prefix: str
) -> None:
    """Put people into a scene before it is compiled; they are called `prefix`1, `prefix`2, ...

    Args:
        origin: Where the robot starts in the scene (x, y [m], heading [rad]).
    """
    for number, request in enumerate(requests, 1):
        models = mujoco.MjSpec.from_file(str(_MODELS))  # a fresh one for each: colours are copied only once
        figure = FIGURES[KINDS[request.kind]]
        (x, y), turn = _at(origin, *request.points[0]), origin[2] + request.start_heading()
        cosine, sine = math.cos(turn), math.sin(turn)
        for part, offset in zip(_PARTS, ((0.0, 0.0, 0.0), figure.elbow, figure.neck), strict=True):
            source = models.body(KINDS[request.kind] + part)
            if source is None or offset is None:
                continue
            body = spec.worldbody.add_frame().attach_body(source, f"{prefix}{number}/", "")
            body.pos = [x + cosine * offset[0] - sine * offset[1], y + sine * offset[0] + cosine * offset[1], offset[2]]
            body.quat = [math.cos(0.5 * turn), 0.0, 0.0, math.sin(0.5 * turn)]
        if figure.posture == "seated":
            spec.worldbody.add_geom(
                type=mujoco.mjtGeom.mjGEOM_BOX,
                pos=[x + 0.02 * cosine, y + 0.02 * sine, _STOOL[2]],
                quat=[math.cos(0.5 * turn), 0.0, 0.0, math.sin(0.5 * turn)],
                size=list(_STOOL),
                rgba=[0.72, 0.54, 0.36, 1.0],
                contype=1,
                conaffinity=1,
            )


def spawn_origin(spec: mujoco.MjSpec, robot: RobotModel) -> tuple[float, float, float]:
    """Return where a robot starts in the scene (x, y [m], heading [rad])."""
    site = spec.site(robot.spawn)
    w, _, _, z = np.asarray(site.quat).tolist()
    heading = 2.0 * math.atan2(z, w)
    x, y = _at((float(site.pos[0]), float(site.pos[1]), heading), *robot.offset)
    return x, y, heading


def _at(origin: tuple[float, float, float], x: float, y: float) -> tuple[float, float]:
    cosine, sine = math.cos(origin[2]), math.sin(origin[2])
    return origin[0] + cosine * x - sine * y, origin[1] + sine * x + cosine * y
