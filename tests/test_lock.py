"""The lock: every package that `./stack` and a robot's bundle install, at one version, its files known by their hashes.

It is written by `./stack lock`; these tests say when that was forgotten, and ask no package index.
"""

from __future__ import annotations

import itertools
import re
import runpy
import tomllib
from importlib import metadata
from pathlib import Path

import pytest
import setuptools
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[1]
STACK = ROOT / "requirements" / "stack.txt"
TOOLS = [ROOT / "requirements" / f"{name}.txt" for name in ("uv", "fuzz")]
ROBOT = ROOT / "catkin_ws" / "src" / "rto_bringup" / "robot" / "requirements.txt"
IMAGE = ROOT / "requirements" / "image.txt"
LOCKS = [STACK, IMAGE, ROBOT, *TOOLS]
RENEW = "run:  ./stack lock"


def locked(path: Path, here: bool = False) -> dict[str, tuple[str, set[str]]]:
    """Name of each package of a lock -> its version and the hashes of its files; `here`: of those for this machine."""
    found = {}
    for line in _lines(path):
        package = _requirement(line)
        assert package.name not in found, f"{package.name} stands twice in {path.name}"
        if not here or package.marker is None or package.marker.evaluate():
            version = str(package.specifier).removeprefix("==")
            found[package.name] = version, set(re.findall(r"--hash=sha256:([0-9a-f]{64})(?=\s|$)", line))
    return found


def _lines(path: Path) -> list[str]:
    lines = path.read_text().replace("\\\n", "").splitlines()
    return [line for line in lines if line and not line.startswith("#")]


def _requirement(line: str) -> Requirement:
    return Requirement(line.partition("--hash")[0])


def asked(path: Path) -> list[Requirement]:
    """What a file of requirements asks for."""
    return list(map(Requirement, _lines(path)))


def pinned(requirements: list[Requirement]) -> dict[str, str]:
    """Name of each requirement, which must be of the form name==version -> the version."""
    found = {}
    for requirement in requirements:
        (only,) = requirement.specifier
        assert only.operator == "==" and "*" not in only.version, f"{requirement} names no single version"
        found[canonicalize_name(requirement.name)] = only.version
    return found


@pytest.fixture
def given(monkeypatch: pytest.MonkeyPatch) -> dict:
    """The arguments of setup() in setup.py."""
    arguments: dict = {}
    monkeypatch.setattr(setuptools, "setup", arguments.update)
    runpy.run_path(str(ROOT / "setup.py"))
    return arguments


@pytest.fixture
def ours(given: dict) -> list[Requirement]:
    """Everything that setup.py and pyproject.toml ask for."""
    lines = [*given["install_requires"], *itertools.chain(*given["extras_require"].values())]
    lines += tomllib.loads((ROOT / "pyproject.toml").read_text())["build-system"]["requires"]
    return list(map(Requirement, lines))


def needed(requirements: list[Requirement]) -> set[str]:
    """The names of these packages and of all that they need here, as the installed packages themselves say."""
    waiting, found = [(each.name, extra) for each in requirements for extra in ("", *each.extras)], set()
    while waiting:
        name, extra = waiting.pop()
        if (name, extra) not in found:
            found.add((name, extra))
            for each in map(Requirement, metadata.requires(name) or ()):
                if each.marker is None or each.marker.evaluate({"extra": extra}):
                    waiting += [(canonicalize_name(each.name), wanted) for wanted in ("", *each.extras)]
    return {canonicalize_name(name) for name, _ in found}


@pytest.mark.parametrize("path", LOCKS, ids=lambda path: path.parent.name + "/" + path.name)
def test_every_package_has_hashes_and_no_place_that_it_comes_from(path):
    packages = locked(path)
    assert packages and all(hashes for _, hashes in packages.values())
    assert "/" not in path.read_text().replace("./stack lock", "")


def test_the_lock_has_what_setup_py_asks_for(ours):
    lock = {name: version for name, (version, _) in locked(STACK).items()}
    wrong = {name: (version, lock.get(name)) for name, version in pinned(ours).items() if lock.get(name) != version}
    assert not wrong, f"asked for, and locked: {wrong}; {RENEW}"


def test_the_lock_has_what_those_need_and_that_is_installed(ours):
    lock = {name: version for name, (version, _) in locked(STACK, here=True).items()}
    ours = [each for each in ours if each.marker is None or each.marker.evaluate()]
    assert needed(ours) <= set(lock), RENEW  # Debian leaves out that its dateutil needs six
    assert lock == {name: metadata.version(name) for name in lock}


def test_only_the_tests_need_the_vendors_library(given: dict):
    extras = {
        name for name, lines in given["extras_require"].items() for line in lines if Requirement(line).name == "qi"
    }
    assert extras == {"dev"}


@pytest.mark.parametrize(
    "other, missing",
    [
        ({"platform_machine": "aarch64"}, {"qi", "pyqt5", "pyqt5-qt5", "pyqt5-sip"}),
        ({"platform_machine": "x86_64", "python_version": "3.13", "python_full_version": "3.13.0"}, {"qi"}),
    ],
    ids=["arm64", "Python 3.13"],
)
def test_another_machine_does_without_few_packages(other: dict[str, str], missing: set[str]):
    markers = {package.name: package.marker for package in map(_requirement, _lines(STACK)) if package.marker}
    windows = {"colorama"}
    assert {name for name, marker in markers.items() if not marker.evaluate(other)} == missing | windows


def test_an_image_has_the_same_packages_without_those_of_tests(given: dict, ours: list[Requirement]):
    lock, image = locked(STACK), locked(IMAGE)
    tests = {Requirement(line).name for line in given["extras_require"]["dev"]}
    debians = {"PyQt5"}
    wanted = [each for each in ours if each.name not in tests | debians]
    here = [each for each in wanted if each.marker is None or each.marker.evaluate()]
    assert needed(here) == set(locked(IMAGE, here=True)), RENEW
    assert image == {name: lock[name] for name in image}, RENEW


def test_the_robots_packages_are_those_tested_here():
    lock, robot = locked(STACK), locked(ROBOT)
    wanted = asked(ROBOT.with_suffix(".in"))
    assert set(pinned(wanted)) == {"numpy", "aiortc", "aiohttp"}
    assert pinned(wanted).items() <= {name: version for name, (version, _) in robot.items()}.items(), RENEW
    assert set(robot) == needed(wanted), RENEW
    assert robot == {name: lock[name] for name in robot}, RENEW


@pytest.mark.parametrize("path", TOOLS, ids=lambda path: path.name)
def test_a_tool_for_maintainers_is_locked_too(path):
    assert pinned(asked(path.with_suffix(".in"))) == {name: version for name, (version, _) in locked(path).items()}


def test_the_stack_installs_nothing_else():
    """Every call of pip takes hashes or reads no index; none builds anything that it fetched."""
    calls = re.findall(r"-m pip (.*)", (ROOT / "stack").read_text().replace("\\\n", ""))
    assert len(calls) == 3  # the lock, the tree itself, a tool
    for call in calls:
        assert ("--require-hashes" in call and "--only-binary :all:" in call) or (
            "--no-index" in call and "--no-deps" in call and "--no-build-isolation" in call
        )
