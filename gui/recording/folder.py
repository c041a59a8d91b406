"""The folder of snapshots and recordings, in which faces are: nobody but its owner enters it."""

from __future__ import annotations

import contextlib
import itertools
import os
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


def save_new_picture(picture: QImage, folder: Path, name: str) -> Path:
    """Save a picture under this name in the folder, with a number where there is such a file already; return its path.

    Raises:
        OSError: It cannot be written.
    """
    for number in itertools.count(1):
        path = folder / f"{name}{f'-{number}' if number > 1 else ''}.png"
        try:
            os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY, private_files.FILE_MODE))
        except FileExistsError:
            continue
        break
    try:
        save_picture(picture, path)
    except BaseException:
        with contextlib.suppress(OSError):
            path.unlink()
        raise
    return path


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
