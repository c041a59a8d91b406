"""Choregraphe's behaviours as data: boxes, the diagrams in which they stand, and the links between them.

A behaviour is a file behavior.xar. Its root box holds a diagram; a box holds a diagram of its own, a timeline with
curves of joints and diagrams that start at frames, or a Python script.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pepper_sim.animations.timeline import NotReadable, Timeline, parse_xml, read_curves

FILE = "behavior.xar"
CONTAINER = 0
"""The number under which the links of a diagram name the box that holds it."""
LOAD, START, STOP = 0, 2, 3
"""Natures of inputs."""
STOPPED = 1
"""Nature of the output that a box signals when it is over."""


@dataclass(frozen=True)
class Port:
    """An input or output: its name, and what it is for."""

    name: str
    nature: int


@dataclass(frozen=True)
class Link:
    """A line from an output to an input: numbers of the boxes and of their ports."""

    source: int
    output: int
    target: int
    input: int


@dataclass(frozen=True)
class Diagram:
    """Boxes by number, and the links between them."""

    boxes: Mapping[int, Box]
    links: tuple[Link, ...]


@dataclass(frozen=True)
class Box:
    """One box.

    Attributes:
        script: Its Python code; "" for none.
        timeline: Its curves; None when the box has no timeline of its own.
        diagrams: (seconds after its start, diagram): one at 0 for a box without a timeline.
    """

    name: str
    script: str
    inputs: Mapping[int, Port]
    outputs: Mapping[int, Port]
    parameters: Mapping[str, Any]
    timeline: Timeline | None
    diagrams: tuple[tuple[float, Diagram], ...]

    def all(self) -> Iterator[Box]:
        """Return this box and those inside it."""
        yield self
        for _, diagram in self.diagrams:
            for box in diagram.boxes.values():
                yield from box.all()


def read_behavior(file: Path) -> Box:
    """Return the root box of a behaviour.

    Raises: NotReadable: The file is no behaviour; the text says why.
    """
    project = parse_xml(file)
    root = project.find("Box")
    if project.tag != "ChoregrapheProject" or root is None:
        raise NotReadable(f"{file.name} is no behaviour: its first element is '{project.tag[:40]}'")
    try:
        return _box(root, file)
    except RecursionError:
        raise NotReadable(f"{file.name}: its boxes stand too deep inside each other") from None


def _box(element: ElementTree.Element, file: Path) -> Box:
    timeline = element.find("Timeline")
    curves, diagrams = _timeline(timeline, file) if timeline is not None else (None, ())
    return Box(
        element.get("name", ""),
        _script(element),
        _ports(element, "Input", file),
        _ports(element, "Output", file),
        {parameter.get("name", ""): _value(parameter) for parameter in element.iterfind("Parameter")},
        curves,
        diagrams,
    )


def _ports(element: ElementTree.Element, kind: str, file: Path) -> dict[int, Port]:
    ports = element.iterfind(kind)
    return {_whole(port, "id", file): Port(port.get("name", ""), _whole(port, "nature", file)) for port in ports}


def _timeline(element: ElementTree.Element, file: Path) -> tuple[Timeline | None, tuple[tuple[float, Diagram], ...]]:
    drawn = element.get("enable", "0") in ("1", "true")
    fps = float(_whole(element, "fps", file) or 25)
    first = float(_whole(element, "start_frame", file))
    last = float(_whole(element, "end_frame", file, -1))
    curves = None
    if drawn:
        curves = read_curves(element, fps, first, last if last >= first else math.inf, file)
        if last >= first:
            curves = Timeline(curves.curves, max(curves.duration, (last - first) / fps))
    diagrams = [
        (max(0.0, (_whole(frame, "index", file, 1) - max(first, 1.0)) / fps) if drawn else 0.0, _diagram(diagram, file))
        for layer in element.iterfind("BehaviorLayer")
        for frame in layer.iterfind("BehaviorKeyframe")
        for diagram in frame.iterfind("Diagram")
    ]
    return curves, tuple((moment, diagram) for moment, diagram in diagrams if diagram.boxes or diagram.links)


def _diagram(element: ElementTree.Element, file: Path) -> Diagram:
    boxes = {_whole(box, "id", file): _box(box, file) for box in element.iterfind("Box")}
    links = tuple(
        Link(
            _whole(link, "outputowner", file),
            _whole(link, "indexofoutput", file),
            _whole(link, "inputowner", file),
            _whole(link, "indexofinput", file),
        )
        for link in element.iterfind("Link")
    )
    return Diagram(boxes, links)


def _script(element: ElementTree.Element) -> str:
    content = element.find("script/content")
    text = (content.text or "") if content is not None else ""
    return text.strip("\n") if text.strip() else ""


def _value(element: ElementTree.Element) -> Any:
    """Return the value of a parameter: content_type 0 yes or no, 1 whole, 2 number, 3 text and everything else."""
    text = element.get("value", element.get("default_value", ""))
    try:
        if element.get("content_type") == "0":
            return text.lower() in ("1", "true")
        if element.get("content_type") == "1":
            return int(float(text))
        if element.get("content_type") == "2":
            return float(text)
    except (ValueError, OverflowError):
        return text
    return text


def _whole(element: ElementTree.Element, name: str, file: Path, default: int = 0) -> int:
    text = element.get(name)
    if text is None:
        return default
    try:
        return int(text)
    except ValueError:
        raise NotReadable(f"{file.name}: {element.tag} has the {name} '{text[:20]}'") from None
