"""Snapshots of the picture, and recordings of a session with their films and reports."""

from __future__ import annotations

import contextlib
import os
import time
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from PyQt5.QtCore import QObject, pyqtSignal

from gui.periodic_timer import PeriodicTimer
from gui.recording.folder import open_folder, save_new_picture
from gui.recording.recorder import Recorder

if TYPE_CHECKING:
    from gui.ros.link import RosLink
    from gui.window import OperatorWindow

FOLDER = "TELEPRESENCE_FOLDER"
"""Environment variable that names another folder than ~/telepresence."""


def default_folder() -> Path:
    """Return the folder for snapshots and recordings."""
    return Path(os.environ.get(FOLDER) or Path.home() / "telepresence")


class Capture(QObject):
    """What the buttons Snapshot and Record do."""

    said = pyqtSignal(str, str)
    """A message for the pilot, and its level."""

    def __init__(self, window: OperatorWindow, link: RosLink, folder: Path) -> None:
        super().__init__(window)
        self._window, self._link, self._folder = window, link, folder
        self._since = 0.0
        self._troubles: list[str] = []
        if folder.exists():
            with contextlib.suppress(OSError):  # said when something is to be saved there
                open_folder(folder)
        self.recorder = Recorder(folder, self)
        self.recorder.started.connect(lambda bag: self.said.emit(f"Recording {Path(bag).name}", "good"))
        self.recorder.finished.connect(lambda bag: self._say(f"Recorded {bag}. Writing its report …", "info"))
        self.recorder.reported.connect(lambda page: self._say(f"The session's report: {page}"))
        self.recorder.filmed.connect(lambda film: self._say(f"The session's film: {film}"))
        self.recorder.failed.connect(self._on_failed)
        self.recorder.changed.connect(self._show_state)
        self._timer = PeriodicTimer(500, self._show_state, self)
        window.snapshotButton.clicked.connect(self.take_snapshot)
        window.recordButton.toggled.connect(self._on_record)

    def leave(self) -> None:
        """Nobody is signed in any more: end the recording, and say where it is."""
        if self.recorder.recording:
            self.recorder.stop()
            self._say(f"The recording is being closed. It is in {self._folder}.", "info")

    def take_snapshot(self) -> None:
        """Save the picture as the robot sent it, named after the time when it was taken."""
        video = self._window.video
        image, age = video.image, video.age()
        if image is None:
            self.said.emit("There is no picture to save. Press Robot feed first.", "warn")
            return
        name = self._picture_name(video.stamp or time.time() - age)
        try:
            target = save_new_picture(image, open_folder(self._folder), name)
        except (OSError, ValueError) as error:
            reason = error.strerror if isinstance(error, OSError) else error
            self.said.emit(f"Nothing can be saved in {self._folder}: {reason}.", "bad")
        else:
            old = f". It is no new picture: the last one came {age:.1f} s ago." if video.stale else ""
            self.said.emit(f"Saved {target}{old}", "warn" if old else "good")

    def _on_record(self, wanted: bool) -> None:
        if not wanted:
            self.recorder.stop()
        elif self.recorder.ending:
            self.said.emit("The last recording is still being closed. Press Record again when it is.", "warn")
        elif not self._link.state.master:
            self.said.emit("There is no ROS master, so nothing can be recorded. Press Roscore start.", "warn")
        else:
            self._since, self._troubles = time.monotonic(), []
            topics = [self._link.resolve(topic) for topic in self._link.robot.recorded]
            self.recorder.start(self._name(datetime.now()), topics, self._link.resolve(self._link.robot.filmed))
        self._show_state()

    def _on_failed(self, reason: str) -> None:
        self._troubles.append(reason)
        self.said.emit(" ".join(self._troubles), "bad")

    def _say(self, text: str, level: str = "good") -> None:
        """Say this after what went wrong with the recording: the window shows the newest message alone, and report and
        film follow within seconds."""
        self.said.emit(" ".join([*self._troubles, text]), "bad" if self._troubles else level)

    def _show_state(self) -> None:
        """Show on the button what is so, not what was pressed: how long a recording has run, or that it is closed."""
        button, runs = self._window.recordButton, self.recorder.recording and not self.recorder.ending
        if not runs:
            self._timer.stop()
            button.setChecked(False)
            button.setText("■ Closing" if self.recorder.recording else "● Record")
            return
        seconds = int(time.monotonic() - self._since)
        button.setText(f"■ {seconds // 60}:{seconds % 60:02d}")
        if not self._timer.isActive():
            self._timer.start()

    def _picture_name(self, taken: float) -> str:
        """Name a picture after the time when it was taken [s since 1970]: a camera takes several in a second."""
        when = datetime.fromtimestamp(taken)
        return f"{self._name(when)}-{when.microsecond // 1000:03d}"

    def _name(self, when: datetime) -> str:
        return f"{self._link.robot.name}-{when:%Y%m%d-%H%M%S}"
