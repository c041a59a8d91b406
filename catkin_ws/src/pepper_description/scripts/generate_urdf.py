#!/usr/bin/env python3
"""Writes urdf/pepper.urdf from the tables in data/.

    python scripts/generate_urdf.py            writes urdf/pepper.urdf
    python scripts/generate_urdf.py --check    exit code 1 when the file is not what the tables say

Tree: base_link (no mass: KDL allows none at the root) = torso, from there head, arms and leg; the leg ends in Tibia,
which carries wheels, bumpers and range sensors, and in base_footprint on the floor under it.
"""

from __future__ import annotations

import argparse
import csv
import sys
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Iterator
from pathlib import Path

PACKAGE = Path(__file__).resolve().parent.parent
OUTPUT = PACKAGE / "urdf" / "pepper.urdf"
COLOURS = {"white": "0.92 0.92 0.93 1", "grey": "0.58 0.60 0.63 1", "dark": "0.16 0.17 0.19 1"}
AXES = {"x": "1 0 0", "y": "0 1 0", "z": "0 0 1"}
FINGER_TURN = 0.872665
"""Angle of every finger joint [rad] when the hand is open (URDF of ros-naoqi/pepper_robot)."""
PHALANX = {"Finger": 0.018, "Thumb": 0.022}
"""Length of a phalanx [m], and its radius."""
PHALANX_RADIUS = 0.007
FINGER_MASS, FINGER_INERTIA = "2e-06", "2e-10"
"""[kg, kg m2]: a thin rod of this mass and a phalanx's length, about its end."""
FOOTPRINT_BELOW_KNEE = "0 0 -0.334"
OPTICAL = "-1.570796 0 -1.570796"
"""Rotation from a frame that points along x to one that points along z with x to the right: REP 103."""

Row = dict[str, str]


def rows(name: str) -> Iterator[Row]:
    """The lines of a table in data/, without its comments."""
    with (PACKAGE / "data" / name).open() as table:
        yield from csv.DictReader(line for line in table if not line.startswith("#"))


def generate() -> str:
    """The URDF as text."""
    robot = ET.Element("robot", name="pepper")
    robot.append(ET.Comment(" Written by scripts/generate_urdf.py from the tables in data/; change those. "))
    for name, rgba in COLOURS.items():
        ET.SubElement(ET.SubElement(robot, "material", name=name), "color", rgba=rgba)
    inertia = {row["link"]: row for row in rows("inertia.csv")}
    shapes: dict[str, list[Row]] = {}
    for row in rows("shapes.csv"):
        shapes.setdefault(row["link"], []).append(row)

    add_link(robot, "base_link")
    add_fixed(robot, "base_joint", "base_link", "torso")
    add_link(robot, "torso", inertia["torso"], shapes.get("torso", ()))
    for row in rows("joints.csv"):
        add_joint(robot, row)
        add_link(robot, row["child"], inertia.get(row["child"]), shapes.get(row["child"], ()))
    add_fixed(robot, "base_footprint_joint", "Tibia", "base_footprint", FOOTPRINT_BELOW_KNEE)
    add_link(robot, "base_footprint")
    for row in rows("fingers.csv"):
        add_finger(robot, row)
    for row in rows("frames.csv"):
        frame = row["frame"]
        add_fixed(robot, frame.replace("_frame", "_joint"), row["parent"], frame, xyz(row), rpy(row))
        add_link(robot, frame)
        if frame.startswith("Camera"):
            optical = frame.replace("_frame", "_optical_frame")
            add_fixed(robot, optical.replace("_frame", "_joint"), frame, optical, turn=OPTICAL)
            add_link(robot, optical)
    ET.indent(robot)
    return '<?xml version="1.0"?>\n' + ET.tostring(robot, encoding="unicode") + "\n"


