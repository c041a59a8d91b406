"""A node as our roslaunch starts it: watched by its beats, and adopted when roslaunch itself was restarted."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
from pathlib import Path

from roslaunch.core import printerrlog, printlog_bold
from roslaunch.nodeprocess import LocalProcess
from roslaunch.pmon import Process

from telepresence.station import program_registry, vitals
from telepresence.station.adopted import UNKNOWN, Adopted
from telepresence.station.program_registry import Running
from telepresence.station.vitals import Beats, Vitals
from telepresence_ros.forked_process import ForkedProcess


class WatchedNode(LocalProcess):
    """Debian's process of a node, and its vitals.

    Args:
        process: As roslaunch made it; only what it says of the node is used.
        node: The node's full name, as other nodes see it.
        folder: Where its socket is and where is written down that it runs.
        closable: It starts again unless it ended with exit code 0, whatever `respawn` says.
        ends_first: Before the others, because its end brings a robot to rest.
    """

    popen: subprocess.Popen | ForkedProcess | Adopted | None

    def __init__(
        self, process: LocalProcess, node: str, folder: Path, *, closable: bool = False, ends_first: bool = False
    ) -> None:
        super().__init__(
            process.run_id,
            process.package,
            process.name,
            process.args,
            process.env,
            process.log_output,
            respawn=process.respawn or closable,
            respawn_delay=process.respawn_delay,
            required=process.required,
            cwd=process.cwd,
            is_node=process.is_node,
            sigint_timeout=process.sigint_timeout,
            sigterm_timeout=process.sigterm_timeout,
        )
        self.node, self.closable, self.ends_first = node, closable, ends_first
        self._folder = folder
        self._beats: Beats | None = None
        try:
            self._beats = Beats(program_registry.file_of(folder, node, "beats"))
            self.env["NOTIFY_SOCKET"] = str(self._beats.path)
        except OSError as error:
            printerrlog(f"[{self.name}] its beats cannot be listened for, freezing is not noticed: {error}")
        self._vitals: Vitals | None = None
        self._beater = 0
        self._killed_as_frozen = False
        self.descriptor: int | None = None
        """pidfd of the running process: readable once it has ended (pidfd_open(2))."""

    def start(self) -> bool:
        """Start the process, or go on with the one that an earlier roslaunch has started."""
        known = None if self.spawn_count else program_registry.recall(self._folder, self.node)
        if known is not None and self._adopt(known):
            return True
        self._beater = 0
        if self._beats is not None:
            self._beats.stopping = False
        started = super().start()
        if self.popen is not None:
            self._watch(self._running(self.popen.pid))
        return started

    def froze(self, elapsed: float) -> bool:
        """Whether it froze; `elapsed` seconds since the last look. Once it did, it is killed and not judged again."""
        if self._vitals is None or self._killed_as_frozen:
            return False
        froze = self._vitals.froze(elapsed)
        if self._vitals.beater != self._beater:  # now it is known to beat: whoever adopts it must know that, too
            self._beater = self._vitals.beater
            program_registry.remember(self._folder, self._running(self._vitals.pid))
        return froze

    def kill_frozen(self) -> None:
        """Kill it with its process group; what beats for it (a node in an xterm has a group of its own), too."""
        self._killed_as_frozen = True
        for pid in {self._vitals.pid, self._beater} - {0} if self._vitals is not None else ():
            with contextlib.suppress(ProcessLookupError):
                os.killpg(os.getpgid(pid), signal.SIGKILL)

    @property
    def cause(self) -> str:
        """Why the process ended: "froze", "died: signal 9", "died: exit code 1"."""
        if self._killed_as_frozen:
            return "froze"
        return "died" if self.exit_code in (None, UNKNOWN) else vitals.cause(self.exit_code)

    @property
    def was_closed(self) -> bool:
        """Whether a person has closed it, who does not want it back. Of one that was adopted nobody learns the exit
        code: it has said so itself."""
        if not self.closable or self.exit_code not in (0, UNKNOWN):
            return False
        if self.exit_code == UNKNOWN and self._beats is not None:
            self._beats.read()  # what it said at the very end
            return self._beats.stopping
        return self.exit_code == 0

    def bury(self) -> None:
        """The process has ended: nobody waits for it any more."""
        if self.descriptor is not None:
            os.close(self.descriptor)
        self.descriptor = self._vitals = None
        self.stop([])

    def _adopt(self, known: Running) -> bool:
        """Go on with what runs already; False when it has to be started."""
        if not known.lives:
            if self.respawn:
                return False
            # It ended while there was no roslaunch: that is for our monitor to find, as if it had ended now.
            Process.start(self)
            self.started, self.popen = True, None
            return True
        same = known.arguments == self._own_arguments()
        if same:
            with contextlib.suppress(ProcessLookupError):
                self.popen = Adopted(known.pid)
                Process.start(self)
                self.started, self.stopped, self.pid = True, False, known.pid
                self._watch(known)
                printlog_bold(f"process[{self.name}]: goes on with pid [{known.pid}]")
                return True
        with contextlib.suppress(ProcessLookupError):
            os.killpg(os.getpgid(known.pid), signal.SIGKILL)
        return False

    def _watch(self, known: Running) -> None:
        self._beater, self._killed_as_frozen = known.beater, False
        with contextlib.suppress(ProcessLookupError):  # a child stays until we have asked for its exit code; others not
            self.descriptor = os.pidfd_open(known.pid)
        self._vitals = Vitals(known.pid, self._beats, known.beater)
        program_registry.remember(self._folder, known)

    def _running(self, pid: int) -> Running:
        return Running(self.node, pid, vitals.start_time(pid), self._own_arguments(), self._beater)

    def _own_arguments(self) -> list[str]:
        return [word for word in self.args if not word.startswith("__log:=")]
