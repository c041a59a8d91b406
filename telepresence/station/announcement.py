"""What `./stack up` says to the person at the terminal: what runs where, and, when there is a picture, what to do."""

from __future__ import annotations

import os
from pathlib import Path

from telepresence import ports
from telepresence.station.launch_settings import PEPPER, STATIONS
from telepresence.station.pilot_page import certificate_fingerprint
from telepresence.station.screen import Screen

PAGE_KEY, ROBOT_PAGE_KEY = "TELEPRESENCE_PAGE_KEY", "TELEPRESENCE_ROBOT_PAGE_KEY"
"""Environment variables with the keys to the tablet's page and to that of a simulated Pepper's owner: the banner says
them, and the programs that serve the pages find them there, where other users of the machine cannot read them."""
FIRST_PICTURE = "The window shows the first picture."
"""What the window prints then."""
NO_SOUND = "there is no sound card"
"""Words of a program that finds no device to speak or to hear with."""
END = "Ctrl-C ends all of it."


def banner(
    robot: str,
    settings: dict[str, str],
    master_uri: str,
    simulated: bool,
    screen: Screen | None = None,
    link: str = "",
    output: Path | None = None,
) -> str:
    """Return what runs where.

    Args:
        screen: The virtual display with the window; None for no such.
        link: Opens the pilot's page; empty where there is none.
        output: The file with what the programs print.
    """
    wires = STATIONS.get(robot, ())
    lines = [""]
    for wire in wires:
        usual, kind = (wire.simulated_port, "simulated") if simulated else (wire.real_port, "real")
        where = robot_url(wire.scheme, settings.get(wire.address, "127.0.0.1"), settings.get(wire.port, usual))
        lines.append(f"  robot        {wire.name}, {kind}, {where}")
    lines.append(f"  ROS master   {master_uri}")
    links = pepper_links(robot, settings, simulated)
    if PEPPER in wires:
        lines.append(f"  tablet page  {links[0] if links else 'com_cam prints its address, with the key to it'}")
    if link:
        lines.append(f"  pilot's page {link}")
        if certificate := certificate_fingerprint(settings):
            lines.append(f"  certificate  SHA-256 {certificate}")
    if links:
        lines.append(f"  owner's page {links[1]}")
    if screen is not None:
        lines += [
            f"  window       {screen.url}",
            f"               There is no display here, so the window is on a virtual one ({screen.name}).",
        ]
    if output is not None:
        lines.append(f"  output       {output}")
    lines += ["", f"  {END}", ""]
    return "\n".join(lines)


def robot_url(scheme: str, address: str, port: str | int) -> str:
    """Return how a robot is reached.

    Args:
        scheme, port: Where the address has none of its own.
        address: As a person gives it: host, host:port, or with a scheme, as a Pepper's with NAOqi 2.9.
    """
    named, separator, place = address.rpartition("://")
    host, colon, number = place.rpartition(":")
    has_port = bool(colon) and number.isdigit() and (":" not in host or host.endswith("]"))
    return f"{named if separator else scheme}://{place if has_port else f'{place}:{port}'}"


def pepper_links(robot: str, settings: dict[str, str], simulated: bool) -> list[str]:
    """Return the links to the tablet's page of a simulated Pepper and to its owner's; none where there is no such."""
    if PEPPER not in STATIONS.get(robot, ()) or not simulated:
        return []
    where = settings.get("page_port", ports.TABLET_PAGE), settings.get("robot_page_port", ports.OWNER_PAGE)
    keys = (os.environ.get(name, "") for name in (PAGE_KEY, ROBOT_PAGE_KEY))
    return [f"http://127.0.0.1:{port}/?k={key}" for port, key in zip(where, keys, strict=True)]


def next_steps(window: bool, link: str, sound: bool = True, keyboard: bool = True) -> str:
    """Return what a person can do now that everything works.

    Args:
        window: Whether there is the operator's window.
        link: Opens the pilot's page; empty where there is none.
        sound: Whether this machine has a device to speak and to hear with.
        keyboard: Whether one drives from the terminal where there is no window.
    """
    silence = "" if sound else "No sound here: no sound server answers, and there is no sound card.\n"
    if not window and not keyboard:
        where = f" Drive in any browser:\n  {link}" if link else ""
        return f"Everything is started.{where}\n{END}"
    begin = f"{FIRST_PICTURE} Drive there" if window else "Everything is started. Drive from here"
    return silence + (f"{begin}, or in any browser:\n  {link}\n{END}" if link else f"{begin}. {END}")
