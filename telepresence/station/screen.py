"""The virtual display of the operator's window, where there is no real one, and the web page with its picture."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from functools import partial
from pathlib import Path

from telepresence import ports
from telepresence.station import container_image, processes, takeover
from telepresence.station.absence import goes_on
from telepresence.station.adopted import Adopted
from telepresence.station.kept_program import KeptProgram, Report
from telepresence.station.launch_settings import port_setting, require_free
from telepresence.station.program_on_demand import ProgramOnDemand
from telepresence.station.virtual_display import VirtualDisplay
from telepresence.web.listener import listener

SCREEN_KEY = "TELEPRESENCE_SCREEN_KEY"
"""Environment variable with the key to the page: the banner says it, and the page's program finds it there, where other
users of the machine cannot read it."""


PAGE = "screen_page"


class Screen:
    """Starts Xvfb now and the page's program at its first visit; programs that start later find the display in their
    environment.

    Args:
        settings: Of the launch file, as a person gave them.
        report: Gets each fault.
        folder: The station's.
        left: The folder of a display whose `./stack up` has died; None for a new one.
    Raises:
        RuntimeError: The page's port is taken or Xvfb does not start.
        OSError: The display that was left cannot be taken over.

    Attributes:
        name: Value of the environment variable DISPLAY.
        folder: Of the display.
        programs: What has to be looked after.
    """

    def __init__(self, settings: dict[str, str], report: Report, folder: Path, left: Path | None = None) -> None:
        takeover.kill(folder, PAGE)  # it has the port
        self._port = port_setting(settings, "screen_port", ports.SCREEN_PAGE)
        address = container_image.own_address() if container_image.in_image() else "127.0.0.1"
        require_free(self._port, "screen_port", "the picture of the window", address=address)
        self._display = VirtualDisplay(opengl=False, left=left)  # the window uses none
        self.name, self.folder = self._display.name, self._display.folder
        os.environ.update(self._display.environment)
        listening = listener(address, self._port)
        serve = takeover.noted(folder, PAGE, partial(_serve, self._display, listening))
        self._page = ProgramOnDemand(PAGE, listening, serve, report)
        self.programs = (KeptProgram("Xvfb", partial(_restart, self._display), report), self._page)

    @property
    def url(self) -> str:
        """Where a browser of this machine finds the picture; the key is part of it."""
        return f"http://127.0.0.1:{self._port}/?k={os.environ.get(SCREEN_KEY, '')}"

    def close(self) -> None:
        """End both programs; the display's windows end with it."""
        self._page.close(patience=2.0)
        self._display.close()


def _restart(display: VirtualDisplay) -> subprocess.Popen | Adopted:
    """Return the display's process, a new one if it has ended: what had windows there is started again by roslaunch."""
    if display.process.poll() is not None:
        display.start_again()
    return display.process


def _serve(display: VirtualDisplay, listening: socket.socket) -> subprocess.Popen:
    """Start the web server, as a separate process so that it cannot slow driving."""
    program = [sys.executable, "-P", "-m", "telepresence.station.screen_page", str(display.folder)]
    return processes.start(
        ["nice", *program, "--listening", str(listening.fileno())],
        tied=not goes_on(),
        stdout=subprocess.DEVNULL,
        pass_fds=[listening.fileno()],
    )
