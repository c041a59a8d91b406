"""ALLogger: writes into the robot's log. Source: NAOqi 2.8 documentation, ALLogger (deprecated since 1.12)."""

from __future__ import annotations

import logging
import threading

from pepper_sim.disk import RobotDisk
from pepper_sim.naoqi.service import Module, ServiceError, one_of, remote, shown

_VERBOSITIES = {"silent": 0, "fatal": 1, "error": 2, "warning": 3, "info": 4, "verbose": 5, "debug": 6}
_FOLDER = "/home/nao/naoqi"
_FILE = "file"
"""Name of the handler that writes into a file."""
_ROOT = "pepper_sim"
_LONGEST = 10_000


class ALLogger(Module):
    """Passes messages on to the robot's log, which LogManager sends to listeners."""

    name = "ALLogger"

    def __init__(self, disk: RobotDisk) -> None:
        self._disk = disk
        self._lock = threading.Lock()
        self._verbosity = _VERBOSITIES["info"]
        self._file: logging.FileHandler | None = None

    def close(self) -> None:
        """Close the file."""
        self._take_file_off()

    @remote("v(ss)")
    def fatal(self, moduleName: str, message: str) -> None:
        """Logs a fatal error."""
        self._log(1, logging.CRITICAL, moduleName, message)

    @remote("v(ss)")
    def error(self, moduleName: str, message: str) -> None:
        """Logs an error."""
        self._log(2, logging.ERROR, moduleName, message)

    @remote("v(ss)")
    def warn(self, moduleName: str, message: str) -> None:
        """Logs a warning."""
        self._log(3, logging.WARNING, moduleName, message)

    @remote("v(ss)")
    def info(self, moduleName: str, message: str) -> None:
        """Logs an information."""
        self._log(4, logging.INFO, moduleName, message)

    @remote("v(ss)")
    def lowInfo(self, moduleName: str, message: str) -> None:
        """Logs a less important information."""
        self._log(5, logging.DEBUG, moduleName, message)

    @remote("v(ss)")
    def debug(self, moduleName: str, message: str) -> None:
        """Logs what helps to find an error."""
        self._log(6, logging.DEBUG, moduleName, message)

    @remote("v(ss)")
    def lowDebug(self, moduleName: str, message: str) -> None:
        """Logs what helps to find an error."""
        self._log(6, logging.DEBUG, moduleName, message)

    @remote("v()")
    def separator(self) -> None:
        """Logs a line between others."""
        self._log(4, logging.INFO, self.name, "-" * 40)

    @remote("v(s)")
    def logInFile(self, fileName: str) -> None:
        """Writes the log into a file of the robot's disk, too; its name is relative to NAOqi's folder."""
        path = self._disk.output(f"{_FOLDER}/{fileName}")
        path.parent.mkdir(parents=True, exist_ok=True)
        self._take_file_off()
        handler = logging.FileHandler(path)
        with self._lock:
            self._file = handler
        logging.getLogger(_ROOT).addHandler(handler)

    @remote("v(s)")
    def removeHandler(self, name: str) -> None:
        """Ends what logInFile began; its handler is called "file"."""
        if name != _FILE or self._file is None:
            raise ServiceError(f"there is no handler {shown(name)}")
        self._take_file_off()

    @remote("v(s)")
    def logInForwarder(self, inputAddress: str) -> None:
        """Sends the log to the maker's log forwarder. Refused: there is none."""
        raise ServiceError("a simulated robot has no log forwarder")

    @remote("v()")
    def logInStd(self) -> None:
        """Does nothing, as documented."""

    @remote("v()")
    def logInSys(self) -> None:
        """Does nothing, as documented."""

    @remote("v()")
    def setFilter(self) -> None:
        """Does nothing: what it did is not documented any more."""

    @remote("v(s)")
    def setVerbosity(self, verbosity: str) -> None:
        """Logs only what is important enough: silent, fatal, error, warning, info, verbose or debug."""
        self._verbosity = _VERBOSITIES[one_of(verbosity, _VERBOSITIES, "verbosity")]

    @remote("i()")
    def verbosity(self) -> int:
        """Returns what setVerbosity chose, from 0 (silent) to 6 (debug)."""
        return self._verbosity

    def _log(self, importance: int, level: int, module: str, message: str) -> None:
        if importance <= self._verbosity:
            logging.getLogger(f"{_ROOT}.{module}").log(level, "%s", message[:_LONGEST])

    def _take_file_off(self) -> None:
        with self._lock:
            handler, self._file = self._file, None
        if handler is not None:
            logging.getLogger(_ROOT).removeHandler(handler)
            handler.close()
