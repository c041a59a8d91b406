"""ALWorldRepresentation: objects that programs place in a tree of the world, with attributes by category.

A position is [x, y, z, wx, wy, wz] in metres and radians, in the frame of the object's parent. Methods that answer a
number answer 0 when they succeed. Source: NAOqi 2.8 documentation, ALWorldRepresentation.
"""

from __future__ import annotations

import json
import threading
import time
from collections import deque
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from pepper_sim.disk import RobotDisk
from pepper_sim.naoqi.object_places import PLACES, as_place, as_transform, at, quaternion
from pepper_sim.naoqi.object_tables import ObjectTables
from pepper_sim.naoqi.service import Module, ServiceError, remote, shown

ROOT = "World"
FILE = "/home/nao/.local/share/worldrepresentation/world.json"
_DONE, _FAILED = 0, 1
_MOST = 10_000
_HISTORY = 1000


@dataclass
class _Object:
    """An object: its parent, its category, and where it was when, newest last."""

    parent: str
    category: str
    places: deque[tuple[float, list[float]]] = field(default_factory=lambda: deque(maxlen=_HISTORY))


class ALWorldRepresentation(Module):
    """Stores objects; they last as long as the simulation runs, or as what `save` wrote."""

    name = "ALWorldRepresentation"

    def __init__(self, disk: RobotDisk) -> None:
        self._disk = disk
        self._lock = threading.RLock()
        self._tables = ObjectTables()
        self._categories: set[str] = set()
        self._objects: dict[str, _Object] = {}

    def close(self) -> None:
        """Forget everything."""
        self._tables.close()

    # --- categories --------------------------------------------------------------------------------------------------

    @remote("i(sb)")
    def createObjectCategory(self, categoryName: str, resetCategory: bool) -> int:
        """Makes a category; one that is there keeps its objects unless it is to be reset."""
        with self._lock:
            if resetCategory:
                self.removeObjectCategory(categoryName)
            self._categories.add(categoryName)
        return _DONE

    @remote("i(s)")
    def removeObjectCategory(self, categoryName: str) -> int:
        """Removes a category and its objects."""
        with self._lock:
            if categoryName not in self._categories:
                return _FAILED
            for name in self.getObjectsInCategory(categoryName):
                self.clearObject(name)
            self._tables.remove_category(categoryName)
            self._categories.discard(categoryName)
        return _DONE

    @remote("i(ssm)")
    def addAttributeToCategory(self, categoryName: str, attributeName: str, attributeFields: Any) -> int:
        """Adds an attribute with the fields [[name, type], ...]."""
        fields = [(name, str(kind)) for name, kind in _pairs(attributeFields, "attributeFields")]
        if categoryName not in self._categories or not fields:
            return _FAILED
        return _DONE if self._tables.add(categoryName, attributeName, fields) else _FAILED

    # --- objects -----------------------------------------------------------------------------------------------------

    @remote("i(ss[f]sm)")
    def storeObject(
        self, objectName: str, parentName: str, position6D: list[float], categoryName: str, attributes: Any
    ) -> int:
        """Adds an object at a place in its parent, with [[attribute, [[field, value], ...]], ...]."""
        return self._store(objectName, parentName, parentName, position6D, categoryName, attributes)

    @remote("i(sss[f]sm)")
    def storeObjectWithReference(
        self,
        objectName: str,
        referenceName: str,
        parentName: str,
        position6D: list[float],
        categoryName: str,
        attributes: Any,
    ) -> int:
        """Adds an object to a parent, at a place in the frame of another object."""
        return self._store(objectName, parentName, referenceName, position6D, categoryName, attributes)

    @remote("i(s)")
    def clearObject(self, objectName: str) -> int:
        """Removes an object and what is in it."""
        with self._lock:
            if objectName not in self._objects:
                return _FAILED
            for child in self.getChildrenNames(objectName):
                self.clearObject(child)
            self._tables.remove_object(self._objects.pop(objectName).category, objectName)
        return _DONE

    @remote("b(s)")
    def findObject(self, objectName: str) -> bool:
        """Whether an object is there."""
        return objectName == ROOT or objectName in self._objects

    @remote("s()")
    def getRootName(self) -> str:
        """Returns the name of what holds everything."""
        return ROOT

    @remote("[s]()")
    def getObjectNames(self) -> list[str]:
        """Lists all objects."""
        return [ROOT, *self._objects]

    @remote("[s](s)")
    def getChildrenNames(self, objectName: str) -> list[str]:
        """Lists the objects whose parent this is."""
        with self._lock:
            return [name for name, known in self._objects.items() if known.parent == objectName]

    @remote("s(s)")
    def getObjectParentName(self, objectName: str) -> str:
        """Returns an object's parent; the root is its own."""
        known = self._objects.get(objectName)
        return known.parent if known else objectName if objectName == ROOT else ""

    @remote("s(s)")
    def getObjectCategory(self, objectName: str) -> str:
        """Returns an object's category; "" if there is no such object."""
        known = self._objects.get(objectName)
        return known.category if known else ""

    @remote("[s](s)")
    def getObjectsInCategory(self, objectName: str) -> list[str]:
        """Lists the objects of a category."""
        with self._lock:
            return [name for name, known in self._objects.items() if known.category == objectName]

    # --- attributes --------------------------------------------------------------------------------------------------

    @remote("m(s)")
    def getObjectAttributes(self, objectName: str) -> list[list[str]]:
        """Lists [attribute, "(field type, ...)"] of an object."""
        attributes = self._tables.attributes(self.getObjectCategory(objectName))
        return [
            [name, f"({', '.join(f'{field} {kind}' for field, kind in fields)})"] for name, fields in attributes.items()
        ]

    @remote("i(ssm)")
    def storeObjectAttribute(self, objectName: str, attributeName: str, attributeFields: Any) -> int:
        """Adds a value of an attribute: [[field, value], ...]."""
        values = dict(_pairs(attributeFields, "attributeFields"))
        category = self.getObjectCategory(objectName)
        return _DONE if category and self._tables.store(category, attributeName, objectName, values) else _FAILED

    @remote("i(sssm)")
    def updateAttribute(self, objectName: str, attributeName: str, criterion: str, attributeFields: Any) -> int:
        """Changes fields, [[field, value], ...], of the values of an attribute that match an SQL condition."""
        category = self.getObjectCategory(objectName)
        if not category:
            return _FAILED
        rows = self._tables.rows(category, attributeName, objectName, criterion)
        self._tables.change_rows(category, attributeName, rows, dict(_pairs(attributeFields, "attributeFields")))
        return _DONE

    @remote("i(sss)")
    def deleteObjectAttribute(self, objectName: str, attributeName: str, criterion: str) -> int:
        """Removes the values of an attribute that match an SQL condition."""
        category = self.getObjectCategory(objectName)
        if not category:
            return _FAILED
        rows = self._tables.rows(category, attributeName, objectName, criterion)
        self._tables.remove_rows(category, attributeName, rows)
        return _DONE

    @remote("m(ssi)")
    def getObjectAttributeValues(self, objectName: str, attributeName: str, latestCount: int) -> list[list]:
        """Lists the newest values of an attribute, each as its fields' values."""
        return self._tables.latest(self.getObjectCategory(objectName), attributeName, objectName, latestCount)

    @remote("m(si)")
    def getObjectLatestAttributes(self, objectName: str, latestCount: int) -> list[list]:
        """Lists [attribute, newest values] for each attribute of an object."""
        category = self.getObjectCategory(objectName)
        return [
            [attribute, self._tables.latest(category, attribute, objectName, latestCount)]
            for attribute in self._tables.attributes(category)
        ]

    @remote("m(ssss)")
    def select(self, criterion: str, categoryName: str, attributeName: str, fields: str) -> list[list]:
        """Lists the values in a category that match an SQL condition; fields is "*" or "Field0, Field1"."""
        return self._tables.select(categoryName, attributeName, criterion, fields)

    @remote("m(sssss)")
    def selectWithOrder(
        self, criterion: str, orderBy: str, categoryName: str, attributeName: str, fields: str
    ) -> list[list]:
        """Like select, ordered by "Field ASC" or "Field DESC"."""
        return self._tables.select(categoryName, attributeName, criterion, fields, orderBy)

    # --- places ------------------------------------------------------------------------------------------------------

    @remote("i(s[f]b)")
    def updatePosition(self, objectName: str, position6D: list[float], keepPositions: bool) -> int:
        """Moves an object in its parent; what was before is forgotten unless it is to be kept."""
        return self._move(objectName, self.getObjectParentName(objectName), position6D, keepPositions)

    @remote("i(ss[f]b)")
    def updatePositionWithReference(
        self, objectName: str, referenceName: str, position6D: list[float], keepPositions: bool
    ) -> int:
        """Moves an object to a place in the frame of another one."""
        return self._move(objectName, referenceName, position6D, keepPositions)

    @remote("i(si)")
    def clearOldPositions(self, objectName: str, maxAge: int) -> int:
        """Forgets where an object was more than `maxAge` seconds ago; where it is stays known."""
        with self._lock:
            known = self._objects.get(objectName)
            if known is None:
                return _FAILED
            oldest = time.time() - maxAge
            while len(known.places) > 1 and known.places[0][0] < oldest:
                known.places.popleft()
        return _DONE

    @remote("m(ss)")
    def getPosition(self, referenceName: str, objectName: str) -> list[list[float]]:
        """Returns [[w, x, y, z], [x, y, z]] of an object in the frame of another one."""
        transform = self._between(referenceName, objectName, time.time())
        return [quaternion(transform[:3, :3]), [float(value) for value in transform[:3, 3]]]

    @remote("[f](ss)")
    def getPosition6D(self, referenceName: str, objectName: str) -> list[float]:
        """Returns [x, y, z, wx, wy, wz] of an object in the frame of another one; zeros if one is missing."""
        return self._place(referenceName, objectName, time.time())

    @remote("[f](ssii)")
    def getPosition6DAtTime(self, referenceName: str, objectName: str, secondsAgo: int, interpType: int) -> list[float]:
        """Returns where an object was; between two known places linearly, with either kind of interpolation."""
        return self._place(referenceName, objectName, time.time() - secondsAgo)

    # --- on disk -----------------------------------------------------------------------------------------------------

    @remote("i()")
    def save(self) -> int:
        """Writes everything to the robot's disk."""
        with self._lock:
            content = {
                "categories": {
                    category: {
                        attribute: {"fields": fields, "rows": self._tables.all(category, attribute)}
                        for attribute, fields in self._tables.attributes(category).items()
                    }
                    for category in sorted(self._categories)
                },
                "objects": {
                    name: [known.parent, known.category, list(known.places)] for name, known in self._objects.items()
                },
            }
        file = self._disk.path(FILE)
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps(content))
        return _DONE

    @remote("i()")
    def load(self) -> int:
        """Replaces everything by what `save` wrote."""
        file = self._disk.path(FILE)
        if not file.is_file():
            return _FAILED
        content = json.loads(file.read_text())
        with self._lock:
            for category in list(self._categories):
                self.removeObjectCategory(category)
            for category, attributes in content["categories"].items():
                self._categories.add(category)
                for attribute, held in attributes.items():
                    fields = [(name, kind) for name, kind in held["fields"]]
                    self._tables.add(category, attribute, fields)
                    for name, *values in held["rows"]:
                        named = dict(zip((field for field, _ in fields), values, strict=True))
                        self._tables.store(category, attribute, name, named)
            for name, (parent, category, places) in content["objects"].items():
                self._objects[name] = _Object(parent, category, deque(map(tuple, places), maxlen=_HISTORY))
        return _DONE

    # --- inside ------------------------------------------------------------------------------------------------------

    def _store(self, name: str, parent: str, reference: str, place: list[float], category: str, attributes: Any) -> int:
        rows = [(attribute, dict(_pairs(fields, "fields"))) for attribute, fields in _pairs(attributes, "attributes")]
        local = as_transform(place)
        with self._lock:
            missing = category not in self._categories or not self.findObject(parent) or not self.findObject(reference)
            if missing or not name or self.findObject(name):
                return _FAILED
            if len(self._objects) >= _MOST:
                raise ServiceError(f"there are {_MOST} objects already")
            now = time.time()
            known = _Object(parent, category)
            known.places.append((now, as_place(self._between(parent, reference, now) @ local)))
            self._objects[name] = known
            if not all(self._tables.store(category, attribute, name, values) for attribute, values in rows):
                self.clearObject(name)
                return _FAILED
        return _DONE

    def _move(self, name: str, reference: str, place: list[float], keep: bool) -> int:
        local = as_transform(place)
        with self._lock:
            known = self._objects.get(name)
            if known is None or not self.findObject(reference):
                return _FAILED
            now = time.time()
            found = as_place(self._between(known.parent, reference, now) @ local)
            if not keep:
                known.places.clear()
            known.places.append((now, found))
        return _DONE

    def _place(self, reference: str, name: str, when: float) -> list[float]:
        if not (self.findObject(reference) and self.findObject(name)):
            return [0.0] * PLACES
        return as_place(self._between(reference, name, when))

    def _between(self, reference: str, name: str, when: float) -> np.ndarray:
        """Return the frame of an object in that of another one, as a matrix."""
        for known in (reference, name):
            if not self.findObject(known):
                raise ServiceError(f"there is no object {shown(known)}")
        return np.linalg.inv(self._in_root(reference, when)) @ self._in_root(name, when)

    def _in_root(self, name: str, when: float) -> np.ndarray:
        transform = np.eye(4)
        with self._lock:
            while name != ROOT:
                known = self._objects[name]
                transform = as_transform(at(known.places, when)) @ transform
                name = known.parent
        return transform


def _pairs(value: Any, argument: str) -> list[tuple[str, Any]]:
    """Return [[name, value], ...] of a client."""
    if not isinstance(value, list | tuple) or not all(
        isinstance(pair, list | tuple) and len(pair) == 2 and isinstance(pair[0], str) for pair in value
    ):
        raise ServiceError(f"{argument} must be [[name, value], ...], got {shown(value)}")
    return [(name, held) for name, held in value]
