"""Temporary folders that go even when their owner was killed: whoever makes the next one of that kind removes them.

The owner holds a lock on its folder (flock(2)), which the kernel releases however the owner ends.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import shutil
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType

TAKE_TIMEOUT = 1.0
"""Seconds in which a folder that nobody owns is taken over."""


def nothing(folder: Path) -> None:
    """What most folders have elsewhere."""


class TemporaryFolder:
    """A new folder in the folder for temporary files, which only this user can enter, until `close`.

    Args:
        prefix: Of its name, one for each kind of folder. Those of this kind whose owners were killed are removed.
        elsewhere: Removes what belongs to a folder of this kind but lies elsewhere; called before that is removed.
        left: One of this kind whose owner was killed, and which is taken over instead.
        spared: Which of those whose owners were killed are not removed.
    Raises:
        OSError: It cannot be made, or taken over.
    """

    def __init__(
        self,
        prefix: str,
        elsewhere: Callable[[Path], None] = nothing,
        left: Path | None = None,
        spared: Callable[[Path], bool] = lambda folder: False,
    ) -> None:
        self._elsewhere = elsewhere
        if left is not None:
            self.path = left
            self._lock = os.open(left, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
            self._take()
            return
        for folder in ownerless(prefix):
            if not spared(folder):
                remove(folder, elsewhere)
        while True:
            self.path = Path(tempfile.mkdtemp(prefix=prefix))
            self._lock = os.open(self.path, os.O_RDONLY | os.O_DIRECTORY)
            fcntl.flock(self._lock, fcntl.LOCK_EX)
            if self.path.exists():
                break
            os.close(self._lock)  # somebody took it for ownerless before it was locked

    def _take(self) -> None:
        """Lock it. Whoever looks whether it is owned has it locked for a moment."""
        deadline = time.monotonic() + TAKE_TIMEOUT
        while True:
            try:
                fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                return
            except BlockingIOError:
                if time.monotonic() > deadline:
                    os.close(self._lock)
                    raise
            time.sleep(0.001)

    def __enter__(self) -> Path:
        return self.path

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Remove the folder with everything in it; once more does nothing."""
        if self._lock < 0:
            return
        remove(self.path, self._elsewhere)
        os.close(self._lock)
        self._lock = -1


def ownerless(prefix: str) -> list[Path]:
    """Return this user's folders of a kind whose owners were killed."""
    found = []
    for folder in sorted(Path(tempfile.gettempdir()).glob(f"{prefix}*")):
        with contextlib.suppress(OSError):  # it has just gone
            if folder.is_dir() and not folder.is_symlink() and folder.stat().st_uid == os.geteuid():
                if not owned(folder):
                    found.append(folder)
    return found


def owned(folder: Path) -> bool:
    """Whether the owner of this folder lives.

    Raises:
        OSError: It is no folder, or not ours to look into.
    """
    try:
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    except FileNotFoundError:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)  # who looks is not taken for the owner by others who do
    except BlockingIOError:
        return True
    finally:
        os.close(descriptor)
    return False


def remove(folder: Path, elsewhere: Callable[[Path], None] = nothing) -> None:
    """Remove a folder, and what it has elsewhere."""
    elsewhere(folder)
    shutil.rmtree(folder, ignore_errors=True)
