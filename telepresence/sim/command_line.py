"""The command line of every simulation: options, the viewer, and running until a signal ends it."""

from __future__ import annotations

import argparse
import logging
import signal
import sys
import threading
from collections.abc import Callable

from telepresence.sim.camera import CamerasFailed
from telepresence.sim.scene import scene_names
from telepresence.sim.simulation import Simulation
from telepresence.sim.viewer import NoDisplay, require_display, view
from telepresence.stop_signals import stop_on

log = logging.getLogger(__name__)

_LOOPBACK = ("127.0.0.1", "localhost", "::1")
_ALIVE_PERIOD = 0.5
SWITCH_INTERVAL = 0.0001
"""Seconds within which a thread that waits for Python's interpreter lock gets it; Python's own is 0.005."""


def parser(program: str, description: str, *, scene: str, port: int | None = None) -> argparse.ArgumentParser:
    """Return a parser with the options that every simulation has; `port` and `scene` are the defaults."""
    options = argparse.ArgumentParser(prog=f"python -m {program}", description=description)
    if port is not None:
        options.add_argument("--port", type=port_number, default=port, help="0 takes a free one (default: %(default)s)")
    options.add_argument(
        "--address",
        default="127.0.0.1",
        help="address to listen on; 0.0.0.0 lets other machines in, without any password (default: %(default)s)",
    )
    options.add_argument(
        *("--scene", "--terrain"),
        dest="scene",
        default=scene,
        help=f"the place and its ground, one of: {', '.join(scene_names())} (default: %(default)s)",
    )
    options.add_argument("--seed", type=int, default=0, help="start of all random sequences (default: %(default)s)")
    options.add_argument("--viewer", action="store_true", help="open MuJoCo's viewer; needs a display")
    options.add_argument("--verbose", action="store_true", help="log more")
    return options


def run(
    program: str,
    options: argparse.Namespace,
    open_simulation: Callable[[], Simulation],
) -> int:
    """Run a simulation until SIGINT, SIGTERM or SIGHUP.

    Args:
        program: Name for error messages.
        options: From `parser`.
        open_simulation: Builds it; its errors about settings, addresses and displays are printed as one line.
    Returns:
        The program's exit status.
    """
    level = logging.DEBUG if options.verbose else logging.INFO
    logging.basicConfig(level=level, format="%(levelname)s %(name)s: %(message)s", stream=sys.stderr)
    logging.getLogger("OpenGL").setLevel(logging.WARNING)
    sys.setswitchinterval(SWITCH_INTERVAL)
    stopping = threading.Event()
    stop_on(stopping, signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    if options.address not in _LOOPBACK:
        log.warning("listening on %s without authentication: whoever reaches it drives the robot", options.address)
    try:
        if options.viewer:
            require_display()
        with open_simulation() as simulation:
            announce(simulation)
            if options.viewer:
                view(simulation.world, stopping)
            while not stopping.wait(_ALIVE_PERIOD):
                if simulation.failure:
                    log.error("%s", simulation.failure)
                    return 1
    except (CamerasFailed, NoDisplay, ValueError, OSError) as error:
        log.debug("no simulation", exc_info=True)
        print(f"{program}: {error}", file=sys.stderr)
        return 1
    return 0


def announce(simulation: Simulation) -> None:
    """Print a line for every address, with the robot's name where there are several robots."""
    for name, robot in simulation.robots.items():
        for url in robot.urls:
            print(f"listening on {url}" + (f" ({name})" if len(simulation.robots) > 1 else ""), flush=True)
        if robot.page_url:
            print(f"owner's page {robot.page_url}", flush=True)
    if not simulation.urls:
        print("running; no robot here has a wire", flush=True)


def port_number(text: str) -> int:
    """Return the port that an argument of a command line names."""
    try:
        number = int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"a port is a number, got {text!r}") from None
    if not 0 <= number <= 65535:
        raise argparse.ArgumentTypeError(f"a port is between 0 and 65535, got {number}")
    return number
