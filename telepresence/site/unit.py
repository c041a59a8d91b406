"""One robot's unit of a site: the command line and the environment of the `./stack up` that brings it up.

Each has a ROS master, ports, logs, sign-ins and a unix socket for its page of its own, so whatever happens to one is
nobody else's business. Accounts and invitations are those of the user, for all of them.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

from telepresence.page.proxy import SOCKET
from telepresence.site import container
from telepresence.site.site_file import PLAIN, Site, SiteError, Unit
from telepresence.station.launch_settings import allow_port, require_free
from telepresence.station.pilot_page import PILOT_PAGE_KEY, SITE
from telepresence.switch import is_on

TCP, UDP = False, True
LONGEST_SOCKET = 107
"""[bytes] of the path of a unix socket: unix(7)."""
SIMULATED: dict[str, tuple[tuple[str, bool], ...]] = {
    "pepper": (("nao_port", TCP), ("robot_page_port", TCP)),
    "robotino": (("robotino_port", TCP), ("drive_port", UDP), ("camera_port", TCP), ("sound_port", TCP)),
    "both": (
        ("nao_port", TCP), ("robot_page_port", TCP),
        ("robotino_port", TCP), ("drive_port", UDP), ("camera_port", TCP), ("sound_port", TCP),
    ),
}  # fmt: skip
"""Launch arguments with the ports of simulated robots, which listen here."""
ALWAYS: dict[str, tuple[tuple[str, bool], ...]] = {
    "pepper": (("page_port", TCP), ("drive_port", UDP)),
    "robotino": (),
    "both": (("page_port", TCP), ("pepper_drive_port", UDP)),
}
"""Those with the ports of a unit itself."""
_MASTER, TABLET = "master_port", "page_port"


def socket_of(unit: Unit, folder: Path) -> Path:
    """Return where a unit's page listens.

    Args:
        folder: Of the site, which nobody else may enter.
    """
    if unit.image:  # in a folder that the container may write: among these, no name is one of the site's own folders
        return folder / "units" / unit.name / container.SOCKET_NAME
    return folder / f"{unit.name}.socket"


def heartbeat_of(unit: Unit, folder: Path) -> Path:
    """Return the socket where a unit's first program beats.

    Args:
        folder: Of the site.
    """
    return folder / "watch" / unit.name


def require_usable(site: Site, folder: Path) -> None:
    """Raise SiteError when the folder for temporary files is none for the site's sockets."""
    if not PLAIN.fullmatch(str(folder)):  # Caddy would read more in it than a path
        raise SiteError(
            f"{folder}: a path without quotes, braces and dollar signs is needed. Set TMPDIR to another one"
        )
    sockets = [place(unit, folder) for unit in site.units for place in (socket_of, heartbeat_of)]
    excess = max((len(os.fsencode(path)) for path in sockets), default=0) - LONGEST_SOCKET
    if excess > 0:
        raise SiteError(
            f"{folder.parent} is too long a path for the site's sockets, by {excess} bytes. Set TMPDIR to a shorter one"
        )


def ports_of(unit: Unit) -> dict[str, tuple[int, bool]]:
    """Return the ports on which a unit will listen, by what chooses them, and whether they are udp's.

    Raises:
        SiteError: A setting is no port.
    """
    found = {} if unit.image else {_MASTER: (unit.master_port, TCP)}
    wanted = ALWAYS[unit.kind] + (SIMULATED[unit.kind] if unit.simulated else ())
    if unit.image:  # what a robot must reach; everything else is in the container
        wanted = () if unit.simulated else tuple(each for each in ALWAYS[unit.kind] if each == (TABLET, TCP))
    for number, (name, udp) in enumerate(wanted, 1):
        word = unit.settings.get(name, str(unit.first_port + number))
        if not (word.isascii() and word.isdigit() and 0 < int(word) < 65536):
            raise SiteError(f"robot.{unit.name}: {name} = {word} is no port: a number from 1 to 65535 is needed")
        found[name] = int(word), udp
    return found


