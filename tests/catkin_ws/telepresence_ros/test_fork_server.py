"""A program that was forked is a process like one that was started: real processes, no ROS graph."""

import json
import os
import select
import signal
import socket
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict

import pytest
from telepresence_ros import forked_process
from telepresence_ros.fork_server import LONGEST, Program
from telepresence_ros.forked_process import TERMINAL, UNKNOWN, NodeStarter, can_be_forked
from telepresence_ros.node_monitor import NodeMonitor

from telepresence.station import processes, vitals
from telepresence.station.faults import FaultListener, FaultReporter

pytestmark = pytest.mark.ros

PATH = os.pathsep.join(sys.path)
PROGRAM = f"""#!{sys.executable}
import atexit, json, os, signal, sys, time
import rospy.names
from telepresence.station import heartbeat
atexit.register(print, "orderly end", flush=True)
print(json.dumps(dict(
    argv=sys.argv, name=__name__, file=__file__, folder=os.getcwd(), word=os.environ.get("WORD"), path=sys.path[0],
    session=os.getsid(0) == os.getpid(), beats=heartbeat._address, title=open("/proc/self/cmdline").read(),
    found=os.environ.get("NOTIFY_SOCKET"),
    station="STATION=here" in open("/proc/self/environ").read().split("\\0"),
    namespace=rospy.names.get_namespace(), mapped=rospy.names.get_mappings(), open=len(os.listdir("/proc/self/fd")),
    threads=len(os.listdir("/proc/self/task")),
)), flush=True)
if sys.argv[1] == "wait":
    time.sleep(60)
if sys.argv[1] == "raise":
    raise ValueError("on purpose")
sys.exit(int(sys.argv[1]))
"""


@pytest.fixture(scope="module")
def starter():
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", PATH)
        patch.setenv("STATION", "here")
        starter = NodeStarter()
        yield starter
        starter.close()


class Started:
    def __init__(self, starter, folder, *words, **environment):
        self.script = folder / "program"
        self.script.write_text(PROGRAM)
        self.script.chmod(0o755)
        self.output = folder / "output"
        with open(self.output, "w") as output:
            self.process = starter.start(
                [str(self.script), *words],
                env={**os.environ, "PYTHONPATH": PATH, **environment},
                cwd=str(folder),
                stdout=output,
                stderr=output,
                close_fds=True,
                preexec_fn=os.setsid,
            )

    @property
    def text(self):
        return self.output.read_text()

    def says(self, wait_until):
        wait_until(lambda: "\n" in self.text, "it runs")
        return json.loads(self.text.splitlines()[0])

    def ends(self, wait_until):
        wait_until(lambda: self.process.poll() is not None, "it ends")
        return self.process.poll()


