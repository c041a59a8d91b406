"""The file of a site, in TOML: which robots there are, and where people find them.

address = "127.0.0.1"                  # of this computer; others reach it only if this is another one
port = 8443

[robot.anna]                           # one word: it stands in the page's address
kind = "pepper"                        # pepper, robotino or both: what ./stack up takes
settings = { sim = false, nao_ip = "192.168.1.20" }

[robot.carl]                           # a unit on a computer of its own
url = "https://10.8.0.21:8443/"
authority = "carl.crt"                 # that computer's authority.crt, which has signed its page
"""

from __future__ import annotations

import ipaddress
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from telepresence import ports
from telepresence.station.launch_settings import STATIONS, launch_arguments, require_choices, require_loopback
from telepresence.switch import is_on

FIRST_PORT, PORTS_OF_ONE = 21000, 20
"""Ports of the units of this computer begin here, so many for each; below those that Linux gives by itself."""
MOST_ROBOTS = 64
LONGEST_TITLE = 60
_NAME = re.compile(r"[a-z][a-z0-9-]{0,30}")
_HOST = re.compile(r"(?=.{1,253}$)[A-Za-z0-9]([A-Za-z0-9-]*[A-Za-z0-9])?(\.[A-Za-z0-9]([A-Za-z0-9-]*[A-Za-z0-9])?)*")
PLAIN = re.compile(r"[^\x00-\x1f\x7f\"`{}$]*")
"""A path that Caddy takes as it is."""
_IMAGE = re.compile(r"[a-z0-9][a-zA-Z0-9._:/@-]{0,200}")
_VOLUME = re.compile(r"[a-zA-Z0-9][a-zA-Z0-9_.-]{0,100}")
_TAKEN = ("static", "caddy", "proxy")
"""Names of the site's own: in addresses, among programs and logs."""
_OURS = ("gui", "teleop", "page", "page_url", "page_proxy", "page_folder", "page_certificate", "page_certificate_key",
         "pilot_page_port")  # fmt: skip
"""Settings that a robot of a site has from the site."""
_SITE: dict[str, type] = {
    "address": str, "port": int, "name": str, "certificate": str, "certificate_key": str, "logs": str,
    "first_port": int, "volume": str, "robot": dict,
}  # fmt: skip
_UNIT: dict[str, type] = {"title": str, "kind": str, "settings": dict, "master_port": int, "image": str}
_ELSEWHERE: dict[str, type] = {"title": str, "url": str, "authority": str}


class SiteError(RuntimeError):
    """A file is no site's; the text says what is wrong with it."""


@dataclass(frozen=True)
class Unit:
    """A robot whose programs run on this computer.

    Attributes:
        name, title: In addresses, and for people.
        kind: What `./stack up` takes.
        settings: For its launch file, as a person gave them.
        first_port: Of its block.
        master_port: Of its ROS master.
        image: Of which its programs run in a container; empty: on this computer itself.
    """

    name: str
    title: str
    kind: str
    settings: Mapping[str, str]
    first_port: int
    master_port: int
    image: str = ""

    @property
    def simulated(self) -> bool:
        return is_on(self.settings, "sim")


@dataclass(frozen=True)
class Elsewhere:
    """A robot whose unit runs on another computer.

    Attributes:
        url: Of its page, https://HOST[:PORT]/.
        authority: The file with what has signed its certificate; None for those that this computer trusts anyway.
    """

    name: str
    title: str
    url: str
    authority: Path | None


@dataclass(frozen=True)
class Site:
    """What a file says.

    Attributes:
        address, port: Where people find it.
        name: How they call it; empty: by address.
        certificate, key: Of the site's own; None: signed by this computer's authority. The key may be in that file.
        logs: The folder for logs, a folder of it for each unit; None for the usual one.
        robots: In the order of the file.
        volume: podman's, with accounts and invitations of units in containers.
    """

    address: str
    port: int
    name: str
    certificate: Path | None
    key: Path | None
    logs: Path | None
    robots: tuple[Unit | Elsewhere, ...] = field(default=())
    volume: str = "telepresence"

    @property
    def units(self) -> list[Unit]:
        """Those that run here."""
        return [robot for robot in self.robots if isinstance(robot, Unit)]

    @property
    def host(self) -> str:
        """What stands in links: a name or an address."""
        return self.name or ("localhost" if ipaddress.ip_address(self.address).is_loopback else self.address)

    @property
    def url(self) -> str:
        """Where the list of robots is."""
        return f"https://{self.host}:{self.port}/"

    def page_url(self, robot: Unit | Elsewhere) -> str:
        """Return where people find the page of a robot."""
        return f"{self.url}{robot.name}/"


