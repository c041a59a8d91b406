"""The folder of logs stays small, whatever a node prints and however many runs there were."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from telepresence.station import log_folder
from telepresence.station.log_folder import LogKeeper, cut_outputs, delete_old

CONFIGURATION = Path(log_folder.__file__).with_name("python_logging.conf")
FLOOD = """
import logging, rosgraph.roslogging
rosgraph.roslogging.configure_logging("flood")
for _ in range(80):
    logging.getLogger("flood").info("x" * 300_000)
"""


def run_of(folder, name, age, size=10):
    """A run's folder whose log was last written so many seconds ago."""
    (folder / name).mkdir(parents=True)
    (folder / name / "node-1.log").write_bytes(b"x" * size)
    for path in (folder / name / "node-1.log", folder / name):
        os.utime(path, (1e9 - age, 1e9 - age))
    return folder / name


def disk_use(folder):
    return sum(path.stat().st_blocks * 512 for path in folder.rglob("*"))


def test_the_oldest_runs_go_and_a_running_station_keeps_its_own(tmp_path, monkeypatch):
    monkeypatch.setattr(log_folder, "RUNS", 2)
    oldest, old, new, newest = (run_of(tmp_path, f"run{age}", age) for age in (40, 30, 20, 10))
    (tmp_path / "latest").symlink_to(newest)
    with (oldest / "node-1.log").open("a"):
        assert delete_old(tmp_path) == [old]
    assert {path.name for path in tmp_path.iterdir()} == {oldest.name, new.name, newest.name, "latest"}


def test_many_bytes_go_before_many_runs_do(tmp_path, monkeypatch):
    monkeypatch.setattr(log_folder, "MOST", 50_000)
    old, new = run_of(tmp_path, "old", 20, 30_000), run_of(tmp_path, "new", 10, 30_000)
    assert delete_old(tmp_path) == [old] and new.exists()


def test_logs_outside_any_run_go_too(tmp_path, monkeypatch):
    monkeypatch.setattr(log_folder, "LOOSE_FILES", 3)
    for number in range(5):
        (tmp_path / f"rostopic-{number}.log").write_text("")
        os.utime(tmp_path / f"rostopic-{number}.log", (number, number))
    delete_old(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == [f"rostopic-{number}.log" for number in (2, 3, 4)]


def test_a_folder_that_is_not_there_is_no_error(tmp_path):
    assert delete_old(tmp_path / "none") == []


@pytest.mark.parametrize("mode", ["a", "w"])
def test_what_a_program_prints_is_cut_while_it_goes_on(tmp_path, mode, run_program, wait_until):
    """roslaunch opens the file of a node that it restarts for appending, that of another one not."""
    path = tmp_path / "run" / "node-1-stdout.log"
    path.parent.mkdir()
    with path.open(mode) as output:
        words = f"yes again | head -c {2 * log_folder.LARGEST_OUTPUT}; read word; echo goes on"
        program = run_program("sh", "-c", words, stdin=subprocess.PIPE, stdout=output)
    wait_until(lambda: path.stat().st_size == 2 * log_folder.LARGEST_OUTPUT, "all is printed")
    cut_outputs(tmp_path)
    assert disk_use(tmp_path) < log_folder.KEPT_OUTPUT + 100_000
    assert Path(f"{path}.1").read_text().endswith("again\nagain\nag")
    program.communicate(b"\n", timeout=10)
    assert path.read_text().endswith("goes on\n") and disk_use(tmp_path) < log_folder.KEPT_OUTPUT + 100_000


def test_the_keeper_cuts_by_itself(tmp_path, wait_until):
    path = tmp_path / "run" / "node-1-stdout.log"
    path.parent.mkdir()
    path.write_bytes(b"x" * 2 * log_folder.LARGEST_OUTPUT)
    keeper = LogKeeper(tmp_path).start()
    try:
        wait_until(lambda: path.stat().st_size == 0, "it is cut")
    finally:
        keeper.close()


def test_what_is_printed_is_cut_though_its_end_cannot_be_kept(tmp_path):
    """Where there is no room for the end, too much is printed above all."""
    outputs = [tmp_path / f"{name}-stdout.log" for name in ("anna", "ben", "carl")]
    for path in outputs:
        path.write_bytes(b"x" * 2 * log_folder.LARGEST_OUTPUT)
    Path(f"{outputs[1]}.1").mkdir()
    with pytest.raises(IsADirectoryError):
        cut_outputs(tmp_path)
    assert [path.stat().st_size for path in outputs] == [0, 0, 0]


def test_a_folder_that_cannot_be_tidied_holds_up_no_other_and_is_told_until_it_can(
    tmp_path, monkeypatch, caplog, wait_until
):
    anna, ben, broken, cut = tmp_path / "anna", tmp_path / "ben", [True], []

    def cut_outputs(folder):
        if folder == anna and broken:
            raise OSError("no disk")
        cut.append(folder)

    monkeypatch.setattr(log_folder, "cut_outputs", cut_outputs)
    monkeypatch.setattr(log_folder, "CUT_PERIOD", 0.001)
    keeper = LogKeeper(anna, ben, deletes=False).start()
    try:
        wait_until(lambda: cut.count(ben) > 3, "the other folder is cut again and again")
        assert anna not in cut and caplog.messages == [f"logs in {anna} are not tidied: no disk"]
        broken.clear()
        wait_until(lambda: anna in cut, "the disk is back")
        broken.append(True)
        wait_until(lambda: len(caplog.messages) == 2, "the disk is gone again")
    finally:
        keeper.close()


def test_a_python_program_that_logs_in_a_tight_loop_does_not_fill_the_disk(tmp_path):
    environment = {**os.environ, "ROS_PYTHON_LOG_CONFIG_FILE": str(CONFIGURATION), "ROS_LOG_DIR": str(tmp_path)}
    subprocess.run([sys.executable, "-c", FLOOD], env=environment, check=True, timeout=60)
    assert 8_000_000 < disk_use(tmp_path) < 13_000_000


def test_the_environment_names_the_configuration():
    root = CONFIGURATION.parents[2]
    words = ". ./env.sh; echo $ROS_PYTHON_LOG_CONFIG_FILE"
    environment = {name: value for name, value in os.environ.items() if name != "ROS_PYTHON_LOG_CONFIG_FILE"}
    told = subprocess.run(["bash", "-c", words], cwd=root, env=environment, capture_output=True, text=True, timeout=60)
    assert told.stdout.strip() == str(CONFIGURATION)


@pytest.mark.parametrize(
    ("first", "handlers"), [("import sys", {"StreamHandler"}), ("import sys, rospy", {"RosStreamHandler"})]
)
def test_only_a_node_imports_rospy_to_log(ros_environment, tmp_path, first, handlers):
    """For its handler, that is; roslaunch and the ROS master would have 10 MB more."""
    asks = f"""
{first}
import logging, rosgraph.roslogging
before = "rospy" in sys.modules
rosgraph.roslogging.configure_logging("x", filename={str(tmp_path / "x.log")!r})
assert ("rospy" in sys.modules) is before
print(*(type(handler).__name__ for handler in logging.getLogger("rosout").handlers))
"""
    environment = ros_environment | {"ROS_PYTHON_LOG_CONFIG_FILE": str(CONFIGURATION)}
    printed = subprocess.run(
        [sys.executable, "-c", asks], env=environment, check=True, capture_output=True, text=True
    ).stdout
    assert set(printed.split()) == handlers
