# Runs on Pepper's own Python 2.7 as well as on Python 3: keep to syntax that both accept.
# ruff: noqa: UP031
"""Opening files that belong to nobody else, on the pilot's computer and on a robot. Standard library only."""

import errno
import os
import pwd
import stat
import sys

MYPY = False
if MYPY:
    from os import PathLike  # noqa: F401
    from typing import Union  # noqa: F401

FILE_MODE = 0o600
OTHERS = 0o077
_FLAGS = os.O_NOFOLLOW | getattr(os, "O_CLOEXEC", 0) | os.O_NONBLOCK  # a pipe that somebody put there must not block us
_REFUSED = OSError if sys.version_info[0] == 2 else PermissionError


class NotPrivate(_REFUSED):  # type: ignore[valid-type, misc]
    """A file or folder is not ours alone; the text says why and what to do."""

    def __init__(self, path, reason):
        # type: (Union[str, PathLike[str]], str) -> None
        super(NotPrivate, self).__init__(errno.EPERM, "it " + reason, str(path))  # noqa: UP008

    def __str__(self):
        # type: () -> str
        return "%s: %s" % (self.filename, self.strerror)


def open_checked(path, flags):
    # type: (Union[str, PathLike[str]], int) -> int
    """Open what is at the path itself, if it is ours; return the descriptor.

    Raises:
        NotPrivate: It is a symbolic link, or belongs to somebody else.
        OSError: It cannot be opened.
    """
    try:
        descriptor = os.open(str(path), flags | _FLAGS, FILE_MODE)
    except OSError:
        if not os.path.islink(str(path)):
            raise
        descriptor = -1
    if descriptor < 0:
        raise NotPrivate(path, "is a symbolic link, which is not followed; name what it points to")
    owner = os.fstat(descriptor).st_uid
    if owner != os.geteuid():
        os.close(descriptor)
        raise NotPrivate(
            path, "belongs to %s, not to you; name one of your own, or let its owner do this" % _name(owner)
        )
    return descriptor


def open_file(path, flags=os.O_RDONLY, tighten=True):
    # type: (Union[str, PathLike[str]], int, bool) -> int
    """Open a file, and tighten it if others may read it; return the descriptor.

    Args:
        flags: As for os.open, O_CREAT for example.
        tighten: Otherwise what others may read is refused: a key that they have read is of no use any more.
    Raises:
        NotPrivate: It is a symbolic link, no regular file, belongs to somebody else, or has a second name.
        OSError: It cannot be opened.
    """
    # Not cut before it is known whose it is.
    descriptor = open_checked(path, flags & ~os.O_TRUNC)
    try:
        status = os.fstat(descriptor)
        if not stat.S_ISREG(status.st_mode):
            raise NotPrivate(path, "is no file")
        if status.st_nlink > 1:
            raise NotPrivate(path, "has a second name (a hard link), which other users may read; remove one of the two")
        if status.st_mode & OTHERS:
            if not tighten:
                raise NotPrivate(path, "can be read or changed by others: type  chmod 600 %s" % path)
            os.fchmod(descriptor, FILE_MODE)
            say("%s was readable for other users; only its owner can read it now." % path)
        if flags & os.O_TRUNC:
            os.ftruncate(descriptor, 0)
    except BaseException:
        os.close(descriptor)
        raise
    return descriptor


def say(sentence):
    # type: (str) -> None
    """Say it on standard error."""
    sys.stderr.write("telepresence: %s\n" % sentence)
    sys.stderr.flush()


def _name(user):
    # type: (int) -> str
    try:
        return pwd.getpwuid(user).pw_name
    except KeyError:
        return "user %d" % user
