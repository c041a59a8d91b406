"""ALPreferences: files of preferences on the robot's disk. Source: NAOqi 2.8 documentation, ALPreferences."""

from __future__ import annotations

from typing import Any

from pepper_sim.disk import RobotDisk
from pepper_sim.naoqi import preference_files
from pepper_sim.naoqi.service import Module, ServiceError, remote
from pepper_sim.services.al_memory import ALMemory

APPLICATION = "naoqi"
"""Whose preferences it reads and writes."""


class ALPreferences(Module):
    """Reads and writes files of preferences; see `pepper_sim.naoqi.preference_files`."""

    name = "ALPreferences"

    def __init__(self, disk: RobotDisk, memory: ALMemory) -> None:
        self._disk = disk
        self._memory = memory

    @remote("m(sb)")
    def readPrefFile(self, fileName: str, autoGenerateMemoryNames: bool) -> list[list]:
        """Returns a module's preferences; those without a name in ALMemory get "module/name" if asked for."""
        found = preference_files.read(preference_files.path_of(self._disk, APPLICATION, fileName))
        return _named(found, fileName.removesuffix(".xml")) if autoGenerateMemoryNames else found

    @remote("b(m)")
    def saveToMemory(self, prefs: Any) -> bool:
        """Writes the preferences that have a name in ALMemory to it."""
        for row in preference_files.rows(prefs):
            if preference_files.is_nested(row[2]):
                self.saveToMemory(row[2])
            elif len(row) == 4 and row[3]:
                self._memory.store(row[3], row[2])
        return True

    @remote("v(smb)")
    def writePrefFile(self, fileName: str, prefs: Any, ignoreMemoryNames: bool) -> None:
        """Writes a module's preferences, without their names in ALMemory if asked for."""
        file = preference_files.path_of(self._disk, APPLICATION, fileName)
        preference_files.write(file, prefs, not ignoreMemoryNames)

    @remote("v(s)")
    def removePrefFile(self, fileName: str) -> None:
        """Removes a module's file; an error if there is none."""
        file = preference_files.path_of(self._disk, APPLICATION, fileName)
        if not file.is_file():
            raise ServiceError(f"there is no preference file {file.name}")
        file.unlink()


def _named(rows: list[list], prefix: str) -> list[list]:
    """Return preferences that all have a name in ALMemory, but for those that hold others."""
    named = []
    for row in rows:
        name = f"{prefix}/{row[0]}"
        if preference_files.is_nested(row[2]):
            row = [*row[:2], _named(row[2], name), *row[3:]]
        elif len(row) == 3:
            row = [*row, name]
        named.append(row)
    return named
