"""The robot's disk keeps clients inside its folder."""

import pytest

from pepper_sim.disk import RobotDisk


@pytest.fixture
def disk():
    made = RobotDisk()
    yield made
    made.close()


def test_names_are_those_of_the_robot(disk):
    assert disk.path("/home/nao/a.wav") == disk.path("a.wav") == disk.root / "home/nao/a.wav"
    assert disk.path("/tmp/x") == disk.root / "tmp/x"
    assert disk.path("/home/nao").is_dir()


@pytest.mark.parametrize("name", ["", "../x", "/home/nao/../../../etc/passwd", "a\0b"])
def test_nothing_leads_out(disk, name):
    with pytest.raises(ValueError, match="file name"):
        disk.path(name)


def test_a_folder_of_ones_own_is_kept(tmp_path):
    first = RobotDisk(tmp_path / "robot")
    first.path("a").write_text("x")
    first.close()
    second = RobotDisk(tmp_path / "robot")
    assert second.path("/home/nao/a").read_text() == "x" and (tmp_path / "robot/home/nao/a").exists()


def test_closing_removes_it(disk):
    disk.path("a").write_text("x")
    disk.close()
    assert not disk.root.exists()
