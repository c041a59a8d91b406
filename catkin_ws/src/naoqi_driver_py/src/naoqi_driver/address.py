"""A robot's address, and what opens its door: NAOqi up to 2.8 has none, later ones ask for user and password."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Address:
    """Where NAOqi answers. `user` and `password` are for tcps only: over tcp they are sent to nobody."""

    url: str
    user: str | None = None
    password: str | None = field(default=None, repr=False)

    @classmethod
    def parse(cls, ip: str, port: int = 9559, user: str | None = None, password: str | None = None) -> Address:
        """`ip` is a host name, an IP address, host:port, or a whole URL (`tcp://...`, `tcps://...`).

        Raises:
            ValueError: The address is empty or its scheme is neither tcp nor tcps.
        """
        scheme, mark, rest = ip.rpartition("://")
        if mark and scheme not in ("tcp", "tcps"):
            raise ValueError(f"address {ip!r}: the scheme must be tcp or tcps")
        if not rest:
            raise ValueError(f"address {ip!r} names no robot; use an IP address, a host name or tcp://host:port")
        named_port = rest.rpartition(":")[2].isdigit() and ":" in rest
        return cls(f"{scheme or 'tcp'}://{rest if named_port else f'{rest}:{port}'}", user, password)

    @property
    def encrypted(self) -> bool:
        return self.url.startswith("tcps://")

    @property
    def place(self) -> tuple[str, int]:
        """Host and port."""
        host, _, port = self.url.partition("://")[2].rpartition(":")
        return host.strip("[]"), int(port)

    def __str__(self) -> str:
        return self.url


class Login:
    """Hands user and password to the library, in the steps its authenticator interface asks for; the names are its."""

    def __init__(self, user: str, password: str) -> None:
        self._answer = {"user": user, "token": password}

    def newAuthenticator(self) -> Login:
        return self

    def initialAuthData(self) -> dict[str, str]:
        return self._answer

    def _processAuth(self, _asked: object) -> dict[str, str]:
        return self._answer
