"""Every ROS package names in its package.xml what it uses, there are no circles, and nobody but avatar_gui needs the
window.

What a package uses is read from its Python files (`import`, and message types in strings such as "nav_msgs/Odometry"),
its launch files (`pkg=`, `$(find ...)`) and its messages. `gui` belongs to avatar_gui, which starts it. What only its
rostests in the folder `test` use may stand under test_depend.
"""

from __future__ import annotations

import ast
import os
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SOURCES = ROOT / "catkin_ws/src"
INSTALLED = Path("/usr/share")
"""Debian's ROS packages have their package.xml here."""
WITHOUT_MANIFEST = {"roslib", "visualization_msgs"}
"""ROS packages that Debian installs without one."""
PACKAGES = {path.parent.name: path.parent for path in sorted(SOURCES.glob("*/package.xml"))}
VERSION = "0.9.0"
INTERFACES = ("*.msg", "*.srv", "*.action")


def module_owners() -> dict[str, str]:
    """Our Python modules -> the ROS package that they belong to."""
    owners = {name: name for name in PACKAGES}
    for name, folder in PACKAGES.items():
        owners.update({init.parent.name: name for init in folder.glob("src/*/__init__.py")})
    return owners


OWNERS = module_owners()


def is_python(path: Path) -> bool:
    if path.suffix == ".py":
        return True
    return path.suffix == "" and path.is_file() and path.read_bytes().startswith(b"#!/usr/bin/env python3")


def python_files(folder: Path) -> list[Path]:
    return [path for path in sorted(folder.rglob("*")) if is_python(path) and path.name != "setup.py"]


def files_of(package: str) -> list[Path]:
    """Its Python files but those of its rostests."""
    window = python_files(ROOT / "gui") if package == "avatar_gui" else []
    return [path for path in python_files(PACKAGES[package]) if path.parent.name != "test"] + window


@cache
def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(), str(path))


def imports(path: Path) -> set[str]:
    """The top-level modules that the file imports, wherever in it."""
    found = set()
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Import):
            found |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and not node.level:
            found.add(str(node.module).partition(".")[0])
    return found


def strings(path: Path) -> Iterator[str]:
    """Every string of the file but its docstrings."""
    texts = {
        id(node.body[0].value)
        for node in ast.walk(tree(path))
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)
        and node.body
        and isinstance(node.body[0], ast.Expr)
    }
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in texts:
            yield node.value


def ros_package(module: str) -> str | None:
    """The ROS package that a module belongs to; None for other modules."""
    if module in OWNERS:
        return OWNERS[module]
    return module if module in WITHOUT_MANIFEST or (INSTALLED / module / "package.xml").exists() else None


def launch_files(package: str) -> list[Path]:
    return sorted(path for path in PACKAGES[package].rglob("*") if path.name.endswith((".launch", ".launch.xml")))


def uses(package: str) -> dict[str, str]:
    """ROS packages that this one uses when it runs -> a file that does."""
    found = used_by(package, files_of(package), launch_files(package))
    for pattern in INTERFACES:
        for path in PACKAGES[package].rglob(pattern):
            words = set(re.findall(r"^(\w+)/\w+", path.read_text(), re.MULTILINE))
            words |= {"std_msgs"} if re.search(r"^Header ", path.read_text(), re.MULTILINE) else set()
            found.update({name: str(path.relative_to(ROOT)) for name in words - {package} - {*found}})
    return found


def rostests(package: str) -> list[Path]:
    """Its .test files."""
    return sorted((PACKAGES[package] / "test").glob("*.test"))


def uses_in_tests(package: str) -> dict[str, str]:
    """ROS packages that its rostests use -> a file that does."""
    return {
        **used_by(package, python_files(PACKAGES[package] / "test"), rostests(package)),
        **({"rostest": "add_rostest"} if rostests(package) else {}),
    }


def used_by(package: str, programs: list[Path], launches: list[Path]) -> dict[str, str]:
    """ROS packages that these files of a package use -> one of them."""
    found: dict[str, str] = {}

    def note(name: str | None, path: Path) -> None:
        if name and name != package:
            found.setdefault(name, str(path.relative_to(ROOT)))

    for path in programs:
        for module in imports(path):
            note(ros_package(module), path)
        for text in strings(path):
            if match := re.fullmatch(r"([a-z]\w+)/[A-Z]\w+", text):
                note(ros_package(match[1]), path)
    for path in launches:
        for match in re.finditer(r'pkg="(\w+)"|\$\(find (\w+)\)', path.read_text()):
            note(match[1] or match[2], path)
    return found


def manifest(package: str) -> ElementTree.Element:
    return ElementTree.parse(PACKAGES[package] / "package.xml").getroot()


