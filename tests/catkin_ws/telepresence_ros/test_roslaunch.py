"""Our roslaunch brings nodes back that die or freeze, leaves slow and foreign ones alone, and goes on with the nodes of
one that was killed. The nodes are small programs that know no ROS."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from telepresence_msgs.msg import Fault
from telepresence_ros.node_monitor import NodeMonitor

from telepresence.station import processes, vitals
from telepresence.station.faults import FaultListener, FaultReporter

pytestmark = pytest.mark.ros

PROGRAM = f"""#!{sys.executable}
import os, sys, threading, time
from pathlib import Path
from telepresence.station.heartbeat import beat, notify

assert "TELEPRESENCE_WATCH" not in os.environ, "another roslaunch, started by a node, would take the nodes for its own"
name, folder = sys.argv[1], Path(sys.argv[2])
with open(folder / (name + ".pids"), "a") as file:
    print(os.getpid(), file=file)
if name == "crashing":
    sys.exit(3)
while name != "foreign" and not (folder / f"hang.{{os.getpid()}}").exists():
    beat()
    time.sleep(0.05)
    if (folder / ("close." + name)).exists():
        notify("STOPPING=1")
        sys.exit(0)
threading.Event().wait()
"""
SLOW_TO_END = f"""#!{sys.executable}
import os, signal, sys, threading, time
from pathlib import Path

name, folder = sys.argv[1], Path(sys.argv[2])

def end(*_):
    with open(folder / "interrupted", "a") as file:
        print(name, file=file)
    time.sleep(0.5)
    sys.exit(0)

