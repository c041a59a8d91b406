"""The rostests of the workspace are run by pytest, and what is wrong with one is seen: `catkin_ws/conftest.py`."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
MANIFEST = """<package format="2"><name>broken</name><version>0.0.0</version><description>Red.</description>
<maintainer email="nobody@telepresence.example">Nobody</maintainer><license>BSD-3-Clause</license></package>"""
LAUNCH = """<launch><!-- pytest: slow --><test test-name="broken" pkg="broken" type="broken_test.py" /></launch>"""
PROGRAM = """#!/usr/bin/env python3
import unittest, rostest
class Broken(unittest.TestCase):
    def test_two_and_two(self):
        self.assertEqual(2 + 2, 5, "broken on purpose")
rostest.rosrun("broken", "broken", Broken)
"""


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    """A project with our collector and a package with one rostest that fails."""
    folder = tmp_path / "catkin_ws" / "src" / "broken" / "test"
    folder.mkdir(parents=True)
    shutil.copy(ROOT / "catkin_ws" / "conftest.py", tmp_path / "catkin_ws")
    environment = f'. "{ROOT}/env.sh" && export ROS_PACKAGE_PATH="{tmp_path}/catkin_ws/src:$ROS_PACKAGE_PATH"\n'
    (tmp_path / "env.sh").write_text(environment)
    (tmp_path / "pytest.ini").write_text("[pytest]\nmarkers =\n    ros: needs ROS\n    slow: takes some seconds\n")
    (folder.parent / "package.xml").write_text(MANIFEST)
    (folder / "broken.test").write_text(LAUNCH)
    (folder / "broken_test.py").write_text(PROGRAM)
    (folder / "broken_test.py").chmod(0o755)
    return tmp_path


def pytest_in(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *arguments],
        cwd=folder,
        env={name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")},
        capture_output=True,
        text=True,
        timeout=120,
    )


@pytest.mark.ros
def test_a_broken_rostest_is_red_says_why_and_leaves_its_result_for_catkin(workspace):
    ended = pytest_in(workspace, "-m", "ros and slow")
    assert ended.returncode == 1, ended.stdout + ended.stderr
    assert "broken on purpose" in ended.stdout and "rostest broken broken.test" in ended.stdout
    judged = subprocess.run(["catkin_test_results", workspace / "catkin_ws/build"], capture_output=True, text=True)
    assert judged.returncode == 1 and "broken" in judged.stdout, judged.stdout + judged.stderr


@pytest.mark.ros
def test_a_file_that_tests_nothing_is_red(workspace):
    (workspace / "catkin_ws/src/broken/test/broken.test").write_text("<launch />")
    ended = pytest_in(workspace)
    assert ended.returncode == 1 and "no test was run" in ended.stdout, ended.stdout + ended.stderr


def test_every_rostest_is_collected_once_and_its_programs_are_not():
    ended = pytest_in(ROOT, "--collect-only", "-q", "catkin_ws/src")
    wanted = {f"{path.relative_to(ROOT)}::{path.stem}" for path in (ROOT / "catkin_ws/src").glob("*/test/*.test")}
    found = [line for line in ended.stdout.splitlines() if "::" in line]
    assert len(wanted) >= 8 and sorted(found) == sorted(wanted), ended.stdout + ended.stderr
