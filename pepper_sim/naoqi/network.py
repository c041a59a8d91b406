"""The simulated robot's network: a cable that is plugged in, and a Wi-Fi whose radio finds nothing.

Nothing of this touches the machine that simulates it: connections to the robot stay whatever a client changes here. A
network service is described by [[key, value], ...], as ALConnectionManager does.
"""

from __future__ import annotations

import ipaddress
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from pepper_sim.naoqi.service import ServiceError, one_of, shown

ETHERNET, WIFI = "ethernet", "wifi"
TECHNOLOGIES = (ETHERNET, WIFI)
CABLE = "ethernet_020000000001_cable"
"""Identity of the one network service that there is."""
INTERFACES = (("eth0", "02:00:00:00:00:01"), ("wlan0", "02:00:00:00:00:02"))
"""Names and addresses; the second digit says that nobody has assigned them."""
IDLE, ONLINE = "idle", "online"
_ADDRESS = {"Method": "dhcp", "Address": "10.0.2.15", "Netmask": "255.255.255.0", "Gateway": "10.0.2.2"}
_METHODS = ("dhcp", "manual", "off", "fixed")
_PROXY_METHODS = ("direct", "auto", "manual")


@dataclass
class NetworkService:
    """A network that the robot can connect to, and how it does."""

    identity: str
    name: str
    kind: str
    state: str = ONLINE
    favourite: bool = True
    domains: list[str] = field(default_factory=list)
    nameservers: list[str] = field(default_factory=list)
    ipv4: dict[str, str] = field(default_factory=lambda: dict(_ADDRESS))
    proxy: dict[str, str] = field(default_factory=lambda: {"Method": "direct"})

    def pairs(self) -> list[list]:
        """Return what ALConnectionManager says about it."""
        return [
            ["ServiceId", self.identity],
            ["Name", self.name],
            ["Type", self.kind],
            ["State", self.state],
            ["Favorite", self.favourite],
            ["Autoconnect", self.favourite],
            ["Domains", list(self.domains)],
            ["Nameservers", list(self.nameservers)],
            ["IPv4", [list(pair) for pair in self.ipv4.items()]],
            ["Proxy", [list(pair) for pair in self.proxy.items()]],
            ["Security", []],
            ["Error", ""],
        ]


class Network:
    """The robot's network services and their settings.

    Args:
        changed: Called with the service after its state has changed.
    """

    def __init__(self, changed: Callable[[NetworkService], None]) -> None:
        self._changed = changed
        self._lock = threading.Lock()
        self._services = {CABLE: NetworkService(CABLE, "Wired", ETHERNET)}

    @property
    def services(self) -> list[NetworkService]:
        """List the networks within reach."""
        return list(self._services.values())

    @property
    def state(self) -> str:
        """ "online" while a service is connected, else "offline"."""
        return ONLINE if any(service.state == ONLINE for service in self.services) else "offline"

    def find(self, identity: str) -> NetworkService:
        """Return a service.

        Raises: ServiceError: There is none of this identity.
        """
        if identity not in self._services:
            raise ServiceError(f"there is no network service {shown(identity)}")
        return self._services[identity]

    def switch(self, identity: str, on: bool) -> None:
        """Connect or disconnect a service; raises as `find`."""
        service, state = self.find(identity), ONLINE if on else IDLE
        with self._lock:
            before, service.state = service.state, state
        if before != state:
            self._changed(service)

    def configure(self, identity: str, settings: Mapping[str, Any]) -> None:
        """Change settings of a service: Domains, Nameservers, IPv4, Proxy, Autoconnect.

        Raises: ServiceError: There is no such service or setting, or it cannot have the value.
        """
        service = self.find(identity)
        for key, value in settings.items():
            one_of(key, _SETTINGS, "key")
            _SETTINGS[key](service, value)


def _names(value: Any, argument: str) -> list[str]:
    if not isinstance(value, list | tuple) or not all(isinstance(item, str) for item in value):
        raise ServiceError(f"{argument} must be a list of strings, got {shown(value)}")
    return list(value)


def _map(value: Any, argument: str) -> dict[str, str]:
    pairs = value.items() if isinstance(value, dict) else value
    try:
        found = {str(key): str(text) for key, text in pairs}
    except (TypeError, ValueError):
        raise ServiceError(f"{argument} must be a map of strings, got {shown(value)}") from None
    return found


def _address(text: str) -> str:
    try:
        return str(ipaddress.IPv4Address(text))
    except ValueError:
        raise ServiceError(f"{shown(text)} is no IPv4 address") from None


def _set_domains(service: NetworkService, value: Any) -> None:
    service.domains = _names(value, "domains")


def _set_nameservers(service: NetworkService, value: Any) -> None:
    service.nameservers = [_address(name) for name in _names(value, "nameservers")]


def _set_ipv4(service: NetworkService, value: Any) -> None:
    wanted = _map(value, "ipv4")
    one_of(wanted.get("Method", "dhcp"), _METHODS, "Method")
    for key in wanted:
        one_of(key, _ADDRESS, "key")
    service.ipv4 = {key: text if key == "Method" else _address(text) for key, text in {**_ADDRESS, **wanted}.items()}


def _set_proxy(service: NetworkService, value: Any) -> None:
    wanted = _map(value, "proxy")
    one_of(wanted.get("Method", "direct"), _PROXY_METHODS, "Method")
    service.proxy = wanted


def _set_autoconnect(service: NetworkService, value: Any) -> None:
    service.favourite = bool(value)


_SETTINGS: dict[str, Callable[[NetworkService, Any], None]] = {
    "Domains": _set_domains,
    "Nameservers": _set_nameservers,
    "IPv4": _set_ipv4,
    "Proxy": _set_proxy,
    "Autoconnect": _set_autoconnect,
}
