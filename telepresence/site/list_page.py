"""The list of a site's robots, as a page: made once, when the site starts."""

from __future__ import annotations

import html
from pathlib import Path

from telepresence.site.caddyfile import STATIC
from telepresence.site.site_file import Elsewhere, Site, Unit
from telepresence.site.unit import signs_in

PLACE = "<!-- robots -->"
_KINDS = {"pepper": "Pepper", "robotino": "Robotino", "both": "Pepper, Robotino"}


def write_list(site: Site, folder: Path) -> None:
    """Write the list into a folder, where Caddy finds it."""
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    template = (STATIC / "list.html").read_text(encoding="utf-8")
    rows = "\n".join(_row(robot, site) for robot in site.robots)
    (folder / "index.html").write_text(template.replace(PLACE, rows), encoding="utf-8")


def _row(robot: Unit | Elsewhere, site: Site) -> str:
    """A robot as a stranger may see it: what it is called, what it is, where the file says that, and by which part of
    the site's link its page opens: the key where nobody signs in, else the invitation; robots with accounts of their
    own by neither."""
    kind = opens = ""
    if isinstance(robot, Unit):
        kind = _KINDS[robot.kind]
        opens = "" if robot.image else "i" if signs_in(robot, site) else "k"
    return (
        f'<li><a href="{robot.name}/"><span class="name">{html.escape(robot.title)}</span>'
        f'<span class="kind">{kind}</span>'
        f'<span class="state" data-robot="{robot.name}" data-opens="{opens}"></span></a></li>'
    )