def require_ports(site: Site) -> None:
    """Raise SiteError when two units want the same port, or one is taken already."""
    wanted: dict[tuple[int, bool], str] = {(site.port, TCP): "the site's port"}
    for unit in site.units:
        for name, (port, udp) in ports_of(unit).items():
            who = f"{name} of robot.{unit.name}"
            if (port, udp) in wanted:
                raise SiteError(f"port {port} is wanted twice: {wanted[port, udp]} and {who}")
            wanted[port, udp] = who
    for (port, udp), who in wanted.items():
        address = site.address if (port, udp) == (site.port, TCP) else "127.0.0.1"
        try:
            require_free(port, "", "", udp, address)
        except RuntimeError as refusal:
            kind = "udp" if udp else "tcp"
            if isinstance(refusal.__cause__, PermissionError):
                raise SiteError(
                    f"{kind} port {port}, {who}, is not for everybody: {allow_port(port)}, or choose another one"
                ) from None
            raise SiteError(
                f"{kind} port {port} of {address}, {who}, cannot be had: another program has it, or this "
                "computer has no such address. Choose another one in the file, or another first_port"
            ) from None


def command(unit: Unit, site: Site, folder: Path) -> list[str]:
    """Return the command line of a unit's programs.

    Args:
        folder: See `socket_of`.
    """
    if unit.image:
        published = {name: port for name, (port, _) in ports_of(unit).items()}
        return container.command(unit, site, str(socket_of(unit, folder).parent), published)
    settings = dict(unit.settings)
    settings.update({name: str(port) for name, (port, _) in ports_of(unit).items() if name != _MASTER})
    settings.update(
        page="true" if site.address.startswith("127.") else site.address,
        page_url=site.page_url(unit),
        page_proxy=f"{SOCKET}{socket_of(unit, folder)}",
        page_folder=str(page_folder(unit)),
    )
    words = [f"{name}:={value}" for name, value in settings.items()]
    return [sys.executable, "-P", "-m", "telepresence.station", "--unit", unit.kind, *words]


def environment(unit: Unit, site: Site, key: str, logs: Path, base: Mapping[str, str]) -> dict[str, str]:
    """Return the environment of a unit's programs.

    Args:
        key: Lets in, where nobody signs in, whoever has started the site.
        logs: The folder of the unit's logs.
        base: Environment of whoever has started the site, without what is the site's own.
    """
    made = {name: value for name, value in base.items() if name not in ("ROS_HOSTNAME", "DISPLAY")}
    return made | {
        "ROS_MASTER_URI": f"http://127.0.0.1:{unit.master_port}",
        "ROS_IP": "127.0.0.1",
        "ROS_LOG_DIR": str(logs),
        SITE: site.url,
        PILOT_PAGE_KEY: key,
    }


def signs_in(unit: Unit, site: Site) -> bool:
    """Return whether people sign in to this robot: as with `./stack up`, a simulated one on loopback asks nobody."""
    if unit.image:  # whose page is at the container's address
        return True
    usual = not unit.simulated or not site.address.startswith("127.")
    return is_on(unit.settings, "sign_in", usual)


def page_folder(unit: Unit) -> Path:
    """Return where a unit's page keeps its sign-ins and its audit: those of two programs cannot be in one file."""
    return Path.home() / ".config" / "telepresence" / "site" / unit.name


@contextlib.contextmanager
def claimed(site: Site) -> Iterator[None]:
    """Keep the names of this site's robots for it: of two sites of one user, robots of one name would share sign-ins,
    audit and logs, and the container of one would end the other's.

    Raises:
        SiteError: Another site that runs has one of them.
        OSError: Their folders cannot be made.
    """
    with contextlib.ExitStack() as ends:
        for unit in site.units:
            folder = page_folder(unit)
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            lock = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)  # the kernel releases it however this process ends
            ends.callback(os.close, lock)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise SiteError(
                    f"robot.{unit.name}: another site of yours, which runs, has a robot of this name. End it, or "
                    "choose another name"
                ) from None
        yield


def log_folder(unit: Unit, site: Site) -> Path:
    """Return the folder of a unit's logs."""
    return site_logs(site) / unit.name


def site_logs(site: Site) -> Path:
    """Return the folder of the site's logs."""
    home = Path(os.environ.get("ROS_HOME") or "~/.ros").expanduser()
    return site.logs or home / "site"


def remove_socket(path: Path) -> None:
    """Remove what a page that was killed has left: a socket in its place cannot be bound again."""
    with contextlib.suppress(FileNotFoundError):
        path.unlink()
