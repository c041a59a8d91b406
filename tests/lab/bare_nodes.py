"""A ROS master and single nodes of the workspace, for tests that attack one program: no launch file, no station."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

from endings import end_together
from free_ports import free_port
from waiting import wait_until

from telepresence.station import processes
from telepresence.station.ros_master import master_answers

ROOT = Path(__file__).resolve().parents[2]
PATIENCE = 40.0


class BareNode:
    """A node that is started again when it has ended, and what it has printed."""

    def __init__(self, argv: list[str], environment: dict[str, str], log: Path) -> None:
        self._argv, self._environment, self._log = argv, environment, log
        self.process: subprocess.Popen | None = None

    @property
    def alive(self) -> bool:
        return self.process is not None and self.process.poll() is None

    def ensure(self) -> None:
        """Start it if it does not run."""
        if not self.alive:
            with self._log.open("a") as output:
                self.process = processes.start(
                    self._argv,
                    env=self._environment,
                    stdin=subprocess.DEVNULL,
                    stdout=output,
                    stderr=subprocess.STDOUT,
                )

    def kill(self) -> None:
        """End it at once."""
        if self.process is not None:
            self.process.kill()
            self.process.wait()

    @property
    def output(self) -> str:
        return self._log.read_bytes().decode(errors="replace")


class BareNodes:
    """The master, from the beginning, and nodes by `node`; all end with `close`."""

    def __init__(self, folder: Path, **environment: str) -> None:
        self._folder = folder
        uri = f"http://127.0.0.1:{free_port()}"
        words = subprocess.run(
            ["bash", "-c", '. "$0"/env.sh && env -0', str(ROOT)], check=True, capture_output=True, text=True
        ).stdout
        self.environment = {
            **os.environ,
            **dict(word.split("=", 1) for word in words.split("\0") if "=" in word),
            "ROS_MASTER_URI": uri,
            "ROS_HOME": str(folder / "ros"),
            "ROS_IP": "127.0.0.1",
            "XDG_CONFIG_HOME": str(folder / "config"),
            **environment,
        }
        self.nodes: list[BareNode] = []
        master = self._add(["rosmaster", "--core", "-p", uri.rpartition(":")[2]])
        wait_until(lambda: master_answers(uri), "the ROS master answers")
        self.nodes.remove(master)
        self._all = [master]

    def node(self, package: str, program: str, *arguments: str) -> BareNode:
        """Start a node of the workspace."""
        node = self._add([str(ROOT / "catkin_ws/devel/lib" / package / program), *arguments])
        self._all.append(node)
        return node

    def close(self) -> None:
        end_together([node.process for node in self._all if node.process is not None])

    def _add(self, argv: list[str]) -> BareNode:
        log = self._folder / f"{len(self.nodes)}_{Path(argv[0]).name}.log"
        self.nodes.append(BareNode(argv, self.environment, log))
        self.nodes[-1].ensure()
        return self.nodes[-1]
