"""A station that systemd keeps: a manager of the benchmark's own, and in it the unit that `./stack service` prints.

`systemd --user` wants a cgroup below which it may make others, and a machine that systemd has booted, by which it means
a folder. It gets both in a mount namespace of its own, which needs root; the machine's own systemd, if there is one,
does not see it.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from telepresence.station import processes

ROOT = Path(__file__).resolve().parents[3]
PROGRAM = Path("/usr/lib/systemd/systemd")
UNIT = "telepresence.service"
CGROUPS = "/sys/fs/cgroup"
START_TIMEOUT = 60.0
ENTER = f"""\
set -e
mount -t cgroup2 none {CGROUPS}
mkdir {CGROUPS}/$1
echo $$ >{CGROUPS}/$1/cgroup.procs
mount -t tmpfs none /run
mkdir -p /run/systemd/system
exec {PROGRAM} --user
"""
LEAVE = f"mount -t cgroup2 none {CGROUPS} && find {CGROUPS}/$1 -depth -type d -exec rmdir {{}} +"


class Service:
    """`./stack up` as a unit of systemd, until closed.

    Args:
        arguments: Of `./stack up`.
        environment: Of the station.
        folder: For the unit, and for what the manager writes.
    Raises:
        RuntimeError: There is no systemd here, or the unit does not start; the text says why.
    """

    def __init__(self, arguments: Sequence[str], environment: Mapping[str, str], folder: Path) -> None:
        if not PROGRAM.exists():
            raise RuntimeError("there is no systemd on this machine:  apt install systemd")
        runtime = folder / "run"
        runtime.mkdir(mode=0o700)
        self._environment = {**environment, "XDG_RUNTIME_DIR": str(runtime)}
        units = Path(environment["XDG_CONFIG_HOME"]) / "systemd" / "user"
        (units / f"{UNIT}.d").mkdir(parents=True)
        words = [str(ROOT / "stack"), "service", *arguments]
        unit = subprocess.run(words, env=self._environment, stdout=subprocess.PIPE, text=True, check=True).stdout
        (units / UNIT).write_text(unit.replace('"up"', '"up" "--verbose"'))  # what the window shows is measured, too
        printed = folder / "printed"
        os.mkfifo(printed)  # there is no journal
        (units / f"{UNIT}.d" / "output.conf").write_text(f"[Service]\nStandardOutput=file:{printed}\n")
        # Open for writing, too: the reading does not end with the station.
        self.output: Iterator[str] = os.fdopen(os.open(printed, os.O_RDWR), errors="replace")
        self._cgroup = f"telepresence-bench-{os.getpid()}-{folder.name}"
        command = ["unshare", "--mount", "sh", "-c", ENTER, "sh", self._cgroup]
        self.manager = processes.start(command, tied=True, env=self._environment, stdin=subprocess.DEVNULL)
        deadline = time.monotonic() + START_TIMEOUT
        while problem := self._control("start", "--no-block", UNIT):
            if self.manager.poll() is not None or time.monotonic() > deadline:
                raise RuntimeError(f"systemd does not start the station: {problem}")
            time.sleep(0.1)

    def close(self) -> None:
        """Stop the unit and end its manager."""
        self._control("stop", UNIT)
        processes.end(self.manager, patience=5.0)
        with contextlib.suppress(subprocess.CalledProcessError):  # something is in there still: at the next boot
            subprocess.run(["unshare", "--mount", "sh", "-c", LEAVE, "sh", self._cgroup], check=True)
        shutil.rmtree(self._environment["XDG_RUNTIME_DIR"], ignore_errors=True)

    def _control(self, *words: str) -> str:
        """systemctl; what it complains about, or ""."""
        command = ["systemctl", "--user", *words]
        done = subprocess.run(command, env=self._environment, capture_output=True, text=True, check=False)
        return done.stderr.strip() or ("" if done.returncode == 0 else f"exit code {done.returncode}")