signal.signal(signal.SIGINT, end)
(folder / (name + ".runs")).write_text(f"{{os.getpid()}}\\n")
threading.Event().wait()
"""
AT_ONCE = 10
"""So many nodes does roslaunch end at a time."""
STATION = """
import subprocess, sys
from telepresence.station import processes
processes.start(sys.argv[1:], tied=True).wait()
"""
LISTENER = """
import json, rospy
from telepresence_msgs.msg import Fault
rospy.init_node("listener")
rospy.Subscriber("/station/faults", Fault, lambda m: print(json.dumps([m.program, m.what, m.next]), flush=True))
rospy.spin()
"""
NAMES = ("dying", "hanging", "foreign", "crashing")


class Launch:
    """A package with one program, a launch file with four nodes of it, and who launches that."""

    def __init__(self, folder: Path, environment: dict[str, str], run_program) -> None:
        self.folder, self._run_program = folder, run_program
        package = folder / "package" / "small_nodes"
        package.mkdir(parents=True)
        (package / "package.xml").write_text("<package><name>small_nodes</name></package>")
        (package / "small").write_text(PROGRAM)
        (package / "small").chmod(0o755)
        nodes = "".join(
            f'<node pkg="small_nodes" type="small" name="{name}" args="{name} {folder}" respawn="true"/>'
            for name in NAMES
        )
        nodes += "".join(
            f'<node pkg="small_nodes" type="small" name="{name}" args="{name} {folder}">'
            '<env name="TELEPRESENCE_CLOSABLE" value="true" /></node>'
            for name in ("window", "adopted_window")
        )
        (folder / "all.launch").write_text(f"<launch>{nodes}</launch>")
        (folder / "w").mkdir()
        path = f"{package.parent}:{environment['ROS_PACKAGE_PATH']}"
        self.environment = {**environment, "ROS_PACKAGE_PATH": path, "TELEPRESENCE_WATCH": str(folder / "w")}

    def start(self, *under: str) -> subprocess.Popen:
        """Start our roslaunch, or what starts it."""
        command = (*under, sys.executable, "-m", "telepresence_ros.roslaunch", str(self.folder / "all.launch"))
        with open(self.folder / "output", "a") as output:
            return self._run_program(*command, env=self.environment, stdout=output, stderr=output)

    @property
    def output(self) -> str:
        return (self.folder / "output").read_text()

    def hang(self, name: str) -> None:
        """Let its program hang."""
        (self.folder / f"hang.{self.pids(name)[-1]}").touch()

    def pids(self, name: str) -> list[int]:
        """Every process that this node has had, the present one last."""
        path = self.folder / f"{name}.pids"
        return [int(line) for line in path.read_text().split()] if path.exists() else []


@pytest.fixture
def launch(tmp_path, ros_master, run_program) -> Launch:
    return Launch(tmp_path, ros_master, run_program)


def test_nodes_come_back_and_outlive_roslaunch(launch, run_program, wait_until):
    roslaunch = launch.start()
    listener = run_program(
        sys.executable, "-c", LISTENER, env=launch.environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    )
    wait_until(lambda: all(launch.pids(name) for name in NAMES), "all nodes run")
    assert json.loads(listener.stdout.readline())[0] == "/crashing"  # latched: now nothing is missed

    def comes_back(name: str) -> None:
        known = launch.pids(name)
        wait_until(lambda: len(launch.pids(name)) > len(known), f"{name} comes back")
        assert vitals.state(known[-1]) in ("", "Z")

    os.kill(launch.pids("dying")[-1], signal.SIGKILL)
    comes_back("dying")
    os.kill(launch.pids("foreign")[-1], signal.SIGSTOP)
    comes_back("foreign")
    launch.hang("hanging")
    comes_back("hanging")
    os.kill(launch.pids("window")[-1], signal.SIGKILL)
    comes_back("window")
    (launch.folder / "close.window").touch()
    wait_until(
        lambda: "[window-5] process has finished cleanly" in launch.output, "who closes it does not want it back"
    )
    assert len(launch.pids("window")) == 2

    wanted = [
        ["/dying", "died: signal 9", "starts again"],
        ["/foreign", "froze", "starts again"],
        ["/hanging", "froze", "starts again"],
    ]
    wait_until(lambda: launch.output.count("no more is said") == 1, "the crashing node is said to be hopeless")
    roslaunch.kill()
    roslaunch.wait()
    known = {name: launch.pids(name) for name in NAMES[:3]}
    roslaunch = launch.start()
    wait_until(lambda: launch.output.count("goes on with pid") >= 4, "the second roslaunch adopts what runs")
    wait_until(lambda: launch.output.count("no more is said") == 2, "it starts what does not run")
    assert {name: launch.pids(name) for name in NAMES[:3]} == known

    (launch.folder / "close.adopted_window").touch()
    wait_until(lambda: not vitals.start_time(launch.pids("adopted_window")[-1]), "the adopted window is closed")
    launch.hang("hanging")
    comes_back("hanging")
    os.kill(launch.pids("dying")[-1], signal.SIGKILL)
    comes_back("dying")
    assert len(launch.pids("adopted_window")) == 1, "who closes it does not want it back"
    faults: list[list[str]] = []
    while not all(fault in faults for fault in [*wanted, ["/dying", "died", "starts again"]]):
        faults.append(json.loads(listener.stdout.readline()))
    assert processes.end(roslaunch, patience=20.0) == 0
    wait_until(
        lambda: not any(vitals.start_time(launch.pids(name)[-1]) for name in NAMES), "roslaunch ends its adopted nodes"
    )
    listener.kill()
    listener.stdout.close()


def has_nodes_that_end_slowly(launch: Launch, *others: str) -> None:
    """The first is the one that brings a robot to rest."""
    (launch.folder / "package" / "small_nodes" / "small").write_text(SLOW_TO_END)
    mark = '<env name="TELEPRESENCE_ENDS_FIRST" value="true" />'
    nodes = "".join(
        f'<node pkg="small_nodes" type="small" name="{name}" args="{name} {launch.folder}">'
        f"{mark if name == 'driver' else ''}</node>"
        for name in ("driver", *others)
    )
    (launch.folder / "all.launch").write_text(f"<launch>{nodes}</launch>")


def test_what_brings_a_robot_to_rest_is_ended_first(launch, wait_until):
    names = ["driver", *(f"other_{i}" for i in range(AT_ONCE + 2))]
    has_nodes_that_end_slowly(launch, *names[1:])
    roslaunch = launch.start()
    wait_until(lambda: all((launch.folder / f"{name}.runs").exists() for name in names), "all nodes run")
    assert processes.end(roslaunch, patience=20.0) == 0
    interrupted = (launch.folder / "interrupted").read_text().split()
    assert sorted(interrupted) == sorted(names) and "driver" in interrupted[:AT_ONCE]


def test_the_death_of_the_station_is_told_while_its_nodes_end(launch, run_program, wait_until):
    has_nodes_that_end_slowly(launch, *(f"other_{i}" for i in range(AT_ONCE)), "dies")
    station = launch.start(sys.executable, "-c", STATION)
    listener = run_program(
        sys.executable, "-c", LISTENER, env=launch.environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    )
    dies = launch.folder / "dies.runs"
    wait_until(lambda: dies.exists() and dies.read_text().endswith("\n"), "it runs")
    os.kill(int(dies.read_text()), signal.SIGKILL)
    assert json.loads(listener.stdout.readline())[:2] == ["/dies", "died: signal 9"]  # now nothing is missed
    everything = processes.descendants(station.pid)
    station.kill()
    assert json.loads(listener.stdout.readline()) == ["stack up", "died", "takes everything with it"]
    wait_until(lambda: all(vitals.state(pid) in ("", "Z") for pid in everything), "all ends")
    assert "driver" in (launch.folder / "interrupted").read_text().split()
    ended = [line for line in launch.output.splitlines() if "killing on exit" in line]
    assert "station_faults" in ended[-1], "who says it stays until the others have ended"
    listener.stdout.close()


def test_a_station_that_is_stopped_is_reported_once(run_program, wait_until, tmp_path):
    station = run_program("sleep", "60")
    faults = FaultListener(tmp_path / "faults")
    monitor = NodeMonitor()
    monitor.station, monitor.faults = station.pid, FaultReporter(tmp_path / "faults")
    monitor._look_at_station()
    processes.send(station.pid, signal.SIGSTOP)
    wait_until(lambda: vitals.state(station.pid) == "T", "it stands")
    for _ in range(3):
        monitor._look_at_station()
    assert faults.next(0.0).program == "stack up"
    processes.send(station.pid, signal.SIGCONT)
    wait_until(lambda: vitals.state(station.pid) != "T", "it goes on")
    monitor._look_at_station()
    with pytest.raises(BlockingIOError):
        faults.next(0.0)
    faults.close()


def test_a_mistyped_argument_is_refused_before_anything_starts(launch, run_program):
    launch_file = launch.folder / "all.launch"
    launch_file.write_text('<launch><arg name="gate" default="" /><arg name="fixed" value="" /></launch>')
    words = (launch_file, "gate:=robot", "gaet:=robot", "__log:=/dev/null", "_rate:=1")
    command = (sys.executable, "-m", "telepresence_ros.roslaunch", *words)
    refused = run_program(*command, env=launch.environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    said, _ = refused.communicate(timeout=60.0)
    assert refused.returncode == 1 and "there is no argument 'gaet'; arguments: gate" in said and "fixed" not in said


def test_the_message_of_a_fault_has_the_fields_that_are_sent():
    assert Fault.__slots__ == ["stamp", "program", "what", "next"]
