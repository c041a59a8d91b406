"""Command line of the walker: `python -m telepresence.sim.walker --terrain rough`. It runs until SIGINT or SIGTERM."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from telepresence.sim import command_line
from telepresence.sim.walker.gait import GAITS, TROT
from telepresence.sim.walker.simulation import DEFAULT_PORT, DEFAULT_SCENE, Simulation


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a simulated walker; the exit status."""
    parser = command_line.parser(
        "telepresence.sim.walker",
        "A small four-legged robot that answers JSON over HTTP. Prints its address when it is ready.",
        port=DEFAULT_PORT,
        scene=DEFAULT_SCENE,
    )
    parser.add_argument("--gait", choices=tuple(GAITS), default=TROT.name, help="(default: %(default)s)")
    options = parser.parse_args(arguments)
    return command_line.run(
        "telepresence.sim.walker",
        options,
        lambda: Simulation(options.scene, options.seed, options.address, options.port, gait=options.gait),
    )


if __name__ == "__main__":
    sys.exit(main())
