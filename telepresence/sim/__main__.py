"""Several robots in one world: `python -m telepresence.sim --robot pepper --robot robotino:rto3:8080`.

It runs until SIGINT or SIGTERM. Every robot answers at its own address, as if it were alone.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

from telepresence.sim import command_line
from telepresence.sim.simulated_robot import kinds
from telepresence.sim.simulation import Simulation, parse_robots


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a world with robots; the exit status."""
    parser = command_line.parser(
        "telepresence.sim",
        "Any number of simulated robots in one world. Prints their addresses when they are ready.",
        scene="apartment",
    )
    parser.add_argument(
        "--robot",
        action="append",
        required=True,
        metavar="KIND[*COUNT][:NAME[:PORT]]",
        help=f"robots of the world; may be given again; kinds: {', '.join(kinds())}; port 0 takes a free one",
    )
    options = parser.parse_args(arguments)
    return command_line.run(
        "telepresence.sim",
        options,
        lambda: Simulation(parse_robots(options.robot), options.scene, options.seed, options.address),
    )


if __name__ == "__main__":
    sys.exit(main())
