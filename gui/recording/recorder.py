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

from PyQt5.QtCore import QObject, QProcess, QTimer, pyqtSignal

from gui.recording.folder import open_folder

PATIENCE = 8000
"""[ms] that each program may take to end when the window is closed."""
FILM_PATIENCE = 60000
"""[ms] that a film may take to end; the programs of a busy machine come before it."""
LEAST_FREE = 500e6
"""[B] that must be free on the disk; a session with pictures takes about 1 MB a second."""
MIN_SPACE = "200M"
"""What rosbag leaves free. It looks every 20 s; with less, rosbag 1.15.15 ends, others run on and write nothing."""
DISABLED = b"Disabling recording."
"""What all of them say then."""
BUFFER = "64"
"""[MB] of memory in which messages wait for the disk."""
LONGEST_OUTPUT = 4096
"""[B] of what rosbag says that are kept."""
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
    changed = pyqtSignal()
    """`recording` or `ending` has changed."""

    def __init__(self, folder: Path, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._folder = folder
        self._process: QProcess | None = None
        self._film: QProcess | None = None
        self._reports: set[QProcess] = set()
        self._output = b""
        self._disk_full = False
        self.ending = False
        """Bag and film, or what is left of them, are being closed."""
        self._limit = QTimer(self)
        self._limit.setSingleShot(True)
        self._limit.setInterval(FILM_PATIENCE)
        self._limit.timeout.connect(self._kill_film)

    @property
    def recording(self) -> bool:
        """Whether a bag or a film is being written or closed."""
        return self._process is not None or self._film is not None

    def start(self, name: str, topics: Sequence[str], film: str = "") -> None:
        """Record these topics into <folder>/<name>.bag, and this topic of pictures into <folder>/<name>.mp4.

        Nothing happens while `recording`, even if it is `ending`.
        """
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
        self._output, self._disk_full = b"", False
        bag = self._folder / f"{name}.bag"
        self._process = process = QProcess(self)
        process.setProcessChannelMode(QProcess.ProcessChannelMode.MergedChannels)
        process.readyRead.connect(lambda: self._read(process))
        process.finished.connect(lambda _code: self._on_recorded(process, bag))
        self._watch_start(process, "recording")
        words = ["rosbag", "record", f"--buffsize={BUFFER}", f"--min-space={MIN_SPACE}"]
        _start(process, ["rosrun", *words, "-O", str(bag), *topics])
        if self._process is not process:  # it could not start
            return
        if film:
            self._start_film(film, bag.with_suffix(".mp4"))
        self.started.emit(str(bag))
        self.changed.emit()

    def stop(self) -> None:
        """Close bag and film; `finished` and `reported` follow, and when nothing is written any more `changed`."""
        if self.recording and not self.ending:
            self._end()

    def close(self) -> None:
        """End the recording, and wait for reports that are being written; takes a few seconds at most."""
        self.stop()
        for process in (self._process, self._film):
            if process is not None and not process.waitForFinished(PATIENCE):
                process.kill()
                process.waitForFinished(1000)
        for report in list(self._reports):
            report.waitForFinished(PATIENCE)

    def _end(self) -> None:
        self.ending = True
        for process in (self._process, self._film):
            if process is not None:
                _interrupt(process)
        self._limit.start()
        self.changed.emit()

    def _kill_film(self) -> None:
        """Film nobody for longer. A bag may take its time: killed, it lacks its index, and it receives no more."""
        if self._film is not None:
            self._film.kill()

    def _forget(self, process: QProcess) -> None:
        """This program runs no more; a film does not go on without its bag."""
        process.deleteLater()
        if process is self._process:
            self._process = None
        elif process is self._film:
            self._film = None
        if not self.recording:
            self.ending = False
            self._limit.stop()
        elif self._process is None and not self.ending:
            self._end()
        self.changed.emit()

    def _watch_start(self, process: QProcess, what: str) -> None:
        process.errorOccurred.connect(lambda error: self._on_error(process, error, what))
        # A program that does not run yet cannot be interrupted.
        process.started.connect(lambda: _interrupt(process) if self.ending else None)

    def _on_error(self, process: QProcess, error: QProcess.ProcessError, what: str) -> None:
        if error == QProcess.ProcessError.FailedToStart:  # after any other error `finished` follows
            self._forget(process)
            self.failed.emit(f"The {what} cannot start: {process.errorString()}.")

    def _read(self, process: QProcess) -> None:
        self._output = (self._output + bytes(process.readAll()))[-LONGEST_OUTPUT:]
        if DISABLED in self._output and not self.ending:
            self._disk_full = True
            self._end()

    def _on_recorded(self, process: QProcess, bag: Path) -> None:
        self._read(process)
        said = self._output.decode(errors="replace").strip()
        expected = self.ending
        self._forget(process)
        if not bag.exists():
            reason = said.splitlines()[-1] if said else "rosbag said nothing"
            self.failed.emit(f"The recording failed: {reason}.")
            return
        if self._disk_full:
            self.failed.emit(
                f"{self._folder} has less than {MIN_SPACE}B left, so the recording has ended; "
                f"{bag.name} holds what came before. Delete something."
            )
        elif not expected:
            self.failed.emit(f"The recording ended unexpectedly; {bag.name} holds what came before.")
        self.finished.emit(str(bag))
        self._write_report(bag)

    def _start_film(self, topic: str, path: Path) -> None:
        self._film = process = QProcess(self)
        process.setProcessChannelMode(QProcess.ProcessChannelMode.MergedChannels)
        process.finished.connect(lambda code: self._on_filmed(process, code, path))
        self._watch_start(process, "film")
        # Below the drivers, which wait for nobody's film.
        _start(process, ["nice", "rosrun", "avatar_gui", "record_film", topic, str(path)])

    def _on_filmed(self, process: QProcess, code: int, path: Path) -> None:
        said = bytes(process.readAll()).decode(errors="replace").strip()
        killed = process.exitStatus() == QProcess.ExitStatus.CrashExit
        ended = self.ending
        self._forget(process)
        if killed and path.exists():
            self.failed.emit(f"The film did not end in order; {path.name} holds what came before.")
        elif code == 0 and not killed:
            self.filmed.emit(str(path))
        elif ended and not said and not path.exists():
            self.failed.emit("There is no film: the recording ended before the first picture.")
        else:
            reason = said.splitlines()[-1] if said else f"exit code {code}"
            self.failed.emit(f"There is no film {path.name}: {reason}.")

    def _write_report(self, bag: Path) -> None:
        process = QProcess(self)
        self._reports.add(process)
        process.setProcessChannelMode(QProcess.ProcessChannelMode.MergedChannels)
        process.finished.connect(lambda code: self._on_reported(process, code, bag))
        process.setWorkingDirectory(str(Path(__file__).resolve().parents[2]))
        process.start(sys.executable, ["-P", "-m", "gui.session_report", str(bag)])

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