@pytest.fixture
def run(starter, tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", PATH)
    started = []

    def start(*words, **environment):
        started.append(Started(starter, tmp_path, *words, **environment))
        return started[-1]

    yield start
    for one in started:
        if one.process.poll() is None:
            processes.send(one.process.pid, signal.SIGKILL)


def test_it_is_as_if_it_had_been_started(run, tmp_path, wait_until):
    words = ["0", "__name:=a", "__ns:=/robot", "b:=c"]
    program = run(*words, WORD="x", NOTIFY_SOCKET="/nowhere")
    said = program.says(wait_until)
    script = str(program.script)
    assert isinstance(program.process, forked_process.ForkedProcess)
    assert said["argv"] == [script, *words] and said["file"] == script and said["name"] == "__main__"
    assert (said["folder"], said["path"], said["word"]) == (str(tmp_path), str(tmp_path), "x")
    assert said["session"] and said["threads"] == 1 and said["station"]
    assert said["title"].rstrip("\0") == " ".join([sys.executable, script, *words])
    assert (said["namespace"], said["beats"]) == ("/robot/", "/nowhere")
    assert said["found"] == "/nowhere", "for a program that beats by itself"
    assert "/robot/b" in said["mapped"] or "b" in said["mapped"]
    assert said["open"] == 4, "input, output, errors, and the folder that it lists"
    assert program.ends(wait_until) == 0 and program.text.endswith("orderly end\n")


def test_its_end_is_known(run, wait_until):
    assert run("7").ends(wait_until) == 7
    raised = run("raise")
    assert raised.ends(wait_until) == 1 and "ValueError: on purpose" in raised.text
    for request in (signal.SIGTERM, signal.SIGKILL):
        killed = run("wait")
        killed.says(wait_until)
        os.kill(killed.process.pid, request)
        assert killed.ends(wait_until) == -request
    interrupted = run("wait")
    interrupted.says(wait_until)
    os.kill(interrupted.process.pid, signal.SIGINT)
    assert interrupted.ends(wait_until) == -signal.SIGINT and "KeyboardInterrupt" in interrupted.text


@pytest.mark.parametrize(("mark", "where"), [({}, "output"), ({TERMINAL: "true"}, "errors")])
def test_one_that_reads_keys_prints_where_the_person_is(starter, tmp_path, monkeypatch, wait_until, mark, where):
    """In `./stack up` standard output is no terminal."""
    program = tmp_path / "program"
    program.write_text(PROGRAM)
    program.chmod(0o755)
    with open(tmp_path / "output", "w") as output, open(tmp_path / "errors", "w") as errors:
        monkeypatch.setattr(sys, "stdout", output)
        monkeypatch.setattr(sys, "stderr", errors)
        environment = {**os.environ, "PYTHONPATH": PATH, **mark}
        process = starter.start([str(program), "0"], env=environment, cwd=str(tmp_path), stdout=None, stderr=None)
        wait_until(lambda: process.poll() is not None, "it ends")
    assert [file.name for file in (tmp_path / "output", tmp_path / "errors") if file.read_text()] == [where]


def test_one_that_has_ended_at_once_is_not_started_again(starter, run, tmp_path, wait_until):
    server = starter._server
    script = tmp_path / "short"
    script.write_text(f"#!{sys.executable}\nimport os\nopen('ran', 'a').write('once\\n')\nos._exit(3)\n")
    with open(tmp_path / "output", "w") as output:
        program = Program([str(script)], dict(os.environ), str(tmp_path))
        pid = server.start(program, [output.fileno(), output.fileno()])
    wait_until(lambda: vitals.state(pid) == "", "it is gone")
    ended = forked_process.ForkedProcess(server, pid)
    assert (ended.poll(), (tmp_path / "ran").read_text()) == (3, "once\n")
    assert run("4").ends(wait_until) == 4 and starter._server is server


def test_one_that_needs_another_interpreter_gets_one(run, tmp_path):
    ours = tmp_path / "ours"
    ours.write_text(f"#!{sys.executable}\n")
    assert not can_be_forked([str(ours)], dict(os.environ)), "it may not be executed"
    ours.chmod(0o755)
    assert can_be_forked([str(ours)], dict(os.environ))
    assert not can_be_forked([str(ours)], {**os.environ, "LD_PRELOAD": "libx.so"})
    assert not can_be_forked([str(tmp_path / "nothing")], dict(os.environ))
    for first in (b"#!/bin/sh", b"#!" + os.fsencode(sys.executable) + b" -O", b"\x7fELF", b"#!", b""):
        other = tmp_path / "other"
        other.write_bytes(first + b"\n")
        other.chmod(0o755)
        assert not can_be_forked([str(other)], dict(os.environ))


def test_one_that_still_imports_is_waited_for(tmp_path, monkeypatch, wait_until):
    """On a busy machine that takes many times as long as a start."""
    monkeypatch.setenv("PYTHONPATH", PATH)
    monkeypatch.setattr(forked_process, "PATIENCE", 0.01)
    starter = NodeStarter()
    os.kill(starter._server._process.pid, signal.SIGSTOP)
    with ThreadPoolExecutor(1) as pool:
        started = pool.submit(Started, starter, tmp_path, "5")
        with pytest.raises(TimeoutError):
            started.result(0.5)
        monkeypatch.setattr(forked_process, "PATIENCE", 60.0)
        os.kill(starter._server._process.pid, signal.SIGCONT)
        program = started.result(60.0)
    assert isinstance(program.process, forked_process.ForkedProcess) and program.ends(wait_until) == 5
    starter.close()


def test_a_server_that_hangs_starts_nothing_later(tmp_path, monkeypatch, wait_until):
    monkeypatch.setenv("PYTHONPATH", PATH)
    starter = NodeStarter()
    Started(starter, tmp_path, "0").ends(wait_until)  # it serves
    server = starter._server
    server._channel.settimeout(0.3)
    os.kill(server._process.pid, signal.SIGSTOP)
    usual = Started(starter, tmp_path, "wait")
    assert not isinstance(usual.process, forked_process.ForkedProcess)
    usual.says(wait_until)
    assert server._process.poll() == -signal.SIGKILL, "nor can it ever start it, too"
    usual.process.kill()
    usual.process.wait()
    starter.close()


def test_without_the_server_programs_go_on_and_start_as_usual(tmp_path, monkeypatch, wait_until):
    monkeypatch.setenv("PYTHONPATH", PATH)
    starter = NodeStarter()
    forked = Started(starter, tmp_path, "wait")
    forked.says(wait_until)
    server = starter._server._process
    server.kill()
    server.wait()
    assert forked.process.poll() is None
    usual = Started(starter, tmp_path, "5")
    assert usual.ends(wait_until) == 5 and not isinstance(usual.process, forked_process.ForkedProcess)
    os.kill(forked.process.pid, signal.SIGKILL)
    assert forked.ends(wait_until) == UNKNOWN
    wait_until(lambda: vitals.state(forked.process.pid) in ("", "Z"), "nothing is left")
    starter.close()


@pytest.mark.parametrize(("end", "befallen"), [(signal.SIGKILL, "died: signal 9"), (signal.SIGSTOP, "froze")])
def test_another_server_takes_the_place_of_one_that_dies_or_is_stopped(
    tmp_path, monkeypatch, wait_until, end, befallen
):
    monkeypatch.setenv("PYTHONPATH", PATH)
    monkeypatch.setattr(forked_process, "LEAST_LIFE", 0.0)
    faults = FaultListener(tmp_path / "faults")
    monitor = NodeMonitor()
    monitor.faults, monitor.starter = FaultReporter(tmp_path / "faults"), NodeStarter()
    starter = monitor.starter
    first = Started(starter, tmp_path, "wait")
    first.says(wait_until)
    monitor._look_at_starter()
    os.kill(starter._server._process.pid, end)
    wait_until(starter._server.failure, "it is noticed")
    monitor._look_at_starter()
    fault = faults.next(1.0)
    assert (fault.program, fault.what, fault.next) == ("fork_server", befallen, "starts again")
    assert first.process.poll() is None, "what it has started goes on"
    again = Started(starter, tmp_path, "5")
    assert isinstance(again.process, forked_process.ForkedProcess) and again.ends(wait_until) == 5
    os.kill(first.process.pid, signal.SIGKILL)
    assert first.ends(wait_until) == UNKNOWN
    starter.close()
    faults.close()


def test_a_server_that_cannot_run_is_not_started_again_and_again(monkeypatch, wait_until):
    monkeypatch.setenv("PYTHONPATH", PATH)
    starter = NodeStarter()
    starter._server._process.kill()
    wait_until(starter._server.failure, "it is noticed")
    assert starter.poll() == ("died: signal 9", "programs start more slowly from now on")
    assert starter.poll() is None and starter._server is None
    starter.close()


def test_a_server_whose_client_was_killed_ends_in_order(tmp_path):
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with theirs:
        words = [sys.executable, "-m", "telepresence_ros.fork_server", str(theirs.fileno())]
        server = subprocess.Popen(words, pass_fds=[theirs.fileno()], stderr=subprocess.PIPE, text=True)
    ours.settimeout(30.0)
    assert "serves" in json.loads(ours.recv(LONGEST))
    script = tmp_path / "short"
    script.write_text("")
    for _ in range(2):
        program = Program([str(script)], dict(os.environ), str(tmp_path))
        socket.send_fds(ours, [json.dumps(asdict(program)).encode()], [1, 2])
    assert select.select([ours], [], [], 30.0)[0], "it has answered"
    ours.close()  # with the answer in it
    _, said = server.communicate(timeout=30)
    assert (server.returncode, said) == (0, "")
