"""ALConnectionManager: the robot's network connections. Source: NAOqi 2.8 documentation, ALConnectionManager.

The network is a simulated one, see `pepper_sim.naoqi.network`: what is set here can be read again and is reported, and
the connections of clients stay.
"""

from __future__ import annotations

import threading
from collections.abc import Mapping
from typing import Any

from pepper_sim.naoqi.network import INTERFACES, TECHNOLOGIES, WIFI, Network, NetworkService
from pepper_sim.naoqi.service import Service, ServiceError, one_of, remote, shown
from pepper_sim.services.al_memory import ALMemory

_EVENTS = (
    *("NetworkStateChanged", "NetworkDefaultTechnologyChanged", "NetworkServiceStateChanged", "NetworkServiceAdded"),
    *("NetworkServiceRemoved", "NetworkServiceInputRequired", "NetworkTechnologyAdded", "NetworkTechnologyRemoved"),
    "NetworkConnectStatus",
)
_COUNTRIES = {
    **{"AU": "Australia", "CA": "Canada", "CN": "China", "DE": "Germany", "ES": "Spain", "FR": "France"},
    **{"GB": "United Kingdom", "IT": "Italy", "JP": "Japan", "KR": "South Korea", "US": "United States"},
}
"""Codes of countries whose Wi-Fi rules can be chosen (ISO 3166-1)."""
_SHORTEST_PASSPHRASE, _LONGEST_PASSPHRASE = 8, 63
_MOST = 100


