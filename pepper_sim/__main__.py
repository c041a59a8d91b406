"""Command line of the simulated Pepper: `python -m pepper_sim`. It runs until SIGINT or SIGTERM."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pepper_sim.simulation import DEFAULT_PORT, DEFAULT_SCENE, Simulation
from telepresence.sim import command_line


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a simulated robot; the exit status."""
    options = command_line.parser(
        "pepper_sim",
        "A simulated Pepper that speaks NAOqi. Prints its address when it is ready.",
        port=DEFAULT_PORT,
        scene=DEFAULT_SCENE,
    ).parse_args(arguments)
    return command_line.run(
        "pepper_sim", options, lambda: Simulation(options.scene, options.seed, options.address, options.port)
    )


if __name__ == "__main__":
    sys.exit(main())
