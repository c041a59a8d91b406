"""Snapshots: of which moment they are, and that none takes the place of another."""

import os
from datetime import datetime

import pytest
from fake_window_parts import picture
from PyQt5.QtGui import QImage

from gui.app.capture import Capture
from gui.window import OperatorWindow

NOON = datetime(2026, 1, 1, 12).timestamp()
"""[s since 1970]"""


@pytest.fixture
def window(qt, link, terminal, tmp_path):
    window = OperatorWindow(terminal)
    window.said = []
    capture = Capture(window, link, tmp_path / "kept")
    capture.said.connect(lambda text, level: window.said.append((text, level)))
    return window


def show(window, taken, colour=99, age=0.0):
    """Show a picture of one colour that was taken then [s since 1970], and has been there for `age` seconds."""
    shot = picture(age)
    shot.pixels[:] = colour
    object.__setattr__(shot, "stamp", taken)
    window.video.show_picture(shot)


def kept(tmp_path):
    """Name -> grey level of each snapshot."""
    return {path.name: QImage(str(path)).pixelColor(5, 5).red() for path in sorted((tmp_path / "kept").iterdir())}


def test_a_snapshot_is_named_after_the_time_of_its_picture(window, tmp_path):
    show(window, NOON + 0.0425)
    window.snapshotButton.click()
    show(window, NOON + 0.5, colour=200)
    window.snapshotButton.click()
    assert kept(tmp_path) == {"pepper-20260101-120000-042.png": 99, "pepper-20260101-120000-500.png": 200}
    assert window.said[-1] == (f"Saved {tmp_path / 'kept' / 'pepper-20260101-120000-500.png'}", "good")


def test_no_snapshot_takes_the_place_of_another_file(window, tmp_path):
    show(window, NOON)
    window.snapshotButton.click()
    window.video.clear("Another camera", "Wait.")
    show(window, NOON, colour=200)
    window.snapshotButton.click()
    assert kept(tmp_path) == {"pepper-20260101-120000-000.png": 99, "pepper-20260101-120000-000-2.png": 200}
    assert "-2.png" in window.said[-1][0]


def test_a_snapshot_of_a_lost_picture_says_how_old_it_is(window, tmp_path, spin):
    show(window, NOON, age=7.0)
    spin(lambda: window.video.stale, "the picture counts as lost")
    window.snapshotButton.click()
    text, level = window.said[-1]
    assert "pepper-20260101-120000-000.png" in text and "no new picture" in text and "came 7." in text
    assert level == "warn" and len(kept(tmp_path)) == 1


def test_a_picture_without_a_time_is_named_after_its_arrival(window, tmp_path):
    before = datetime.now()
    show(window, 0.0, age=3600.0)
    window.snapshotButton.click()
    (name,) = kept(tmp_path)
    named = datetime.strptime(name, "pepper-%Y%m%d-%H%M%S-%f.png")
    assert 3590.0 < (before - named).total_seconds() < 3610.0


def test_what_cannot_be_saved_leaves_no_file(window, tmp_path, monkeypatch):
    def fail(*_arguments):
        raise OSError(28, os.strerror(28))

    monkeypatch.setattr("gui.recording.folder.private_files.write", fail)
    show(window, NOON)
    window.snapshotButton.click()
    assert window.said[-1][1] == "bad" and "No space left" in window.said[-1][0] and kept(tmp_path) == {}
