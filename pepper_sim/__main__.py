"""Command line of the simulated Pepper: `python -m pepper_sim`. It runs until SIGINT or SIGTERM."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pepper_sim.body.description import HEADS
from pepper_sim.simulation import DEFAULT_PORT, DEFAULT_SCENE, Simulation
from telepresence.sim import command_line


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a simulated robot until it is interrupted; return the exit status."""
    parser = command_line.parser(
        "pepper_sim",
        "A simulated Pepper that speaks NAOqi. Prints its address when it is ready.",
        port=DEFAULT_PORT,
        scene=DEFAULT_SCENE,
    )
    parser.add_argument(
        "--speaker",
        default="none",
        metavar="DEVICE",
        help="play the robot's loudspeaker on this sound device; auto picks the system's default (default: none)",
    )
    parser.add_argument("--record-speaker", default="", metavar="FILE", help="write the same sound into a WAV file")
    parser.add_argument(
        "--room-sound", default="", metavar="WHAT", help="sound in the room: tone, or a WAV file, repeated"
    )
    parser.add_argument(
        "--head",
        choices=HEADS,
        default=HEADS[0],
        help="version of the head: 1.8 has a stereo camera, 1.8a and older ones a depth camera (default: %(default)s)",
    )
    parser.add_argument(
        "--package", dest="packages", action="append", default=[], metavar="FILE", help="install a .pkg on the robot"
    )
    parser.add_argument(
        "--disk", default="", metavar="FOLDER", help="the robot's files, kept (default: a fresh disk that ends with it)"
    )
    parser.add_argument(
        "--tablet-browser",
        choices=("built-in", "chromium"),
        default="built-in",
        help="what shows the tablet's pages; chromium runs their scripts and needs 500 MB (default: %(default)s)",
    )
    parser.add_argument(
        "--poster",
        dest="posters",
        action="append",
        default=[],
        metavar="WHAT@AHEAD,LEFT,HEIGHT[,TURN[,WIDTH]]",
        help="put a landmark (mark:85), a QR code (code:TEXT) or a picture file before the robot; metres and degrees",
    )
    parser.add_argument(
        "--owner-consents",
        action="store_true",
        help="let programs switch safety reflexes off, as a real robot's owner can on its page",
    )
    parser.add_argument(
        "--page-port",
        type=command_line.port_number,
        default=None,
        metavar="PORT",
        help="serve the owner's page, where this can be changed; 0 takes a free port (default: no page)",
    )
    parser.add_argument(
        "--page-address", default="127.0.0.1", help="address on which that page listens (default: %(default)s)"
    )
    parser.add_argument(
        "--person",
        dest="people",
        action="append",
        default=[],
        metavar="KIND@X,Y",
        help="put a person there, in metres ahead of the robot's start and to its left: standing@1.5,0, seated@2,1, "
        "waving@1.5,0.5, or walking@2,-1;2,1 to and fro; standing@1.5,0,90 is turned by degrees; may be repeated",
    )
    parser.add_argument(
        "--station",
        default="",
        metavar="X,Y,THETA",
        help="pose of the robot on its charging station, seen from where it starts [m, m, rad] (default: no station)",
    )
    options = parser.parse_args(arguments)
    names = (
        "speaker",
        "record_speaker",
        "room_sound",
        "head",
        "packages",
        "disk",
        "tablet_browser",
        "posters",
        "people",
        "station",
        "owner_consents",
    )
    parts = {name: getattr(options, name) for name in (*names, "page_port", "page_address")}
    return command_line.run(
        "pepper_sim", options, lambda: Simulation(options.scene, options.seed, options.address, options.port, **parts)
    )


if __name__ == "__main__":
    sys.exit(main())
