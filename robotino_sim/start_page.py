"""The page at /: the real robot serves its web application there, this one what a person wants to look at first."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape

_PAGE = """<!DOCTYPE html>
<html lang="en">
<head><meta charset="utf-8"><title>Robotino (simulated)</title></head>
<body>
<h1>Robotino</h1>
<p>This is a simulated robot that answers as RobotinoOS does.</p>
<p><img src="/cam0" alt="camera"> <img src="/sensorimage" alt="distance sensors and bumper"></p>
<ul>
{links}
</ul>
</body>
</html>
"""


def start_page(readings: Iterable[str]) -> bytes:
    """Return the page, with a link for each of these paths."""
    links = "\n".join(f'<li><a href="{escape(path)}">{escape(path)}</a></li>' for path in readings)
    return _PAGE.format(links=links).encode()
