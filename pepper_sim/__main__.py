"""Command line of the simulated Pepper: `python -m pepper_sim`. It runs until SIGINT or SIGTERM."""

from __future__ import annotations

import argparse
import logging
import signal
import sys
import threading
from collections.abc import Sequence

from pepper_sim.server import CannotListen
from pepper_sim.simulation import DEFAULT_PORT, Simulation
from pepper_sim.viewer import NoDisplay, require_display, view
from telepresence.sim.camera import CamerasFailed
from telepresence.sim.scene import scene_names

log = logging.getLogger("pepper_sim")

_LOOPBACK = ("127.0.0.1", "localhost", "::1")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a simulated robot; the exit status."""
    options = _parse(arguments)
    logging.basicConfig(
        level=logging.DEBUG if options.verbose else logging.INFO,
        format="%(levelname)s %(name)s: %(message)s",
        stream=sys.stderr,
    )
    logging.getLogger("OpenGL").setLevel(logging.WARNING)
    stopping = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stopping.set())
    if options.address not in _LOOPBACK:
        log.warning("listening on %s without authentication: whoever reaches it drives the robot", options.address)
    try:
        if options.viewer:
            require_display()
        with Simulation(options.scene, options.seed, options.address, options.port) as simulation:
            for endpoint in simulation.server.endpoints:
                print(f"listening on {endpoint}", flush=True)
            if options.viewer:
                view(simulation, stopping)
            while not stopping.wait(1.0):
                if not simulation.world.running:
                    log.error("the simulated world has stopped")
                    return 1
    except (CannotListen, CamerasFailed, NoDisplay, ValueError) as error:
        print(f"pepper_sim: {error}", file=sys.stderr)
        return 1
    return 0


def _parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m pepper_sim",
        description="A simulated Pepper that speaks NAOqi. Prints its address when it is ready.",
    )
    parser.add_argument("--port", type=_port, default=DEFAULT_PORT, help="0 takes a free one (default: %(default)s)")
    parser.add_argument(
        "--address",
        default="127.0.0.1",
        help="address to listen on; 0.0.0.0 lets other machines in, without any password (default: %(default)s)",
    )
    parser.add_argument(
        "--scene", default="apartment", help=f"one of: {', '.join(scene_names())} (default: %(default)s)"
    )
    parser.add_argument("--seed", type=int, default=0, help="start of all random sequences (default: %(default)s)")
    parser.add_argument("--viewer", action="store_true", help="open MuJoCo's viewer; needs a display")
    parser.add_argument("--verbose", action="store_true", help="log more")
    return parser.parse_args(arguments)


def _port(text: str) -> int:
    try:
        port = int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"a port is a number, got {text!r}") from None
    if not 0 <= port <= 65535:
        raise argparse.ArgumentTypeError(f"a port is between 0 and 65535, got {port}")
    return port


if __name__ == "__main__":
    sys.exit(main())
