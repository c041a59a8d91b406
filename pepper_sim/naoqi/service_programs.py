"""The programs of installed packages' services: started as on the robot, watched, and ended."""

from __future__ import annotations

import concurrent.futures
import importlib.util
import logging
import os
import shlex
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pepper_sim import robot_python
from pepper_sim.naoqi.client_services import ClientServices
from pepper_sim.naoqi.installed_packages import UNTRUSTED, InstalledPackages, ServiceProgram
from pepper_sim.naoqi.service import ServiceError

log = logging.getLogger(__name__)

KILL_AFTER = 15.0
"""Seconds between SIGTERM and SIGKILL, as on the robot."""
CLOSE_TIMEOUT = 3.0
"""Seconds that the programs have when the robot is switched off."""


def environment(url: str) -> dict[str, str]:
    """Return the environment of a program on the robot, which finds NAOqi at `url`.

    It imports the vendor's `qi` if that is installed, and ours under the same name if not.
    """
    found = {**os.environ, "QI_URL": url}
    if importlib.util.find_spec("qi") is None:
        found["PYTHONPATH"] = os.pathsep.join([*robot_python.__path__, *filter(None, [os.environ.get("PYTHONPATH")])])
    return found


class ServicePrograms:
    """Runs at most one process for each service.

    Args:
        packages: Services of removed packages are ended.
        clients: Tells the programs where NAOqi answers, by the environment variable QI_URL.
        ended: Called with the service's name, and whether it ended by itself, after every end; on a thread of its own.
    """

    def __init__(
        self, packages: InstalledPackages, clients: ClientServices, ended: Callable[[str, bool], None]
    ) -> None:
        self._packages = packages
        self._clients = clients
        self._report = ended
        self._lock = threading.Lock()
        self._running: dict[str, subprocess.Popen] = {}
        self._ending: dict[str, concurrent.futures.Future] = {}
        packages.on_removed(self._end_removed)

    def start(self, program: ServiceProgram) -> bool:
        """Start a program unless it runs; false if there is no such program.

        Raises: ServiceError: It must not run.
        """
        if not program.trusted:
            raise ServiceError(f"{program.name} does not start: {UNTRUSTED}")
        words = shlex.split(program.command)
        if words and Path(words[0]).name.startswith("python"):
            words[0] = sys.executable  # the robot's own is Python 2.7 with its own qi
        with self._lock:
            if program.name in self._running:
                return True
            try:
                process = subprocess.Popen(
                    words,
                    cwd=program.folder,
                    env=environment(self._clients.url),
                    stdin=subprocess.DEVNULL,
                    start_new_session=True,
                )
            except (OSError, IndexError) as error:
                log.warning("the service %s cannot be started: %s", program.name, error)
                return False
            self._running[program.name] = process
        threading.Thread(target=self._watch, args=(program.name, process), name=program.name, daemon=True).start()
        return True

    def runs(self, name: str) -> bool:
        """Whether the program of this service runs."""
        return name in self._running

    def process(self, name: str) -> int | None:
        """Return the number of the program's process; None if it does not run."""
        with self._lock:
            process = self._running.get(name)
        return process.pid if process is not None else None

    def stop(self, name: str) -> concurrent.futures.Future:
        """End a program; the future holds true once it has ended, at once when it did not run."""
        with self._lock:
            process = self._running.get(name)
            done = self._ending.setdefault(name, concurrent.futures.Future())
            if process is None:
                del self._ending[name]
                done.set_result(True)
                return done
        process.terminate()
        timer = threading.Timer(KILL_AFTER, process.kill)
        timer.daemon = True
        timer.start()
        done.add_done_callback(lambda _: timer.cancel())
        return done

    def then(self, first: concurrent.futures.Future, action: Callable[[], Any]) -> concurrent.futures.Future:
        """Return a future of what `action` returns when it is run after `first`."""
        done: concurrent.futures.Future = concurrent.futures.Future()
        first.add_done_callback(lambda _: done.set_result(action()))
        return done

    def close(self) -> None:
        """End every program."""
        with self._lock:
            names = list(self._running)
        ending = [self.stop(name) for name in names]
        concurrent.futures.wait(ending, CLOSE_TIMEOUT)
        with self._lock:
            left = list(self._running.values())
        for process in left:
            process.kill()
            process.wait()

    def _watch(self, name: str, process: subprocess.Popen) -> None:
        code = process.wait()
        with self._lock:
            del self._running[name]
            asked = self._ending.pop(name, None)
        if asked is None:
            log.warning("the service %s ended by itself, with %d", name, code)
        self._report(name, asked is None)
        if asked is not None:
            asked.set_result(True)

    def _end_removed(self) -> None:
        for name in list(self._running):
            if self._packages.service(name) is None:
                self.stop(name)
