"""What hinders a station is said before it starts."""

import os
import resource
import shlex
import socket
import subprocess
import sys
import threading
from xmlrpc.server import SimpleXMLRPCServer

import pytest

from telepresence.station import start_conditions

ASK = """
import os, sys
from pathlib import Path
from telepresence.station import start_conditions
print(start_conditions.choose_log_folder(Path(sys.argv[1])), os.environ.get("ROS_LOG_DIR"), os.environ.get("ROS_HOME"))
"""


def in_namespace(script: str) -> str:
    answer = subprocess.run(["unshare", "-rm", "sh", "-c", script], capture_output=True, text=True, timeout=60)
    assert answer.returncode == 0, answer.stderr
    return answer.stdout


@pytest.mark.parametrize(
    ("options", "words"), [("ro", "Read-only file system"), ("size=64k", "the disk is full, 0 MB are free")]
)
def test_logs_go_elsewhere_when_home_is_read_only_or_full(tmp_path, options, words):
    other = tmp_path.with_name(f"{tmp_path.name}-other")
    home = shlex.quote(str(tmp_path))
    ask = shlex.join([sys.executable, "-c", ASK, str(other)])
    variables = f"env -u ROS_LOG_DIR -u ROS_HOME HOME={home} PYTHONPATH={shlex.quote(os.pathsep.join(sys.path))}"
    said = in_namespace(f"mount -t tmpfs -o {options} tmpfs {home} && exec {variables} {ask}")
    assert words in said and str(tmp_path / ".ros" / "log") in said and f" {other} " in said
    assert said.endswith(f" {other}\n" if options == "ro" else " None\n"), "where roslaunch starts the nodes"


def test_logs_stay_where_they_can_be_written(tmp_path, monkeypatch):
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path / "log"))
    assert start_conditions.choose_log_folder(tmp_path / "other") == ""
    assert os.environ["ROS_LOG_DIR"] == str(tmp_path / "log")


def test_a_full_folder_for_temporary_files_is_said(monkeypatch):
    monkeypatch.setattr(start_conditions, "LEAST_ROOM", 1 << 60)
    with pytest.raises(RuntimeError, match=r"the disk is full.*TMPDIR"):
        start_conditions.require_room()


def test_few_descriptors_are_made_more_if_that_is_allowed():
    code = (
        "import resource; from telepresence.station import start_conditions as s; said = s.raise_descriptor_limit();"
        "print(resource.getrlimit(resource.RLIMIT_NOFILE)[0], said)"
    )
    said = [
        subprocess.run(
            ["prlimit", f"--nofile={limit}", sys.executable, "-c", code], capture_output=True, text=True, timeout=60
        ).stdout
        for limit in ("256:4096", "256:256")
    ]
    assert said[0] == f"{start_conditions.DESCRIPTORS} \n"
    assert said[1].startswith("256 Each program may open only 256 files")
    assert resource.getrlimit(resource.RLIMIT_NOFILE)[0] >= 256


def test_a_second_station_at_one_master_is_refused_and_a_dead_one_is_not_in_the_way(free_port):
    """A master and a node that answer as the ROS APIs say."""
    server = SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False)
    uri = f"http://127.0.0.1:{server.server_address[1]}/"
    node = {"address": uri}
    server.register_function(lambda caller: (1, "", 4711), "getPid")
    server.register_function(lambda caller, name: (1, "", node["address"]), "lookupNode")
    server.register_function(lambda caller: (1, "", uri), "getUri")
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        with pytest.raises(RuntimeError, match=r"another station runs.*ROS_MASTER_URI"):
            start_conditions.require_no_station(uri)
        node["address"] = f"http://127.0.0.1:{free_port()}/"
        start_conditions.require_no_station(uri)
    finally:
        server.shutdown()
        server.server_close()
    start_conditions.require_no_station(uri)


