"""ALPreferenceManager: texts that programs store by domain and name; they last as long as the simulation runs.

Source: NAOqi 2.8 documentation, ALPreferenceManager. There is no cloud to keep them in step with.
"""

from __future__ import annotations

import threading
from typing import Any

from pepper_sim.disk import RobotDisk
from pepper_sim.naoqi import preference_files
from pepper_sim.naoqi.service import Module, ServiceError, remote, shown
from pepper_sim.services.al_memory import ALMemory
from telepresence.naoqi.signals import Signal

_MAX_VALUES = 100_000
_MAX_NAME, _MAX_TEXT = 512, 1_000_000
"""Bytes, as documented."""


class ALPreferenceManager(Module):
    """Stores preferences. Values that are no texts are ignored, as documented."""

    name = "ALPreferenceManager"

    def __init__(self, disk: RobotDisk, memory: ALMemory) -> None:
        self._disk = disk
        self._memory = memory
        self._lock = threading.Lock()
        self._domains: dict[str, dict[str, str]] = {}
        self.preferenceAdded = Signal("(ssm)")
        self.preferenceUpdated = Signal("(ssm)")
        self.preferenceRemoved = Signal("(ss)")
        self.preferenceDomainRemoved = Signal("(s)")
        self.preferencesSynchronized = Signal("()")
        events = ("preferenceAdded", "preferenceChanged", "preferenceRemoved", "preferenceDomainRemoved")
        memory.declare((*events, "preferenceSynchronized"), self.name)

    @remote("[s]()")
    def getDomainList(self) -> list[str]:
        """Lists the domains."""
        return sorted(self._domains)

    @remote("[[m]]()")
    def getValues(self) -> list[list]:
        """Lists [domain, name, value] of all domains."""
        with self._lock:
            return [[domain, *pair] for domain, values in self._domains.items() for pair in values.items()]

    @remote("[[m]](s)")
    def getValueList(self, domain: str) -> list[list]:
        """Lists [name, value] of a domain."""
        with self._lock:
            return [[*pair] for pair in self._domains.get(domain, {}).items()]

    @remote("m(ss)")
    def getValue(self, domain: str, setting: str) -> str | None:
        """Returns a value; nothing when it is not set."""
        return self._domains.get(domain, {}).get(setting)

    @remote("v(ssm)")
    def setValue(self, domain: str, setting: str, value: Any) -> None:
        """Sets a value; ignored if it is no text."""
        if not isinstance(value, str):
            return
        for text, longest, argument in (
            (domain, _MAX_NAME, "domain"),
            (setting, _MAX_NAME, "setting"),
            (value, _MAX_TEXT, "value"),
        ):
            if len(text.encode()) > longest:
                raise ServiceError(f"{argument} is longer than {longest} bytes: {shown(text)}")
        with self._lock:
            if sum(map(len, self._domains.values())) >= _MAX_VALUES:
                raise ServiceError(f"there are {_MAX_VALUES} preferences already")
            values = self._domains.setdefault(domain, {})
            known, values[setting] = setting in values, value
        (self.preferenceUpdated if known else self.preferenceAdded)(domain, setting, value)
        self._memory.announce("preferenceChanged" if known else "preferenceAdded", [domain, setting])

    @remote("v({s{sm}})")
    def setValues(self, values: dict[str, dict[str, Any]]) -> None:
        """Sets many values: {domain: {name: value}}."""
        for domain, settings in values.items():
            for setting, value in settings.items():
                self.setValue(domain, setting, value)

    @remote("v(ss)")
    def removeValue(self, domain: str, setting: str) -> None:
        """Removes a value."""
        with self._lock:
            found = self._domains.get(domain, {}).pop(setting, None)
        if found is not None:
            self.preferenceRemoved(domain, setting)
            self._memory.announce("preferenceRemoved", [domain, setting])

    @remote("v(s)")
    def removeDomainValues(self, domain: str) -> None:
        """Removes a domain."""
        with self._lock:
            found = self._domains.pop(domain, None)
        if found is not None:
            self.preferenceDomainRemoved(domain)
            self._memory.announce("preferenceDomainRemoved", domain)

    @remote("v(sssb)")
    def importPrefFile(self, domain: str, application: str, filename: str, override: bool) -> None:
        """Takes a file of ALPreferences over; values that are set already stay unless `override`."""
        file = preference_files.path_of(self._disk, application, filename)
        for name, value in _flat(preference_files.read(file)):
            if override or self.getValue(domain, name) is None:
                self.setValue(domain, name, value)

    @remote("v()")
    def update(self) -> None:
        """Brings the preferences into step with the cloud. There is none, so they are."""
        self.preferencesSynchronized()
        self._memory.announce("preferenceSynchronized", None)


def _flat(rows: list[list], prefix: str = "") -> list[tuple[str, Any]]:
    """Return name and value of preferences, those in others as "outer/inner"."""
    found: list[tuple[str, Any]] = []
    for name, _, value, *_ in rows:
        if preference_files.is_nested(value):
            found += _flat(value, f"{prefix}{name}/")
        else:
            found.append((prefix + name, value))
    return found