class ALConnectionManager(Service):
    """Lists and configures network services."""

    name = "ALConnectionManager"

    def __init__(self, memory: ALMemory) -> None:
        self._memory = memory
        self._network = Network(self._report)
        self._lock = threading.Lock()
        self._provisioned: dict[str, dict[str, str]] = {}
        self._country = ""
        self._tethering = ""
        """The technology that is tethered, or ""."""
        self._tethering_name, self._passphrase = "Pepper", "nao12345"
        memory.declare(_EVENTS, self.name)
        memory.store("NetworkStateChanged", self._network.state)

    @remote("s()")
    def state(self) -> str:
        """Returns "online", "ready" or "offline"."""
        return self._network.state

    @remote("m()")
    def services(self) -> list[list[list]]:
        """Describes the network services within reach."""
        return [service.pairs() for service in self._network.services]

    @remote("m(s)")
    def service(self, serviceId: str) -> list[list]:
        """Describes a network service."""
        return self._network.find(serviceId).pairs()

    @remote("m()")
    def technologies(self) -> list[str]:
        """Lists the kinds of network that the robot has."""
        return list(TECHNOLOGIES)

    @remote("m()")
    def interfaces(self) -> list[list[str]]:
        """Lists [name, hardware address]."""
        return [list(pair) for pair in INTERFACES]

    @remote("v()", "v(s)")
    def scan(self, technology: str = WIFI) -> None:
        """Looks for network services. The simulated radio finds none."""
        one_of(technology, TECHNOLOGIES, "technology")

    @remote("v(s)")
    def connect(self, serviceId: str) -> None:
        """Connects to a network service."""
        self._network.switch(serviceId, True)

    @remote("v(s)")
    def disconnect(self, serviceId: str) -> None:
        """Disconnects from a network service. Clients stay connected to this simulator."""
        self._network.switch(serviceId, False)

    @remote("v(s)")
    def forget(self, serviceId: str) -> None:
        """Forgets a network service's settings, and does not connect to it by itself any more."""
        self._network.configure(
            serviceId, {"Autoconnect": False, "Domains": [], "Nameservers": [], "IPv4": {}, "Proxy": {}}
        )
        self._network.switch(serviceId, False)

    @remote("v(m)")
    def setServiceConfiguration(self, configuration: Any) -> None:
        """Sets what a description of a network service holds, [["ServiceId", ...], ["Domains", ...], ...]."""
        settings = _map(configuration, "configuration")
        identity = settings.pop("ServiceId", None)
        if not isinstance(identity, str):
            raise ServiceError("configuration must hold a ServiceId")
        self._network.configure(identity, settings)

    @remote("v(s{ss})")
    def setServiceIPv4(self, serviceId: str, ipv4: Mapping[str, str]) -> None:
        """Sets Method (dhcp or manual), Address, Netmask and Gateway."""
        self._network.configure(serviceId, {"IPv4": ipv4})

    @remote("v(s[s])")
    def setServiceDomains(self, serviceId: str, domains: list[str]) -> None:
        """Sets the domains in which names are looked up."""
        self._network.configure(serviceId, {"Domains": domains})

    @remote("v(s[s])")
    def setServiceNameservers(self, serviceId: str, nameservers: list[str]) -> None:
        """Sets the name servers' addresses."""
        self._network.configure(serviceId, {"Nameservers": nameservers})

    @remote("v(s{ss})")
    def setServiceProxy(self, serviceId: str, proxy: Mapping[str, str]) -> None:
        """Sets the proxy: Method (direct, auto or manual) and what belongs to it."""
        self._network.configure(serviceId, {"Proxy": proxy})

    @remote("v(m)")
    def setServiceInput(self, input: Any) -> None:
        """Answers NetworkServiceInputRequired, which no simulated network service raises: an error."""
        identity = _map(input, "input").get("ServiceId")
        if not isinstance(identity, str):
            raise ServiceError("input must hold a ServiceId")
        raise ServiceError(f"{self._network.find(identity).name} has not asked for anything")

    @remote("v({ss})")
    def provisionService(self, configuration: Mapping[str, str]) -> None:
        """Keeps the settings of a network that may come within reach: Type, Name, Security, Passphrase ..."""
        settings = dict(configuration)
        if not settings.get("Name"):
            raise ServiceError("the configuration of a network needs a Name")
        one_of(settings.get("Type", WIFI), TECHNOLOGIES, "Type")
        with self._lock:
            if len(self._provisioned) >= _MOST:
                raise ServiceError(f"there are {_MOST} provisioned services already")
            self._provisioned[settings["Name"]] = settings

    @remote("m()")
    def provisionedServices(self) -> list[dict[str, str]]:
        """Lists what provisionService has kept, without passphrases."""
        with self._lock:
            return [
                {key: text for key, text in settings.items() if key != "Passphrase"}
                for settings in self._provisioned.values()
            ]

    @remote("v(s)")
    def removeProvisionedService(self, serviceName: str) -> None:
        """Forgets what provisionService has kept."""
        with self._lock:
            if self._provisioned.pop(serviceName, None) is None:
                raise ServiceError(f"there is no provisioned service {shown(serviceName)}")

    @remote("v(s)", "v(sss)")
    def enableTethering(self, technology: str, name: str = "", passphrase: str = "") -> None:
        """Makes the robot an access point, with the name and passphrase of the last time if none are given."""
        if one_of(technology, TECHNOLOGIES, "technology") != WIFI:
            raise ServiceError(f"{technology} cannot be tethered")
        if passphrase and not _SHORTEST_PASSPHRASE <= len(passphrase) <= _LONGEST_PASSPHRASE:
            raise ServiceError(f"passphrase must have {_SHORTEST_PASSPHRASE} to {_LONGEST_PASSPHRASE} characters")
        with self._lock:
            self._tethering = technology
            self._tethering_name, self._passphrase = name or self._tethering_name, passphrase or self._passphrase

    @remote("v(s)")
    def disableTethering(self, technology: str) -> None:
        """Ends being an access point."""
        one_of(technology, TECHNOLOGIES, "technology")
        with self._lock:
            self._tethering = "" if self._tethering == technology else self._tethering

    @remote("b(s)")
    def getTetheringEnable(self, technology: str) -> bool:
        """Whether the robot is an access point."""
        return self._tethering == one_of(technology, TECHNOLOGIES, "technology")

    @remote("s(s)")
    def tetheringName(self, technology: str) -> str:
        """Returns the access point's name."""
        one_of(technology, TECHNOLOGIES, "technology")
        return self._tethering_name

    @remote("s(s)")
    def tetheringPassphrase(self, technology: str) -> str:
        """Returns the access point's passphrase."""
        one_of(technology, TECHNOLOGIES, "technology")
        return self._passphrase

    @remote("m()")
    def countries(self) -> list[list[str]]:
        """Lists [code, name] of the countries whose Wi-Fi rules can be chosen."""
        return [list(pair) for pair in _COUNTRIES.items()]

    @remote("s()")
    def country(self) -> str:
        """Returns the code that setCountry chose; "" if it has not."""
        return self._country

    @remote("v(s)")
    def setCountry(self, country: str) -> None:
        """Chooses a country's Wi-Fi rules by its code."""
        self._country = one_of(country, _COUNTRIES, "country")

    def _report(self, service: NetworkService) -> None:
        self._memory.announce("NetworkServiceStateChanged", [service.identity, service.state])
        if self._memory.read("NetworkStateChanged") != self._network.state:
            self._memory.announce("NetworkStateChanged", self._network.state)


def _map(value: Any, argument: str) -> dict[str, Any]:
    """Return a client's [[key, value], ...] or map."""
    pairs = list(value.items()) if isinstance(value, dict) else value
    if not isinstance(pairs, list | tuple) or not all(
        isinstance(pair, list | tuple) and len(pair) == 2 and isinstance(pair[0], str) for pair in pairs
    ):
        raise ServiceError(f"{argument} must be [[key, value], ...], got {shown(value)}")
    return dict(pairs)
