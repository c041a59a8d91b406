"""Records a session as a ROS bag and its pictures as an MP4 film, and writes a report of it at the end.

All three are separate programs, so a recording neither slows the window down nor is lost with it: when the window is
killed, the recording ends, and bag and film are complete.
"""

from __future__ import annotations

import os
import shutil
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

from PyQt5.QtCore import QObject, QProcess, pyqtSignal

from gui.recording.folder import open_folder

PATIENCE = 8000
"""[ms] that the recorder may take to close its bag when the window is closed."""
LEAST_FREE = 500e6
"""[B] that must be free on the disk; a session with pictures takes about 1 MB a second."""
BUFFER = "64"
"""[MB] of memory in which messages wait for the disk."""
TIED = ("--pdeathsig", "INT")
"""Words for setpriv: the kernel interrupts the program when this process ends, however that happens."""
PRIVATE = ("sh", "-c", 'umask 077; exec "$@"', "sh")
"""Words that start a program whose files nobody else can read: faces are on them."""


class Recorder(QObject):
    """Makes one recording at a time.

    Args:
        folder: Where bags and reports go; created when it is needed.
    """

    started = pyqtSignal(str)
    """A recording into this file has started."""
    finished = pyqtSignal(str)
    """A recording has ended; the path of the bag."""
    reported = pyqtSignal(str)
    """A report has been written; the path of the HTML file."""
    filmed = pyqtSignal(str)
    """A film has been written; the path of the MP4 file."""
    failed = pyqtSignal(str)
    """A message for the pilot."""

    def __init__(self, folder: Path, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._folder = folder
        self._process: QProcess | None = None
        self._film: QProcess | None = None
        self._reports: set[QProcess] = set()
        self._asked_to_end = False

    @property
    def recording(self) -> bool:
        return self._process is not None

    def start(self, name: str, topics: Sequence[str], film: str = "") -> None:
        """Record these topics into <folder>/<name>.bag, and this topic of pictures into <folder>/<name>.mp4."""
        if self.recording:
            return
        try:
            open_folder(self._folder)
            free = shutil.disk_usage(self._folder).free
        except OSError as error:
            self.failed.emit(f"Nothing can be recorded into {self._folder}: {error.strerror}.")
            return
        if free < LEAST_FREE:
            self.failed.emit(
                f"{self._folder} has only {free / 1e6:.0f} MB left, too little to record. Delete something."
            )
            return
        self._asked_to_end = False
        bag = self._folder / f"{name}.bag"
        self._process = process = QProcess(self)
        process.setProcessChannelMode(QProcess.ProcessChannelMode.MergedChannels)
        process.finished.connect(lambda _code: self._on_recorded(process, bag))
        process.errorOccurred.connect(lambda error: self._on_error(process, error))
        words = ["rosbag", "record", f"--buffsize={BUFFER}", "--min-space=200M"]
        _start(process, ["rosrun", *words, "-O", str(bag), *topics])
        if film:
            self._start_film(film, bag.with_suffix(".mp4"))
        self.started.emit(str(bag))

    def stop(self) -> None:
        """Close the bag; `finished` and `reported` follow."""
        if self._process is not None and not self._asked_to_end:
            self._asked_to_end = True
            _interrupt(self._process)
            if self._film is not None:
                _interrupt(self._film)

    def close(self) -> None:
        """End the recording, and wait for reports that are being written; takes a few seconds at most."""
        self.stop()
        if self._process is not None and not self._process.waitForFinished(PATIENCE):
            self._process.kill()
            self._process.waitForFinished(1000)
        if self._film is not None and not self._film.waitForFinished(PATIENCE):
            self._film.kill()
            self._film.waitForFinished(1000)
        for report in list(self._reports):
            report.waitForFinished(PATIENCE)

    def _on_error(self, process: QProcess, error: QProcess.ProcessError) -> None:
        if error == QProcess.ProcessError.FailedToStart:  # after any other error `finished` follows
            process.deleteLater()
            self._process = None
            self.failed.emit(f"The recording cannot start: {process.errorString()}.")

    def _on_recorded(self, process: QProcess, bag: Path) -> None:
        said = bytes(process.readAll()).decode(errors="replace").strip()
        process.deleteLater()
        self._process = None
        if self._film is not None and not self._asked_to_end:
            _interrupt(self._film)
        if not bag.exists():
            reason = said.splitlines()[-1] if said else "rosbag said nothing"
            self.failed.emit(f"The recording failed: {reason}.")
            return
        if not self._asked_to_end:
            self.failed.emit(f"The recording ended unexpectedly; {bag.name} holds what came before.")
        self.finished.emit(str(bag))
        self._write_report(bag)

    def _start_film(self, topic: str, path: Path) -> None:
        self._film = process = QProcess(self)
        process.setProcessChannelMode(QProcess.ProcessChannelMode.MergedChannels)
        process.finished.connect(lambda code: self._on_filmed(process, code, path))
        # Below the drivers, which wait for nobody's film.
        _start(process, ["nice", "rosrun", "avatar_gui", "record_film", topic, str(path)])

    def _on_filmed(self, process: QProcess, code: int, path: Path) -> None:
        said = bytes(process.readAll()).decode(errors="replace").strip()
        process.deleteLater()
        self._film = None
        if code == 0:
            self.filmed.emit(str(path))
        else:
            reason = said.splitlines()[-1] if said else f"exit code {code}"
            self.failed.emit(f"There is no film {path.name}: {reason}.")

    def _write_report(self, bag: Path) -> None:
        process = QProcess(self)
        self._reports.add(process)
        process.setProcessChannelMode(QProcess.ProcessChannelMode.MergedChannels)
        process.finished.connect(lambda code: self._on_reported(process, code, bag))
        process.setWorkingDirectory(str(Path(__file__).resolve().parents[2]))
        process.start(sys.executable, ["-m", "gui.session_report", str(bag)])

    def _on_reported(self, process: QProcess, code: int, bag: Path) -> None:
        said = bytes(process.readAll()).decode(errors="replace").strip()
        process.deleteLater()
        self._reports.discard(process)
        if code == 0:
            self.reported.emit(str(bag.with_suffix(".html")))
        else:
            reason = said.splitlines()[-1] if said else f"exit code {code}"
            self.failed.emit(f"{bag.name} is recorded, but its report failed: {reason}")


def _start(process: QProcess, words: list[str]) -> None:
    process.start("setpriv", [*TIED, *PRIVATE, *words])


def _interrupt(process: QProcess) -> None:
    if process.state() == QProcess.ProcessState.Running:
        os.kill(process.processId(), signal.SIGINT)