def read_site(path: Path) -> Site:
    """Return what a file says.

    Raises:
        SiteError: It cannot be read, or says something that no site can be.
    """
    try:
        text = path.read_bytes().decode()
        return parse_site(text, path.parent)
    except OSError as error:
        raise SiteError(f"{path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise SiteError(f"{path} is no text in UTF-8") from None
    except SiteError as error:
        raise SiteError(f"{path}: {error}") from None


def parse_site(text: str, folder: Path) -> Site:
    """Return what the text of a file says.

    Args:
        folder: In which files are that it names.
    Raises:
        SiteError: See `read_site`.
    """
    try:
        table = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        twice = re.search(r"Cannot declare \('robot', '([\w-]+)'\) twice(.*)", str(error))
        raise SiteError(f"there are two robots '{twice[1]}'{twice[2]}" if twice else str(error)) from None
    _require_shape("the site", table, _SITE)
    first = _port(table, "first_port", FIRST_PORT)
    robots: list[Unit | Elsewhere] = []
    found = table.get("robot", {})
    if not found:
        raise SiteError("there is no robot: a site has one at least, [robot.NAME]")
    if len(found) > MOST_ROBOTS:
        raise SiteError(f"there are {len(found)} robots, and {MOST_ROBOTS} is the limit")
    if first + len(found) * PORTS_OF_ONE > 65536:
        raise SiteError(f"first_port = {first}: {len(found)} robots need {PORTS_OF_ONE} ports each from there on")
    for number, (name, fields) in enumerate(found.items()):
        robots.append(_robot(name, fields, first + number * PORTS_OF_ONE, folder))
    _require_different(robots)
    address = table.get("address", "127.0.0.1")
    try:
        if ipaddress.IPv4Address(address).is_unspecified:
            raise ValueError
    except ValueError:
        raise SiteError(f'address = "{address}" is not one IPv4 address of this computer') from None
    if not ipaddress.ip_address(address).is_loopback:
        _require_sign_in(robots, address)
    name = table.get("name", "")
    if name and not _HOST.fullmatch(name):
        raise SiteError(f'name = "{name}" is no name of a computer')
    volume = table.get("volume", Site.volume)
    if not _VOLUME.fullmatch(volume):
        raise SiteError(f'volume = "{volume}" is no name of a volume')
    if "certificate_key" in table and "certificate" not in table:
        raise SiteError("certificate_key without certificate")
    return Site(
        address,
        _port(table, "port", ports.PILOT_PAGE),
        name.lower(),
        _file(table, "certificate", folder),
        _file(table, "certificate_key", folder),
        _path(table["logs"], folder) if "logs" in table else None,
        tuple(robots),
        volume,
    )


def _robot(name: str, fields: Any, first_port: int, folder: Path) -> Unit | Elsewhere:
    what = f"robot.{name}"
    if not _NAME.fullmatch(name) or name in _TAKEN:
        raise SiteError(
            f"{what}: a robot's name stands in addresses: a to z, 0 to 9 and -, and not {', '.join(_TAKEN)}"
        )
    if not isinstance(fields, dict):
        raise SiteError(f"{what} is no table: write [{what}]")
    if "url" in fields:
        _require_shape(what, fields, _ELSEWHERE)
        return Elsewhere(
            name, _title(what, fields, name), _url(what, fields["url"]), _file(fields, "authority", folder)
        )
    _require_shape(what, fields, _UNIT)
    kind = fields.get("kind", "pepper")
    if kind not in STATIONS:
        raise SiteError(f'{what}: there is no kind "{kind}"; there are: {", ".join(STATIONS)}')
    settings = {key: _setting(f"{what}: {key}", value) for key, value in fields.get("settings", {}).items()}
    known = sorted(launch_arguments(kind) - {*_OURS})
    for key in settings:
        if key in _OURS:
            raise SiteError(f"{what}: {key} is the site's, and not a setting of one robot")
        if key not in known:
            raise SiteError(f"{what}: {kind} has no setting '{key}'; settings: {', '.join(known)}")
    image = fields.get("image", "")
    if image and not _IMAGE.fullmatch(image):
        raise SiteError(f'{what}: image = "{image}" is no name of an image')
    try:
        signs_in = is_on(settings, "sign_in")
        require_choices(kind, settings)
        if is_on(settings, "sim"):
            for wire in STATIONS[kind]:
                require_loopback(settings, wire.address)
    except RuntimeError as error:
        raise SiteError(f"{what}: {error}") from None
    if image and not signs_in:
        raise SiteError(f"{what}: sign_in = false, and everybody who reaches its container would drive")
    master = _port(fields, "master_port", first_port)
    return Unit(name, _title(what, fields, name), kind, settings, first_port, master, image)


def _require_shape(what: str, table: dict[str, Any], shape: dict[str, type]) -> None:
    for key, value in table.items():
        if key not in shape:
            raise SiteError(f"{what} has no '{key}'; there are: {', '.join(shape)}")
        if type(value) is not shape[key]:
            kinds = {str: 'a text in "quotes"', int: "a whole number", dict: "a table"}
            raise SiteError(f"{what}: {key} is to be {kinds[shape[key]]}")


def _require_different(robots: list[Unit | Elsewhere]) -> None:
    """Raise SiteError when one robot is there twice: two units would drive it, each against the other."""
    found: dict[str, str] = {}
    for robot in robots:
        for place in _places(robot):
            if place in found:
                raise SiteError(f"robot.{found[place]} and robot.{robot.name} are the same robot: {place}")
            found[place] = robot.name


def _require_sign_in(robots: list[Unit | Elsewhere], address: str) -> None:
    for robot in robots:
        if isinstance(robot, Unit) and not is_on(robot.settings, "sign_in"):
            raise SiteError(f"robot.{robot.name}: sign_in = false, and everybody who reaches {address} would drive")


def _places(robot: Unit | Elsewhere) -> list[str]:
    """Return the addresses of a real robot, or of its unit."""
    if isinstance(robot, Elsewhere):
        return [robot.url]
    if robot.simulated:
        return []
    wires = STATIONS[robot.kind]
    return [
        f"{robot.settings.get(wire.address, '127.0.0.1')}:{robot.settings.get(wire.port, wire.real_port)}"
        for wire in wires
    ]


def _setting(what: str, value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float | str):
        return str(value)
    raise SiteError(f"{what} is to be a text, a number, true or false")


def _title(what: str, fields: dict[str, Any], name: str) -> str:
    title = fields.get("title", name)
    if not 0 < len(title) <= LONGEST_TITLE or not title.isprintable():
        raise SiteError(f"{what}: a title has 1 to {LONGEST_TITLE} letters")
    return title


def _url(what: str, url: str) -> str:
    try:
        parts = urlsplit(url)
        port = parts.port
    except ValueError:
        parts, port = urlsplit(""), None
    host = parts.hostname or ""
    if (
        parts.scheme != "https"
        or not _HOST.fullmatch(host)
        or parts.path not in ("", "/")
        or parts.query
        or parts.username
    ):
        raise SiteError(f'{what}: url = "{url}" is not of the form https://HOST:PORT/')
    return f"https://{host}:{port or 443}/"


def _port(table: dict[str, Any], key: str, default: int) -> int:
    port = table.get(key, default)
    if not 0 < port < 65536:
        raise SiteError(f"{key} = {port} is no port: a number from 1 to 65535 is needed")
    return port


def _file(table: dict[str, Any], key: str, folder: Path) -> Path | None:
    if key not in table:
        return None
    path = _path(table[key], folder)
    if not path.is_file():
        raise SiteError(f'{key} = "{table[key]}": there is no such file')
    return path


def _path(word: str, folder: Path) -> Path:
    if not word or not PLAIN.fullmatch(word):
        raise SiteError(f"{word!r}: a path without quotes, braces and dollar signs is needed")
    return (folder / Path(word).expanduser()).absolute()
