"""ALPreferenceManager: values that programs store by domain and name; they last as long as the simulation runs."""

from __future__ import annotations

import threading
from typing import Any

from pepper_sim.naoqi.service import Module, ServiceError, remote, shown

_MAX_VALUES = 100_000


class ALPreferenceManager(Module):
    """Stores preferences."""

    name = "ALPreferenceManager"

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._domains: dict[str, dict[str, Any]] = {}

    @remote("m(ss)")
    def getValue(self, domain: str, setting: str) -> Any:
        """Returns a value; nothing when it is not set."""
        return self._domains.get(domain, {}).get(setting)

    @remote("v(ssm)")
    def setValue(self, domain: str, setting: str, value: Any) -> None:
        """Sets a value."""
        with self._lock:
            if sum(map(len, self._domains.values())) >= _MAX_VALUES:
                raise ServiceError(f"there are {_MAX_VALUES} preferences already")
            self._domains.setdefault(domain, {})[setting] = value

    @remote("v(sm)")
    def setValues(self, domain: str, values: Any) -> None:
        """Sets many values of a domain: [[name, value], ...]."""
        if not isinstance(values, list | tuple) or not all(
            isinstance(pair, list | tuple) and len(pair) == 2 and isinstance(pair[0], str) for pair in values
        ):
            raise ServiceError(f"values must be [[name, value], ...], got {shown(values)}")
        for setting, value in values:
            self.setValue(domain, setting, value)

    @remote("m(s)")
    def getValueList(self, domain: str) -> list[list]:
        """Lists [name, value] of a domain."""
        return [[setting, value] for setting, value in list(self._domains.get(domain, {}).items())]

    @remote("v(ss)")
    def removeValue(self, domain: str, setting: str) -> None:
        """Removes a value."""
        with self._lock:
            self._domains.get(domain, {}).pop(setting, None)

    @remote("v(s)")
    def removeDomainValues(self, domain: str) -> None:
        """Removes a domain."""
        with self._lock:
            self._domains.pop(domain, None)

    @remote("[s]()")
    def getDomainList(self) -> list[str]:
        """Lists the domains."""
        return sorted(self._domains)

    @remote("v()")
    def update(self) -> None:
        """Synchronises with the manufacturer's server. There is none."""
