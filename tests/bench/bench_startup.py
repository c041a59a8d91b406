"""`./stack up` on a built tree until the window shows the first picture, against roslaunch of as many empty nodes."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from report import Row
from ros_graph import free_port, private_environment, wait_for
from startup.timeline import Timeline, draw

from telepresence.station import processes
from telepresence.station.ros_master import master_answers, master_proxy

ROOT = Path(__file__).resolve().parent.parent.parent
ROUNDS = 3
FIRST_PICTURE, BANNER = "first picture", "Ctrl-C ends all of it"
EMPTY_NODE = "#!/usr/bin/env python3\nimport rospy\nrospy.init_node('empty')\nrospy.spin()\n"


def run(out: Path | None = None) -> list[Row]:
    """Start the station and as many empty nodes, in turn.

    Args:
        out: Folder for startup.png, of one more start; None to draw nothing.
    """
    ours, bare = [], []
    for _ in range(ROUNDS):
        seconds, nodes = time_up()
        ours.append(seconds)
        bare.append(time_empty_nodes(nodes))
    if out is not None:
        time_up(out / "startup.png")
    return [
        Row("start to first picture", statistics.median(ours), statistics.median(bare), "s", f"{nodes} empty nodes")
    ]


def time_up(picture: Path | None = None, command: Sequence[str] = ()) -> tuple[float, int]:
    """Seconds until the window says that it shows a picture, and the number of nodes then.

    Args:
        picture: File for a picture of who computes when.
        command: Words before `./stack up`.
    """
    with private_environment() as environment:
        environment.pop("DISPLAY", None)
        ports = [
            f"{name}:={free_port()}"
            for name in ("nao_port", "drive_port", "page_port", "robot_page_port", "pilot_page_port", "screen_port")
        ]
        begin = time.monotonic()
        up = processes.start(
            [*command, str(ROOT / "stack"), "up", "pepper", *ports, "source:=test"],
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        timeline = Timeline(up.pid, begin)
        try:
            if picture is not None:
                timeline.start()
            lines, marks = [], {}
            for line in up.stdout:
                lines.append(line)
                if BANNER in line:
                    marks["says where everything is"] = time.monotonic() - begin
                if FIRST_PICTURE in line:
                    marks["first picture"] = seconds = time.monotonic() - begin
                    if picture is not None:
                        timeline.stop()
                        draw(timeline, marks, picture)
                    return seconds, len(node_names(environment["ROS_MASTER_URI"]))
            raise RuntimeError("./stack up ended without a picture:\n" + "".join(lines[-20:]))
        finally:
            processes.end(up, patience=20.0)
            up.stdout.close()


def time_empty_nodes(count: int) -> float:
    """Seconds until roslaunch, with a master of its own, has `count` empty rospy nodes registered."""
    with private_environment() as environment, tempfile.TemporaryDirectory() as folder:
        package = Path(folder, "empty_nodes")
        package.mkdir()
        package.joinpath("package.xml").write_text("<package><name>empty_nodes</name></package>")
        node = package / "empty"
        node.write_text(EMPTY_NODE)
        node.chmod(0o755)
        launch = package / "empty.launch"
        nodes = "".join(f'<node name="n{i}" pkg="empty_nodes" type="empty"/>' for i in range(count))
        launch.write_text(f"<launch>{nodes}</launch>")
        environment["ROS_PACKAGE_PATH"] = f"{folder}:{os.environ['ROS_PACKAGE_PATH']}"
        uri = environment["ROS_MASTER_URI"]
        begin = time.monotonic()
        process = processes.start(
            ["roslaunch", "-p", uri.rpartition(":")[2], str(launch)],
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=sys.stderr,
        )
        try:
            wait_for(lambda: master_answers(uri) and sum(n.startswith("/n") for n in node_names(uri)) == count, "nodes")
            return time.monotonic() - begin
        finally:
            processes.end(process)


def node_names(uri: str) -> set[str]:
    state = master_proxy(uri, timeout=2.0).getSystemState("/bench")[2]
    return {node for group in state for _, nodes in group for node in nodes}
