"""A robot's unit of a site in a container of the project's image (docs/container.md), by podman.

The container has a network, processes and files of its own. What it shares are the folder with its page's unix socket,
where the site's proxy finds it, and the volume with accounts, invitations and logs, which all containers of the
site have. No port is published but that of a real Pepper's tablet.
"""

from __future__ import annotations

import os
import shlex

from telepresence.page.proxy import SOCKET
from telepresence.site.site_file import Site, Unit
from telepresence.station.pilot_page import SITE

PODMAN = "podman"
OPTIONS = "CONTAINER_RUN_OPTIONS"
"""Environment variable: further options of `podman run`, for a machine that wants some."""
HOME = "/var/lib/telepresence"
"""Where the image has its volume."""
INSIDE = "/run/telepresence"
"""Where the container has the folder of its page's socket."""
SOCKET_NAME = "page.socket"
_USER = 1000
"""User id of the image's programs."""


def name_of(unit: Unit) -> str:
    """Return what podman calls a unit's container."""
    return f"telepresence-{unit.name}"


def command(unit: Unit, site: Site, folder: str, ports: dict[str, int]) -> list[str]:
    """Return the command line that runs a unit's container, and ends with it.

    Args:
        folder: In which its page's socket is to be.
        ports: Those that a robot must reach, by launch argument.
    """
    options = [
        "--rm", "--replace", "--name", name_of(unit), "--hostname", "telepresence", "--pull", "never", "--read-only",
        "--cap-drop", "all", "--security-opt", "no-new-privileges", "--health-on-failure", "kill",
        "--volume", f"{site.volume}:{HOME}", "--volume", f"{folder}:{INSIDE}:U",
        "--env", f"{SITE}={site.url}", "--env", f"ROS_LOG_DIR={HOME}/.ros/site/{unit.name}",
    ]  # fmt: skip
    for port in ports.values():
        options += ["--publish", f"{port}:{port}"]
    if os.geteuid() != 0:  # the image's user is whoever has started the site, so that Caddy may open the socket
        options += ["--userns", f"keep-id:uid={_USER},gid={_USER}"]
    settings = {**unit.settings, **{name: str(port) for name, port in ports.items()}}
    settings.update(
        page_url=site.page_url(unit),
        page_proxy=f"{SOCKET}{INSIDE}/{SOCKET_NAME}",
        page_folder=f"{HOME}/.config/telepresence/site/{unit.name}",
    )
    words = [f"{name}:={value}" for name, value in settings.items()]
    return [PODMAN, "run", *options, *shlex.split(os.environ.get(OPTIONS, "")), unit.image, "unit", unit.kind, *words]