def add_link(robot: ET.Element, name: str, inertia: Row | None = None, shapes: Iterable[Row] = ()) -> None:
    link = ET.SubElement(robot, "link", name=name)
    if inertia is not None:
        element = ET.SubElement(link, "inertial")
        ET.SubElement(element, "origin", xyz=xyz(inertia), rpy="0 0 0")
        ET.SubElement(element, "mass", value=inertia["mass"])
        ET.SubElement(element, "inertia", {key: inertia[key] for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")})
    for shape in shapes:
        add_shape(ET.SubElement(link, "visual"), shape, shape["colour"])
        if shape["solid"] == "yes":
            add_shape(ET.SubElement(link, "collision"), shape)


def add_shape(element: ET.Element, shape: Row, colour: str | None = None) -> None:
    ET.SubElement(element, "origin", xyz=xyz(shape), rpy=rpy(shape))
    geometry = ET.SubElement(element, "geometry")
    if shape["shape"] == "box":
        ET.SubElement(geometry, "box", size=shape["size"])
    elif shape["shape"] == "cylinder":
        radius, length = shape["size"].split()
        ET.SubElement(geometry, "cylinder", radius=radius, length=length)
    elif shape["shape"] == "sphere":
        ET.SubElement(geometry, "sphere", radius=shape["size"])
    else:
        raise ValueError(f"shapes.csv: {shape['link']} has a shape {shape['shape']!r}; use box, cylinder or sphere")
    if colour is not None:
        ET.SubElement(element, "material", name=colour)


def add_fixed(
    robot: ET.Element, name: str, parent: str, child: str, offset: str = "0 0 0", turn: str = "0 0 0"
) -> None:
    joint = ET.SubElement(robot, "joint", name=name, type="fixed")
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=child)
    ET.SubElement(joint, "origin", xyz=offset, rpy=turn)


def add_joint(robot: ET.Element, row: Row) -> None:
    joint = ET.SubElement(robot, "joint", name=row["name"], type=row["type"])
    ET.SubElement(joint, "parent", link=row["parent"])
    ET.SubElement(joint, "child", link=row["child"])
    ET.SubElement(joint, "origin", xyz=xyz(row), rpy=rpy(row))
    ET.SubElement(joint, "axis", xyz=AXES[row["axis"]])
    limit = {"effort": row["effort"], "velocity": row["velocity"]}
    if row["lower"]:
        limit |= {"lower": row["lower"], "upper": row["upper"]}
    ET.SubElement(joint, "limit", limit)


def add_finger(robot: ET.Element, row: Row) -> None:
    """A phalanx: a link of almost no mass, since the hand's own mass includes its fingers."""
    joint = ET.SubElement(robot, "joint", name=row["name"], type="revolute")
    ET.SubElement(joint, "parent", link=row["parent"])
    ET.SubElement(joint, "child", link=f"{row['name']}_link")
    ET.SubElement(joint, "origin", xyz=xyz(row), rpy=rpy(row))
    ET.SubElement(joint, "axis", xyz=AXES["z"])
    ET.SubElement(joint, "limit", effort="0.144", velocity="12.56", lower="0", upper=str(FINGER_TURN))
    ET.SubElement(joint, "mimic", joint=row["hand"], multiplier=str(FINGER_TURN), offset="0")
    length = next(length for part, length in PHALANX.items() if part in row["name"])
    link = ET.SubElement(robot, "link", name=f"{row['name']}_link")
    element = ET.SubElement(link, "inertial")
    ET.SubElement(element, "origin", xyz="0 0 0", rpy="0 0 0")
    ET.SubElement(element, "mass", value=FINGER_MASS)
    inertia = dict.fromkeys(("ixx", "iyy", "izz"), FINGER_INERTIA) | dict.fromkeys(("ixy", "ixz", "iyz"), "0")
    ET.SubElement(element, "inertia", inertia)
    visual = ET.SubElement(link, "visual")
    ET.SubElement(visual, "origin", xyz=f"{length / 2:g} 0 0", rpy="0 1.570796 0")
    ET.SubElement(ET.SubElement(visual, "geometry"), "cylinder", radius=str(PHALANX_RADIUS), length=str(length))
    ET.SubElement(visual, "material", name="grey")


def xyz(row: Row) -> str:
    return f"{row['x']} {row['y']} {row['z']}"


def rpy(row: Row) -> str:
    return f"{row['roll']} {row['pitch']} {row['yaw']}"


def main() -> int:
    parser = argparse.ArgumentParser(description="Write urdf/pepper.urdf from the tables in data/.")
    parser.add_argument("--check", action="store_true", help="write nothing; fail when the file is out of date")
    if not parser.parse_args().check:
        OUTPUT.write_text(generate())
        return 0
    if OUTPUT.read_text() != generate():
        print(f"{OUTPUT} is not what the tables say; run scripts/generate_urdf.py", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
