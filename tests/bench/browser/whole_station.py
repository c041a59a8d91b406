"""The whole station of a simulated Pepper with its window, and its page: `./stack up pepper`."""

from __future__ import annotations

import contextlib
import os
import re
import subprocess
import threading
import time
from collections.abc import Iterator
from pathlib import Path

from ros_graph import free_port, private_environment
from soak.samples import Usage, sample

from telepresence.station import processes

ROOT = Path(__file__).resolve().parents[3]
PORTS = ("nao_port", "drive_port", "page_port", "robot_page_port", "pilot_page_port", "screen_port")
_TICK = os.sysconf("SC_CLK_TCK")


class WholeStation:
    """A running station.

    Attributes:
        master: Address of its ROS master.
        link: The one that it has printed: who opens it has the page.
        users: Its accounts.
        environment: For programs on its graph.
    """

    def __init__(self, up: subprocess.Popen, environment: dict[str, str], link: str) -> None:
        self.master, self.link, self._up = environment["ROS_MASTER_URI"], link, up
        self.users, self.environment = Path(environment["TELEPRESENCE_USERS"]), environment

    @property
    def url(self) -> str:
        """The page's address, without what lets people in."""
        return self.link.partition("#")[0]

    def usage(self) -> dict[str, Usage]:
        """Return what each of its programs uses."""
        return sample((self._up.pid, *processes.descendants(self._up.pid)))

    def cores(self, seconds: float) -> dict[str, float]:
        """Return how much of a processor each of its programs takes, by its command line."""
        before = self._used()
        time.sleep(seconds)
        after = self._used()
        return {
            f"{pid} {words}": (used - before.get((pid, words), 0.0)) / seconds for (pid, words), used in after.items()
        }

    def _used(self) -> dict[tuple[int, str], float]:
        found = {}
        for pid in (self._up.pid, *processes.descendants(self._up.pid)):
            with contextlib.suppress(FileNotFoundError, ProcessLookupError):  # it has ended meanwhile
                words = Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode().strip()
                fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
                found[pid, words] = (int(fields[11]) + int(fields[12])) / _TICK
        return found


@contextlib.contextmanager
def whole_station() -> Iterator[WholeStation]:
    """Yield a station whose window shows pictures and whose page can be opened."""
    with private_environment() as environment:
        environment.pop("DISPLAY", None)
        environment["TELEPRESENCE_USERS"] = str(Path(environment["ROS_HOME"], "users.db"))
        ports = [f"{name}:={free_port()}" for name in PORTS]
        up = processes.start(
            [str(ROOT / "stack"), "up", "--verbose", "pepper", *ports, "source:=test"],
            env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        )  # fmt: skip
        try:
            link = _printed_link(up)
            threading.Thread(target=up.stdout.read, daemon=True).start()  # who does not read stops the station
            yield WholeStation(up, environment, link)
        finally:
            processes.end(up, patience=20.0)
            up.stdout.close()


def _printed_link(up: subprocess.Popen) -> str:
    """Return the printed link, once the page's program and the window run."""
    lines, missing = [], {r"pilot's page https", r"the pilot's page: https", "first picture"}
    for line in up.stdout:
        lines.append(line)
        missing = {words for words in missing if not re.search(words, line)}
        if not missing:
            return re.search(r"pilot's page (https://\S+)", "".join(lines))[1]
    raise RuntimeError("./stack up ended:\n" + "".join(lines[-20:]))
