"""Files that only their owner reads: accounts, keys, settings, recordings and photographs. Standard library only.

Files have mode 0600, folders 0700. What was left readable by others is tightened, with one line on standard error. A
symbolic link, another user's file and what is no file are refused: somebody else may have put them there so that we
write, read or tighten what they choose.
"""

from __future__ import annotations

import contextlib
import os
import stat
import tempfile
from collections.abc import Iterator
from pathlib import Path

from telepresence.security.owned_file import FILE_MODE, OTHERS, NotPrivate, open_checked, open_file, say

FOLDER_MODE = 0o700
__all__ = ["FILE_MODE", "FOLDER_MODE", "NotPrivate", "open_file"]


def restrict_new_files() -> None:
    """Make what this process and its children create from now on readable for its owner only."""
    os.umask(OTHERS)


def make_folder(path: Path, close: bool = True) -> Path:
    """Return the folder, made if necessary, readable for its owner only; a home directory stays as it is.

    Args:
        close: Close one that exists and is open to others; otherwise it is only examined.
    Raises:
        NotPrivate: It is a symbolic link, belongs to somebody else, or everybody may write into it.
        OSError: It cannot be made.
    """
    with contextlib.suppress(FileExistsError):  # what exists is examined below
        path.mkdir(FOLDER_MODE, parents=True)
    descriptor = open_checked(path, os.O_RDONLY | os.O_DIRECTORY)
    try:
        status = os.fstat(descriptor)
        if status.st_mode & stat.S_ISVTX:
            raise NotPrivate(path, "is a folder for everybody's files; name one of your own")
        if close and status.st_mode & OTHERS and path.resolve() != Path.home().resolve():
            os.fchmod(descriptor, FOLDER_MODE)
            say(f"{path} was open to other users; only its owner can enter it now.")
    finally:
        os.close(descriptor)
    return path


def read(path: Path) -> bytes:
    """Return the contents of a file; raises as `open_file` does."""
    with open(open_file(path), "rb") as file:
        return file.read()


def write(path: Path, contents: bytes, *, lasting: bool = False) -> None:
    """Write a file at once: readers find the old one or the whole new one, on a full disk too. A link at its place is
    replaced, not followed.

    Args:
        lasting: Wait until the disk has it, which takes seconds while others write there: else a machine that loses
            power within the next half minute may have the new name with nothing in it. Not in a loop that others
            wait for.
    Raises:
        OSError: It cannot be written.
    """
    descriptor, new = tempfile.mkstemp(prefix=f".{path.name[:64]}.", dir=path.parent)  # mode 0600, nobody's name
    try:
        with open(descriptor, "wb") as file:
            file.write(contents)
            file.flush()
            if lasting:
                os.fsync(file.fileno())
        os.replace(new, path)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(new)
        raise


def tighten(folder: Path, *endings: str) -> int:
    """Take other users' permissions from files of the folder whose names end so, and say it in one line.

    Links, other users' files and subfolders are left alone.

    Returns:
        How many were tightened.
    """
    count = 0
    for path in _files(folder, endings):
        with contextlib.suppress(OSError):  # it has just been removed, or is not ours
            descriptor = open_checked(path, os.O_RDONLY)
            try:
                status = os.fstat(descriptor)
                if stat.S_ISREG(status.st_mode) and status.st_mode & OTHERS:
                    os.fchmod(descriptor, FILE_MODE)
                    count += 1
            finally:
                os.close(descriptor)
    if count:
        say(
            f"{count} file{'s' if count > 1 else ''} in {folder} could be read by other users; only by their owner now."
        )
    return count


def _files(folder: Path, endings: tuple[str, ...]) -> Iterator[Path]:
    try:
        entries = list(os.scandir(folder))
    except OSError:  # there is no such folder, or it is not ours to look into
        return
    for entry in entries:
        if entry.name.endswith(endings) and entry.is_file(follow_symlinks=False):
            yield Path(entry.path)
