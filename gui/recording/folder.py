"""The folder of snapshots and recordings, in which faces are: nobody but its owner enters it."""

from __future__ import annotations

from pathlib import Path

from PyQt5.QtCore import QBuffer, QIODevice
from PyQt5.QtGui import QImage, QPixmap

from telepresence.security import private_files

ENDINGS = (".bag", ".active", ".mp4", ".html", ".png", ".jpg")
"""Endings of the files that versions before 0.4 left readable for others."""


def open_folder(folder: Path) -> Path:
    """Return the folder, made if necessary, closed to other users with all that is in it.

    A folder that holds other things too, such as a project's, stays open; the recordings in it are closed.

    Raises:
        OSError: It cannot be made, or belongs to others too; see `telepresence.security.private_files`.
    """
    ours = not folder.is_dir() or all(entry.name.endswith(ENDINGS) for entry in folder.iterdir())
    private_files.make_folder(folder, close=ours)
    private_files.tighten(folder, *ENDINGS)
    return folder


def save_picture(picture: QImage | QPixmap, path: Path) -> None:
    """Save a picture that only its owner can read, in the format that the ending of the name says.

    Raises:
        OSError: It cannot be written.
        ValueError: There is no such format, or no picture.
    """
    buffer = QBuffer()
    buffer.open(QIODevice.OpenModeFlag.WriteOnly)
    if not picture.save(buffer, path.suffix[1:]):
        raise ValueError(f"'{path.suffix}' is no ending of a picture; .png and .jpg are")
    private_files.write(path, bytes(buffer.data()))
