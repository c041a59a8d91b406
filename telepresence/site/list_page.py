"""The list of a site's robots, as a page: made once, when the site starts."""

from __future__ import annotations

import html
from pathlib import Path

from telepresence.site.caddyfile import STATIC
from telepresence.site.site_file import Elsewhere, Site, Unit

PLACE = "<!-- robots -->"
_KINDS = {"pepper": "Pepper", "robotino": "Robotino", "both": "Pepper, Robotino"}


def write_list(site: Site, folder: Path) -> None:
    """Write the list into a folder, where Caddy finds it."""
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    template = (STATIC / "list.html").read_text(encoding="utf-8")
    rows = "\n".join(_row(robot) for robot in site.robots)
    (folder / "index.html").write_text(template.replace(PLACE, rows), encoding="utf-8")


def _row(robot: Unit | Elsewhere) -> str:
    """A robot as a stranger may see it: what it is called, and what it is, where the file says that."""
    kind = _KINDS[robot.kind] if isinstance(robot, Unit) else ""
    return (
        f'<li><a href="{robot.name}/"><span class="name">{html.escape(robot.title)}</span>'
        f'<span class="kind">{kind}</span><span class="state" data-robot="{robot.name}"></span></a></li>'
    )
