"""Rules for the window's code as a whole: which part may import which, and files that can be read in one sitting."""

import ast
import functools
import re
from pathlib import Path

import pytest

import gui

FOLDER = Path(gui.__file__).parent
FILES = sorted(FOLDER.glob("**/*.py"))
LONGEST = 400
"""[lines]"""
ROS = {"genpy", "rosbag", "rosgraph", "roslib", "rospy", "tf2_ros"}


def name_of(file):
    return ".".join(["gui", *file.relative_to(FOLDER).with_suffix("").parts])


@functools.cache
def imported(file, with_types=True):
    """Full names of the modules that a file imports, and of what it imports from them; `with_types` counts imports for
    type annotations only, too."""
    tree = ast.parse(file.read_text())
    if not with_types:
        for node in ast.walk(tree):
            if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
                node.body = []
    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found += [name.name for name in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            found += [node.module, *(f"{node.module}.{name.name}" for name in node.names)]
    return found


def imports(file, package, **how):
    return any(name == package or name.startswith(f"{package}.") for name in imported(file, **how))


def files_in(folder):
    return sorted(FOLDER.joinpath(folder).glob("**/*.py"))


def test_two_files_import_rospy():
    assert [file.name for file in FILES if imports(file, "rospy")] == ["link.py", "node.py"]


def test_ros_is_imported_in_its_folder_only():
    """`gui.ros.bag` reads files: it needs ROS's libraries, no graph."""
    knowing = {name_of(file) for file in FILES if any(imports(file, package) for package in ROS)}
    assert knowing == {"gui.ros.bag", "gui.ros.link", "gui.ros.node"}


@pytest.mark.parametrize("file", files_in("widgets"), ids=lambda file: file.stem)
def test_widgets_import_neither_ros_nor_what_joins_them(file):
    """A widget takes plain readings and emits signals, so each can be shown and tested alone."""
    for package in (
        *sorted(ROS),
        "gui.ros.link",
        "gui.ros.node",
        "gui.robots",
        "gui.app",
        "gui.driving",
        "gui.window",
    ):
        assert not imports(file, package), package


@pytest.mark.parametrize("file", files_in("ros"), ids=lambda file: file.stem)
def test_the_link_imports_nothing_that_is_shown(file):
    for package in ("gui.app", "gui.driving", "gui.widgets", "gui.window", "PyQt5.QtWidgets"):
        assert not imports(file, package), package


@pytest.mark.parametrize("folder", ["driving", "recording", "terminal", "ros", "widgets"])
def test_nothing_but_the_start_imports_gui_app(folder):
    assert [file.name for file in files_in(folder) if imports(file, "gui.app")] == []


def test_no_file_imports_itself_in_a_circle():
    """Imports for type annotations only are not followed: they are never executed."""
    names = {name_of(file).removesuffix(".__init__"): file for file in FILES}
    edges = {
        name: {other for other in imported(file, with_types=False) if other in names} for name, file in names.items()
    }

    def reachable(start):
        found, waiting = set(), [start]
        while waiting:
            for name in edges[waiting.pop()] - found:
                found.add(name)
                waiting.append(name)
        return found

    assert [name for name in names if name in reachable(name)] == []


@pytest.mark.parametrize("file", FILES, ids=name_of)
def test_no_file_is_too_long(file):
    assert len(file.read_text().splitlines()) <= LONGEST


@pytest.mark.parametrize("file", FILES, ids=name_of)
def test_a_qt_class_is_found_by_its_name(file):
    """A file with one public class made of Qt's is called like the class, or like a part of its name."""
    classes = [
        node.name
        for node in ast.parse(file.read_text()).body
        if isinstance(node, ast.ClassDef)
        and not node.name.startswith("_")
        and any(ast.unparse(base).startswith("Q") for base in node.bases)
    ]
    if len(classes) == 1:
        words = re.findall("[A-Z][a-z]*", classes[0])
        assert file.stem.removesuffix("s") in "_".join(words).lower(), classes[0]
