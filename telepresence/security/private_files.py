"""Files that only their owner reads: accounts, keys, settings, recordings and photographs. Standard library only.

Files have mode 0600, folders 0700. What was left readable by others is tightened, with one line on standard error. A
symbolic link, another user's file and what is no file are refused: somebody else may have put them there so that we
write, read or tighten what they choose.
"""

from __future__ import annotations

import contextlib
import errno
import os
import pwd
import stat
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

FILE_MODE, FOLDER_MODE = 0o600, 0o700
_OTHERS = 0o077
_FLAGS = os.O_NOFOLLOW | os.O_CLOEXEC | os.O_NONBLOCK  # a pipe that somebody put there must not block us


class NotPrivate(PermissionError):
    """A file or folder is not ours alone; the text says why and what to do."""

    def __init__(self, path: Path, reason: str) -> None:
        super().__init__(errno.EPERM, f"it {reason}", str(path))

    def __str__(self) -> str:
        return f"{self.filename}: {self.strerror}"


def restrict_new_files() -> None:
    """Make what this process and its children create from now on readable for its owner only."""
    os.umask(_OTHERS)


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
    descriptor = _open_checked(path, os.O_RDONLY | os.O_DIRECTORY)
    try:
        status = os.fstat(descriptor)
        if status.st_mode & stat.S_ISVTX:
            raise NotPrivate(path, "is a folder for everybody's files; name one of your own")
        if close and status.st_mode & _OTHERS and path.resolve() != Path.home().resolve():
            os.fchmod(descriptor, FOLDER_MODE)
            _say(f"{path} was open to other users; only its owner can enter it now.")
    finally:
        os.close(descriptor)
    return path


def open_file(path: Path, flags: int = os.O_RDONLY, tighten: bool = True) -> int:
    """Open a file, and tighten it if others may read it; return the descriptor.

    Args:
        flags: As for os.open, O_CREAT for example.
        tighten: Otherwise what others may read is refused: a key that they have read is of no use any more.
    Raises:
        NotPrivate: It is a symbolic link, no regular file, belongs to somebody else, or has a second name.
        OSError: It cannot be opened.
    """
    # Not cut before it is known whose it is.
    descriptor = _open_checked(path, flags & ~os.O_TRUNC)
    try:
        status = os.fstat(descriptor)
        if not stat.S_ISREG(status.st_mode):
            raise NotPrivate(path, "is no file")
        if status.st_nlink > 1:
            raise NotPrivate(path, "has a second name (a hard link), which other users may read; remove one of the two")
        if status.st_mode & _OTHERS:
            if not tighten:
                raise NotPrivate(path, f"can be read or changed by others: type  chmod 600 {path}")
            os.fchmod(descriptor, FILE_MODE)
            _say(f"{path} was readable for other users; only its owner can read it now.")
        if flags & os.O_TRUNC:
            os.ftruncate(descriptor, 0)
    except BaseException:
        os.close(descriptor)
        raise
    return descriptor


def read(path: Path) -> bytes:
    """Return the contents of a file; raises as `open_file` does."""
    with open(open_file(path), "rb") as file:
        return file.read()


def write(path: Path, contents: bytes) -> None:
    """Write a file at once: readers find the old one or the whole new one, on a full disk too. A link at its place is
    replaced, not followed.

    Raises:
        OSError: It cannot be written.
    """
    descriptor, new = tempfile.mkstemp(prefix=f".{path.name[:64]}.", dir=path.parent)  # mode 0600, nobody's name
    try:
        with open(descriptor, "wb") as file:
            file.write(contents)
            file.flush()
            os.fsync(file.fileno())  # or a machine that loses power could have the new name with nothing in it
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
            descriptor = _open_checked(path, os.O_RDONLY)
            try:
                status = os.fstat(descriptor)
                if stat.S_ISREG(status.st_mode) and status.st_mode & _OTHERS:
                    os.fchmod(descriptor, FILE_MODE)
                    count += 1
            finally:
                os.close(descriptor)
    if count:
        _say(
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


def _open_checked(path: Path, flags: int) -> int:
    """Open what is at the path itself, if it is ours."""
    try:
        descriptor = os.open(path, flags | _FLAGS, FILE_MODE)
    except OSError:
        if path.is_symlink():
            raise NotPrivate(path, "is a symbolic link, which is not followed; name what it points to") from None
        raise
    owner = os.fstat(descriptor).st_uid
    if owner != os.geteuid():
        os.close(descriptor)
        raise NotPrivate(path, f"belongs to {_name(owner)}, not to you; name one of your own, or let its owner do this")
    return descriptor


def _name(user: int) -> str:
    try:
        return pwd.getpwuid(user).pw_name
    except KeyError:
        return f"user {user}"


def _say(sentence: str) -> None:
    print(f"telepresence: {sentence}", file=sys.stderr, flush=True)
