"""Command line of the simulated Robotino: `python -m robotino_sim`. It runs until SIGINT or SIGTERM."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from robotino_sim.controller import CONTROLLER_WATCHDOG, REST_WATCHDOG
from robotino_sim.power import KINDS
from robotino_sim.simulation import DEFAULT_PORT, DEFAULT_SCENE, Simulation
from robotino_sim.webcam import SIZES
from telepresence.sim import command_line


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a simulated robot; the exit status."""
    options = _parse(arguments)
    return command_line.run("robotino_sim", options, lambda: _open(options))


def _open(options: argparse.Namespace) -> Simulation:
    return Simulation(
        options.scene,
        options.seed,
        options.address,
        options.port,
        watchdog=options.watchdog,
        laser=options.laser,
        battery=options.battery,
        charging=options.charging,
        camera_size=tuple(map(int, options.camera.split("x"))),
        strict_camera=options.strict_camera,
        cors=options.cors,
    )


def _parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = command_line.parser(
        "robotino_sim",
        "A simulated Robotino that answers RobotinoOS's REST interface. Prints its address when it is ready.",
        port=DEFAULT_PORT,
        scene=DEFAULT_SCENE,
    )
    sizes = [f"{width}x{height}" for width, height in SIZES]
    parser.add_argument(
        "--watchdog",
        type=float,
        choices=(REST_WATCHDOG, CONTROLLER_WATCHDOG),
        default=REST_WATCHDOG,
        help="seconds of silence after which the robot stops (default: %(default)s)",
    )
    parser.add_argument("--laser", action="store_true", help="put a laser scanner on the robot")
    parser.add_argument(
        "--battery",
        choices=tuple(KINDS),
        default="NiMH",
        help="Li-Ion: packs with a Festool charger (default: %(default)s)",
    )
    parser.add_argument("--charging", action="store_true", help="stand at the charger from the start")
    parser.add_argument("--camera", choices=sizes, default=sizes[1], help="size of /cam0 (default: %(default)s)")
    parser.add_argument(
        "--strict-camera", action="store_true", help="answer /cam0 with 500 whenever the robot of 2021 would have"
    )
    parser.add_argument("--cors", action="store_true", help="let pages of other web servers in: they may drive it")
    return parser.parse_args(arguments)


if __name__ == "__main__":
    sys.exit(main())
