"""What must stay true of the window's code as a whole: ROS behind one file, files that can be read in one sitting."""

import ast
from pathlib import Path

import pytest

import gui

FILES = sorted(Path(gui.__file__).parent.glob("**/*.py"))
LONGEST = 400
"""[lines]"""


def _imported(file):
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            yield from (name.name.partition(".")[0] for name in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module.partition(".")[0]


def test_one_file_imports_rospy():
    assert [file.name for file in FILES if "rospy" in _imported(file)] == ["link.py"]


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_no_file_is_too_long(file):
    assert len(file.read_text().splitlines()) <= LONGEST