def declared(package: str) -> set[str]:
    """What the package needs when it runs."""
    return {str(element.text) for tag in ("depend", "exec_depend") for element in manifest(package).iter(tag)}


def declared_for_tests(package: str) -> set[str]:
    """What only its rostests need."""
    return {str(element.text) for element in manifest(package).iter("test_depend")}


def test_the_packages_and_ros_itself_are_found():
    assert {"telepresence_ros", "naoqi_driver_py", "rto_node"} <= set(PACKAGES)
    assert ros_package("rospy") == "rospy" and ros_package("tf2_ros") == "tf2_ros"
    assert ros_package("naoqi_driver") == "naoqi_driver_py" and ros_package("numpy") is None


@pytest.mark.parametrize("package", PACKAGES)
def test_a_package_declares_what_it_uses(package):
    missing = {name: path for name, path in uses(package).items() if name not in declared(package)}
    assert not missing, f"{package}/package.xml lacks {missing}"


@pytest.mark.parametrize("package", PACKAGES)
def test_a_package_declares_what_its_rostests_use_and_no_more(package):
    assert declared_for_tests(package) == set(uses_in_tests(package)) - declared(package)


@pytest.mark.parametrize("package", PACKAGES)
def test_catkin_knows_every_rostest(package):
    recipe = (PACKAGES[package] / "CMakeLists.txt").read_text()
    registered = re.findall(r"add_rostest\((\S+)\)", recipe)
    assert sorted(registered) == [f"test/{path.name}" for path in rostests(package)]
    assert not registered or "if(CATKIN_ENABLE_TESTING)" in recipe


@pytest.mark.parametrize(
    "path", [path for package in PACKAGES for path in rostests(package)], ids=lambda path: path.stem
)
def test_a_rostest_launches_once_and_its_program_can_be_run(path):
    """rostest starts everything anew for each `<test>`."""
    (program,) = ElementTree.parse(path).getroot().iter("test")
    assert program.get("pkg") == path.parents[1].name
    assert os.access(path.parent / str(program.get("type")), os.X_OK)


@pytest.mark.parametrize("package", PACKAGES)
def test_a_package_declares_nothing_in_vain(package):
    named = {word for path in files_of(package) for text in strings(path) for word in re.findall(r"\w+", text)}
    tools = {"roslaunch"} if launch_files(package) else set()
    tools |= {"message_runtime"} if any(PACKAGES[package].rglob("*.msg")) else set()
    tools |= {"actionlib_msgs"} if any(PACKAGES[package].rglob("*.action")) else set()
    unused = declared(package) - set(uses(package)) - named - tools
    assert not unused, f"{package}/package.xml declares {unused}, and nothing in it uses them"


def test_there_are_no_circles():
    for graph in (
        {package: (declared(package) | declared_for_tests(package)) & set(PACKAGES) for package in PACKAGES},
        {package: set(uses(package)) & set(PACKAGES) for package in PACKAGES},
    ):
        try:
            TopologicalSorter(graph).prepare()
        except CycleError as error:
            pytest.fail(f"these packages need each other: {' -> '.join(error.args[1])}")


@pytest.mark.parametrize("package", [name for name in PACKAGES if name != "avatar_gui"])
def test_only_avatar_gui_needs_the_window(package):
    assert not [str(path) for path in files_of(package) if "gui" in imports(path)]


@pytest.mark.parametrize("folder", ["telepresence", "pepper_sim", "robotino_sim"])
def test_what_robots_and_simulators_share_needs_neither_ros_nor_the_window(folder):
    found = {
        str(path.relative_to(ROOT)): module
        for path in python_files(ROOT / folder)
        for module in imports(path)
        if module == "gui" or (ros_package(module) and module not in ("catkin", "telepresence"))
    }
    assert not found


@pytest.mark.parametrize("package", ["naoqi_driver_py", "naoqi_pose", "pepper_sensors_py", "rto_node"])
def test_a_driver_needs_no_package_about_a_web_camera(package):
    assert "telepresence_1" not in uses(package)


@pytest.mark.parametrize("package", PACKAGES)
def test_every_package_has_this_version(package):
    assert manifest(package).findtext("version") == VERSION


@pytest.mark.parametrize("package", [name for name, folder in PACKAGES.items() if (folder / "setup.py").exists()])
def test_every_python_package_is_named_where_catkin_installs_from(package):
    sources = PACKAGES[package] / "src"
    folders = {".".join(path.parent.relative_to(sources).parts) for path in sources.rglob("*.py")}
    called = ast.parse((PACKAGES[package] / "setup.py").read_text())
    (named,) = (word.value for word in ast.walk(called) if isinstance(word, ast.keyword) and word.arg == "packages")
    assert set(ast.literal_eval(named)) == folders
