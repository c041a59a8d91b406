"""NAOqi's old XML files of preferences, as ALPreferences reads and writes them.

    <ModulePreference name="ALMotion">
      <Preference name="speed" description="" value="0.5" type="float" memoryName="ALMotion/Speed"/>
      <Preference name="limits" description="" type="array" memoryName=""> <Preference .../> ... </Preference>
    </ModulePreference>

A preference is [name, description, value] or [name, description, value, name in ALMemory], and a value may be a list of
preferences. Source: NAOqi 2.8 documentation, ALPreferences.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

from pepper_sim.disk import RobotDisk
from pepper_sim.naoqi.service import ServiceError, shown

FOLDER = "/home/nao/.config"
_DEEPEST = 16


def path_of(disk: RobotDisk, application: str, file: str) -> Path:
    """Return where a file of an application's preferences is; ".xml" is added where it is missing.

    Raises: ServiceError: The name leads to another folder.
    """
    name = file if file.endswith(".xml") else f"{file}.xml"
    if "/" in name or "/" in application or not application or name == ".xml":
        raise ServiceError(f"{shown(file)} is no name of a preference file")
    return disk.path(f"{FOLDER}/{application}/{name}")


def read(file: Path) -> list[list]:
    """Return the preferences of a file.

    Raises: ServiceError: There is no such file, or it holds something else.
    """
    try:
        root = ElementTree.fromstring(file.read_bytes())
    except OSError:
        raise ServiceError(f"there is no preference file {file.name}") from None
    except ElementTree.ParseError as error:
        raise ServiceError(f"{file.name} holds no preferences: {error}") from None
    return [_read(element) for element in root.iterfind("Preference")]


def write(file: Path, preferences: Any, with_memory_names: bool) -> None:
    """Write preferences into a file.

    Raises: ServiceError: They are none; the text says what is wrong.
    """
    root = ElementTree.Element("ModulePreference", name=file.stem)
    for row in rows(preferences):
        _write(root, row, with_memory_names, _DEEPEST)
    ElementTree.indent(root)
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(ElementTree.tostring(root, encoding="utf-8", xml_declaration=True))


def rows(preferences: Any) -> list[list]:
    """Return the preferences that a client sent.

    Raises: ServiceError: They are none.
    """
    if not isinstance(preferences, list | tuple):
        raise ServiceError(f"prefs must be a list of preferences, got {shown(preferences)}")
    for row in preferences:
        named = isinstance(row, list | tuple) and len(row) in (3, 4) and isinstance(row[0], str)
        if not named or not all(isinstance(word, str) for word in (row[1], *row[3:])):
            raise ServiceError(f"a preference is [name, description, value, memory name], got {shown(row)}")
    return [list(row) for row in preferences]


def is_nested(value: Any) -> bool:
    """Whether a preference's value holds preferences."""
    return isinstance(value, list | tuple)


def _read(element: ElementTree.Element) -> list:
    text, kind = element.get("value", ""), element.get("type", "string")
    value: Any = text
    if kind == "array":
        value = [_read(child) for child in element.iterfind("Preference")]
    elif kind == "bool":
        value = text.lower() in ("true", "1")
    elif kind in ("int", "float"):
        try:
            value = int(text) if kind == "int" else float(text)
        except ValueError:
            raise ServiceError(f"{element.get('name')} is no {kind}: {shown(text)}") from None
    row = [element.get("name", ""), element.get("description", ""), value]
    return [*row, element.get("memoryName", "")] if element.get("memoryName") else row


def _write(parent: ElementTree.Element, row: list, with_memory_names: bool, depth: int) -> None:
    if depth == 0:
        raise ServiceError(f"preferences are nested deeper than {_DEEPEST}")
    name, description, value = row[:3]
    element = ElementTree.SubElement(parent, "Preference", name=name, description=description)
    if with_memory_names and len(row) == 4:
        element.set("memoryName", row[3])
    if is_nested(value):
        element.set("type", "array")
        for child in rows(value):
            _write(element, child, with_memory_names, depth - 1)
        return
    kinds = {bool: "bool", int: "int", float: "float", str: "string"}
    if type(value) not in kinds:
        raise ServiceError(f"{name} cannot be {shown(value)}")
    element.set("type", kinds[type(value)])
    element.set("value", str(value).lower() if isinstance(value, bool) else str(value))
