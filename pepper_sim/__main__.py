"""Command line of the simulated Pepper: `python -m pepper_sim`. It runs until SIGINT or SIGTERM."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from pepper_sim.body.description import HEADS
from pepper_sim.simulation import DEFAULT_PORT, DEFAULT_SCENE, Simulation
from telepresence.sim import command_line


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a simulated robot until it is interrupted; return the exit status."""
    options = _parse(arguments)
    return command_line.run("pepper_sim", options, lambda: _open(options))


def _open(options: argparse.Namespace) -> Simulation:
    return Simulation(
        options.scene,
        options.seed,
        options.address,
        options.port,
        head=options.head,
        disk=options.disk,
        packages=options.packages,
        tablet_browser=options.tablet_browser,
        speaker=options.speaker,
        record_speaker=options.record_speaker,
        room_sound=options.room_sound,
        posters=options.posters,
        people=options.people,
        station=options.station,
        dials=options.dials,
        owner_consents=options.owner_consents,
        page_port=options.page_port,
        page_address=options.page_address,
    )


def _parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = command_line.parser(
        "pepper_sim",
        "A simulated Pepper that speaks NAOqi. Prints its address when it is ready.",
        port=DEFAULT_PORT,
        scene=DEFAULT_SCENE,
    )
    _add_robot(parser.add_argument_group("the robot"))
    _add_sound(parser.add_argument_group("its sound"))
    _add_surroundings(parser.add_argument_group("what is around it"))
    _add_owner(parser.add_argument_group("its owner"))
    return parser.parse_args(arguments)


def _add_robot(group: argparse._ArgumentGroup) -> None:
    group.add_argument(
        "--head",
        choices=HEADS,
        default=HEADS[0],
        help="version of the head: 1.8 has a stereo camera, 1.8a and older ones a depth camera (default: %(default)s)",
    )
    group.add_argument(
        "--package", dest="packages", action="append", default=[], metavar="FILE", help="install a .pkg on the robot"
    )
    group.add_argument(
        "--disk", default="", metavar="FOLDER", help="the robot's files, kept (default: a fresh disk that ends with it)"
    )
    group.add_argument(
        "--tablet-browser",
        choices=("built-in", "chromium"),
        default="built-in",
        help="what shows the tablet's pages; chromium runs their scripts and needs 500 MB (default: %(default)s)",
    )
    group.add_argument(
        "--dials",
        action="store_true",
        help="connect to clients whose services it calls, which must listen for it, as an ordinary Pepper does "
        "(default: call them over the connections that they opened)",
    )


def _add_sound(group: argparse._ArgumentGroup) -> None:
    group.add_argument(
        "--speaker",
        default="none",
        metavar="DEVICE",
        help="play the robot's loudspeaker on this sound device; auto picks the system's default (default: none)",
    )
    group.add_argument("--record-speaker", default="", metavar="FILE", help="write the same sound into a WAV file")
    group.add_argument(
        "--room-sound", default="", metavar="WHAT", help="sound in the room: tone, or a WAV file, repeated"
    )


def _add_surroundings(group: argparse._ArgumentGroup) -> None:
    group.add_argument(
        "--poster",
        dest="posters",
        action="append",
        default=[],
        metavar="WHAT@AHEAD,LEFT,HEIGHT[,TURN[,WIDTH]]",
        help="put a landmark (mark:85), a QR code (code:TEXT) or a picture file before the robot; metres and degrees",
    )
    group.add_argument(
        "--person",
        dest="people",
        action="append",
        default=[],
        metavar="KIND@X,Y",
        help="put a person there, in metres ahead of the robot's start and to its left: standing@1.5,0, seated@2,1, "
        "waving@1.5,0.5, or walking@2,-1;2,1 to and fro; standing@1.5,0,90 is turned by degrees; may be repeated",
    )
    group.add_argument(
        "--station",
        default="",
        metavar="X,Y,THETA",
        help="pose of the robot on its charging station, seen from where it starts [m, m, rad] (default: no station)",
    )


def _add_owner(group: argparse._ArgumentGroup) -> None:
    group.add_argument(
        "--owner-consents",
        action="store_true",
        help="let programs switch safety reflexes off, as a real robot's owner can on its page",
    )
    group.add_argument(
        "--page-port",
        type=command_line.port_number,
        default=None,
        metavar="PORT",
        help="serve the owner's page, where this can be changed; 0 takes a free port (default: no page)",
    )
    group.add_argument(
        "--page-address", default="127.0.0.1", help="address on which that page listens (default: %(default)s)"
    )


if __name__ == "__main__":
    sys.exit(main())