@pytest.mark.parametrize("host", ["192.0.2.1", "no-such-host.invalid"])
def test_a_master_that_would_be_elsewhere_and_does_not_answer_is_named(monkeypatch, host, free_port):
    monkeypatch.setattr(start_conditions, "master_answers", lambda *_arguments, **_options: False)  # no traffic
    with pytest.raises(RuntimeError, match=rf"{host}.*unset ROS_MASTER_URI"):
        start_conditions.require_master_here(f"http://{host}:11311")
    for here in ("localhost", "127.0.0.1", "[::1]"):
        start_conditions.require_master_here(f"http://{here}:{free_port()}")
    monkeypatch.setattr(start_conditions, "master_answers", lambda *_arguments, **_options: True)
    start_conditions.require_master_here(f"http://{host}:11311")


def test_the_environment_has_umlauts_in_every_locale(request):
    words = ["bash", "-c", ". ./env.sh; locale charmap"]
    environment = {**os.environ, "LC_ALL": "C"}
    answer = subprocess.run(words, cwd=request.config.rootpath, env=environment, capture_output=True, text=True)
    assert answer.stdout == "UTF-8\n", answer.stderr


@pytest.mark.parametrize(
    ("uri", "own", "warns"),
    [
        ("http://192.0.2.5:11311", {}, True),
        ("http://robot.example:11311/", {}, True),
        ("http://192.0.2.5:11311", {"ROS_IP": "127.0.0.1"}, True),
        ("http://192.0.2.5:11311", {"ROS_HOSTNAME": "localhost"}, True),
        ("http://[2001:db8::5]:11311", {"ROS_IP": "192.0.2.7", "ROS_HOSTNAME": "127.0.0.1"}, True),
        ("http://192.0.2.5:11311", {"ROS_IP": "192.0.2.7"}, False),
        ("http://192.0.2.5:11311", {"ROS_HOSTNAME": "pilot.example"}, False),
        (f"http://{socket.gethostname()}:11311", {}, False),
        ("http://localhost:11311/", {}, False),
        ("http://LOCALHOST:11311", {}, False),
        ("http://localhost.localdomain:11311", {}, False),
        ("http://ip6-localhost:11311", {}, False),
        ("http://0177.1:11311", {}, False),
        ("http://127.0.0.1:11312", {}, False),
        ("http://[::1]:11311", {}, False),
        ("", {}, False),
    ],
)
def test_the_environment_says_that_a_master_elsewhere_gets_no_data(request, uri, own, warns):
    """0177.1 is 127.0.0.1, as inet_aton(3) reads it: a name of this machine of which no name server needs to know."""
    shell = {name: value for name, value in os.environ.items() if name not in ("ROS_IP", "ROS_HOSTNAME")}
    shell |= {"ROS_MASTER_URI": uri, **own}
    words = ["bash", "-uc", ". ./env.sh; echo $ROS_IP"]
    answer = subprocess.run(words, cwd=request.config.rootpath, env=shell, capture_output=True, text=True)
    assert ("no data comes" in answer.stderr) is warns, answer.stderr
    assert ("unset ROS_HOSTNAME" in answer.stderr) is (warns and "ROS_HOSTNAME" in own)
    assert answer.stdout.strip() == own.get("ROS_IP", "" if own else "127.0.0.1"), "nothing listens elsewhere unasked"


def test_the_environment_warns_of_a_master_that_is_chosen_after_it_was_read(request):
    shell = {name: value for name, value in os.environ.items() if name not in ("ROS_IP", "ROS_HOSTNAME")}
    words = ["bash", "-uc", ". ./env.sh; export ROS_MASTER_URI=http://192.0.2.5:11311; bash -uc '. ./env.sh'"]
    answer = subprocess.run(words, cwd=request.config.rootpath, env=shell, capture_output=True, text=True)
    assert answer.stderr.count("no data comes") == 1, answer.stderr


def test_the_environment_passes_on_what_a_program_prints_before_it_is_killed(request):
    words = ["bash", "-c", ". ./env.sh; python -c \"import os; print('here', end=''); os._exit(0)\""]
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    answer = subprocess.run(words, cwd=request.config.rootpath, env=environment, capture_output=True, text=True)
    assert answer.stdout == "here", answer.stderr
